#include "tiles/layers/outline.h"

#include <gtest/gtest.h>
#include <ogr_geometry.h>

#include <map>
#include <memory>
#include <random>
#include <set>

#include "tests/tiles/small_scene.h"

namespace scarp {
namespace {

WideArea doubled_area_of(const Tin& tin, TriangleIndex triangle) {
  const auto& [a, b, c] = tin.triangles[triangle];
  return doubled_area(tin, {a, b, c});
}

std::unique_ptr<OGRMultiPolygon> as_geometry(const Tin& tin, const GroupOutline& outline) {
  auto result = std::make_unique<OGRMultiPolygon>();
  for (const VertexPolygon& polygon : outline.polygons) {
    OGRPolygon part;
    for (const VertexRing& ring : polygon) {
      OGRLinearRing line;
      for (const VertexIndex v : ring) line.addPoint(tin.vertices[v].x_m, tin.vertices[v].y_m);
      line.closeRings();
      part.addRing(&line);
    }
    result->addGeometry(&part);
  }
  return result;
}

/// Everything that trace_groups promises, judged from the triangles alone.
void expect_sound(const Tin& tin, const std::vector<GroupIndex>& group_of,
                  const std::vector<GroupOutline>& outlines) {
  std::map<GroupIndex, WideArea> areas;
  std::map<GroupIndex, std::set<std::pair<VertexIndex, VertexIndex>>> borders;
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
    if (group_of[t] == kNone) continue;
    areas[group_of[t]] += doubled_area_of(tin, t);
    for (std::size_t i = 0; i < 3; ++i) {
      const TriangleIndex across = tin.neighbours[t][i];
      if (across == kNone || group_of[across] != group_of[t])
        borders[group_of[t]].insert({tin.triangles[t][(i + 1) % 3], tin.triangles[t][(i + 2) % 3]});
    }
  }
  ASSERT_EQ(outlines.size(), areas.size());
  auto expected = areas.begin();
  for (const GroupOutline& outline : outlines) {
    ASSERT_EQ(outline.group, expected->first);
    WideArea area = 0;
    std::set<std::pair<VertexIndex, VertexIndex>>& border = borders[outline.group];
    for (const VertexPolygon& polygon : outline.polygons) {
      for (std::size_t r = 0; r < polygon.size(); ++r) {
        const VertexRing& ring = polygon[r];
        EXPECT_EQ(doubled_area(tin, ring) > 0, r == 0) << "outer ring first, then holes";
        area += doubled_area(tin, ring);
        EXPECT_EQ(std::set<VertexIndex>(ring.begin(), ring.end()).size(), ring.size());
        for (std::size_t i = 0; i < ring.size(); ++i)
          EXPECT_EQ(border.erase({ring[i], ring[(i + 1) % ring.size()]}), 1U);
      }
    }
    EXPECT_TRUE(area == expected->second);
    EXPECT_TRUE(border.empty()) << "border edges in no ring";
    EXPECT_TRUE(as_geometry(tin, outline)->IsValid()) << "group " << outline.group;
    ++expected;
  }
}

/// Cells of a grid drawn as letters: 'a' is group 0, '.' no group. Both triangles of a cell go
/// along.
struct Drawing {
  Tin tin;
  std::vector<GroupIndex> group_of;

  explicit Drawing(const std::vector<std::string>& rows) {
    tin = test::grid_tin(static_cast<std::uint32_t>(rows[0].size()) + 1,
                         static_cast<std::uint32_t>(rows.size()) + 1);
    for (const std::string& row : rows) {
      for (const char c : row) {
        const GroupIndex group = c == '.' ? kNone : static_cast<GroupIndex>(c - 'a');
        group_of.insert(group_of.end(), 2, group);
      }
    }
  }

  std::vector<GroupOutline> traced() const {
    const auto outlines = trace_groups(tin, group_of);
    expect_sound(tin, group_of, outlines);
    return outlines;
  }
};

TEST(TraceGroups, OneSquare) {
  const auto outlines = Drawing({"a"}).traced();
  ASSERT_EQ(outlines.size(), 1U);
  ASSERT_EQ(outlines[0].polygons.size(), 1U);
  EXPECT_EQ(outlines[0].polygons[0], VertexPolygon({{1, 0, 2, 3}}));
}

TEST(TraceGroups, NoGroupNoOutline) {
  EXPECT_TRUE(Drawing({"..", ".."}).traced().empty());
  EXPECT_TRUE(trace_groups(Tin{}, {}).empty());
}

TEST(TraceGroups, HoleWithAnIsland) {
  const auto outlines = Drawing({"aaaaa", "abbba", "abaca", "abbba", "aaaaa"}).traced();
  ASSERT_EQ(outlines.size(), 3U);
  EXPECT_EQ(outlines[0].polygons.size(), 2U);     // the frame and the island
  EXPECT_EQ(outlines[0].polygons[0].size(), 2U);  // outer ring and hole
  EXPECT_EQ(outlines[1].polygons[0].size(), 1U);  // b is open to the right, where c is
}

TEST(TraceGroups, PartsThatTouchInAPoint) {
  // the diagonal of a cell runs from lower left to upper right: these meet in one vertex
  const auto outlines = Drawing({"a.", ".a"}).traced();
  ASSERT_EQ(outlines[0].polygons.size(), 2U);
  EXPECT_EQ(outlines[0].polygons[0].size(), 1U);
}

TEST(TraceGroups, RingThatClosesInAPoint) {
  // the ends of the C touch: an outer ring, and a hole that touches it in that vertex
  const auto outlines = Drawing({"aaa", "a.a", "aa."}).traced();
  ASSERT_EQ(outlines[0].polygons.size(), 1U);
  ASSERT_EQ(outlines[0].polygons[0].size(), 2U);
}

TEST(TraceGroups, HolesThatTouchEachOther) {
  const auto outlines = Drawing({"aaaa", "a.aa", "aa.a", "aaaa"}).traced();
  ASSERT_EQ(outlines[0].polygons.size(), 1U);
  ASSERT_EQ(outlines[0].polygons[0].size(), 3U);
}

TEST(TraceGroups, RandomGroupsOfTriangles) {
  for (unsigned seed = 1; seed <= 150; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 generator(seed);
    const auto random = [&](unsigned below) { return static_cast<unsigned>(generator() % below); };
    const Tin tin = test::grid_tin(2 + random(12), 2 + random(12));
    const unsigned groups = 1 + random(4);
    const unsigned orphans = random(3);
    std::vector<GroupIndex> group_of;
    for (std::size_t t = 0; t < tin.triangles.size(); ++t) {
      const unsigned pick = random(groups + orphans);
      group_of.push_back(pick < groups ? pick * 7 : kNone);
    }
    expect_sound(tin, group_of, trace_groups(tin, group_of));
    if (HasFailure()) return;
  }
}

TEST(TraceGroups, AreasAreExactAtTheEndOfTheLattice) {
  Tin tin;
  tin.vertices = {{-0x1p27, -0x1p27, 0}, {0x1p27, -0x1p27, 0}, {0x1p27, 0x1p27, 0}};
  EXPECT_TRUE(doubled_area(tin, {0, 1, 2}) == WideArea{1} << 80);
  EXPECT_TRUE(doubled_area(tin, {0, 2, 1}) == -(WideArea{1} << 80));
}

}  // namespace
}  // namespace scarp
