#include "core/occlusion/certified/reached_cells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/occlusion/splitmix64.h"

namespace scarp {
namespace {

/// A plane that bounds every camera by one slope.
CellPlane flat_plane(float slope) {
  CellPlane plane{};
  plane.slope_error = -slope;
  plane.falling = slope;
  return plane;
}

/// A ray of a fan that passes a group's centre, and a camera on it, in radii.
struct Ray {
  double turn_rad;  // from the fan's middle
  double offset;    // of its line, to the left of the centre
  double distance;  // of the camera from the centre
  double azimuth_rad() const { return turn_rad + std::asin(offset / distance); }
};

class Cells {
 public:
  Cells(std::int32_t sectors, std::int32_t fans, std::int32_t fan)
      : layout_{sectors, 2},
        fan_(fan_of(fans, fan)),
        rings_(layout_, fan_),
        borders_(borders_of(layout_)),
        bounds_(static_cast<std::size_t>(sectors) * kRings, std::numeric_limits<float>::infinity()),
        least_(bounds_.size() + kHintsBeyond, slope_hint(-1e30F)),
        wanted_(bounds_.size() / kCellsMarked) {
    turns_.turn_to(layout_, fan_, rings_);
  }

  const Fan& fan() const { return fan_; }

  std::int32_t ring_at(const Ray& ray) const {
    const double units = ray.distance / kFirstRing;
    return ring_of(layout_, static_cast<float>(units * units));
  }

  /// What is known of a camera's cell after planes were raised over a piece that the ray crosses.
  float bound_at(const Ray& ray, const std::vector<CellPlane>& planes, bool as_part) {
    const ReachedCells::Known known{bounds_.data(), least_.data(), wanted_.data()};
    const auto lane = static_cast<std::size_t>((ray.offset + 1) * (kLanes / 2));
    ReachedCells whole, part;
    whole.mark(turns_, layout_.sectors, known, wanted_.data());
    whole.reach(rings_, turns_, borders_, as_part ? 0 : lane, as_part ? kLanes - 1 : lane, known);
    if (as_part) part.reach_part(whole, lane, lane);
    ReachedCells& cells = as_part ? part : whole;
    cells.raise(planes);
    std::vector<float> bounds = bounds_;
    cells.lower(bounds.data());
    const double azimuth_rad = fan_.middle_rad + ray.azimuth_rad();
    const auto sector = sector_of(layout_, std::cos(azimuth_rad), std::sin(azimuth_rad));
    return bounds[static_cast<std::size_t>(ring_at(ray) * layout_.sectors + sector)];
  }

 private:
  PolarLayout layout_;
  Fan fan_;
  RingTable rings_;
  Turns turns_;
  std::vector<SectorBorders> borders_;
  std::vector<float> bounds_;
  std::vector<std::uint16_t> least_;
  std::vector<std::uint64_t> wanted_;
};

/// Calls visit(cells, ray, random) for rays of many fans.
template <class Visit>
void for_each_ray(Visit visit) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    SplitMix64 random(seed);
    const std::int32_t fans = 8 << random.below(6), sectors = 64 << random.below(4);
    const auto fan = static_cast<std::int32_t>(random.below(static_cast<std::uint64_t>(fans)));
    Cells cells(sectors, fans, fan);
    for (int i = 0; i < 10; ++i) {
      // The ends of a fan are where something may be missed.
      const double turn = random.below(2)   ? 2 * random.unit() - 1
                          : random.below(2) ? 1 - 1e-9
                                            : -1 + 1e-9;
      const Ray ray{
          turn * cells.fan().half_rad, 1.999 * random.unit() - 1,
          kFirstRing * (1 + std::ldexp(random.unit(), static_cast<int>(random.below(7))))};
      visit(cells, ray, random);
    }
  }
}

TEST(ReachedCells, APlaneLowersTheCellsThatItsRaysLeadTo) {
  for_each_ray([](Cells& cells, const Ray& ray, SplitMix64& random) {
    CellPlane mine = flat_plane(-5), other = flat_plane(7);
    mine.low_rad = mine.high_rad = static_cast<float>(ray.turn_rad);
    EXPECT_EQ(cells.bound_at(ray, {mine, other}, random.below(2)), -5) << ray.turn_rad;
  });
}

TEST(ReachedCells, APlaneOfOtherRaysDoesNotLowerACell) {
  std::size_t spared = 0;
  for_each_ray([&](Cells& cells, const Ray& ray, SplitMix64& random) {
    CellPlane mine = flat_plane(7), other = flat_plane(-5);
    other.low_rad = static_cast<float>(ray.turn_rad) + 0.3F;
    spared += cells.bound_at(ray, {mine, other}, random.below(2)) == 7;
  });
  EXPECT_GT(spared, 100U);
}

TEST(ReachedCells, APlaneHidesNothingFromCamerasThatAreNotBeyondIt) {
  for_each_ray([](Cells& cells, const Ray& ray, SplitMix64& random) {
    CellPlane mine = flat_plane(-5), other = flat_plane(7);
    mine.first_ring = static_cast<std::size_t>(cells.ring_at(ray)) + 1;
    const std::vector<CellPlane> planes =
        random.below(2) ? std::vector{mine, other} : std::vector{mine};
    EXPECT_EQ(cells.bound_at(ray, planes, random.below(2)),
              -std::numeric_limits<float>::infinity());
  });
}

}  // namespace
}  // namespace scarp
