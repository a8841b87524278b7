#include "core/culling/cell_culling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "core/culling/certified_culling.h"
#include "core/occlusion/certified/box_hiding.h"
#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/squares.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

struct Scene {
  Tin tin;
  CertifiedRegions regions;
};

const Scene& hills() {
  static const Scene scene = [] {
    Scene made{test::triangulated(test::random_hills(36, 36, 10, 4, 150, 0.01), 1), {}};
    const LeafGroups groups = group_by_squares(made.tin, 12);
    HidingOptions options;
    options.fans = 32;
    options.sectors = 32;
    made.regions = certify_groups(made.tin, groups.group_of_triangle, groups.count, options);
    return made;
  }();
  return scene;
}

TEST(BoxHiding, WhatIsHiddenFromABoxIsHiddenFromEveryCameraInIt) {
  const Scene& scene = hills();
  std::mt19937 random(1);
  const auto unit = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
  std::uint64_t hidden = 0, hidden_from_middle = 0;
  for (int i = 0; i < 150; ++i) {
    const double size_m = std::exp(4 * unit());
    Bounds box{round_to_lattice(Position{360 * unit(), 360 * unit(), 150 * unit() - 20}), {}};
    box.high =
        round_to_lattice(Position{box.low.x_m + size_m * unit(), box.low.y_m + size_m * unit(),
                                  box.low.z_m + size_m * unit()});
    for (GroupIndex g = 0; g < scene.regions.groups.size(); ++g) {
      const Position middle = round_to_lattice(Position{
          (box.low.x_m + box.high.x_m) / 2, (box.low.y_m + box.high.y_m) / 2, box.high.z_m});
      hidden_from_middle += hides_group(scene.regions, g, middle);
      if (!hides_group_from(scene.regions, g, box)) continue;
      ++hidden;
      for (int k = 0; k < 12; ++k) {
        // Corners and borders as often as the inside.
        const auto within = [&](double low, double high) {
          const double share = k < 6 ? std::round(unit()) : unit();
          return low + share * (high - low);
        };
        const Position eye = round_to_lattice(Position{within(box.low.x_m, box.high.x_m),
                                                       within(box.low.y_m, box.high.y_m),
                                                       within(box.low.z_m, box.high.z_m)});
        ASSERT_TRUE(hides_group(scene.regions, g, eye)) << "group " << g << ", box " << i;
      }
    }
  }
  EXPECT_GT(hidden, hidden_from_middle / 4) << "it must also find something";
}

TEST(CellCulling, NeverLeavesOutWhatCertifiedShowsAndComesCloseToIt) {
  const Scene& scene = hills();
  CertifiedCulling certified(scene.regions);
  const Bounds space{{-50, -50, -50}, {400, 400, 300}};
  CellCulling coarse(scene.regions, space, 100), fine(scene.regions, space, 6);
  std::mt19937 random(2);
  const auto unit = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
  std::size_t by_certified = 0, by_fine = 0, by_coarse = 0, all = 0;
  for (int i = 0; i < 25; ++i) {
    const Position eye =
        round_to_lattice(Position{360 * unit(), 360 * unit(), 100 * unit() * unit()});
    const auto exact = certified.visible({eye, {}}).visible_groups;
    const auto from_fine = fine.visible({eye, {}}).visible_groups;
    const auto from_coarse = coarse.visible({eye, {}}).visible_groups;
    ASSERT_TRUE(std::includes(from_fine.begin(), from_fine.end(), exact.begin(), exact.end()));
    ASSERT_TRUE(
        std::includes(from_coarse.begin(), from_coarse.end(), from_fine.begin(), from_fine.end()));
    all += scene.regions.groups.size();
    by_certified += exact.size();
    by_fine += from_fine.size();
    by_coarse += from_coarse.size();
  }
  EXPECT_LT(by_fine, by_coarse);
  EXPECT_LT(all - by_fine, all - by_certified + 1);
  EXPECT_GT(2 * (all - by_fine), all - by_certified)
      << "half of what certified leaves out, at least";
}

TEST(CellCulling, SeesEverythingFromOutsideItsSpace) {
  CellCulling cells(hills().regions, {{0, 0, 0}, {100, 100, 100}}, 10);
  EXPECT_EQ(cells.visible({{500, 0, 0}, {}}).visible_groups.size(), hills().regions.groups.size());
  EXPECT_EQ(cells.cells(), 1U);
}

}  // namespace
}  // namespace scarp
