#include "core/viewshed/part_sweep.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "core/geodesy/predicates.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Stands for "no ground" as a lower, and for "anything" as an upper bound of s.
constexpr float kNothing = -1e30F;
constexpr float kAnything = 1e30F;

/// Grid lines nearer to the eye than this are compared in double, ray by ray: seen from there the
/// picture of a line may be wider than float holds.
constexpr double kNearCells = 1.5;

/// s of a sample is a double rounded to float (2^-24 of itself), compared with another such one;
/// 2^-20 leaves room for the arithmetic before.
constexpr float kSlopeMargin = 0x1p-20F;

constexpr std::int32_t kFirstBins = 8;

/// Least spacing of the samples of a line, in bins, that the margins below are derived for.
constexpr float kLeastSpacingBins = 0.5F;

/// t of a sample in bins is below the number of bins, so its rounding to float is below 2^-24 of
/// that; a sample and a target may miss each other by twice as much, and 2^-22 is used.
float bin_margin(std::int32_t bins) {
  return static_cast<float>(bins) * 0x1p-22F;
}

/// Interpolating at a bin's edge, where both ends of a segment are off by bin_margin and the
/// direction by as much, errs by at most 3 bin_margin / kLeastSpacingBins of the segment's rise,
/// or of its neighbours' where the edge is that close to a sample. 16 bin_margin is used.
float rise_margin(std::int32_t bins) {
  return 16 * bin_margin(bins);
}

}  // namespace

/// Bounds of the horizon by bin, and what may lie between them.
struct PartSweep::Bins {
  std::int32_t count = kFirstBins;
  std::vector<float> low, high;
  /// Lines outside [first, last] are under `low` everywhere in the bin.
  std::vector<std::int32_t> first, last;
  std::vector<std::uint8_t> some_void, all_void;

  Bins()
      : low(kFirstBins, kNothing),
        high(kFirstBins, kNothing),
        first(kFirstBins, 0),
        last(kFirstBins, -1),
        some_void(kFirstBins, 0),
        all_void(kFirstBins, 0) {}

  static float safely_below(float value) { return value - 2 * kSlopeMargin * std::abs(value); }

  /// Ground on a line (or between the last line and this one) that is nowhere in the bin above
  /// upper, and everywhere there and at least lower; kNothing where it may be missing.
  void add(std::int32_t bin, std::int32_t line, float lower, float upper) {
    if (upper == kNothing) return;
    const auto b = static_cast<std::size_t>(bin);
    const float raised = std::max(low[b], lower);
    if (high[b] < safely_below(raised)) first[b] = line;
    if (upper >= safely_below(raised)) {
      if (high[b] == kNothing) first[b] = line;
      last[b] = line;
    }
    low[b] = raised;
    high[b] = std::max(high[b], upper);
  }

  void halve() {
    const auto split = [&](auto& values) {
      values.resize(static_cast<std::size_t>(count) * 2);
      for (std::size_t b = static_cast<std::size_t>(count); b-- > 0;)
        values[2 * b] = values[2 * b + 1] = values[b];
    };
    split(low);
    split(high);
    split(first);
    split(last);
    split(some_void);
    split(all_void);
    count *= 2;
  }
};

/// The picture of a grid line: its samples around the part.
struct PartSweep::Line {
  std::int32_t number = 0;
  std::int32_t first = 0;  ///< sample that index 0 stands for
  std::int32_t count = 0;
  std::vector<float> t;      ///< in bins, rising
  std::vector<float> s;      ///< of the ground; kNothing where void
  std::vector<float> steep;  ///< greatest rise of the segment after a sample and its neighbours
  bool has_void = false;
  bool begins_inside = false, ends_inside = false;  ///< the grid ends within the part

  bool is_void(std::int32_t i) const { return s[static_cast<std::size_t>(i)] == kNothing; }
};

class PartSweep::Run {
 public:
  Run(const PartSweep& sweep, const SweepPart& part, std::span<Sight> result)
      : sight_(sweep.sight_),
        grid_(sight_.grid()),
        frame_(sight_.frame()),
        target_height_m_(sweep.target_height_m_),
        window_(sweep.window_),
        result_(result),
        part_(part) {
    over_columns_ = part.wedge == SweepPart::kEast || part.wedge == SweepPart::kWest;
    outwards_ = part.wedge == SweepPart::kEast || part.wedge == SweepPart::kSouth ? 1 : -1;
    lines_ = over_columns_ ? grid_.columns() : grid_.rows();
    samples_ = over_columns_ ? grid_.rows() : grid_.columns();
    eye_line_ = over_columns_ ? frame_.eye_column : frame_.eye_row;
    eye_sample_ = over_columns_ ? frame_.eye_row : frame_.eye_column;
    constexpr double kWidth = 2.0 / SweepPart::kPartsInWedge;
    low_tangent_ = part.number * kWidth - 1;
    high_tangent_ = low_tangent_ + kWidth;
  }

  SweepCounts run() {
    const auto at_least = [&](double cells) {
      const double from = eye_line_ + outwards_ * cells;
      return static_cast<std::int64_t>(outwards_ > 0 ? std::ceil(from) : std::floor(from));
    };
    // Lines behind the eye begin segments that reach in front of it.
    const std::int64_t near_begin = at_least(-kNearCells);
    const std::int64_t far_begin = at_least(kNearCells);
    // Nothing beyond a target's line can block it.
    const std::int64_t border =
        outwards_ > 0 ? (over_columns_ ? window_.last_column : window_.last_row) + 1
                      : (over_columns_ ? window_.first_column : window_.first_row) - 1;
    const auto inside = [&](std::int64_t line) { return line >= 0 && line < lines_; };
    for (std::int64_t line = near_begin; line != far_begin + outwards_; line += outwards_)
      if (inside(line)) sweep_near(static_cast<std::int32_t>(line), line != far_begin);
    std::int64_t begin = far_begin;
    if (!inside(begin))
      begin = outwards_ > 0 ? std::max<std::int64_t>(begin, 0)
                            : std::min<std::int64_t>(begin, lines_ - 1);
    if (!inside(begin)) return counts_;
    for (std::int64_t line = begin; (border - line) * outwards_ > 0; line += outwards_) {
      sweep_line(static_cast<std::int32_t>(line), line == begin);
    }
    return counts_;
  }

 private:
  struct Picture {
    double forwards, sideways, rise_m;
  };

  Position position(std::int32_t line, std::int32_t i) const {
    return over_columns_ ? grid_.at(line, i) : grid_.at(i, line);
  }
  bool is_known(std::int32_t line, std::int32_t i) const {
    return over_columns_ ? grid_.is_known(line, i) : grid_.is_known(i, line);
  }

  bool is_target(std::int32_t line, std::int32_t i) const {
    return over_columns_ ? window_.contains(line, i) : window_.contains(i, line);
  }

  Picture picture(const Position& p) const {
    const double across = frame_.across(p.x_m, p.y_m), down = frame_.down(p.x_m, p.y_m);
    const double rise_m = p.z_m - sight_.eye().z_m;
    switch (part_.wedge) {
      case SweepPart::kEast:
        return {across, down, rise_m};
      case SweepPart::kSouth:
        return {down, across, rise_m};
      case SweepPart::kWest:
        return {-across, down, rise_m};
      default:
        return {-down, across, rise_m};
    }
  }

  /// Does the sample lie in this part? Decided from the same two numbers in every part, so that
  /// each sample has one.
  bool owns(const Picture& p) const {
    const double f = p.forwards, q = p.sideways;
    if (!(f > 0)) return false;
    const bool in_wedge = part_.wedge == SweepPart::kEast || part_.wedge == SweepPart::kNorth
                              ? -f <= q && q < f
                              : -f < q && q <= f;
    if (!in_wedge) return false;
    const double number = std::floor((q / f + 1) * (SweepPart::kPartsInWedge / 2.0));
    return static_cast<std::int32_t>(std::min(number, SweepPart::kPartsInWedge - 1.0)) ==
           part_.number;
  }

  double bins_per_tangent() const { return bins_.count / (high_tangent_ - low_tangent_); }

  void sweep_near(std::int32_t line, bool judge_targets);
  void add_near_segment(std::int32_t line, const Position& u, bool u_known, const Position& v,
                        bool v_known, bool along_line);
  void sweep_line(std::int32_t line, bool is_first);
  void fill(Line& to, std::int32_t line);
  void add_picture(Line& to, std::int32_t i, bool at_front);
  void add_between(const Line& from, const Line& to);
  void decide(const Line& line);
  void add_line(const Line& line);
  void mark_void(const Line& line);
  void write(std::int32_t line, std::int32_t i, Sight sight) {
    const std::int32_t column = over_columns_ ? line : i, row = over_columns_ ? i : line;
    result_[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid_.columns()) +
            static_cast<std::size_t>(column)] = sight;
  }
  Position target(std::int32_t line, std::int32_t i) const {
    return over_columns_ ? grid_.raised(line, i, target_height_m_)
                         : grid_.raised(i, line, target_height_m_);
  }
  Sight judge(std::int32_t line, std::int32_t i) {
    ++counts_.traced_whole;
    return over_columns_ ? sight_.judge(target(line, i), line, i)
                         : sight_.judge(target(line, i), i, line);
  }
  Sight decide_open(std::int32_t line, std::int32_t i, const Position& at, std::size_t bin);

  const GridSight& sight_;
  const GroundGrid& grid_;
  const PlanFrame& frame_;
  double target_height_m_;
  SampleWindow window_;
  std::span<Sight> result_;
  SweepPart part_;

  bool over_columns_ = true;
  std::int32_t outwards_ = 1;
  std::int32_t lines_ = 0, samples_ = 0;
  double eye_line_ = 0, eye_sample_ = 0;
  double low_tangent_ = 0, high_tangent_ = 0;

  Bins bins_;
  Line lines_kept_[2];
  Line* line_ = &lines_kept_[0];
  Line* before_ = &lines_kept_[1];
  bool bounds_hold_ = true;
  double low_bend_ = 0, high_bend_ = 0;  ///< samples by which the last line missed its guess
  std::vector<float> edge_low_, edge_high_;
  std::vector<std::int32_t> edge_before_;  ///< last sample at or before each bin's edge
  SweepCounts counts_;
};

/// Compares the segments of a near line, and those that lead to it, in double.
void PartSweep::Run::sweep_near(std::int32_t line, bool judge_targets) {
  // In front of the eye by at most kNearCells + 1, a direction of the part leaves the line within
  // as many samples of the eye's; two more hold for bends.
  constexpr std::int32_t kBeside = 5;
  const auto middle =
      static_cast<std::int64_t>(std::floor(std::clamp(eye_sample_, -9.0, samples_ + 9.0)));
  const auto first =
      static_cast<std::int32_t>(std::clamp<std::int64_t>(middle - kBeside, 0, samples_ - 1));
  const auto last =
      static_cast<std::int32_t>(std::clamp<std::int64_t>(middle + kBeside, 0, samples_ - 1));
  const std::int32_t behind = line - outwards_;
  const bool leads_here = behind >= 0 && behind < lines_;
  for (std::int32_t i = first; i <= last; ++i) {
    const Position p = position(line, i);
    if (leads_here)
      add_near_segment(line, position(behind, i), is_known(behind, i), p, is_known(line, i), false);
    if (!judge_targets) continue;
    if (i < last)
      add_near_segment(line, p, is_known(line, i), position(line, i + 1), is_known(line, i + 1),
                       true);
    if (is_target(line, i) && owns(picture(p)) && is_known(line, i)) {
      ++counts_.targets;
      write(line, i, judge(line, i));
    }
  }
}

void PartSweep::Run::add_near_segment(std::int32_t line, const Position& u, bool u_known,
                                      const Position& v, bool v_known, bool along_line) {
  // Along its own direction a segment counts by its samples, which end other segments.
  if (orient2d(sight_.eye(), u, v) == 0) return;
  const Picture a = picture(u), b = picture(v);
  const double slack = bin_margin(bins_.count);
  constexpr double kRounding = 1e-9;
  for (std::int32_t bin = 0; bin < bins_.count; ++bin) {
    // The part of the segment, from 0 to 1, that lies in front and between the bin's edges.
    double from = 0, to = 1;
    bool cut_low = false, cut_high = false;
    const auto clip = [&](double at_a, double at_b, bool& cut) {
      if (at_a >= 0 && at_b >= 0) return;
      cut = true;
      if (at_a < 0 && at_b < 0) {
        from = 1;
        to = 0;
      } else if (at_a < 0) {
        from = std::max(from, at_a / (at_a - at_b));
      } else {
        to = std::min(to, at_a / (at_a - at_b));
      }
    };
    bool behind = false;
    const double low = low_tangent_ + (bin - slack) / bins_per_tangent();
    const double high = low_tangent_ + (bin + 1 + slack) / bins_per_tangent();
    clip(a.sideways - low * a.forwards, b.sideways - low * b.forwards, cut_low);
    clip(high * a.forwards - a.sideways, high * b.forwards - b.sideways, cut_high);
    clip(a.forwards, b.forwards, behind);
    if (from > to) continue;
    const bool whole_bin = along_line && cut_low && cut_high && !behind;
    if (!u_known || !v_known) {
      bins_.some_void[static_cast<std::size_t>(bin)] = 1;
      if (whole_bin) bins_.all_void[static_cast<std::size_t>(bin)] = 1;
      continue;
    }
    double lower = kAnything, upper = kNothing;
    for (const double at : {from, to}) {
      const double forwards = a.forwards + at * (b.forwards - a.forwards);
      const double rise_m = a.rise_m + at * (b.rise_m - a.rise_m);
      const double error_m = kRounding * (std::abs(a.rise_m) + std::abs(b.rise_m));
      const auto slope = [&](double rise) {
        return forwards > 1e-12 ? std::clamp<double>(rise / forwards, kNothing, kAnything)
               : rise < 0       ? kNothing
                                : kAnything;
      };
      lower = std::min(lower, slope(rise_m - error_m));
      upper = std::max(upper, slope(rise_m + error_m));
    }
    const auto rounded_low = static_cast<float>(lower), rounded_high = static_cast<float>(upper);
    bins_.add(bin, line, whole_bin ? rounded_low - 1e-6F * std::abs(rounded_low) : kNothing,
              rounded_high + 1e-6F * std::abs(rounded_high));
  }
}

void PartSweep::Run::add_picture(Line& to, std::int32_t i, bool at_front) {
  const Picture p = picture(position(to.number, i));
  const bool known = is_known(to.number, i);
  if (!(p.forwards > kNearCells / 2)) bounds_hold_ = false;
  const auto t = static_cast<float>((p.sideways / p.forwards - low_tangent_) * bins_per_tangent());
  const float s = known ? static_cast<float>(p.rise_m / p.forwards) : kNothing;
  to.has_void = to.has_void || !known;
  if (at_front) {
    to.t.insert(to.t.begin(), t);
    to.s.insert(to.s.begin(), s);
    --to.first;
  } else {
    to.t.push_back(t);
    to.s.push_back(s);
  }
  ++to.count;
}

/// Samples of a line that reach beyond the part to both sides, by two more than needed, because
/// the segments between lines run sideways.
void PartSweep::Run::fill(Line& to, std::int32_t line) {
  to.number = line;
  to.count = 0;
  to.t.clear();
  to.s.clear();
  to.has_void = false;
  constexpr std::int32_t kMore = 3;
  const double run = std::abs(line - eye_line_);
  const auto within = [&](double at) {
    return static_cast<std::int32_t>(std::clamp(at, 0.0, samples_ - 1.0));
  };
  const double low_guess = eye_sample_ + low_tangent_ * run + low_bend_;
  const double high_guess = eye_sample_ + high_tangent_ * run + high_bend_;
  to.first = within(std::floor(low_guess) - kMore);
  const std::int32_t last = within(std::ceil(high_guess) + kMore);
  for (std::int32_t i = to.first; i <= last; ++i) add_picture(to, i, false);
  // Where the lines bend, the guess is made good and remembered for the next line.
  const auto bins = static_cast<float>(bins_.count);
  const auto third = [&] { return static_cast<std::size_t>(std::min(2, to.count - 1)); };
  while (to.first > 0 && to.t[third()] >= 0) {
    add_picture(to, to.first - 1, true);
    low_bend_ -= 1;
  }
  while (to.first + to.count < samples_ &&
         to.t[static_cast<std::size_t>(to.count - 1) - third()] <= bins) {
    add_picture(to, to.first + to.count, false);
    high_bend_ += 1;
  }
  std::int32_t spare = 0;
  while (spare + 2 * kMore < to.count && to.t[static_cast<std::size_t>(spare + 2 * kMore)] < 0)
    ++spare;
  low_bend_ += spare;
  spare = 0;
  while (spare + 2 * kMore < to.count &&
         to.t[static_cast<std::size_t>(to.count - 1 - spare - 2 * kMore)] > bins)
    ++spare;
  high_bend_ -= spare;

  to.begins_inside = to.first == 0;
  to.ends_inside = to.first + to.count == samples_;
  const auto n = static_cast<std::size_t>(to.count);
  to.steep.assign(n, 0);
  for (std::size_t i = 0; i + 1 < n; ++i) {
    if (to.t[i + 1] - to.t[i] < kLeastSpacingBins) bounds_hold_ = false;
    if (to.s[i] != kNothing && to.s[i + 1] != kNothing)
      to.steep[i] = std::abs(to.s[i + 1] - to.s[i]);
  }
  float left = 0;
  for (std::size_t i = 0; i + 1 < n; ++i) {
    const float own = to.steep[i];
    to.steep[i] = std::max({left, own, to.steep[i + 1]});
    left = own;
  }
}

/// The segments between the last line and this one: each is taken as high as its higher end in
/// every bin that it touches.
void PartSweep::Run::add_between(const Line& from, const Line& to) {
  const float slack = bin_margin(bins_.count);
  const auto bins = static_cast<float>(bins_.count);
  const std::int32_t first = std::max(from.first, to.first);
  const std::int32_t last = std::min(from.first + from.count, to.first + to.count);
  for (std::int32_t i = first; i < last; ++i) {
    const auto a = static_cast<std::size_t>(i - from.first),
               b = static_cast<std::size_t>(i - to.first);
    const float low = std::min(from.t[a], to.t[b]) - slack;
    const float high = std::max(from.t[a], to.t[b]) + slack;
    if (high < 0 || low >= bins) continue;
    const bool is_void = from.s[a] == kNothing || to.s[b] == kNothing;
    const float upper = std::max(from.s[a], to.s[b]);
    const auto first_bin = static_cast<std::int32_t>(std::max(low, 0.0F));
    const auto last_bin = static_cast<std::int32_t>(std::min(high, bins - 1));
    for (std::int32_t bin = first_bin; bin <= last_bin; ++bin) {
      if (is_void) {
        bins_.some_void[static_cast<std::size_t>(bin)] = 1;
      } else {
        bins_.add(bin, to.number, kNothing, upper);
      }
    }
  }
  // A segment that reaches into the part from a sample that was not filled would be missed.
  for (std::int32_t k = 0; k < to.count; ++k) {
    const std::int32_t i = to.first + k;
    const float t = to.t[static_cast<std::size_t>(k)];
    if ((i < first || i >= last) && t > -1 && t < bins + 1) bounds_hold_ = false;
  }
}

Sight PartSweep::Run::decide_open(std::int32_t line, std::int32_t i, const Position& at,
                                  std::size_t bin) {
  if (bins_.some_void[bin] && !bins_.all_void[bin]) return judge(line, i);
  ++counts_.traced_part;
  // The segments that lead to a line are met between the line before and the line.
  const std::int32_t first = bins_.first[bin] - outwards_, last = bins_.last[bin];
  const bool blocked =
      (last - first) * outwards_ >= 0 &&
      sight_.is_blocked_between(at, over_columns_ ? line : i, over_columns_ ? i : line,
                                over_columns_, last, first);
  if (blocked) return Sight::kHidden;
  return bins_.all_void[bin] ? Sight::kUnknown : Sight::kVisible;
}

void PartSweep::Run::decide(const Line& line) {
  const auto bins = static_cast<float>(bins_.count);
  for (std::int32_t k = 0; k < line.count; ++k) {
    const auto n = static_cast<std::size_t>(k);
    const float t = line.t[n];
    if (t < -1 || t > bins + 1 || line.is_void(k)) continue;
    const std::int32_t i = line.first + k;
    if (!is_target(line.number, i)) continue;
    if ((t < 1 || t > bins - 1) && !owns(picture(position(line.number, i)))) continue;
    ++counts_.targets;
    float at_t = t, at_s = line.s[n];
    bool off_line = false;
    Position at = position(line.number, i);
    if (target_height_m_ != 0) {
      const Position ground = at;
      at = target(line.number, i);
      const Picture p = picture(at);
      at_t = static_cast<float>((p.sideways / p.forwards - low_tangent_) * bins_per_tangent());
      at_s = static_cast<float>(p.rise_m / p.forwards);
      off_line = at.x_m != ground.x_m || at.y_m != ground.y_m;
    }
    // The ground's t is in [0, bins] but for its rounding, which the bins' margins hold.
    at_t = std::clamp(at_t, 0.0F, std::nextafter(bins, 0.0F));
    if (!bounds_hold_ || off_line) {
      write(line.number, i, judge(line.number, i));
      continue;
    }
    const auto bin = static_cast<std::size_t>(at_t);
    const float margin = kSlopeMargin * std::abs(at_s);
    Sight sight;
    if (at_s < bins_.low[bin] - margin)
      sight = Sight::kHidden;
    else if (at_s >= bins_.high[bin] + margin && (!bins_.some_void[bin] || bins_.all_void[bin]))
      sight = bins_.all_void[bin] ? Sight::kUnknown : Sight::kVisible;
    else
      sight = decide_open(line.number, i, at, bin);
    write(line.number, i, sight);
  }
}

/// Bounds of a line's picture in each bin: at the bin's two edges and at the samples between.
void PartSweep::Run::add_line(const Line& line) {
  const float slack = bin_margin(bins_.count), per_rise = rise_margin(bins_.count);
  const std::int32_t n = line.count;
  edge_low_.resize(static_cast<std::size_t>(bins_.count) + 1);
  edge_high_.resize(static_cast<std::size_t>(bins_.count) + 1);
  edge_before_.resize(static_cast<std::size_t>(bins_.count) + 1);
  std::int32_t j = -1;
  for (std::int32_t edge = 0; edge <= bins_.count; ++edge) {
    const auto at = static_cast<float>(edge);
    while (j + 1 < n && line.t[static_cast<std::size_t>(j + 1)] <= at) ++j;
    float low = kNothing, high = kNothing;
    const auto u = static_cast<std::size_t>(j);
    const bool inside = j >= 0 && j + 1 < n && !line.is_void(j) && !line.is_void(j + 1);
    const bool at_before = j >= 0 && at - line.t[u] < slack;
    const bool at_after = j + 1 < n && line.t[u + 1] - at < slack;
    if (inside) {
      const float f = (at - line.t[u]) / (line.t[u + 1] - line.t[u]);
      const float s = line.s[u] + f * (line.s[u + 1] - line.s[u]);
      const float margin = per_rise * line.steep[u] + kSlopeMargin * std::abs(s);
      low = s - margin;
      high = s + margin;
    }
    if (at_before) {
      high = std::max(high, line.s[u] + per_rise * line.steep[u]);
      if (j == 0 || line.is_void(j - 1)) low = kNothing;
    }
    if (at_after) {
      high = std::max(high, line.s[u + 1] + per_rise * line.steep[j < 0 ? 0 : u]);
      if (j + 2 >= n || line.is_void(j + 2)) low = kNothing;
    }
    edge_low_[static_cast<std::size_t>(edge)] = low;
    edge_high_[static_cast<std::size_t>(edge)] = high;
    edge_before_[static_cast<std::size_t>(edge)] = j;
  }
  for (std::int32_t bin = 0; bin < bins_.count; ++bin) {
    const auto b = static_cast<std::size_t>(bin);
    float low = std::min(edge_low_[b], edge_low_[b + 1]);
    float high = std::max(edge_high_[b], edge_high_[b + 1]);
    for (std::int32_t k = edge_before_[b] + 1; k <= edge_before_[b + 1]; ++k) {
      const float s = line.s[static_cast<std::size_t>(k)];
      low = std::min(low, s);
      high = std::max(high, s);
    }
    bins_.add(bin, line.number, low, high);
  }
  if (line.has_void) mark_void(line);
}

void PartSweep::Run::mark_void(const Line& line) {
  const float slack = bin_margin(bins_.count);
  std::int32_t j = 0;
  for (std::int32_t bin = 0; bin < bins_.count; ++bin) {
    const auto b = static_cast<std::size_t>(bin);
    const float low = static_cast<float>(bin) - slack, high = static_cast<float>(bin + 1) + slack;
    while (j + 1 < line.count && line.t[static_cast<std::size_t>(j + 1)] < low) ++j;
    // From here segments k to k + 1 touch the bin until one begins beyond it.
    bool some = false, all = line.t[static_cast<std::size_t>(j)] <= low;
    std::int32_t k = j;
    for (; k + 1 < line.count && line.t[static_cast<std::size_t>(k)] <= high; ++k) {
      if (line.t[static_cast<std::size_t>(k + 1)] < low) continue;
      const bool is_void = line.is_void(k) || line.is_void(k + 1);
      some = some || is_void;
      all = all && is_void;
      // Exactly over a known sample a line of sight is over known ground.
      if (line.t[static_cast<std::size_t>(k)] >= low && !line.is_void(k)) all = false;
    }
    if (line.t[static_cast<std::size_t>(k)] <= high) all = false;
    if (some) bins_.some_void[b] = 1;
    if (some && all) bins_.all_void[b] = 1;
  }
}

void PartSweep::Run::sweep_line(std::int32_t line, bool is_first) {
  // One to two bins a sample, everywhere.
  const double run = std::abs(line - eye_line_);
  while (bins_per_tangent() < run) {
    bins_.halve();
    for (float& t : before_->t) t *= 2;
  }
  fill(*line_, line);
  if (!is_first) add_between(*before_, *line_);
  decide(*line_);
  add_line(*line_);
  std::swap(line_, before_);
}

PartSweep::PartSweep(const GridSight& sight, double target_height_m, const SampleWindow& window)
    : sight_(sight), target_height_m_(target_height_m), window_(window) {}

SweepCounts PartSweep::run(const SweepPart& part, std::span<Sight> result) {
  return Run(*this, part, result).run();
}

SweepCounts sweep_viewshed(const GroundGrid& grid, const Position& eye, double target_height_m,
                           const SampleWindow& window, std::span<Sight> result) {
  const auto columns = static_cast<std::size_t>(grid.columns());
  assert(result.size() == columns * static_cast<std::size_t>(grid.rows()));
  const GridSight sight(grid, eye);
  if (window.last_column < window.first_column) return {};
  for (std::int32_t row = window.first_row; row <= window.last_row; ++row) {
    const auto begin = result.begin() + static_cast<std::ptrdiff_t>(row) * grid.columns();
    std::fill(begin + window.first_column, begin + window.last_column + 1, Sight::kUnknown);
  }
  constexpr std::size_t kWedges = 4;
  constexpr auto kParts = static_cast<std::size_t>(SweepPart::kPartsInWedge);
  std::array<SweepCounts, kWedges * kParts> counts;
  parallel_for(counts.size(), [&](std::size_t i) {
    const SweepPart part{static_cast<SweepPart::Wedge>(i % kWedges),
                         static_cast<std::int32_t>(i / kWedges)};
    counts[i] = PartSweep(sight, target_height_m, window).run(part, result);
  });
  SweepCounts sum;
  for (const SweepCounts& of_part : counts) sum.add(of_part);
  // The sample under the eye belongs to no part.
  const auto near = [](double at, std::int32_t count) {
    return static_cast<std::int32_t>(std::lround(std::clamp(at, 0.0, count - 1.0)));
  };
  const std::int32_t column = near(sight.frame().eye_column, grid.columns());
  const std::int32_t row = near(sight.frame().eye_row, grid.rows());
  const Position p = grid.at(column, row);
  if (sight.frame().across(p.x_m, p.y_m) == 0 && sight.frame().down(p.x_m, p.y_m) == 0 &&
      window.contains(column, row) && grid.is_known(column, row)) {
    result[static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column)] =
        sight.judge(grid.raised(column, row, target_height_m), column, row);
    ++sum.targets;
    ++sum.traced_whole;
  }
  return sum;
}

}  // namespace scarp
