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

SkyView::SkyView(std::int32_t columns, std::int32_t rows, bool wants_sky_view, bool wants_openness)
    : columns_(columns),
      samples_(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)),
      light_by_elevation_(kZenithSteps + 1) {
  for (int steps = 0; steps <= kZenithSteps; ++steps) {
    const double cosine = std::cos(steps * std::numbers::pi / (2 * kZenithSteps));
    light_by_elevation_[static_cast<std::size_t>(steps)] = static_cast<float>(cosine * cosine);
  }
  if (wants_sky_view) light_.resize(samples_);
  if (!wants_openness) return;
  zenith_steps_.resize(samples_);
  met_.resize(samples_);
}

void SkyView::begin_azimuth() {
  assert(!light_done_ && !zenith_done_);
  ++azimuths_;
}

void SkyView::add(const SkylinePart& part) {
  for (std::int32_t r = 0; r < part.rows; ++r) {
    const std::int16_t* row = part.estimate.data() + std::ptrdiff_t{r} * part.columns;
    const std::size_t first =
        static_cast<std::size_t>(part.first_row + r) * static_cast<std::size_t>(columns_) +
        static_cast<std::size_t>(part.first_column);
    for (std::size_t c = 0; c < static_cast<std::size_t>(part.columns); ++c) {
      const std::int16_t steps = row[c];
      const std::size_t i = first + c;
      const bool is_unknown = steps == kUnknownElevation;
      if (!light_.empty())
        light_[i] += is_unknown ? kUnknown
                                : light_by_elevation_[static_cast<std::size_t>(
                                      std::clamp<int>(steps, 0, kZenithSteps))];
      if (zenith_steps_.empty()) continue;
      if (is_unknown) zenith_steps_[i] = kUnknown;
      if (steps == kNothingSeen) continue;
      zenith_steps_[i] += static_cast<float>(kZenithSteps - steps);
      ++met_[i];
    }
  }
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
