#include "core/horizon/subsector.h"

#include <cassert>
#include <cmath>
#include <numbers>

namespace scarp {
namespace {

/// Rounds half away from zero. Written out because it is inlined on every instruction set.
std::int64_t projection_steps(double value_m) {
  const double steps = value_m / kProjectionStepM;
  return static_cast<std::int64_t>(steps < 0 ? steps - 0.5 : steps + 0.5);
}

SectorAxis boundary(std::int32_t parts, std::int32_t index) {
  const double azimuth_rad = 2 * std::numbers::pi * index / parts;
  return {std::cos(azimuth_rad), std::sin(azimuth_rad)};
}

double left_of_m(const SectorAxis& direction, const Position& p) {
  return direction.x * p.y_m - direction.y * p.x_m;
}

}  // namespace

Subsector::Subsector(const SectorLayout& layout, std::int32_t part) {
  assert(layout.count >= 4 && layout.subsectors >= 1);
  const std::int32_t parts = layout.count * layout.subsectors;
  assert(part >= 0 && part < parts);
  a_ = boundary(parts, part);
  b_ = boundary(parts, (part + 1) % parts);
  middle_ = sector_axis({parts, 1}, part);
}

Projection Subsector::project(const Position& p) const {
  return {projection_steps(left_of_m(a_, p)), projection_steps(left_of_m(b_, p)), project_u(p)};
}

std::int64_t Subsector::project_u(const Position& p) const {
  return projection_steps(middle_.x * p.x_m + middle_.y * p.y_m);
}

}  // namespace scarp
