#include "core/occlusion/certified/certified_regions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>
#include <string>

#include "core/culling/certified_culling.h"
#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/squares.h"
#include "core/sight/triangle_sight.h"
#include "core/threads/parallel_for.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

struct Certified {
  Tin tin;
  LeafGroups groups;
  CertifiedRegions regions;
};

HidingOptions few_fans() {
  HidingOptions options;
  options.fans = 64;
  options.sectors = 64;
  return options;
}

Certified certify(Tin tin, std::uint32_t group_triangles, const HidingOptions& options) {
  Certified scene{std::move(tin), {}, {}};
  scene.groups = group_by_squares(scene.tin, group_triangles);
  scene.regions =
      certify_groups(scene.tin, scene.groups.group_of_triangle, scene.groups.count, options);
  return scene;
}

/// Groups with a triangle that the judge sees.
std::vector<std::uint8_t> seen_groups(const Certified& scene, const TinIndex& index,
                                      const Position& eye) {
  std::vector<std::uint8_t> seen(scene.groups.count, 0);
  const std::vector<TriangleSight> sight = judge_all(index, eye);
  for (std::size_t t = 0; t < sight.size(); ++t)
    if (sight[t] == TriangleSight::kVisible) seen[scene.groups.group_of_triangle[t]] = 1;
  return seen;
}

/// Highest lattice z up to high_m from which the group is culled at a place, or nothing.
std::optional<double> greatest_culled_z(const CertifiedRegions& regions, GroupIndex group,
                                        Position eye, double low_m, double high_m) {
  const auto culled_at = [&](double z_m) {
    eye.z_m = round_to_lattice(z_m);
    return hides_group(regions, group, eye);
  };
  if (!culled_at(low_m)) return {};
  while (high_m - low_m > kLatticeStepM) {
    const double middle_m = low_m + (high_m - low_m) / 2;
    (culled_at(middle_m) ? low_m : high_m) = middle_m;
    if (high_m - low_m < 2 * kLatticeStepM) break;
  }
  return round_to_lattice(low_m);
}

struct Proof {
  std::uint64_t pairs = 0;  // camera and group, culled and judged
  std::uint64_t culled = 0;
  std::uint64_t false_culls = 0;
};

/// Random cameras, then cameras just under the border of a region: over random places, then moved
/// to where the border is lowest above the ground, which is where it errs if it does.
Proof prove(const Certified& scene, std::uint64_t seed, int random_eyes, int border_eyes) {
  Proof proof;
  const TinIndex index(scene.tin);
  const Bounds bounds = bounds_of(scene.tin.vertices);
  std::mt19937_64 random(seed);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  const double width_m = bounds.high.x_m - bounds.low.x_m,
               depth_m = bounds.high.y_m - bounds.low.y_m;
  const double relief_m = bounds.high.z_m - bounds.low.z_m + 1;
  const auto place = [&] {
    return round_to_lattice(Position{bounds.low.x_m + (1.4 * unit() - 0.2) * width_m,
                                     bounds.low.y_m + (1.4 * unit() - 0.2) * depth_m, 0});
  };
  CertifiedCulling method(scene.regions);
  for (int i = 0; i < random_eyes; ++i) {
    Position eye = i % 3 == 0 ? scene.tin.vertices[random() % scene.tin.vertices.size()] : place();
    const double ground_m = index.ground_height_m(eye.x_m, eye.y_m).value_or(bounds.low.z_m);
    const double heights_m[] = {0, 2, 0.1 * relief_m, unit() * relief_m, -unit() * relief_m};
    eye.z_m = round_to_lattice(ground_m + heights_m[random() % 5]);
    const std::vector<std::uint8_t> seen = seen_groups(scene, index, eye);
    std::vector<std::uint8_t> culled(scene.groups.count, 1);
    for (const GroupIndex g : method.visible({eye, {}}).visible_groups) culled[g] = 0;
    for (GroupIndex g = 0; g < scene.groups.count; ++g) {
      ++proof.pairs;
      EXPECT_EQ(culled[g] != 0, hides_group(scene.regions, g, eye)) << "group " << g;
      proof.culled += culled[g];
      proof.false_culls += culled[g] && seen[g];
    }
  }
  std::vector<std::vector<TriangleIndex>> members(scene.groups.count);
  for (TriangleIndex t = 0; t < scene.tin.triangles.size(); ++t)
    members[scene.groups.group_of_triangle[t]].push_back(t);
  const double low_m = bounds.low.z_m - 20 * relief_m, high_m = bounds.high.z_m + 20 * relief_m;
  for (int i = 0; i < border_eyes; ++i) {
    const auto group = static_cast<GroupIndex>(random() % scene.groups.count);
    Position eye = place();
    // Climb towards places where the border is high over the ground that blocks the view.
    std::optional<double> best;
    for (int step = 0; step < 6; ++step) {
      Position next = step == 0 ? eye : eye;
      if (step > 0) {
        const double size_m = std::ldexp(0.25, -step);
        next.x_m = round_to_lattice(eye.x_m + (unit() - 0.5) * size_m * width_m);
        next.y_m = round_to_lattice(eye.y_m + (unit() - 0.5) * size_m * depth_m);
      }
      const auto z_m = greatest_culled_z(scene.regions, group, next, low_m, high_m);
      if (!z_m) continue;
      next.z_m = *z_m;
      ++proof.pairs;
      ++proof.culled;
      bool seen = false;
      for (const TriangleSight sight : judge_each(index, next, members[group]))
        seen |= sight == TriangleSight::kVisible;
      proof.false_culls += seen;
      if (seen)
        ADD_FAILURE() << "group " << group << " is visible from " << next.x_m << " " << next.y_m
                      << " " << next.z_m;
      if (!best || *z_m >= *best) best = z_m, eye = next;
    }
  }
  return proof;
}

int scaled(int usual) {
  const char* asked = std::getenv("SCARP_PROVE_PAIRS");
  return asked ? std::max(usual, std::atoi(asked)) : usual;
}

/// Terrains of the kinds where methods fail, by number.
SampleGrid hard_terrain(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  const int columns = 8 + static_cast<int>(random() % 24),
            rows = 8 + static_cast<int>(random() % 24);
  const double nothing = std::nan("");
  switch (seed % 8) {
    case 0:
      return test::random_hills(columns, rows, 10, seed, 120, 0.01);
    case 1:
      return test::random_hills(columns, rows, 10, seed, 60, 15);  // terraces
    case 2:
      return test::random_hills(columns, rows, 10, seed, 120, 0.1, 0.2);  // voids
    case 3:                                                               // spikes and pits
      return test::grid_of(columns, rows, 10, [&](int, int) {
        return unit() < 0.08 ? 300 * unit() : unit() < 0.05 ? -200 : 5 * unit();
      });
    case 4:  // walls along rows, columns and diagonals, with a gap
      return test::grid_of(columns, rows, 10, [&](int c, int r) {
        const bool wall = c == columns / 3 || r == rows / 2 || c + r == columns;
        return wall && c != 2 && r != 3 ? 100.0 : unit();
      });
    case 5:  // cliffs, near-vertical on 0.25 m cells
      return test::grid_of(columns, rows, 0.25, [&](int c, int r) {
        return std::floor((c + 0.7 * r) / 5) * 40 + unit();
      });
    case 6:  // a coast, and single samples
      return test::grid_of(columns, rows, 30, [&](int c, int r) {
        return c + 3 * unit() < columns / 2.0 + r % 3 ? 80 * unit() * unit() + 20 * (r % 7 == 0)
                                                      : nothing;
      });
    default:
      return test::grid_of(columns, rows, 1000, [&](int, int) { return 4000 * unit(); });
  }
}

/// Shears and shifts a mesh: needles, very unequal sizes, great coordinates.
Tin deformed(Tin tin, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const double shift_m = seed % 3 == 0 ? 5e6 : 0;
  const double squeeze = seed % 5 == 0 ? 1e-3 : 1;
  for (Position& p : tin.vertices)
    p = round_to_lattice(Position{p.x_m + 0.3 * p.y_m + shift_m, p.y_m * squeeze - shift_m, p.z_m});
  return tin;
}

TEST(CertifiedRegions, NothingThatIsCulledIsVisible) {
  Proof all;
  for (std::uint64_t seed = 1; seed <= 32; ++seed) {
    SCOPED_TRACE("terrain " + std::to_string(seed));
    Tin tin = deformed(test::triangulated(hard_terrain(seed), seed), seed);
    if (tin.triangles.empty() || check_tin(tin)) continue;
    const std::uint32_t sizes[] = {1, 4, 16, 64};
    const Certified scene = certify(std::move(tin), sizes[seed % 4], few_fans());
    ASSERT_EQ(check_certified(scene.regions), std::nullopt);
    const Proof proof = prove(scene, seed, scaled(3), scaled(30));
    EXPECT_EQ(proof.false_culls, 0U);
    all.pairs += proof.pairs;
    all.culled += proof.culled;
  }
  EXPECT_GT(all.culled, 1000U);
  RecordProperty("pairs", std::to_string(all.pairs));
}

TEST(CertifiedRegions, FewFansAndSectorsAreAsSafe) {
  for (const std::int32_t count : {8, 16, 40}) {
    SCOPED_TRACE(count);
    HidingOptions options;
    options.fans = options.sectors = count;
    options.width = 1.5;
    options.piece = 4;
    const Certified scene =
        certify(test::triangulated(test::random_hills(24, 24, 10, 5, 150, 0.01)), 8, options);
    EXPECT_EQ(prove(scene, 3, 6, 80).false_culls, 0U);
  }
}

TEST(CertifiedRegions, AWallHidesWhatIsBehindIt) {
  std::vector<double> heights(60, 0.0);
  heights[30] = 200;
  const Certified scene =
      certify(test::triangulated(test::extruded_profile(heights, 10, 60)), 64, few_fans());
  const Position eye{50, 300, 5};  // west of the wall
  std::size_t behind = 0, hidden = 0;
  for (GroupIndex g = 0; g < scene.groups.count; ++g) {
    if (scene.regions.groups[g].centre_x_m < 350) continue;
    ++behind;
    hidden += hides_group(scene.regions, g, eye);
  }
  ASSERT_GT(behind, 20U);
  EXPECT_GT(static_cast<double>(hidden), 0.5 * static_cast<double>(behind));
  for (GroupIndex g = 0; g < scene.groups.count; ++g)
    EXPECT_FALSE(hides_group(scene.regions, g, {50, 300, 5000}));
}

/// What is known of groups before it is coded: steps that are joined keep the least slope, and
/// cover up.
struct Known {
  Tin tin;
  LeafGroups groups;
  HidingBounds bounds;
  std::vector<std::vector<TriangleIndex>> members;

  Known(const SampleGrid& grid, std::uint32_t group_triangles)
      : tin(test::triangulated(grid)), groups(group_by_squares(tin, group_triangles)) {
    bounds = bound_hiding(tin, groups.group_of_triangle, groups.count, few_fans());
    members.resize(groups.count);
    for (TriangleIndex t = 0; t < tin.triangles.size(); ++t)
      members[groups.group_of_triangle[t]].push_back(t);
  }

  /// Greatest lattice height at a place that the bound of its cell calls hidden from a group.
  std::optional<double> greatest_hidden_z(GroupIndex g, const Position& at) const {
    const double x_m = at.x_m - bounds.circle[g].x_m, y_m = at.y_m - bounds.circle[g].y_m;
    const double far_m = std::hypot(x_m, y_m), inner_m = bounds.circle[g].radius_m * kFirstRing;
    if (!(far_m > inner_m)) return {};
    const std::int32_t ring =
        ring_of(bounds.layout, static_cast<float>(far_m * far_m / (inner_m * inner_m)));
    const double slope = static_cast<double>(
        bounds.at(g, sector_of(bounds.layout, x_m, y_m))[static_cast<std::size_t>(ring)]);
    if (!(std::abs(slope) < 1e6)) return {};
    const double z_m = round_to_lattice(bounds.height_m[g] + slope * far_m);
    return z_m < bounds.height_m[g] + slope * far_m ? z_m : z_m - kLatticeStepM;
  }

  /// Judges a group from just under the bound at a place. @return whether there is one
  bool judge(const TinIndex& index, GroupIndex g, Position eye) const {
    const auto z_m = greatest_hidden_z(g, eye);
    if (!z_m) return false;
    eye.z_m = *z_m;
    for (const TriangleSight sight : judge_each(index, eye, members[g]))
      if (sight == TriangleSight::kVisible) {
        ADD_FAILURE() << "group " << g << " is visible from " << eye.x_m << " " << eye.y_m << " "
                      << eye.z_m;
        break;
      }
    return true;
  }
};

TEST(CertifiedRegions, CamerasFarOutsideTheDataAreBoundedRingByRing) {
  // Beyond two radii of a group outside the data no cell is worked on by itself: all that holds
  // there are bounds of whole rings, the last of which has no end.
  const Known known(test::random_hills(24, 24, 10, 5, 150, 0.01), 32);
  const TinIndex index(known.tin);
  std::mt19937_64 random(9);
  std::size_t judged = 0;
  for (int i = 0; i < 100 && !HasFailure(); ++i) {
    const double azimuth_rad = static_cast<double>(random() % 6283) / 1000;
    const double distance_m = 250 * std::exp2(static_cast<double>(random() % 700) / 100);
    const Position at = round_to_lattice(Position{115 + distance_m * std::cos(azimuth_rad),
                                                  115 + distance_m * std::sin(azimuth_rad), 0});
    for (GroupIndex g = 0; g < known.groups.count; ++g) judged += known.judge(index, g, at);
  }
  EXPECT_GT(judged, 2000U);
}

TEST(CertifiedRegions, CamerasOverAVoidUnderAllGroundAroundAreBoundedRingByRing) {
  // Slopes fall to a void from all sides, and the cells under its rim are of no use to a camera
  // over ground: one that is there all the same looks up at what no ridge beyond it hides.
  const SampleGrid grid = test::grid_of(26, 26, 10, [](int c, int r) {
    const double x = c - 12.5, y = r - 12.5, out = std::hypot(x, y);
    if (out < 5) return std::nan("");
    return 20 * out + 60 * (static_cast<int>(out) % 4 == 3) + (c * 37 + r * 61) % 13;
  });
  const Known known(grid, 8);
  const TinIndex index(known.tin);
  std::mt19937_64 random(3);
  std::size_t judged = 0;
  for (int i = 0; i < 60 && !HasFailure(); ++i) {
    const double azimuth_rad = static_cast<double>(random() % 6283) / 1000;
    const double distance_m = static_cast<double>(random() % 400) / 10;
    const Position at = round_to_lattice(Position{125 + distance_m * std::cos(azimuth_rad),
                                                  125 + distance_m * std::sin(azimuth_rad), 0});
    for (GroupIndex g = 0; g < known.groups.count; ++g) judged += known.judge(index, g, at);
  }
  EXPECT_GT(judged, 1000U);
}

TEST(CertifiedRegions, ACameraUnderAllGroundOutsideTheDataSeesSlopesThatFallTowardsIt) {
  // A rough roof: outside, between the lowest ground and the planes of its slopes, one looks up at
  // it.
  std::mt19937_64 random(5);
  const SampleGrid grid = test::grid_of(32, 32, 10, [&](int c, int r) {
    return 200 - 9.0 * std::abs(c - 15.5) - 0.5 * std::abs(r - 15.5) +
           static_cast<double>(random() % 1024) / 128;
  });
  const Certified scene = certify(test::triangulated(grid), 4, few_fans());
  const TinIndex index(scene.tin);
  const double lowest_m = bounds_of(scene.tin.vertices).low.z_m;
  std::size_t seen_count = 0;
  for (const double x_m : {-20.0, -60.0, -150.0, -400.0, 330.0, 500.0, 900.0})
    for (const double y_m : {-40.0, 20.0, 155.0, 300.0})
      for (const double under_m : {0.5, 5.0, 20.0, 60.0, 150.0}) {
        const Position eye = round_to_lattice(Position{x_m, y_m, lowest_m - under_m});
        const std::vector<std::uint8_t> seen = seen_groups(scene, index, eye);
        for (GroupIndex g = 0; g < scene.groups.count; ++g) {
          seen_count += seen[g];
          EXPECT_FALSE(seen[g] && hides_group(scene.regions, g, eye))
              << "group " << g << " from " << x_m << " " << y_m << ", " << under_m << " m under";
        }
      }
  EXPECT_GT(seen_count, 100U);
}

TEST(CertifiedRegions, VoidHidesNothing) {
  // The wall of above, but of nothing known.
  const SampleGrid grid =
      test::grid_of(40, 40, 10, [](int c, int) { return c == 20 ? std::nan("") : 0.0; });
  const Certified scene = certify(test::triangulated(grid), 32, few_fans());
  for (GroupIndex g = 0; g < scene.groups.count; ++g)
    EXPECT_FALSE(hides_group(scene.regions, g, {30, 200, 1}));
}

TEST(CertifiedRegions, TheSameBitsForAnyNumberOfThreads) {
  const auto steps = [](int threads) {
    set_thread_count(threads);
    const Certified scene =
        certify(test::triangulated(test::random_hills(30, 30, 10, 9, 100, 0.01)), 16, few_fans());
    set_thread_count(0);
    return scene.regions.steps;
  };
  const auto one = steps(1);
  EXPECT_EQ(one, steps(2));
  EXPECT_EQ(one, steps(5));
}

TEST(CertifiedRegions, SectorsKeepToTheBytes) {
  for (const std::uint32_t groups : {1U, 10U, 77U}) {
    const std::size_t triangles = 128 * groups;
    const double bytes = groups * kept_group_bytes(sectors_within(16, triangles, groups));
    EXPECT_LE(bytes, 16.0 * static_cast<double>(triangles));
    EXPECT_GT(bytes, 15.0 * static_cast<double>(triangles));
  }
}

TEST(CertifiedRegions, OrphansAndNoGroupsAreFine) {
  const Tin tin = test::triangulated(test::random_hills(10, 10, 10, 2, 50, 0.01));
  const std::vector<GroupIndex> none(tin.triangles.size(), kNone);
  EXPECT_TRUE(certify_groups(tin, none, 0).groups.empty());
  std::vector<GroupIndex> one = none;
  one[7] = 0;
  const CertifiedRegions regions = certify_groups(tin, one, 1, few_fans());
  EXPECT_EQ(regions.groups.size(), 1U);
  EXPECT_EQ(check_certified(regions), std::nullopt);
}

TEST(CertifiedRegions, CheckNamesWhatIsBroken) {
  const Certified scene =
      certify(test::triangulated(test::random_hills(10, 10, 10, 2, 50, 0.01)), 16, few_fans());
  const auto broken = [&](auto change) {
    CertifiedRegions regions = scene.regions;
    change(regions);
    return check_certified(regions).value_or("");
  };
  EXPECT_NE(broken([](auto& r) { r.steps.pop_back(); }), "");
  EXPECT_NE(broken([](auto& r) { r.groups[1].radius_m = 0; }), "");
  EXPECT_NE(broken([](auto& r) { r.groups[1].height_m = HUGE_VAL; }), "");
  EXPECT_NE(broken([](auto& r) { r.steps[5] = {9 << 10, 8 << 10, 8 << 10, 8 << 10}; }), "");
  EXPECT_NE(broken([](auto& r) { r.layout.sectors = 12; }), "");
}

}  // namespace
}  // namespace scarp
