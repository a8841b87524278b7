#include "tiles/tileset/tile_ground.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/geodesy/earth_frame.h"

namespace scarp {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Least radius of curvature of WGS 84, b^2 / a, less the depth of any ground: metres.
constexpr double kLeastRadiusM = 6.32e6;

std::vector<TilePoint> points_of(std::span<const EcefPoint> ecef, const TilesetFrame& frame,
                                 double step_m) {
  std::vector<TilePoint> points;
  points.reserve(ecef.size());
  for (const EcefPoint& p : ecef) points.push_back(round_to_step(frame.from_ecef(p), step_m));
  return points;
}

/// Sums of the normals around each vertex, each triangle counting by its area.
std::vector<TilePoint> normal_sums(const Tin& tin, const std::vector<TilePoint>& points) {
  std::vector<TilePoint> sums(points.size());
  for (const auto& [a, b, c] : tin.triangles) {
    TilePoint u, v;
    for (std::size_t i = 0; i < 3; ++i) {
      u[i] = points[b][i] - points[a][i];
      v[i] = points[c][i] - points[a][i];
    }
    const TilePoint n = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                         u[0] * v[1] - u[1] * v[0]};
    for (const VertexIndex vertex : {a, b, c})
      for (std::size_t i = 0; i < 3; ++i) sums[vertex][i] += n[i];
  }
  return sums;
}

/// Calls take(vertex) for the ends of border edges, more than once.
template <class Take>
void for_border_vertices(const Tin& tin, const Take& take) {
  for (std::size_t t = 0; t < tin.triangles.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      if (tin.neighbours[t][i] != kNone) continue;
      take(tin.triangles[t][(i + 1) % 3]);
      take(tin.triangles[t][(i + 2) % 3]);
    }
  }
}

std::array<double, 3> key_of(const Position& p) {
  return {p.x_m, p.y_m, p.z_m};
}

std::vector<std::array<float, 3>> normals_of(const Tin& tin, const std::vector<TilePoint>& points,
                                             const BorderNormals& around) {
  std::vector<TilePoint> sums = normal_sums(tin, points);
  if (!around.empty())
    for_border_vertices(tin, [&](VertexIndex v) {
      const auto found = around.find(key_of(tin.vertices[v]));
      if (found != around.end()) sums[v] = found->second;
    });
  std::vector<std::array<float, 3>> normals;
  normals.reserve(sums.size());
  for (const TilePoint& n : sums) {
    const double size = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    if (size > 0)
      normals.push_back({static_cast<float>(n[0] / size), static_cast<float>(n[1] / size),
                         static_cast<float>(n[2] / size)});
    else
      normals.push_back({0, 0, 1});
  }
  return normals;
}

/// Triangles in the order of their groups, kNone last.
std::vector<TriangleIndex> by_group(const Tin& tin, const Groups* groups) {
  std::vector<TriangleIndex> order(tin.triangles.size());
  for (TriangleIndex t = 0; t < order.size(); ++t) order[t] = t;
  if (groups != nullptr)
    std::stable_sort(order.begin(), order.end(), [&](TriangleIndex a, TriangleIndex b) {
      return groups->group_of_triangle[a] < groups->group_of_triangle[b];
    });
  return order;
}

double longitude_rad(const EcefPoint& p) {
  return std::atan2(p.y_m, p.x_m);
}

double latitude_rad(const EcefPoint& up) {
  return std::asin(std::clamp(up.z_m, -1.0, 1.0));
}

/// Heights of a piece of ground and the region that holds it.
class GroundExtent {
 public:
  void add(const EcefPoint& p) {
    const EllipsoidNormal normal = ellipsoid_normal(kWgs84, p);
    least_m_ = std::min(least_m_, normal.height_m);
    greatest_m_ = std::max(greatest_m_, normal.height_m);
    // Longitudes relative to the first one, so that the antimeridian is nothing special.
    const double longitude = longitude_rad(p);
    if (!middle_known_) middle_ = longitude, middle_known_ = true;
    const double away = std::remainder(longitude - middle_, 2 * std::numbers::pi);
    west_ = std::min(west_, away);
    east_ = std::max(east_, away);
    south_ = std::min(south_, latitude_rad(normal.up));
    north_ = std::max(north_, latitude_rad(normal.up));
  }

  /// The middle of a wide triangle lies lower than its corners: by e^2 / 6 R at most, e its longest
  /// side, because the circle through the corners of the worst one has the radius e / sqrt(3).
  void add_sag(double longest_side_m) {
    const double sag_m = longest_side_m * longest_side_m / (6 * kLeastRadiusM);
    sag_m_ = std::max(sag_m_, sag_m);
  }

  double least_m() const { return least_m_ - sag_m_; }
  double greatest_m() const { return greatest_m_; }
  std::array<double, 4> region_rad() const {
    const auto turned = [](double a) { return std::remainder(a, 2 * std::numbers::pi); };
    return {turned(middle_ + west_), south_, turned(middle_ + east_), north_};
  }

 private:
  double least_m_ = kInfinity, greatest_m_ = -kInfinity, sag_m_ = 0;
  bool middle_known_ = false;
  double middle_ = 0, west_ = kInfinity, east_ = -kInfinity, south_ = kInfinity,
         north_ = -kInfinity;
};

double longest_side_m(const std::array<VertexIndex, 3>& corners, std::span<const EcefPoint> ecef) {
  double longest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const EcefPoint &p = ecef[corners[i]], &q = ecef[corners[(i + 1) % 3]];
    longest = std::max(longest, std::hypot(p.x_m - q.x_m, p.y_m - q.y_m, p.z_m - q.z_m));
  }
  return longest;
}

/// Fills a TerrainMesh group by group.
class GroundBuilder {
 public:
  GroundBuilder(const Tin& tin, std::span<const EcefPoint> ecef, std::vector<TilePoint> points,
                double step_m, const BorderNormals& around)
      : tin_(tin),
        ecef_(ecef),
        points_(std::move(points)),
        normals_(normals_of(tin, points_, around)),
        new_vertex_(tin.vertices.size(), kNone) {
    TilePoint low = points_[0], high = points_[0];
    for (const TilePoint& p : points_) {
      for (std::size_t i = 0; i < 3; ++i) {
        low[i] = std::min(low[i], p[i]);
        high[i] = std::max(high[i], p[i]);
      }
    }
    for (std::size_t i = 0; i < 3; ++i) low[i] = (low[i] + high[i]) / 2;
    mesh_.origin_m = round_to_step(low, step_m);
    reach_m_ = step_m * kFloatSteps;
  }

  /// Triangles of one group, or of none at all where `row` is kNone.
  void add(std::span<const TriangleIndex> triangles, std::uint32_t row) {
    std::vector<VertexIndex> own;  // vertices of this group, by first use
    std::vector<std::uint32_t> corners;
    for (const TriangleIndex t : triangles) {
      for (const VertexIndex v : tin_.triangles[t]) {
        if (new_vertex_[v] == kNone) {
          new_vertex_[v] = static_cast<std::uint32_t>(own.size());
          own.push_back(v);
        }
        corners.push_back(new_vertex_[v]);
      }
    }
    meshopt_optimizeVertexCache(corners.data(), corners.data(), corners.size(), own.size());
    const auto base = static_cast<std::uint32_t>(mesh_.positions.size());
    std::vector<std::uint32_t> by_use(own.size());
    meshopt_optimizeVertexFetchRemap(by_use.data(), corners.data(), corners.size(), own.size());
    mesh_.positions.resize(base + own.size());
    mesh_.normals.resize(base + own.size());
    if (row != kNone) mesh_.row_of_vertex.resize(base + own.size(), row);
    for (std::size_t i = 0; i < own.size(); ++i) {
      put_vertex(own[i], base + by_use[i]);
      new_vertex_[own[i]] = kNone;
    }
    for (const std::uint32_t corner : corners) mesh_.corners.push_back(base + by_use[corner]);
  }

  GroupRow row_of(GroupIndex group, std::span<const TriangleIndex> triangles) const {
    GroundExtent extent;
    for (const TriangleIndex t : triangles) {
      for (const VertexIndex v : tin_.triangles[t]) extent.add(ecef_[v]);
      extent.add_sag(longest_side_m(tin_.triangles[t], ecef_));
    }
    return {group,
            static_cast<std::uint32_t>(triangles.size()),
            static_cast<std::uint32_t>(mesh_.corners.size() / 3),
            extent.least_m(),
            extent.greatest_m(),
            extent.region_rad()};
  }

  TerrainMesh& mesh() { return mesh_; }

 private:
  void put_vertex(VertexIndex from, std::uint32_t to) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double away = points_[from][i] - mesh_.origin_m[i];
      assert(std::abs(away) <= reach_m_);
      mesh_.positions[to][i] = static_cast<float>(away);
    }
    mesh_.normals[to] = normals_[from];
  }

  const Tin& tin_;
  std::span<const EcefPoint> ecef_;
  std::vector<TilePoint> points_;
  std::vector<std::array<float, 3>> normals_;
  std::vector<std::uint32_t> new_vertex_;  // while a group is built
  double reach_m_ = 0;
  TerrainMesh mesh_;
};

}  // namespace

BorderNormals border_normals(const Tin& tin, std::span<const EcefPoint> ecef,
                             const TilesetFrame& frame, double step_m) {
  const std::vector<TilePoint> sums = normal_sums(tin, points_of(ecef, frame, step_m));
  BorderNormals border;
  for_border_vertices(tin,
                      [&](VertexIndex v) { border.try_emplace(key_of(tin.vertices[v]), sums[v]); });
  return border;
}

TerrainMesh tile_ground(const Tin& tin, std::span<const EcefPoint> ecef, const TilesetFrame& frame,
                        const Groups* groups, GroupIndex first_group, double step_m,
                        const BorderNormals& around) {
  assert(!tin.triangles.empty() && ecef.size() == tin.vertices.size());
  GroundBuilder builder(tin, ecef, points_of(ecef, frame, step_m), step_m, around);
  const std::vector<TriangleIndex> order = by_group(tin, groups);
  if (groups == nullptr) {
    builder.add(order, kNone);
    return std::move(builder.mesh());
  }
  for (std::size_t begin = 0; begin < order.size();) {
    const GroupIndex group = groups->group_of_triangle[order[begin]];
    std::size_t end = begin;
    while (end < order.size() && groups->group_of_triangle[order[end]] == group) ++end;
    const std::span<const TriangleIndex> own(order.data() + begin, end - begin);
    const auto row = static_cast<std::uint32_t>(builder.mesh().groups.size());
    if (group != kNone) builder.mesh().groups.push_back(builder.row_of(first_group + group, own));
    builder.add(own, row);  // ground of no group comes last, and its row is the one after all
    begin = end;
  }
  return std::move(builder.mesh());
}

TileFacts tile_facts(const Tin& tin, std::span<const EcefPoint> ecef, const TilesetFrame& frame,
                     double step_m) {
  TileFacts facts;
  facts.box = box_around(frame, points_of(ecef, frame, step_m));
  GroundExtent extent;
  for (const EcefPoint& p : ecef) extent.add(p);
  for (const auto& corners : tin.triangles) extent.add_sag(longest_side_m(corners, ecef));
  facts.least_height_m = extent.least_m();
  facts.greatest_height_m = extent.greatest_m();
  return facts;
}

TileFacts facts_of_all(const TilesetFrame& frame, std::span<const TileFacts> tiles) {
  assert(!tiles.empty());
  TileFacts all = tiles[0];
  if (tiles.size() == 1) return all;
  std::vector<TilePoint> corners;
  for (const TileFacts& tile : tiles) {
    for (const TilePoint& corner : tile.box.corners()) corners.push_back(corner);
    all.least_height_m = std::min(all.least_height_m, tile.least_height_m);
    all.greatest_height_m = std::max(all.greatest_height_m, tile.greatest_height_m);
  }
  all.box = box_around(frame, corners);
  return all;
}

}  // namespace scarp
