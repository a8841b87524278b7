#include "core/horizon/certified/places.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/horizon/certified/edge_plane.h"
#include "core/occlusion/splitmix64.h"

namespace scarp {
namespace {

TEST(Places, AnswerForEachOfThemBitForBit) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SplitMix64 random(seed);
    std::vector<FanPlace> list(1 + random.below(40));
    for (FanPlace& place : list)
      place = {-100 * random.unit(), 20 * random.unit(), 50 * random.unit()};
    const Places places(list);
    const double u_m = 200 * random.unit() - 20, z_m = 50 * random.unit();
    double slope = HUGE_VAL, base_m = -HUGE_VAL;
    for (const FanPlace& p : list)
      slope = std::min(slope, (z_m - p.z_m) / std::max(u_m - p.u_m, 0.25));
    for (const FanPlace& p : list) base_m = std::max(base_m, p.z_m - slope * p.u_m);
    const Places::Line line = places.line_to(u_m, z_m, 0.25);
    EXPECT_EQ(line.slope, slope) << "seed " << seed;
    EXPECT_EQ(line.base_m, base_m) << "seed " << seed;
    EXPECT_EQ(places.tangent(slope).base_m, base_m) << "seed " << seed;

    // One by one, places hold a plane as all do together.
    FanView view;
    view.fan = fan_of(64, 3);
    view.error_m = 1e-9, view.height_error_m = 1e-9;
    const FanPlace a{30 * random.unit() - 5, 0, 40 * random.unit()};
    const FanPlace b{30 * random.unit() - 5, 20, 40 * random.unit()};
    EdgePlane together(view, a, b), apart(view, a, b);
    const CurtainPlane curtain(view, a, b);
    together.hold(places);
    double curtain_slope = HUGE_VAL;
    for (const FanPlace& p : list) {
      apart.hold(p);
      curtain_slope =
          std::min(curtain_slope,
                   Places(std::span(&p, 1)).least_rises(apart.line(), curtain.line()).curtain);
    }
    EXPECT_EQ(together.is_held(), apart.is_held()) << "seed " << seed;
    if (apart.is_held()) {
      EXPECT_EQ(together.plane(a, b).ahead, apart.plane(a, b).ahead);
    }
    const Places::Rises rises = places.least_rises(together.line(), curtain.line());
    EXPECT_EQ(rises.edge, places.least_rise(together.line()));
    EXPECT_EQ(rises.curtain, curtain_slope);
  }
}

}  // namespace
}  // namespace scarp
