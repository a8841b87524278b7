#include "core/culling/horizon_triangles.h"

#include <algorithm>
#include <limits>

namespace scarp {
namespace {

/// Whether every difference within the box can be said in steps.
bool is_wide(const Bounds& box) {
  const auto is_long = [](double low_m, double high_m) {
    return lattice_steps(high_m) - lattice_steps(low_m) > std::numeric_limits<std::int32_t>::max();
  };
  return is_long(box.low.x_m, box.high.x_m) || is_long(box.low.y_m, box.high.y_m) ||
         is_long(box.low.z_m, box.high.z_m);
}

}  // namespace

HorizonTriangles::HorizonTriangles(const GroupBatches& batches) {
  for (GroupIndex g = 0; g < batches.groups(); ++g) {
    const auto corners = batches.corners(g);
    const auto vertices = batches.vertices(g);
    Place place{batches.box(g).low, steps_.size() / 9, 0, is_wide(batches.box(g))};
    if (!place.is_wide) {
      const std::size_t count = (corners.size() + kLaidOut - 1) / kLaidOut * kLaidOut;
      place.count = static_cast<std::uint32_t>(count);
      steps_.resize(steps_.size() + 9 * count);
      std::int32_t* const steps = steps_.data() + 9 * place.first;
      const auto put = [&](std::size_t t, std::size_t row, double at_m, double origin_m) {
        steps[t / kLaidOut * 9 * kLaidOut + row * kLaidOut + t % kLaidOut] =
            static_cast<std::int32_t>(lattice_steps(at_m) - lattice_steps(origin_m));
      };
      for (std::size_t t = 0; t < count; ++t)
        for (std::size_t c = 0; c < 3; ++c) {
          const Position& p = vertices[corners[std::min(t, corners.size() - 1)][c]];
          put(t, 3 * c, p.x_m, place.origin.x_m);
          put(t, 3 * c + 1, p.y_m, place.origin.y_m);
          put(t, 3 * c + 2, p.z_m, place.origin.z_m);
        }
    }
    places_.push_back(place);
  }
}

}  // namespace scarp
