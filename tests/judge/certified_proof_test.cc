// No certified region hides what is visible: from many eyes over real ground, and from eyes that
// look for the boundaries of the regions. The short form is a test of CTest; scripts/prove sets
// SCARP_PROVE_PAIRS and SCARP_PROVE_STARTS, and may name DEMs in SCARP_PROVE_DEMS and bound how
// many groups of each are searched in SCARP_PROVE_GROUPS.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/culling/certified_culling.h"
#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/hidden_together.h"
#include "core/occlusion/splitmix64.h"
#include "core/sight/triangle_sight.h"
#include "tests/judge/listed_mesh.h"
#include "tests/support/boundary_search.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

constexpr std::array<double, 4> kHeightsM = {2, 50, 300, 1000};
constexpr std::uint32_t kVertices = 12'500;  // 25,000 triangles
constexpr double kBytes = 16;

/// What the short form takes.
constexpr std::uint32_t kShortVertices = 1'000;
constexpr std::int32_t kShortFans = 64;
constexpr std::uint64_t kShortPairs = 2'500;
constexpr int kShortStarts = 4, kShortSteps = 12;
constexpr char kShortDem[] = "jacksboro";

std::optional<std::uint64_t> asked(const char* variable) {
  const char* text = std::getenv(variable);
  if (!text) return {};
  return std::strtoull(text, nullptr, 10);
}

struct Certified {
  std::string name;
  Tin tin;
  LeafGroups groups;
  CertifiedRegions regions;
  std::vector<std::vector<TriangleIndex>> members;
};

Certified certify(const std::string& name, Tin tin, bool full) {
  Certified scene{name, std::move(tin), {}, {}, {}};
  HiddenTogetherOptions together;
  if (!full) together.group_triangles = 32;
  scene.groups = grow_hidden_together(scene.tin, together);
  HidingOptions hiding;
  hiding.sectors = sectors_within(kBytes, scene.tin.triangles.size(), scene.groups.count);
  if (!full) hiding.fans = kShortFans;
  scene.regions =
      certify_groups(scene.tin, scene.groups.group_of_triangle, scene.groups.count, hiding);
  scene.members = test::triangles_of_groups(scene.groups.group_of_triangle, scene.groups.count);
  return scene;
}

Certified drawn_hills(bool full) {
  return certify("hills", test::triangulated(test::random_hills(32, 32, 30, 3, 400, 0.01, 0.05), 1),
                 full);
}

/// Calls prove(scene) for each DEM of the list where the full proof is asked for; otherwise for one
/// DEM, or for drawn hills where the shared data are not there.
template <class Prove>
void for_each_scene(bool full, Prove prove) {
  const char* named = std::getenv("SCARP_PROVE_DEMS");
  const std::string names = full ? (named ? named : "") : kShortDem;
  int scenes = 0;
  for (const test::ListedDem& listed : test::kListedDems) {
    if (!test::is_asked_for(listed, names)) continue;
    auto tin = test::mesh_of(listed, full ? kVertices : kShortVertices);
    if (!tin) continue;
    SCOPED_TRACE(listed.name);
    ++scenes;
    prove(certify(listed.name, std::move(*tin), full));
  }
  if (scenes == 0) prove(drawn_hills(full));
}

/// A place on the ground, at a vertex or inside a triangle.
Position random_ground(const Tin& tin, SplitMix64& random) {
  const auto& [a, b, c] = tin.triangles[random.below(tin.triangles.size())];
  const Position &p = tin.vertices[a], &q = tin.vertices[b], &r = tin.vertices[c];
  if (random.below(2) == 0) return p;
  double s = random.unit(), t = random.unit();
  if (s + t > 1) s = 1 - s, t = 1 - t;
  const auto mix = [&](double at_p, double at_q, double at_r) {
    return at_p + s * (at_q - at_p) + t * (at_r - at_p);
  };
  return {mix(p.x_m, q.x_m, r.x_m), mix(p.y_m, q.y_m, r.y_m), mix(p.z_m, q.z_m, r.z_m)};
}

struct Counts {
  std::uint64_t pairs = 0;   // of a camera and a group
  std::uint64_t judged = 0;  // of them: culled, and all triangles of the group judged
  std::uint64_t false_culls = 0;
};

/// Judges the groups that a camera culls.
void look_from(const Certified& scene, const TinIndex& index, const Position& eye, Counts& counts) {
  CertifiedCulling method(scene.regions);
  std::vector<std::uint8_t> culled(scene.groups.count, 1);
  for (const GroupIndex g : method.visible({eye, {}}).visible_groups) culled[g] = 0;
  std::vector<TriangleIndex> triangles;
  for (GroupIndex g = 0; g < scene.groups.count; ++g) {
    ++counts.pairs;
    counts.judged += culled[g];
    EXPECT_EQ(culled[g] != 0, hides_group(scene.regions, g, eye)) << "group " << g;
    if (culled[g])
      triangles.insert(triangles.end(), scene.members[g].begin(), scene.members[g].end());
  }
  const std::vector<TriangleSight> sight = judge_each(index, eye, triangles);
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const GroupIndex group = scene.groups.group_of_triangle[triangles[i]];
    if (sight[i] == TriangleSight::kHidden || !culled[group]) continue;
    culled[group] = 0;  // one false cull, however many triangles are seen
    ++counts.false_culls;
    ADD_FAILURE() << scene.name << ": group " << group << " is culled and its triangle "
                  << triangles[i] << " visible from " << eye.x_m << " " << eye.y_m << " "
                  << eye.z_m;
  }
}

/// Eyes in turn at each height, until as many culled pairs are judged as are asked for, or four
/// times as many are looked at: where little is hidden there is little to judge.
std::array<Counts, kHeightsM.size()> prove_culling(const Certified& scene, std::uint64_t pairs) {
  const TinIndex index(scene.tin);
  SplitMix64 random(1);
  std::array<Counts, kHeightsM.size()> counts;
  std::uint64_t judged = 0, looked_at = 0;
  while (looked_at < pairs || (judged < pairs && looked_at < 4 * pairs)) {
    const Position ground = random_ground(scene.tin, random);
    judged = looked_at = 0;
    for (std::size_t h = 0; h < kHeightsM.size(); ++h) {
      Position eye = ground;
      eye.z_m += kHeightsM[h];
      look_from(scene, index, round_to_lattice(eye), counts[h]);
      judged += counts[h].judged;
      looked_at += counts[h].pairs;
    }
    if (testing::Test::HasFailure()) break;
  }
  return counts;
}

TEST(CertifiedProof, NothingThatIsCulledFromOverGroundIsVisible) {
  const auto asked_pairs = asked("SCARP_PROVE_PAIRS");
  for_each_scene(asked_pairs.has_value(), [&](const Certified& scene) {
    Counts all;
    const auto counts = prove_culling(scene, asked_pairs.value_or(kShortPairs));
    std::printf("%-16s %6zu triangles %4u groups; judged", scene.name.c_str(),
                scene.tin.triangles.size(), scene.groups.count);
    for (std::size_t h = 0; h < counts.size(); ++h) {
      std::printf(" %" PRIu64 " at %g m,", counts[h].judged, kHeightsM[h]);
      all.pairs += counts[h].pairs;
      all.judged += counts[h].judged;
      all.false_culls += counts[h].false_culls;
    }
    std::printf(" %" PRIu64 " of %" PRIu64 " pairs; false culls: %" PRIu64 "\n", all.judged,
                all.pairs, all.false_culls);
    std::fflush(stdout);
    EXPECT_EQ(all.false_culls, 0U);
    if (!asked_pairs) {
      EXPECT_GT(all.judged, all.pairs / 20);
    }
  });
}

TEST(CertifiedProof, NothingIsVisibleFromJustInsideTheBoundariesOfRegions) {
  const auto asked_starts = asked("SCARP_PROVE_STARTS");
  test::BoundarySearch search;
  search.starts = static_cast<int>(asked_starts.value_or(kShortStarts));
  if (!asked_starts) search.steps = kShortSteps;
  search.most_groups = asked("SCARP_PROVE_GROUPS").value_or(search.most_groups);
  for_each_scene(asked_starts.has_value(), [&](const Certified& scene) {
    const TinIndex index(scene.tin);
    const test::BoundaryFinding found =
        test::search_boundaries(index, scene.regions, scene.members, search);
    std::printf("%-16s %6zu triangles %4u groups; judged %" PRIu64
                " cameras just inside; the truth is %.3f m above the closest; false culls: %" PRIu64
                "\n",
                scene.name.c_str(), scene.tin.triangles.size(), scene.groups.count, found.judged,
                found.least_slack_m, found.false_culls);
    std::fflush(stdout);
    EXPECT_EQ(found.false_culls, 0U)
        << "the first: group " << found.group << " is culled and visible from " << found.eye.x_m
        << " " << found.eye.y_m << " " << found.eye.z_m;
    EXPECT_GT(found.judged, std::min<std::size_t>(scene.groups.count, search.most_groups));
  });
}

TEST(CertifiedProof, TheSearchFindsRegionsThatAreTooLarge) {
  Certified scene = drawn_hills(false);
  const TinIndex index(scene.tin);
  const test::BoundaryFinding sound =
      test::search_boundaries(index, scene.regions, scene.members, {});
  EXPECT_EQ(sound.false_culls, 0U);
  EXPECT_GT(sound.least_slack_m, 0);
  // All regions raised by a little more than the search came close to the truth.
  for (CertifiedGroup& group : scene.regions.groups) group.height_m += 1.5 * sound.least_slack_m;
  const test::BoundaryFinding wrong =
      test::search_boundaries(index, scene.regions, scene.members, {});
  EXPECT_GT(wrong.false_culls, 0U);
  ASSERT_LT(wrong.group, scene.groups.count);
  EXPECT_TRUE(hides_group(scene.regions, wrong.group, wrong.eye));
  EXPECT_TRUE(test::is_any_seen(index, wrong.eye, scene.members[wrong.group]));
}

TEST(CertifiedProof, TheSearchStandsOneLatticeStepInsideTheBoundary) {
  const Certified scene = drawn_hills(false);
  const Bounds bounds = bounds_of(scene.tin.vertices);
  SplitMix64 random(5);
  int found = 0;
  for (int i = 0; i < 2'000; ++i) {
    const auto group = static_cast<GroupIndex>(random.below(scene.groups.count));
    Position eye = scene.tin.vertices[random.below(scene.tin.vertices.size())];
    const auto z_m = test::greatest_hidden_z(scene.regions, group, eye, bounds.low.z_m - 1'000,
                                             bounds.high.z_m + 10'000);
    if (!z_m) continue;
    ++found;
    eye.z_m = *z_m;
    EXPECT_TRUE(hides_group(scene.regions, group, eye));
    eye.z_m += kLatticeStepM;
    EXPECT_FALSE(hides_group(scene.regions, group, eye));
  }
  EXPECT_GT(found, 200);
}

}  // namespace
}  // namespace scarp
