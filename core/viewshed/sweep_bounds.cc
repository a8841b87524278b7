#include <algorithm>
#include <cmath>

#include "core/viewshed/sweep_run.h"

namespace scarp {

/// Takes a line, and the segments that lead to it from the one before, into the horizon.
void SweepRun::add(const Line& line, const Line* before) {
  if (line.is_whole && (!before || before->is_whole))
    add_whole(line, before);
  else
    add_in_pieces(line, before);
}

void SweepRun::add_whole(const Line& line, const Line* before) {
  const auto bins = static_cast<std::size_t>(strip_.end_bin - strip_.first_bin);
  const std::size_t n = line.t.size();
  this_s_.resize(bins + 1);
  next_s_.resize(bins + 1);
  edge_low_.resize(bins + 1);
  edge_high_.resize(bins + 1);
  edge_before_.resize(bins + 1);
  edge_bounds(bins + 1, line.place_of_edge.data(), line.s.data(), line.steep.data(), per_rise(),
              kSlopeMargin, edge_before_.data(), this_s_.data(), next_s_.data(), edge_low_.data(),
              edge_high_.data());
  const float* place_before = line.place_of_edge.data();
  const float* higher = line.s.data();
  if (before) {
    const std::int32_t shift = before->first - line.first;
    place_before_.resize(bins + 1);
    shift_places(bins + 1, before->place_of_edge.data(),
                 static_cast<float>(static_cast<double>(shift)), place_before_.data());
    place_before = place_before_.data();
    const auto last = static_cast<std::int32_t>(n);
    const std::int32_t begin = std::clamp(shift, 0, last);
    const std::int32_t end = std::clamp(shift + before->count(), begin, last);
    higher_.assign(line.s.begin(), line.s.end());
    std::fill(higher_.begin(), higher_.begin() + begin, kAnyGround);
    take_maximum(static_cast<std::size_t>(end - begin), before->s.data() + (begin - shift),
                 higher_.data() + begin);
    std::fill(higher_.begin() + end, higher_.end(), kAnyGround);
    higher = higher_.data();
    if (place_before[0] < 1 || place_before[bins] > static_cast<float>(n - 2)) {
      add_in_pieces(line, before);
      return;
    }
  }
  pairs_.resize(n);
  take_pairs(n, higher, pairs_.data());
  // A bin's slack in samples: they are kLeastSpacingBins apart or more.
  const float place_slack = 4 * slack();
  const auto first = static_cast<std::size_t>(strip_.first_bin);
  float* up = history_.line(line.place) + first;
  if (!bin_bounds(bins, line.place_of_edge.data(), place_before, place_slack, higher, pairs_.data(),
                  edge_before_.data(), this_s_.data(), next_s_.data(), edge_low_.data(),
                  edge_high_.data(), up, &low_[first], &high_[first]))
    bounds_hold_ = false;
  mark_top(line.number, strip_.first_bin, strip_.end_bin, up);
  history_.end_line(line.place, strip_.first_bin, strip_.end_bin);
}

/// Any line: with void samples, or where the grid ends within the strip.
void SweepRun::add_in_pieces(const Line& line, const Line* before) {
  float* up = history_.line(line.place);
  std::fill(up + strip_.first_bin, up + strip_.end_bin, kNoGround);
  if (before) raise_segments(*before, line, up);
  raise_line(line, up);
  if (line.has_void) mark_void(line);
  const float* from = up + strip_.first_bin;
  take_maximum(static_cast<std::size_t>(strip_.end_bin - strip_.first_bin), from,
               &high_[static_cast<std::size_t>(strip_.first_bin)]);
  mark_top(line.number, strip_.first_bin, strip_.end_bin, from);
  history_.end_line(line.place, strip_.first_bin, strip_.end_bin);
}

/// The segments between the last line and this one: each is taken as high as its higher end in
/// every bin that it touches.
void SweepRun::raise_segments(const Line& from, const Line& to, float* up) {
  const auto first_edge = static_cast<float>(strip_.first_bin);
  const auto last_edge = static_cast<float>(strip_.end_bin);
  const std::int32_t first = std::max(from.first, to.first);
  const std::int32_t end = std::min(from.first + from.count(), to.first + to.count());
  for (std::int32_t i = first; i < end; ++i) {
    const auto a = static_cast<std::size_t>(i - from.first),
               b = static_cast<std::size_t>(i - to.first);
    const float low = std::min(from.t[a], to.t[b]) - slack();
    const float high = std::max(from.t[a], to.t[b]) + slack();
    if (high < first_edge || low >= last_edge) continue;
    const bool is_void = from.is_void[a] || to.is_void[b];
    const float upper = std::max(from.s[a], to.s[b]);
    const auto first_bin = static_cast<std::int32_t>(std::max(low, first_edge));
    const auto last_bin = static_cast<std::int32_t>(std::min(high, last_edge - 1));
    for (std::int32_t bin = first_bin; bin <= last_bin; ++bin) {
      if (is_void) {
        some_void_[static_cast<std::size_t>(bin)] = 1;
      } else {
        up[bin] = std::max(up[bin], upper);
      }
    }
  }
  // A segment that reaches into the strip from a sample that was not taken would be missed.
  for (std::int32_t k = 0; k < to.count(); ++k) {
    const std::int32_t i = to.first + k;
    const float t = to.t[static_cast<std::size_t>(k)];
    if ((i < first || i >= end) && t > first_edge - 1 && t < last_edge + 1) bounds_hold_ = false;
  }
}

/// Bounds of a line's picture in each bin: at the bin's two edges and at the samples between.
void SweepRun::raise_line(const Line& line, float* up) {
  const std::int32_t n = line.count();
  const auto first_bin = static_cast<std::size_t>(strip_.first_bin);
  const auto edges = static_cast<std::size_t>(strip_.end_bin - strip_.first_bin) + 1;
  edge_low_.resize(edges);
  edge_high_.resize(edges);
  edge_before_.resize(edges);
  const auto is_void = [&](std::int32_t k) { return line.is_void[static_cast<std::size_t>(k)]; };
  std::int32_t j = -1;
  for (std::size_t e = 0; e < edges; ++e) {
    const auto at = static_cast<float>(static_cast<std::int32_t>(first_bin + e));
    while (j + 1 < n && line.t[static_cast<std::size_t>(j + 1)] <= at) ++j;
    float low = kNoGround, high = kNoGround;
    const auto u = static_cast<std::size_t>(j);
    const bool inside = j >= 0 && j + 1 < n && !is_void(j) && !is_void(j + 1);
    const bool at_before = j >= 0 && at - line.t[u] < slack();
    const bool at_after = j + 1 < n && line.t[u + 1] - at < slack();
    if (inside) {
      const float f = (at - line.t[u]) / (line.t[u + 1] - line.t[u]);
      const float s = line.s[u] + f * (line.s[u + 1] - line.s[u]);
      const float margin = per_rise() * line.steep[u] + kSlopeMargin * std::abs(s);
      low = s - margin;
      high = s + margin;
    }
    // Beside a sample that ends the known ground, there may be ground up to it or none.
    if (at_before) {
      high = std::max(high, line.s[u] + per_rise() * line.steep[u]);
      if (j == 0 || is_void(j - 1)) low = kNoGround;
    }
    if (at_after) {
      high = std::max(high, line.s[u + 1] + per_rise() * line.steep[j < 0 ? 0 : u]);
      if (j + 2 >= n || is_void(j + 2)) low = kNoGround;
    }
    edge_low_[e] = low;
    edge_high_[e] = high;
    edge_before_[e] = j;
  }
  for (std::size_t b = 0; b + 1 < edges; ++b) {
    float low = std::min(edge_low_[b], edge_low_[b + 1]);
    float high = std::max(edge_high_[b], edge_high_[b + 1]);
    for (std::int32_t k = edge_before_[b] + 1; k <= edge_before_[b + 1]; ++k) {
      low = std::min(low, line.s[static_cast<std::size_t>(k)]);
      high = std::max(high, line.s[static_cast<std::size_t>(k)]);
    }
    low_[first_bin + b] = std::max(low_[first_bin + b], low);
    up[first_bin + b] = std::max(up[first_bin + b], high);
  }
}

void SweepRun::mark_void(const Line& line) {
  std::int32_t j = 0;
  const auto t = [&](std::int32_t k) { return line.t[static_cast<std::size_t>(k)]; };
  const auto is_void = [&](std::int32_t k) { return line.is_void[static_cast<std::size_t>(k)]; };
  for (std::int32_t bin = strip_.first_bin; bin < strip_.end_bin; ++bin) {
    const auto b = static_cast<std::size_t>(bin);
    const float low = static_cast<float>(bin) - slack();
    const float high = static_cast<float>(bin + 1) + slack();
    while (j + 1 < line.count() && t(j + 1) < low) ++j;
    // From here segments k to k + 1 touch the bin until one begins beyond it.
    bool some = false, all = t(j) <= low;
    std::int32_t k = j;
    for (; k + 1 < line.count() && t(k) <= high; ++k) {
      if (t(k + 1) < low) continue;
      const bool missing = is_void(k) || is_void(k + 1);
      some = some || missing;
      // Exactly over a known sample a line of sight is over known ground.
      all = all && missing && (t(k) < low || is_void(k));
    }
    if (t(k) <= high) all = false;
    if (some) some_void_[b] = 1;
    if (some && all) all_void_[b] = 1;
  }
}
/// Keeps in mind which line reaches highest in each bin. Requires its bounds in high_.
/// @param up  of first_bin and on
void SweepRun::mark_top(std::int32_t line, std::int32_t first_bin, std::int32_t end_bin,
                        const float* up) {
  if (output_.least_m.empty()) return;
  const auto first = static_cast<std::size_t>(first_bin);
  take_top(static_cast<std::size_t>(end_bin - first_bin), up, &high_[first], line, &top_[first]);
}

}  // namespace scarp
