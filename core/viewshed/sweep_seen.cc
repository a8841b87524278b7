#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/viewshed/ray_climb.h"
#include "core/viewshed/sweep_run.h"

namespace scarp {

/// On its way from the line before, can a line of sight to sample i cross a segment that joins the
/// two lines? Where the grid does not bend it cannot: in a wedge it goes sideways by a sample at
/// most, from one line to the next.
bool SweepRun::crosses_before(const Line& before, std::int32_t i, float t) const {
  const float room = 4 * slack();
  const std::int32_t k = i - before.first;
  if (k < 1 || k + 1 >= before.count()) return true;
  return before.t[static_cast<std::size_t>(k - 1)] > t - room ||
         before.t[static_cast<std::size_t>(k + 1)] < t + room;
}

/// A raised target may stand beside its sample, by what the normal leans: does it stand so little
/// beside that the segments at the sample, which it may be a step beyond, cannot block it?
bool SweepRun::stands_free(const Position& at, std::int32_t line, std::int32_t i) const {
  const Position ground = position(line, i);
  if (at.x_m == ground.x_m && at.y_m == ground.y_m) return true;
  const Picture p = picture(at), g = picture(ground);
  const double aside = std::abs(p.forwards - g.forwards) + std::abs(p.sideways - g.sideways);
  const double slope_m = std::abs(p.rise_m) / p.forwards;
  if (aside > 0.25 || at.z_m - ground.z_m < 4 * aside * (ground_.steepest_m + slope_m))
    return false;
  for (std::int32_t l = std::max(0, line - 1); l <= std::min(lines_ - 1, line + 1); ++l)
    for (std::int32_t k = std::max(0, i - 1); k <= std::min(samples_ - 1, i + 1); ++k)
      if (!is_known(l, k)) return false;
  return true;
}

Seen SweepRun::judge(std::int32_t line, std::int32_t i) {
  ++counts_.traced_whole;
  return over_columns_ ? sight_.judge(target(line, i), line, i)
                       : sight_.judge(target(line, i), i, line);
}

/// Is a direction the strip's own? Beyond the part's ends by rounding only.
bool SweepRun::is_in_strip(float t) const {
  const auto first_edge = static_cast<float>(strip_.first_bin);
  const auto last_edge = static_cast<float>(strip_.end_bin);
  return (t >= first_edge || (strip_.first_bin == 0 && t >= -slack())) &&
         (t < last_edge || (strip_.end_bin == bins_ && t <= last_edge + slack()));
}

/// Does the ground block the sight of a target at or above sample i? Where measuring does not
/// decide, exact predicates do.
bool SweepRun::is_blocked_in_bin(const Line& line, std::int32_t i, const Position& at,
                                 std::size_t bin, float s) {
  const Picture p = picture(at);
  const RayClimb ray(grid_, frame_, sight_.eye().z_m, over_columns_, outwards_, p.forwards,
                     p.sideways);
  const bool is_known = some_void_[bin] == 0;
  const float least = s - 4 * kSlopeMargin * std::abs(s);
  return history_.any_line(
      line.place, static_cast<std::int32_t>(bin), bins_, least, [&](std::int32_t across) {
        if (is_known && std::abs(across - eye_line_) > RayClimb::kLeastLines) {
          if (const auto slope = ray.slope_at(across)) {
            const double above_m = *slope * p.forwards - p.rise_m;
            if (std::abs(above_m) > kClimbErrorM) return above_m > 0;
          }
        }
        // With the segments that lead to it from the line before it.
        return sight_.is_blocked_between(at, over_columns_ ? line.number : i,
                                         over_columns_ ? i : line.number, over_columns_, across,
                                         across - outwards_);
      });
}

/// Deciding::kByBounds. The upper bound is far looser than the lower one, so the horizon is taken
/// to lie a quarter of the way up: least was wrong there of 0, 0.1, ..., 0.65 (scarp compare).
Seen SweepRun::guess_seen(float t, float s, Decision decision) const {
  constexpr float kHorizonBetween = 0.25F;
  const auto bin = static_cast<std::size_t>(std::clamp(t, 0.0F, static_cast<float>(bins_ - 1)));
  if (all_void_[bin]) return Seen::kUnknown;
  if (decision == Decision::kOpen && s < low_[bin] + kHorizonBetween * (high_[bin] - low_[bin]))
    return Seen::kHidden;
  return some_void_[bin] ? Seen::kUnknown : Seen::kVisible;
}

/// A target that is not hidden for certain.
Seen SweepRun::decide_seen(const Line& line, const Line* before, std::int32_t k,
                           Decision decision) {
  const auto n = static_cast<std::size_t>(k);
  const std::int32_t i = line.first + k;
  const bool raised = this->raised();
  const float t = raised ? target_t_[n] : line.t[n], s = raised ? target_s_[n] : line.s[n];
  if (ground_.deciding == Deciding::kByBounds) return guess_seen(t, s, decision);
  if (before && crosses_before(*before, i, t)) {
    if (line.has_void || before->has_void) return judge(line.number, i);
    if (sight_.is_blocked_between(target(line.number, i), over_columns_ ? line.number : i,
                                  over_columns_ ? i : line.number, over_columns_, line.number,
                                  before->number))
      return Seen::kHidden;
  }
  if (raised && !stands_free(target(line.number, i), line.number, i)) return judge(line.number, i);
  if (raised && !is_in_strip(t)) return judge(line.number, i);
  const auto bin = static_cast<std::size_t>(std::clamp(t, 0.0F, static_cast<float>(bins_ - 1)));
  if (decision == Decision::kOpen) {
    ++counts_.traced_part;
    if (is_blocked_in_bin(line, i, target(line.number, i), bin, s)) return Seen::kHidden;
  }
  if (all_void_[bin]) return Seen::kUnknown;
  return some_void_[bin] ? judge(line.number, i) : Seen::kVisible;
}

/// The strip's own samples of a line, as indices [first, end). Only near the part's ends does it
/// take more than t to tell.
std::pair<std::int32_t, std::int32_t> SweepRun::own_range(const Line& line) const {
  const auto bins = static_cast<float>(bins_);
  // At the part's ends the strip has room for what rounding puts beyond them.
  const float low = strip_.first_bin == 0 ? -1 : static_cast<float>(strip_.first_bin);
  const float high = strip_.end_bin == bins_ ? bins + 1 : static_cast<float>(strip_.end_bin);
  const auto own = [&](std::int32_t k) {
    const float t = line.t[static_cast<std::size_t>(k)];
    return t >= low && t < high && is_target(line.number, line.first + k) &&
           ((t >= 1 && t <= bins - 1) || owns(picture(position(line.number, line.first + k))));
  };
  std::int32_t first = 0, end = line.count();
  while (first < end && !own(first)) ++first;
  while (end > first && !own(end - 1)) --end;
  return {first, end};
}

void SweepRun::decide(const Line& line, const Line* before) {
  const auto [first, end] = own_range(line);
  if (first == end) return;
  const auto n = static_cast<std::size_t>(first);
  const auto count = static_cast<std::size_t>(end - first);
  const bool raised = this->raised();
  if (raised) take_targets(line);
  decisions_.resize(line.t.size());
  classify(count, (raised ? target_t_ : line.t).data() + n,
           (raised ? target_s_ : line.s).data() + n, bins_, low_.data(), high_.data(), kSlopeMargin,
           decisions_.data() + n);
  counts_.targets += count;
  if (line.has_void || !bounds_hold_) {
    for (std::int32_t k = first; k < end; ++k) {
      if (line.is_void[static_cast<std::size_t>(k)])
        --counts_.targets;
      else if (!bounds_hold_)
        decisions_[static_cast<std::size_t>(k)] = Decision::kOpen;
    }
  }
  if (raised)
    for (std::size_t k = n; k < n + count; ++k)
      if (!is_in_strip(target_t_[k])) decisions_[k] = Decision::kOpen;
  // Hidden and visible have the same values in both.
  const auto* sight = reinterpret_cast<const Seen*>(decisions_.data());
  Seen* to = tile_ ? tile_->column(line.number) +
                         ColumnTile::kStride * static_cast<std::size_t>(line.first)
                   : &output_.result[result_index(line.number, 0)] + line.first;
  const std::size_t stride = tile_ ? ColumnTile::kStride : 1;
  if (tile_) {
    tile_->mark(line.number, line.first + first, line.first + end - 1);
    for (std::size_t k = n; k < n + count; ++k) to[k * stride] = sight[k];
  } else {
    std::copy(sight + n, sight + n + count, to + n);
  }
  for (std::size_t k = n; k < n + count; ++k) {
    // Eight hidden ones at a time.
    std::uint64_t eight;
    if (k + sizeof(eight) <= n + count && !line.has_void) {
      std::memcpy(&eight, &decisions_[k], sizeof(eight));
      if (eight == 0) {
        k += sizeof(eight) - 1;
        continue;
      }
    }
    const auto i = static_cast<std::int32_t>(k);
    if (line.is_void[k])
      to[k * stride] = Seen::kUnknown;
    else if (decisions_[k] != Decision::kHidden)
      to[k * stride] = bounds_hold_ ? decide_seen(line, before, i, decisions_[k])
                                    : judge(line.number, line.first + i);
  }
}

}  // namespace scarp
