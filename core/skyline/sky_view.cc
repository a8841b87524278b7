#include "core/skyline/sky_view.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/skyline/crossing_kernels.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

constexpr int kZenithSteps = 9000;
constexpr std::size_t kTask = 1 << 16;
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

template <typename Body>
void for_parts(std::size_t samples, const Body& body) {
  parallel_for((samples + kTask - 1) / kTask, [&](std::size_t task) {
    for (std::size_t i = task * kTask; i < std::min(samples, (task + 1) * kTask); ++i) body(i);
  });
}

}  // namespace

SkyView::SkyView(std::size_t samples, bool wants_sky_view, bool wants_openness)
    : samples_(samples), light_by_elevation_(kZenithSteps + 1) {
  for (int steps = 0; steps <= kZenithSteps; ++steps) {
    const double cosine = std::cos(steps * std::numbers::pi / (2 * kZenithSteps));
    light_by_elevation_[static_cast<std::size_t>(steps)] = static_cast<float>(cosine * cosine);
  }
  if (wants_sky_view) light_.resize(samples);
  if (!wants_openness) return;
  zenith_steps_.resize(samples);
  met_.resize(samples);
}

void SkyView::add(std::span<const std::int16_t> elevations) {
  assert(elevations.size() == samples_ && !light_done_ && !zenith_done_);
  ++azimuths_;
  for_parts(samples_, [&](std::size_t i) {
    const std::int16_t steps = elevations[i];
    const bool is_unknown = steps == kUnknownElevation;
    if (!light_.empty())
      light_[i] += is_unknown ? kUnknown
                              : light_by_elevation_[static_cast<std::size_t>(
                                    std::clamp<int>(steps, 0, kZenithSteps))];
    if (zenith_steps_.empty()) return;
    if (is_unknown) zenith_steps_[i] = kUnknown;
    if (steps == kNothingSeen) return;
    zenith_steps_[i] += static_cast<float>(kZenithSteps - steps);
    ++met_[i];
  });
}

std::span<const float> SkyView::sky_view() {
  assert(!light_.empty());
  if (!light_done_) {
    const auto count = static_cast<float>(azimuths_);
    for_parts(samples_, [&](std::size_t i) { light_[i] /= count; });
    light_done_ = true;
  }
  return light_;
}

std::span<const float> SkyView::openness_deg() {
  assert(!zenith_steps_.empty());
  if (!zenith_done_) {
    for_parts(samples_, [&](std::size_t i) {
      zenith_steps_[i] =
          met_[i] == 0 ? kUnknown : zenith_steps_[i] / (100 * static_cast<float>(met_[i]));
    });
    zenith_done_ = true;
  }
  return zenith_steps_;
}

}  // namespace scarp
