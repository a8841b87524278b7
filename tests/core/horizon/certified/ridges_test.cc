#include "core/horizon/certified/ridges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/support/terrain.h"

namespace scarp {
namespace {

constexpr RidgeRange kAll = {-HUGE_VAL, -HUGE_VAL, HUGE_VAL};

TEST(Ridges, ARangeHoldsWhatIsAheadOfItAndNothingElseChanges) {
  const Tin tin = test::triangulated(test::random_hills(30, 26, 10, 5, 80, 0.01, 0.1), 3);
  const RidgeEdges edges = ridge_edges_of(tin);
  std::mt19937_64 random(1);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  FanView view;
  Ridges all, part;
  std::size_t compared = 0;
  for (std::int32_t i = 0; i < 16; ++i) {
    view_along(fan_of(16, i), tin, 140, 120, view);
    all.cross(edges, view, 7, kAll);
    const double width_m = view.high_v_m - view.low_v_m;
    RidgeRange range;
    range.low_u_m = view.low_u_m + unit() * (view.high_u_m - view.low_u_m);
    range.low_v_m = view.low_v_m + (1.2 * unit() - 0.2) * width_m;
    range.high_v_m = range.low_v_m + unit() * width_m;
    part.cross(edges, view, 7, range);
    for (int k = 0; k <= 40; ++k) {
      const double v_m = range.low_v_m + k / 40.0 * (range.high_v_m - range.low_v_m);
      const auto ahead = [&](const Ridges& ridges) {
        std::vector<std::uint32_t> found;
        for (const RidgeCrossing& c : ridges.along(v_m))
          if (static_cast<double>(c.u_m) >= range.low_u_m) found.push_back(c.edge);
        return found;
      };
      EXPECT_EQ(ahead(part), ahead(all)) << v_m;
      compared += ahead(all).size();
    }
  }
  EXPECT_GT(compared, 1000U);
}

TEST(Ridges, TellTheHighestOfCrossingsThatAreTakenAtOnce) {
  const Tin tin = test::triangulated(test::random_hills(40, 33, 10, 5, 80, 0.01, 0.1), 3);
  const RidgeEdges edges = ridge_edges_of(tin);
  FanView view;
  Ridges ridges;
  std::size_t most = 0;
  for (std::int32_t i = 0; i < 8; ++i) {
    view_along(fan_of(8, i), tin, 140, 120, view);
    ridges.cross(edges, view, 7, kAll);
    for (double v_m = view.low_v_m; v_m < view.high_v_m; v_m += 3) {
      const auto crossings = ridges.along(v_m);
      std::vector<float> highest;
      for (std::size_t at = 0; at < crossings.size(); ++at) {
        if (at % kCrossingsAtOnce == 0) highest.push_back(crossings[at].z_m);
        highest.back() = std::max(highest.back(), crossings[at].z_m);
      }
      const auto told = ridges.highest_along(v_m);
      EXPECT_EQ(std::vector<float>(told.begin(), told.end()), highest) << v_m;
      most = std::max(most, highest.size());
    }
  }
  EXPECT_GT(most, 1U);
}

}  // namespace
}  // namespace scarp
