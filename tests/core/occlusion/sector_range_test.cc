#include "core/occlusion/sector_range.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace scarp {
namespace {

constexpr double kPi = std::numbers::pi;

std::vector<std::int32_t> sectors_in(const SectorLayout& layout, const SectorRange& range) {
  std::vector<std::int32_t> sectors;
  for (std::int32_t s = 0; s < layout.count; ++s)
    if (range.holds(layout, s)) sectors.push_back(s);
  return sectors;
}

using Sectors = std::vector<std::int32_t>;

TEST(SectorRange, ADirectionOnABorderHasBothSectors) {
  const SectorLayout eight{8, 1};
  EXPECT_EQ(sectors_in(eight, sectors_towards(eight, 1, 0)), (Sectors{0, 7}));
  EXPECT_EQ(sectors_in(eight, sectors_towards(eight, 5, 5)), (Sectors{0, 1}));
  EXPECT_EQ(sectors_in(eight, sectors_towards(eight, -1, 0)), (Sectors{3, 4}));
  EXPECT_EQ(sectors_in(eight, sectors_towards(eight, -1, -0.0)), (Sectors{3, 4}));
  EXPECT_EQ(sectors_in(eight, sectors_towards(eight, 2, 1)), (Sectors{0}));
  EXPECT_EQ(sectors_in(eight, sectors_towards(eight, 1e6, -1)), (Sectors{7}));
}

TEST(SectorRange, HoldsEveryDirectionOfAnArc) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> azimuth(-3 * kPi, 3 * kPi), width(0, 2.2 * kPi),
      part(0, 1);
  for (int i = 0; i < 20000; ++i) {
    const SectorLayout layout{4 + static_cast<std::int32_t>(random() % 61), 1};
    const double from_rad = azimuth(random);
    const AzimuthArc arc{from_rad, from_rad + (i % 10 == 0 ? 0 : width(random))};
    const SectorRange range = sectors_touching(layout, arc);
    const double inside_rad = arc.from_rad + part(random) * (arc.to_rad - arc.from_rad);
    const double turns = inside_rad / (2 * kPi);
    const auto sector = static_cast<std::int32_t>((turns - std::floor(turns)) * layout.count);
    ASSERT_TRUE(range.holds(layout, sector % layout.count)) << "round " << i;
    const double sectors_wide = (arc.to_rad - arc.from_rad) * layout.count / (2 * kPi);
    ASSERT_LE(range.count, static_cast<std::int32_t>(sectors_wide) + 2);
    ASSERT_LE(range.count, layout.count);
  }
}

TEST(SectorRange, ArcsOverlapWhereTheyTouchAcrossTheSeam) {
  EXPECT_TRUE(arcs_overlap({-0.1, 0.1}, {0.1, 0.2}));
  EXPECT_TRUE(arcs_overlap({-0.1, 0.1}, {2 * kPi - 0.2, 2 * kPi - 0.1}));
  EXPECT_FALSE(arcs_overlap({-0.1, 0.1}, {0.11, 2 * kPi - 0.11}));
  EXPECT_TRUE(arcs_overlap({0, 2 * kPi}, {3, 3}));
  EXPECT_TRUE(arcs_overlap({3, 3}, {0, 2 * kPi}));
  EXPECT_TRUE(arcs_overlap({1, 5}, {2, 3}));
  EXPECT_TRUE(arcs_overlap({2, 3}, {1, 5}));
  EXPECT_FALSE(arcs_overlap({2, 3}, {4, 5}));
}

}  // namespace
}  // namespace scarp
