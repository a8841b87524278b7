#include "core/viewshed/least_height.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/viewshed/ray_climb.h"

namespace scarp {
namespace {

constexpr float kNever = std::numeric_limits<float>::infinity();
constexpr float kNotKnown = std::numeric_limits<float>::quiet_NaN();

/// GridSight::least_z_m rounds up by less than this, metres: nearer to the ground it is judged
/// whether that is seen.
constexpr double kNearGroundM = 1e-3;

/// Straight under an eye: what lies between is a sample or a segment of the grid that blocks.
float least_height_under_m(const GridSight& sight, const GroundGrid& stands, const Position& ground,
                           std::int32_t column, std::int32_t row) {
  Position target = ground;
  target.z_m = std::max(ground.z_m, sight.grid().at(column, row).z_m);
  for (double more_m = kLatticeStepM; target.z_m <= sight.eye().z_m; more_m *= 2) {
    if (sight.judge(target, column, row) == Seen::kVisible)
      return height_up_to(stands, target.z_m, column, row);
    target.z_m += more_m;
  }
  return kNever;
}

}  // namespace

float height_up_to(const GroundGrid& stands, double z_m, std::int32_t column, std::int32_t row) {
  if (z_m >= kLatticeReachM) return kNever;
  if (z_m <= stands.at(column, row).z_m) return 0;
  // A target is put on the lattice: one step up holds whichever way it is rounded.
  const double height_m = stands.height_above_ground_m(column, row, z_m) + kLatticeStepM;
  const auto rounded = static_cast<float>(height_m);
  return rounded < height_m ? std::nextafter(rounded, kNever) : rounded;
}

float least_height_m(const GridSight& sight, const GroundGrid& stands, std::int32_t column,
                     std::int32_t row) {
  const Position at = stands.at(column, row);
  bool over_void = false;
  const double z_m = sight.least_z_m(at, column, row, over_void);
  if (over_void) return kNotKnown;
  const bool under_eye = at.x_m == sight.eye().x_m && at.y_m == sight.eye().y_m;
  if (!under_eye && std::abs(z_m - at.z_m) > kNearGroundM)
    return height_up_to(stands, z_m, column, row);
  // So near to the ground, whether it is seen is a matter for exact arithmetic.
  const Seen seen = sight.judge(at, column, row);
  if (seen == Seen::kVisible) return 0;
  if (seen == Seen::kUnknown) return kNotKnown;
  return under_eye ? least_height_under_m(sight, stands, at, column, row)
                   : height_up_to(stands, std::max(z_m, at.z_m + kClimbErrorM), column, row);
}

}  // namespace scarp
