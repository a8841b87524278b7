#include <algorithm>
#include <cmath>
#include <limits>

#include "core/viewshed/least_height.h"
#include "core/viewshed/ray_climb.h"
#include "core/viewshed/sweep_run.h"

namespace scarp {

/// On a ground of its own a target may stand beside the sample that blocks, by what the normal
/// leans over the height between them; the bin is that of the sample.
bool SweepRun::stands_aside(std::int32_t line, std::int32_t i) const {
  if (!ground_.apart) return false;
  const Position at = stand(line, i), over = position(line, i);
  return at.x_m != over.x_m || at.y_m != over.y_m;
}

float SweepRun::climb_all(std::int32_t line, std::int32_t i) {
  ++counts_.traced_whole;
  return over_columns_ ? least_height_m(sight_, ground_.stands, line, i)
                       : least_height_m(sight_, ground_.stands, i, line);
}

/// Forwards and sideways of a sample of the line that was filled last.
std::pair<double, double> SweepRun::place_of(const Line& line, std::int32_t k) const {
  if (ground_.across_of_column.empty()) {
    const auto n = static_cast<std::size_t>(k);
    return over_columns_ ? std::pair(across_[n], down_[n]) : std::pair(down_[n], across_[n]);
  }
  const auto& along = over_columns_ ? ground_.down_of_row : ground_.across_of_column;
  const auto& outwards = over_columns_ ? ground_.across_of_column : ground_.down_of_row;
  return {outwards_ * outwards[static_cast<std::size_t>(line.number)],
          along[static_cast<std::size_t>(line.first + k)]};
}

/// Is a target at a flattened height, and so all that is higher, at least enough_m above the
/// ground?
bool SweepRun::is_enough(double z_m, const Line& line, std::int32_t k, float enough_m) const {
  // Within a scene a height in the frame is never twice that on the normal.
  const std::int32_t i = line.first + k;
  const double ground_m =
      ground_.apart ? stand(line.number, i).z_m : line.z_m[static_cast<std::size_t>(k)];
  const double rise_m = z_m - ground_m;
  if (rise_m <= 0 || rise_m < enough_m) return false;
  if (rise_m >= 2.0 * enough_m) return true;
  return ground_.stands.height_above_ground_m(over_columns_ ? line.number : i,
                                              over_columns_ ? i : line.number, z_m) >= enough_m;
}

/// The highest that any line makes it: first the line that reaches highest in the bin, then those
/// that may still be above the highest so far.
float SweepRun::climb_in_bin(const Line& line, std::int32_t k, std::size_t bin, float enough_m) {
  ++counts_.traced_part;
  const std::int32_t i = line.first + k;
  const auto [forwards, sideways] = place_of(line, k);
  const double eye_z_m = sight_.eye().z_m;
  const RayClimb ray(grid_, frame_, eye_z_m, over_columns_, outwards_, forwards, sideways);
  const auto below = [](float s) { return s - 4 * kSlopeMargin * std::abs(s); };
  float least_s = below(low_[bin]);
  double highest = -std::numeric_limits<double>::infinity();
  const auto climb_over = [&](std::int32_t across) {
    std::optional<double> slope;
    if (std::abs(across - eye_line_) > RayClimb::kLeastLines) slope = ray.slope_at(across);
    const double s =
        slope ? *slope
              : (sight_.least_z_between_m(stand(line.number, i), over_columns_ ? line.number : i,
                                          over_columns_ ? i : line.number, over_columns_, across,
                                          across - outwards_) -
                 eye_z_m) /
                    forwards;
    if (s <= highest) return;
    highest = s;
    least_s = std::max(least_s, below(static_cast<float>(s)));
  };
  const std::int32_t top = top_[bin];
  if (top >= 0) climb_over(top);
  if (is_enough(eye_z_m + highest * forwards - kClimbErrorM, line, k, enough_m))
    return std::numeric_limits<float>::quiet_NaN();
  history_.any_line(line.place, static_cast<std::int32_t>(bin), bins_, least_s,
                    [&](std::int32_t across) {
                      if (across != top) climb_over(across);
                      return false;
                    });
  const double ground_m = stand(line.number, i).z_m;
  const double z_m = eye_z_m + highest * forwards;
  if (z_m < ground_m - kClimbErrorM) return 0;
  if (z_m < ground_m + kClimbErrorM &&
      !is_blocked_in_bin(line, i, stand(line.number, i), bin,
                         static_cast<float>((ground_m - eye_z_m) / forwards)))
    return 0;
  return height_up_to(ground_.stands, std::max(z_m, ground_m) + kClimbErrorM,
                      over_columns_ ? line.number : i, over_columns_ ? i : line.number);
}

/// Deciding::kByBounds: over the line that reaches highest in the bin, but not under what all
/// directions of the bin have before them.
float SweepRun::guess_height(const Line& line, std::int32_t k, std::size_t bin) const {
  const std::int32_t i = line.first + k;
  const auto [forwards, sideways] = place_of(line, k);
  double s = low_[bin];
  const std::int32_t top = top_[bin];
  if (top >= 0 && std::abs(top - eye_line_) > RayClimb::kLeastLines) {
    const RayClimb ray(grid_, frame_, sight_.eye().z_m, over_columns_, outwards_, forwards,
                       sideways);
    if (const auto slope = ray.slope_at(top)) s = std::max(s, *slope);
  }
  return height_up_to(ground_.stands, sight_.eye().z_m + s * forwards,
                      over_columns_ ? line.number : i, over_columns_ ? i : line.number);
}

/// Least height over a sample of a line; NaN where that is not known, or where it cannot be less
/// than enough_m.
float SweepRun::climb_to(const Line& line, const Line* before, std::int32_t k, float enough_m) {
  const auto n = static_cast<std::size_t>(k);
  const std::int32_t i = line.first + k;
  const auto bin =
      static_cast<std::size_t>(std::clamp(line.t[n], 0.0F, static_cast<float>(bins_ - 1)));
  if (!bounds_hold_ || stands_aside(line.number, i)) return climb_all(line.number, i);
  if (all_void_[bin]) return std::numeric_limits<float>::quiet_NaN();
  if (output_.lowers()) {
    const float s = low_[bin] - kSlopeMargin * std::abs(low_[bin]);
    if (is_enough(sight_.eye().z_m + s * place_of(line, k).first, line, k, enough_m))
      return std::numeric_limits<float>::quiet_NaN();
  }
  const bool guesses = ground_.deciding == Deciding::kByBounds;
  if (guesses && some_void_[bin]) return std::numeric_limits<float>::quiet_NaN();
  if (some_void_[bin] || (!guesses && before && crosses_before(*before, i, line.t[n])))
    return climb_all(line.number, i);
  float s = line.s[n];
  if (ground_.apart) {
    const Position at = stand(line.number, i);
    s = static_cast<float>((at.z_m - sight_.eye().z_m) / place_of(line, k).first);
  }
  if (s >= high_[bin] + kSlopeMargin * std::abs(s)) return 0;
  if (guesses) return guess_height(line, k, bin);
  return climb_in_bin(line, k, bin, enough_m);
}

/// Writes a height, or, where only lower ones are wanted, sees to it that it is one.
void SweepRun::offer(std::int32_t line, std::int32_t i, float height_m) {
  float& to = output_.least_m[result_index(line, i)];
  if (!output_.lowers()) {
    to = height_m;
    return;
  }
  if (to <= height_m || !std::isfinite(height_m)) return;
  const std::int32_t column = over_columns_ ? line : i, row = over_columns_ ? i : line;
  if (*output_.limit) height_m = (*output_.limit)(column, row, height_m);
  if (!(height_m < to || (std::isnan(to) && !std::isnan(height_m)))) return;
  to = height_m;
  output_.least_tops->touch(column, row);
}

/// decide, for heights: what is not seen on the ground climbs until it is.
void SweepRun::climb(const Line& line, const Line* before) {
  const auto [first, end] = own_range(line);
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (std::int32_t k = first; k < end; ++k) {
    if (line.is_void[static_cast<std::size_t>(k)]) continue;
    ++counts_.targets;
    const std::int32_t i = line.first + k;
    float enough_m = kInfinity;
    if (output_.lowers()) {
      const float so_far_m = output_.least_m[result_index(line.number, i)];
      if (so_far_m <= 0) continue;
      if (!std::isnan(so_far_m)) enough_m = so_far_m;
    }
    const float height_m = climb_to(line, before, k, enough_m);
    if (!output_.lowers() || !std::isnan(height_m)) offer(line.number, i, height_m);
  }
}

}  // namespace scarp
