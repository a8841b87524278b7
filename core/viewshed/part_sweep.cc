#include "core/viewshed/part_sweep.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "core/geodesy/predicates.h"
#include "core/threads/parallel_for.h"
#include "core/viewshed/bin_history.h"
#include "core/viewshed/least_height.h"
#include "core/viewshed/line_kernels.h"
#include "core/viewshed/ray_climb.h"

namespace scarp {
namespace {

/// Grid lines nearer to the eye than this are compared in double, ray by ray: seen from there the
/// picture of a line may be wider than float holds.
constexpr double kNearCells = 1.5;

/// s of a sample is a double rounded to float (2^-24 of itself), compared with another such one;
/// 2^-20 leaves room for the arithmetic before.
constexpr float kSlopeMargin = 0x1p-20F;

constexpr std::int32_t kFirstBins = 8;

/// Least spacing of the samples of a line, in bins, that the margins below are derived for.
constexpr float kLeastSpacingBins = 0.5F;

/// Samples that a line's picture has beyond the part, to each side.
constexpr std::int32_t kBeyond = 4;

}  // namespace

/// What all parts of a sweep share.
struct SweepGround {
  /// Plan places of columns and rows where the placement is separable; otherwise empty.
  std::vector<double> across_of_column, down_of_row;
  /// How far those lie from even spacing, in samples.
  double uneven_samples = 0;
  /// Greatest difference of height between neighbouring samples, metres; only where targets stand
  /// off their grid lines.
  double steepest_m = 0;

  SweepGround(const GroundGrid& grid, const PlanFrame& frame, double target_height_m,
              const SampleWindow& window);
};

namespace {

double unevenness(const std::vector<double>& places) {
  double most = 0;
  const double step = (places.back() - places.front()) / static_cast<double>(places.size() - 1);
  for (std::size_t i = 0; i < places.size(); ++i)
    most = std::max(most, std::abs(places.front() + step * static_cast<double>(i) - places[i]));
  return most;
}

/// Around the samples of a window and those beside them.
double steepest_step_m(const GroundGrid& grid, const SampleWindow& window) {
  constexpr std::int32_t kBeside = 2;
  const std::int32_t first_row = std::max(0, window.first_row - kBeside);
  const std::int32_t last_row = std::min(grid.rows() - 1, window.last_row + kBeside);
  const std::int32_t first_column = std::max(0, window.first_column - kBeside);
  const std::int32_t last_column = std::min(grid.columns() - 1, window.last_column + kBeside);
  std::vector<std::int64_t> of_row(static_cast<std::size_t>(last_row - first_row + 1));
  parallel_for(of_row.size(), [&](std::size_t r) {
    const auto row = first_row + static_cast<std::int32_t>(r);
    const std::int32_t* here = grid.row_steps(row);
    const std::int32_t* below = row + 1 < grid.rows() ? grid.row_steps(row + 1) : here;
    std::int64_t most = 0;
    for (std::int32_t c = first_column; c <= last_column; ++c) {
      if (here[c] == GroundGrid::kVoid) continue;
      for (const std::int32_t next : {c + 1 < grid.columns() ? here[c + 1] : here[c], below[c]})
        if (next != GroundGrid::kVoid)
          most = std::max(most, std::abs(static_cast<std::int64_t>(next) - here[c]));
    }
    of_row[r] = most;
  });
  return static_cast<double>(*std::max_element(of_row.begin(), of_row.end())) * kLatticeStepM;
}

}  // namespace

SweepGround::SweepGround(const GroundGrid& grid, const PlanFrame& frame, double target_height_m,
                         const SampleWindow& window) {
  if (const auto* separable = std::get_if<SeparablePlacement>(&grid.placement())) {
    for (const double x : separable->x_of_column_m)
      across_of_column.push_back(frame.across(x, frame.eye_y_m));
    for (const double y : separable->y_of_row_m)
      down_of_row.push_back(frame.down(frame.eye_x_m, y));
    uneven_samples = std::max(unevenness(across_of_column), unevenness(down_of_row));
  }
  if (target_height_m != 0 && std::holds_alternative<BlockPlacement>(grid.placement()))
    steepest_m = steepest_step_m(grid, window);
}

/// The picture of a grid line: its samples around the part.
struct PartSweep::Line {
  std::int32_t number = 0;
  std::int32_t first = 0;    ///< sample that index 0 stands for
  std::vector<float> t;      ///< in bins, rising
  std::vector<float> s;      ///< of the ground; kNoGround where void
  std::vector<float> steep;  ///< greatest rise of the segment after a sample and its neighbours
  std::vector<float> place;  ///< [bins + 1] where the bins' edges fall, in samples; if is_whole
  std::vector<double> z_m;
  std::vector<std::uint8_t> is_void;
  bool has_void = false;
  bool is_whole = false;  ///< known ground all across the part and a sample beyond

  std::int32_t count() const { return static_cast<std::int32_t>(t.size()); }
};

/// Results of a part that sweeps over columns, gathered so that rows of the raster are written a
/// cache line at a time.
class ColumnTile {
 public:
  static constexpr std::size_t kStride = 64;

  explicit ColumnTile(std::int32_t rows)
      : sight_(static_cast<std::size_t>(rows) * kStride, Seen::kUnknown),
        marks_(static_cast<std::size_t>(rows), 0) {}

  /// Where a column's results go, kStride apart.
  Seen* column(std::int32_t column) { return &sight_[static_cast<std::size_t>(column) % kStride]; }

  /// Rows [first, last] of a column are of the part.
  void mark(std::int32_t column, std::int32_t first, std::int32_t last) {
    const std::uint64_t bit = std::uint64_t{1} << (static_cast<std::size_t>(column) % kStride);
    for (auto r = static_cast<std::size_t>(first); r <= static_cast<std::size_t>(last); ++r)
      marks_[r] |= bit;
    first_row_ = std::min(first_row_, first);
    last_row_ = std::max(last_row_, last);
  }

  static bool is_last_in_tile(std::int32_t column, std::int32_t outwards) {
    const std::size_t at = static_cast<std::size_t>(column) % kStride;
    return outwards > 0 ? at == kStride - 1 : at == 0;
  }

  /// Writes what is marked of the tile that a column belongs to, and begins anew.
  void flush(std::int32_t column, std::int32_t columns, std::span<Seen> result) {
    const std::size_t begin = static_cast<std::size_t>(column) / kStride * kStride;
    for (std::int32_t row = first_row_; row <= last_row_; ++row) {
      const auto r = static_cast<std::size_t>(row);
      const Seen* from = &sight_[r * kStride];
      Seen* to = &result[r * static_cast<std::size_t>(columns) + begin];
      // Mostly one run of columns; where rows bend there may be more.
      for (std::uint64_t marks = marks_[r]; marks != 0;) {
        const int first = std::countr_zero(marks);
        const int length = std::countr_one(marks >> first);
        std::copy(from + first, from + first + length, to + first);
        marks = first + length == 64 ? 0 : marks >> (first + length) << (first + length);
      }
      marks_[r] = 0;
    }
    first_row_ = std::numeric_limits<std::int32_t>::max();
    last_row_ = -1;
  }

 private:
  std::vector<Seen> sight_;
  std::vector<std::uint64_t> marks_;
  std::int32_t first_row_ = std::numeric_limits<std::int32_t>::max(), last_row_ = -1;
};

class PartSweep::Run {
 public:
  /// Either result or least_m is empty.
  Run(const PartSweep& sweep, const SweepPart& part, std::span<Seen> result,
      std::span<float> least_m, const LeastSoFar* so_far = nullptr);
  SweepCounts run();

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
  Position target(std::int32_t line, std::int32_t i) const {
    return over_columns_ ? stands_.raised(line, i, target_height_m_)
                         : stands_.raised(i, line, target_height_m_);
  }
  /// The ground that a target stands on.
  Position stand(std::int32_t line, std::int32_t i) const {
    return over_columns_ ? stands_.at(line, i) : stands_.at(i, line);
  }
  /// On a ground of its own a target may stand beside the sample that blocks, by what the normal
  /// leans over the height between them; the bin is that of the sample.
  bool stands_aside(std::int32_t line, std::int32_t i) const {
    if (!apart_) return false;
    const Position at = stand(line, i), over = position(line, i);
    return at.x_m != over.x_m || at.y_m != over.y_m;
  }
  bool raised() const { return target_height_m_ != 0 || apart_; }
  Seen judge(std::int32_t line, std::int32_t i) {
    ++counts_.traced_whole;
    return over_columns_ ? sight_.judge(target(line, i), line, i)
                         : sight_.judge(target(line, i), i, line);
  }
  std::size_t result_index(std::int32_t line, std::int32_t i) const {
    const std::int32_t column = over_columns_ ? line : i, row = over_columns_ ? i : line;
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(grid_.columns()) +
           static_cast<std::size_t>(column);
  }

  Picture picture(const Position& p) const;
  bool owns(const Picture& p) const;

  double bins_per_tangent() const { return bins_ / (high_tangent_ - low_tangent_); }
  /// t of a sample in bins is below the number of bins, so its rounding to float is below 2^-24 of
  /// that; a sample and a target may miss each other by twice as much. 2^-22 is used, and what
  /// the samples lie off even spacing, at two bins a sample and more near the eye.
  float slack() const {
    return static_cast<float>(bins_) * 0x1p-22F +
           static_cast<float>(uneven_samples_ * bins_per_tangent());
  }
  /// Interpolating at a bin's edge, where both ends of a segment are off by slack and the edge by
  /// as much again, errs by at most 6 slack / kLeastSpacingBins of the segment's rise, or of its
  /// neighbours' where the edge is that close to a sample.
  float per_rise() const { return 16 * slack(); }

  void sweep_near(std::int32_t line, bool judge_targets);
  void add_near_segment(const Position& u, bool u_known, const Position& v, bool v_known,
                        bool along_line);
  void sweep_line(std::int32_t line, bool is_first);

  void halve_bins();
  void fill(Line& to, std::int32_t line);
  void take_samples(Line& to, std::int32_t first, std::int32_t last);
  template <typename Body>
  void for_blocks(std::int32_t line, std::int32_t first, std::size_t count, const Body& body) const;
  void take_pictures(const Line& line, const double* z_m, float* t, float* s);
  void find_edges(Line& to) const;

  void decide(const Line& line, const Line* before);
  void climb(const Line& line, const Line* before);
  float climb_all(std::int32_t line, std::int32_t i);
  float climb_to(const Line& line, const Line* before, std::int32_t k, float enough_m);
  float climb_in_bin(const Line& line, std::int32_t k, std::size_t bin, float enough_m);
  bool is_blocked_in_bin(const Line& line, std::int32_t k, std::size_t bin, float s);
  bool is_enough(double z_m, const Line& line, std::int32_t k, float enough_m) const;
  void offer(std::int32_t line, std::int32_t i, float height_m);
  void mark_top(std::int32_t line, const float* up);
  std::pair<double, double> place_of(const Line& line, std::int32_t k) const;
  std::pair<std::int32_t, std::int32_t> own_range(const Line& line) const;
  void take_targets(const Line& line);
  Seen decide_seen(const Line& line, const Line* before, std::int32_t k, Decision decision);
  bool crosses_before(const Line& before, std::int32_t i, float t) const;
  bool stands_free(const Position& at, std::int32_t line, std::int32_t i) const;

  void add_whole(const Line& line, const Line* before);
  void add_in_pieces(const Line& line, const Line* before);
  void raise_segments(const Line& from, const Line& to, float* up);
  void raise_line(const Line& line, float* up);
  void mark_void(const Line& line);

  const GridSight& sight_;
  const GroundGrid& grid_;    ///< what blocks
  const GroundGrid& stands_;  ///< what targets stand on
  const bool apart_;          ///< whether these are two
  const PlanFrame& frame_;
  const SweepGround& ground_;
  double target_height_m_;
  SampleWindow window_;
  std::span<Seen> result_;
  std::span<float> least_m_;
  const LeastSoFar* so_far_;  ///< null where every height is wanted
  SweepPart part_;

  bool over_columns_ = true;
  std::int32_t outwards_ = 1;
  std::int32_t lines_ = 0, samples_ = 0;
  double eye_line_ = 0, eye_sample_ = 0;
  double low_tangent_ = 0, high_tangent_ = 0;
  double uneven_samples_ = 0;

  /// Bounds of the horizon by bin.
  std::int32_t bins_ = kFirstBins;
  std::vector<float> low_, high_;
  std::vector<std::int32_t> top_;  ///< line that reaches highest so far; for heights only
  std::vector<std::uint8_t> some_void_, all_void_;
  BinHistory history_;

  Line kept_[2];
  Line* line_ = &kept_[0];
  Line* before_ = &kept_[1];
  bool bounds_hold_ = true;
  std::int32_t low_bend_ = 0, high_bend_ = 0;  ///< samples by which lines miss their guess

  // Room for one line.
  std::vector<double> across_, down_, raised_m_;
  std::vector<float> rises_;
  std::vector<float> place_before_, higher_, pairs_, target_t_, target_s_;
  std::vector<float> this_s_, next_s_, edge_low_, edge_high_, line_low_;
  std::vector<std::int32_t> edge_before_;
  std::vector<Decision> decisions_;
  std::optional<ColumnTile> tile_;
  SweepCounts counts_;
};

PartSweep::Run::Run(const PartSweep& sweep, const SweepPart& part, std::span<Seen> result,
                    std::span<float> least_m, const LeastSoFar* so_far)
    : sight_(sweep.sight_),
      grid_(sight_.grid()),
      stands_(sweep.stands_),
      apart_(&grid_ != &stands_),
      frame_(sight_.frame()),
      ground_(sweep.ground_),
      target_height_m_(sweep.target_height_m_),
      window_(sweep.window_),
      result_(result),
      least_m_(least_m),
      so_far_(so_far),
      part_(part),
      uneven_samples_(ground_.uneven_samples),
      low_(kFirstBins, kNoGround),
      high_(kFirstBins, kNoGround),
      top_(kFirstBins, -1),
      some_void_(kFirstBins, 0),
      all_void_(kFirstBins, 0) {
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

SweepCounts PartSweep::Run::run() {
  const auto at_least = [&](double cells) {
    const double from = eye_line_ + outwards_ * cells;
    return static_cast<std::int64_t>(outwards_ > 0 ? std::ceil(from) : std::floor(from));
  };
  // Lines behind the eye begin segments that reach in front of it.
  const std::int64_t near_begin = at_least(-kNearCells);
  const std::int64_t far_begin = at_least(kNearCells);
  // Nothing beyond a target's line can block it.
  const std::int64_t border = outwards_ > 0
                                  ? (over_columns_ ? window_.last_column : window_.last_row) + 1
                                  : (over_columns_ ? window_.first_column : window_.first_row) - 1;
  const auto inside = [&](std::int64_t line) { return line >= 0 && line < lines_; };
  for (std::int64_t line = near_begin; line != far_begin + outwards_; line += outwards_)
    if (inside(line)) sweep_near(static_cast<std::int32_t>(line), line != far_begin);
  std::int64_t begin = far_begin;
  if (!inside(begin))
    begin = outwards_ > 0 ? std::max<std::int64_t>(begin, 0)
                          : std::min<std::int64_t>(begin, lines_ - 1);
  if (!inside(begin)) return counts_;
  if (over_columns_ && least_m_.empty()) tile_.emplace(samples_);
  for (std::int64_t at = begin; (border - at) * outwards_ > 0; at += outwards_) {
    const auto line = static_cast<std::int32_t>(at);
    sweep_line(line, at == begin);
    const bool is_last = at + outwards_ == border;
    if (tile_ && (is_last || ColumnTile::is_last_in_tile(line, outwards_)))
      tile_->flush(line, grid_.columns(), result_);
  }
  return counts_;
}

PartSweep::Run::Picture PartSweep::Run::picture(const Position& p) const {
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

/// Does the sample lie in this part? Decided from the same two numbers in every part, so that each
/// sample has one.
bool PartSweep::Run::owns(const Picture& p) const {
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

/// Compares the segments of a near line, and those that lead to it, in double.
void PartSweep::Run::sweep_near(std::int32_t line, bool judge_targets) {
  // In front of the eye by at most kNearCells + 1, a direction of the part leaves the line within
  // as many samples of the eye's; two more hold for bends.
  constexpr std::int32_t kBeside = 5;
  const auto middle =
      static_cast<std::int64_t>(std::floor(std::clamp(eye_sample_, -9.0, samples_ + 9.0)));
  const auto within = [&](std::int64_t i) {
    return static_cast<std::int32_t>(std::clamp<std::int64_t>(i, 0, samples_ - 1));
  };
  const std::int32_t first = within(middle - kBeside), last = within(middle + kBeside);
  const std::int32_t behind = line - outwards_;
  const bool leads_here = behind >= 0 && behind < lines_;
  float* up = history_.begin_line(line, bins_);
  std::fill(up, up + bins_, kNoGround);
  edge_high_.assign(static_cast<std::size_t>(bins_), kNoGround);
  line_low_.assign(static_cast<std::size_t>(bins_), kNoGround);
  for (std::int32_t i = first; i <= last; ++i) {
    const Position p = position(line, i);
    if (leads_here)
      add_near_segment(position(behind, i), is_known(behind, i), p, is_known(line, i), false);
    if (!judge_targets) continue;
    if (i < last)
      add_near_segment(p, is_known(line, i), position(line, i + 1), is_known(line, i + 1), true);
    if (is_target(line, i) && is_known(line, i) && owns(picture(p))) {
      ++counts_.targets;
      if (least_m_.empty())
        result_[result_index(line, i)] = judge(line, i);
      else
        offer(line, i, climb_all(line, i));
    }
  }
  std::copy(edge_high_.begin(), edge_high_.end(), up);
  history_.end_line();
  for (std::size_t b = 0; b < edge_high_.size(); ++b) {
    low_[b] = std::max(low_[b], line_low_[b]);
    high_[b] = std::max(high_[b], edge_high_[b]);
  }
  mark_top(line, up);
}

void PartSweep::Run::add_near_segment(const Position& u, bool u_known, const Position& v,
                                      bool v_known, bool along_line) {
  // Along its own direction a segment counts by its samples, which end other segments.
  if (orient2d(sight_.eye(), u, v) == 0) return;
  const Picture a = picture(u), b = picture(v);
  constexpr double kRounding = 1e-9;
  for (std::int32_t bin = 0; bin < bins_; ++bin) {
    const auto n = static_cast<std::size_t>(bin);
    // The part of the segment, from 0 to 1, that lies in front and between the bin's edges.
    double from = 0, to = 1;
    const auto clip = [&](double at_a, double at_b) {
      if (at_a >= 0 && at_b >= 0) return false;
      if (at_a < 0 && at_b < 0) {
        from = 1;
        to = 0;
      } else if (at_a < 0) {
        from = std::max(from, at_a / (at_a - at_b));
      } else {
        to = std::min(to, at_a / (at_a - at_b));
      }
      return true;
    };
    const double margin = slack();
    const double low = low_tangent_ + (bin - margin) / bins_per_tangent();
    const double high = low_tangent_ + (bin + 1 + margin) / bins_per_tangent();
    const bool cut_low = clip(a.sideways - low * a.forwards, b.sideways - low * b.forwards);
    const bool cut_high = clip(high * a.forwards - a.sideways, high * b.forwards - b.sideways);
    const bool behind = clip(a.forwards, b.forwards);
    if (from > to) continue;
    const bool whole_bin = along_line && cut_low && cut_high && !behind;
    if (!u_known || !v_known) {
      some_void_[n] = 1;
      if (whole_bin) all_void_[n] = 1;
      continue;
    }
    double lower = kAnyGround, upper = kNoGround;
    for (const double at : {from, to}) {
      const double forwards = a.forwards + at * (b.forwards - a.forwards);
      const double rise_m = a.rise_m + at * (b.rise_m - a.rise_m);
      const double error_m = kRounding * (std::abs(a.rise_m) + std::abs(b.rise_m));
      const auto slope = [&](double rise) {
        return forwards > 1e-12 ? std::clamp<double>(rise / forwards, kNoGround, kAnyGround)
               : rise < 0       ? kNoGround
                                : kAnyGround;
      };
      lower = std::min(lower, slope(rise_m - error_m));
      upper = std::max(upper, slope(rise_m + error_m));
    }
    const auto rounded_low = static_cast<float>(lower), rounded_high = static_cast<float>(upper);
    if (whole_bin)
      line_low_[n] = std::max(line_low_[n], rounded_low - kSlopeMargin * std::abs(rounded_low));
    edge_high_[n] = std::max(edge_high_[n], rounded_high + kSlopeMargin * std::abs(rounded_high));
  }
}

void PartSweep::Run::halve_bins() {
  const auto split = [&](auto& values) {
    values.resize(static_cast<std::size_t>(bins_) * 2);
    for (auto b = static_cast<std::size_t>(bins_); b-- > 0;)
      values[2 * b] = values[2 * b + 1] = values[b];
  };
  split(low_);
  split(high_);
  split(top_);
  split(some_void_);
  split(all_void_);
  bins_ *= 2;
  for (float& t : before_->t) t *= 2;
}

/// Calls body(block, index in the run, count, u, du, v, dv) for the pieces of a run of samples of a
/// line, block by block.
template <typename Body>
void PartSweep::Run::for_blocks(std::int32_t line, std::int32_t first, std::size_t count,
                                const Body& body) const {
  const auto& blocks = std::get<BlockPlacement>(grid_.placement());
  const double step = 2.0 / blocks.side;
  for (std::size_t k = 0; k < count;) {
    const std::int32_t i = first + static_cast<std::int32_t>(k);
    const std::int32_t column = over_columns_ ? line : i, row = over_columns_ ? i : line;
    const std::size_t length =
        std::min(count - k, static_cast<std::size_t>(blocks.side - i % blocks.side));
    body(blocks.block_of(column, row), k, length, blocks.local(column), over_columns_ ? 0 : step,
         blocks.local(row), over_columns_ ? step : 0);
    k += length;
  }
}

/// t and s of samples of a line, from first on, at heights z_m.
void PartSweep::Run::take_pictures(const Line& line, const double* z_m, float* t, float* s) {
  const std::size_t count = line.z_m.size();
  const double eye_z_m = sight_.eye().z_m;
  const std::uint8_t* is_void = line.has_void ? line.is_void.data() : nullptr;
  if (!ground_.across_of_column.empty()) {
    const auto& along = over_columns_ ? ground_.down_of_row : ground_.across_of_column;
    const auto& outwards = over_columns_ ? ground_.across_of_column : ground_.down_of_row;
    const double forwards = outwards_ * outwards[static_cast<std::size_t>(line.number)];
    if (!(forwards > kNearCells / 2)) bounds_hold_ = false;
    take_level_picture(count, forwards, &along[static_cast<std::size_t>(line.first)], z_m, is_void,
                       eye_z_m, low_tangent_, bins_per_tangent(), t, s);
    return;
  }
  across_.resize(count);
  down_.resize(count);
  if (std::holds_alternative<BlockPlacement>(grid_.placement())) {
    for_blocks(line.number, line.first, count,
               [&](const BlockPlacement::Block& block, std::size_t k, std::size_t length, double u,
                   double du, double v, double dv) {
                 place_run(block, u, du, v, dv, length, z_m + k, frame_, &across_[k], &down_[k]);
               });
  } else {
    for (std::size_t k = 0; k < count; ++k) {
      const Position p = position(line.number, line.first + static_cast<std::int32_t>(k));
      across_[k] = frame_.across(p.x_m, p.y_m);
      down_[k] = frame_.down(p.x_m, p.y_m);
    }
  }
  std::vector<double>& forwards = over_columns_ ? across_ : down_;
  if (outwards_ < 0)
    for (double& f : forwards) f = -f;
  if (!take_picture(count, forwards.data(), over_columns_ ? down_.data() : across_.data(), z_m,
                    is_void, eye_z_m, low_tangent_, bins_per_tangent(), kNearCells / 2, t, s))
    bounds_hold_ = false;
}

/// The picture of samples [first, last] of a line.
void PartSweep::Run::take_samples(Line& to, std::int32_t first, std::int32_t last) {
  const auto count = static_cast<std::size_t>(last - first + 1);
  to.first = first;
  to.t.resize(count);
  to.s.resize(count);
  to.z_m.resize(count);
  to.is_void.resize(count);
  const std::int32_t* steps =
      over_columns_ ? grid_.row_steps(first) + to.number : grid_.row_steps(to.number) + first;
  to.has_void = load_heights(steps, over_columns_ ? grid_.stride() : 1, count, to.z_m.data(),
                             to.is_void.data());
  take_pictures(to, to.z_m.data(), to.t.data(), to.s.data());
}

/// The picture of a line, kBeyond samples more than the part to both sides where the grid has
/// them, because the segments between lines run sideways.
void PartSweep::Run::fill(Line& to, std::int32_t line) {
  to.number = line;
  const double run = std::abs(line - eye_line_);
  const auto within = [&](double at) {
    return static_cast<std::int32_t>(std::clamp(at, 0.0, samples_ - 1.0));
  };
  const auto bins = static_cast<float>(bins_);
  // Where the lines bend, the guess is made good and remembered for the next line.
  for (;;) {
    const std::int32_t first =
        within(std::floor(eye_sample_ + low_tangent_ * run) + low_bend_ - kBeyond);
    const std::int32_t last =
        within(std::ceil(eye_sample_ + high_tangent_ * run) + high_bend_ + kBeyond);
    take_samples(to, first, std::max(first, last));
    const auto n = to.t.size();
    const std::size_t inner = std::min<std::size_t>(kBeyond - 1, n - 1);
    const bool short_low = to.first > 0 && to.t[inner] >= 0;
    const bool short_high = to.first + to.count() < samples_ && to.t[n - 1 - inner] <= bins;
    if (!short_low && !short_high) break;
    if (short_low) low_bend_ -= kBeyond;
    if (short_high) high_bend_ += kBeyond;
  }
  constexpr auto kSpare = static_cast<std::size_t>(3 * kBeyond);
  if (to.t.size() > kSpare && to.t[kSpare] < 0) low_bend_ += kBeyond;
  if (to.t.size() > kSpare && to.t[to.t.size() - 1 - kSpare] > bins) high_bend_ -= kBeyond;
  const auto n = to.t.size();
  to.steep.resize(n);
  rises_.resize(n);
  if (!take_rises(n, to.t.data(), to.s.data(), to.has_void ? to.is_void.data() : nullptr,
                  kLeastSpacingBins, rises_.data(), to.steep.data()))
    bounds_hold_ = false;
  to.is_whole =
      bounds_hold_ && !to.has_void && n > 4 && to.t[1] < -slack() && to.t[n - 2] > bins + slack();
  if (to.is_whole) find_edges(to);
}

/// Where the edges between bins fall among the samples of a whole line.
void PartSweep::Run::find_edges(Line& to) const {
  const std::size_t edges = static_cast<std::size_t>(bins_) + 1;
  to.place.resize(edges);
  if (!ground_.across_of_column.empty()) {
    const std::size_t n = to.t.size();
    const double spacing =
        (static_cast<double>(to.t[n - 1]) - to.t[0]) / static_cast<double>(n - 1);
    const auto per_bin = static_cast<float>(1 / spacing);
    const auto begin = static_cast<float>(-to.t[0] / spacing);
    even_places(edges, per_bin, begin, to.place.data());
    return;
  }
  if (near_even_places(edges, to.t.size(), to.t.data(), to.place.data())) return;
  std::size_t j = 0;
  for (std::size_t e = 0; e < edges; ++e) {
    const auto edge = static_cast<float>(static_cast<std::int32_t>(e));
    while (to.t[j + 1] <= edge) ++j;
    to.place[e] = static_cast<float>(static_cast<std::int32_t>(j)) +
                  (edge - to.t[j]) / (to.t[j + 1] - to.t[j]);
  }
}

/// t and s of the targets of a line.
void PartSweep::Run::take_targets(const Line& line) {
  const std::size_t count = line.t.size();
  target_t_.resize(count);
  target_s_.resize(count);
  raised_m_.resize(count);
  if (apart_) {
    for (std::size_t k = 0; k < count; ++k)
      raised_m_[k] =
          line.is_void[k] ? 0 : target(line.number, line.first + static_cast<std::int32_t>(k)).z_m;
  } else if (std::holds_alternative<BlockPlacement>(grid_.placement())) {
    for_blocks(line.number, line.first, count,
               [&](const BlockPlacement::Block& block, std::size_t k, std::size_t length, double u,
                   double du, double v, double dv) {
                 raise_run(block, u, du, v, dv, length, &line.z_m[k], target_height_m_,
                           &raised_m_[k]);
               });
  } else {
    for (std::size_t k = 0; k < count; ++k)
      raised_m_[k] = round_to_lattice(line.z_m[k] + target_height_m_);
  }
  take_pictures(line, raised_m_.data(), target_t_.data(), target_s_.data());
}

/// On its way from the line before, can a line of sight to sample i cross a segment that joins the
/// two lines? Where the grid does not bend it cannot: in a wedge it goes sideways by a sample at
/// most, from one line to the next.
bool PartSweep::Run::crosses_before(const Line& before, std::int32_t i, float t) const {
  const float room = 4 * slack();
  const std::int32_t k = i - before.first;
  if (k < 1 || k + 1 >= before.count()) return true;
  return before.t[static_cast<std::size_t>(k - 1)] > t - room ||
         before.t[static_cast<std::size_t>(k + 1)] < t + room;
}

/// A raised target may stand beside its sample, by what the normal leans: does it stand so little
/// beside that the segments at the sample, which it may be a step beyond, cannot block it?
bool PartSweep::Run::stands_free(const Position& at, std::int32_t line, std::int32_t i) const {
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

/// A target that is not hidden for certain.
Seen PartSweep::Run::decide_seen(const Line& line, const Line* before, std::int32_t k,
                                 Decision decision) {
  const auto n = static_cast<std::size_t>(k);
  const std::int32_t i = line.first + k;
  const bool raised = this->raised();
  const float t = raised ? target_t_[n] : line.t[n], s = raised ? target_s_[n] : line.s[n];
  if (before && crosses_before(*before, i, t)) return judge(line.number, i);
  if (raised && !stands_free(target(line.number, i), line.number, i)) return judge(line.number, i);
  const auto bins = static_cast<float>(bins_);
  if (raised && (t < -slack() || t > bins + slack())) return judge(line.number, i);
  const auto bin = static_cast<std::int32_t>(std::clamp(t, 0.0F, bins - 1));
  if (decision == Decision::kOpen) {
    const Position at = target(line.number, i);
    ++counts_.traced_part;
    const float least = s - 4 * kSlopeMargin * std::abs(s);
    const bool blocked = history_.any_line(bin, bins_, least, [&](std::int32_t across) {
      // With the segments that lead to it from the line before it.
      return sight_.is_blocked_between(at, over_columns_ ? line.number : i,
                                       over_columns_ ? i : line.number, over_columns_, across,
                                       across - outwards_);
    });
    if (blocked) return Seen::kHidden;
  }
  const auto b = static_cast<std::size_t>(bin);
  if (all_void_[b]) return Seen::kUnknown;
  return some_void_[b] ? judge(line.number, i) : Seen::kVisible;
}

/// The part's own samples of a line, as indices [first, end). Only near the part's ends does it
/// take more than t to tell.
std::pair<std::int32_t, std::int32_t> PartSweep::Run::own_range(const Line& line) const {
  const auto bins = static_cast<float>(bins_);
  const auto t = [&](std::int32_t k) { return line.t[static_cast<std::size_t>(k)]; };
  const auto own = [&](std::int32_t k) {
    return is_target(line.number, line.first + k) &&
           ((t(k) >= 1 && t(k) <= bins - 1) ||
            owns(picture(position(line.number, line.first + k))));
  };
  std::int32_t first = 0, end = line.count();
  while (first < end && (t(first) < -1 || !own(first))) ++first;
  while (end > first && (t(end - 1) > bins + 1 || !own(end - 1))) --end;
  return {first, end};
}

void PartSweep::Run::decide(const Line& line, const Line* before) {
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
  // Hidden and visible have the same values in both.
  const auto* sight = reinterpret_cast<const Seen*>(decisions_.data());
  Seen* to = tile_ ? tile_->column(line.number) +
                         ColumnTile::kStride * static_cast<std::size_t>(line.first)
                   : &result_[result_index(line.number, 0)] + line.first;
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

float PartSweep::Run::climb_all(std::int32_t line, std::int32_t i) {
  ++counts_.traced_whole;
  return over_columns_ ? least_height_m(sight_, stands_, line, i)
                       : least_height_m(sight_, stands_, i, line);
}

/// Keeps in mind which line reaches highest in each bin. Requires its bounds in high_.
void PartSweep::Run::mark_top(std::int32_t line, const float* up) {
  if (!least_m_.empty())
    take_top(static_cast<std::size_t>(bins_), up, high_.data(), line, top_.data());
}

/// Forwards and sideways of a sample of the line that was filled last.
std::pair<double, double> PartSweep::Run::place_of(const Line& line, std::int32_t k) const {
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
bool PartSweep::Run::is_enough(double z_m, const Line& line, std::int32_t k, float enough_m) const {
  // Within a scene a height in the frame is never twice that on the normal.
  const std::int32_t i = line.first + k;
  const double ground_m =
      apart_ ? stand(line.number, i).z_m : line.z_m[static_cast<std::size_t>(k)];
  const double rise_m = z_m - ground_m;
  if (rise_m <= 0 || rise_m < enough_m) return false;
  if (rise_m >= 2.0 * enough_m) return true;
  return stands_.height_above_ground_m(over_columns_ ? line.number : i,
                                       over_columns_ ? i : line.number, z_m) >= enough_m;
}

/// Does the ground block the sight of a sample? Decided exactly, as decide_seen does.
bool PartSweep::Run::is_blocked_in_bin(const Line& line, std::int32_t k, std::size_t bin, float s) {
  const std::int32_t i = line.first + k;
  const Position at = stand(line.number, i);
  const float least_s = s - 4 * kSlopeMargin * std::abs(s);
  return history_.any_line(
      static_cast<std::int32_t>(bin), bins_, least_s, [&](std::int32_t across) {
        return sight_.is_blocked_between(at, over_columns_ ? line.number : i,
                                         over_columns_ ? i : line.number, over_columns_, across,
                                         across - outwards_);
      });
}

/// The highest that any line makes it: first the line that reaches highest in the bin, then those
/// that may still be above the highest so far.
float PartSweep::Run::climb_in_bin(const Line& line, std::int32_t k, std::size_t bin,
                                   float enough_m) {
  ++counts_.traced_part;
  const std::int32_t i = line.first + k;
  const auto [forwards, sideways] = place_of(line, k);
  const double eye_z_m = sight_.eye().z_m;
  const RayClimb ray(grid_, frame_, eye_z_m, over_columns_, outwards_, forwards, sideways);
  const auto below = [](float s) { return s - 4 * kSlopeMargin * std::abs(s); };
  float least_s = below(low_[bin]);
  double highest = -std::numeric_limits<double>::infinity();
  const auto climb_over = [&](std::int32_t across) {
    const double s =
        std::abs(across - eye_line_) > RayClimb::kLeastLines
            ? ray.slope_at(across)
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
  history_.any_line(static_cast<std::int32_t>(bin), bins_, least_s, [&](std::int32_t across) {
    if (across != top) climb_over(across);
    return false;
  });
  const double ground_m = stand(line.number, i).z_m;
  const double z_m = eye_z_m + highest * forwards;
  if (z_m < ground_m - kClimbErrorM) return 0;
  if (z_m < ground_m + kClimbErrorM &&
      !is_blocked_in_bin(line, k, bin, static_cast<float>((ground_m - eye_z_m) / forwards)))
    return 0;
  return height_up_to(stands_, std::max(z_m, ground_m) + kClimbErrorM,
                      over_columns_ ? line.number : i, over_columns_ ? i : line.number);
}

/// Least height over a sample of a line; NaN where that is not known, or where it cannot be less
/// than enough_m.
float PartSweep::Run::climb_to(const Line& line, const Line* before, std::int32_t k,
                               float enough_m) {
  const auto n = static_cast<std::size_t>(k);
  const std::int32_t i = line.first + k;
  const auto bin =
      static_cast<std::size_t>(std::clamp(line.t[n], 0.0F, static_cast<float>(bins_ - 1)));
  if (!bounds_hold_ || stands_aside(line.number, i)) return climb_all(line.number, i);
  if (all_void_[bin]) return std::numeric_limits<float>::quiet_NaN();
  if (so_far_) {
    const float s = low_[bin] - kSlopeMargin * std::abs(low_[bin]);
    if (is_enough(sight_.eye().z_m + s * place_of(line, k).first, line, k, enough_m))
      return std::numeric_limits<float>::quiet_NaN();
  }
  if (some_void_[bin] || (before && crosses_before(*before, i, line.t[n])))
    return climb_all(line.number, i);
  float s = line.s[n];
  if (apart_) {
    const Position at = stand(line.number, i);
    s = static_cast<float>((at.z_m - sight_.eye().z_m) / place_of(line, k).first);
  }
  if (s >= high_[bin] + kSlopeMargin * std::abs(s)) return 0;
  return climb_in_bin(line, k, bin, enough_m);
}

/// Writes a height, or, where only lower ones are wanted, sees to it that it is one.
void PartSweep::Run::offer(std::int32_t line, std::int32_t i, float height_m) {
  float& to = least_m_[result_index(line, i)];
  if (!so_far_) {
    to = height_m;
    return;
  }
  if (to <= height_m || !std::isfinite(height_m)) return;
  if (so_far_->limit)
    height_m = so_far_->limit(over_columns_ ? line : i, over_columns_ ? i : line, height_m);
  if (height_m < to || (std::isnan(to) && !std::isnan(height_m))) to = height_m;
}

/// decide, for heights: what is not seen on the ground climbs until it is.
void PartSweep::Run::climb(const Line& line, const Line* before) {
  const auto [first, end] = own_range(line);
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (std::int32_t k = first; k < end; ++k) {
    if (line.is_void[static_cast<std::size_t>(k)]) continue;
    ++counts_.targets;
    const std::int32_t i = line.first + k;
    float enough_m = kInfinity;
    if (so_far_) {
      const float so_far_m = least_m_[result_index(line.number, i)];
      if (so_far_m <= 0) continue;
      if (!std::isnan(so_far_m)) enough_m = so_far_m;
    }
    const float height_m = climb_to(line, before, k, enough_m);
    if (!so_far_ || !std::isnan(height_m)) offer(line.number, i, height_m);
  }
}

void PartSweep::Run::add_whole(const Line& line, const Line* before) {
  const auto bins = static_cast<std::size_t>(bins_);
  const std::size_t n = line.t.size();
  this_s_.resize(bins + 1);
  next_s_.resize(bins + 1);
  edge_low_.resize(bins + 1);
  edge_high_.resize(bins + 1);
  edge_before_.resize(bins + 1);
  edge_bounds(bins + 1, line.place.data(), line.s.data(), line.steep.data(), per_rise(),
              kSlopeMargin, edge_before_.data(), this_s_.data(), next_s_.data(), edge_low_.data(),
              edge_high_.data());
  const float* place_before = line.place.data();
  const float* higher = line.s.data();
  if (before) {
    const std::int32_t shift = before->first - line.first;
    place_before_.resize(bins + 1);
    shift_places(bins + 1, before->place.data(), static_cast<float>(static_cast<double>(shift)),
                 place_before_.data());
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
  float* up = history_.begin_line(line.number, bins_);
  if (!bin_bounds(bins, line.place.data(), place_before, place_slack, higher, pairs_.data(),
                  edge_before_.data(), this_s_.data(), next_s_.data(), edge_low_.data(),
                  edge_high_.data(), up, low_.data(), high_.data()))
    bounds_hold_ = false;
  mark_top(line.number, up);
  history_.end_line();
}

/// Any line: with void samples, or where the grid ends within the part.
void PartSweep::Run::add_in_pieces(const Line& line, const Line* before) {
  float* up = history_.begin_line(line.number, bins_);
  std::fill(up, up + bins_, kNoGround);
  if (before) raise_segments(*before, line, up);
  raise_line(line, up);
  if (line.has_void) mark_void(line);
  take_maximum(static_cast<std::size_t>(bins_), up, high_.data());
  mark_top(line.number, up);
  history_.end_line();
}

/// The segments between the last line and this one: each is taken as high as its higher end in
/// every bin that it touches.
void PartSweep::Run::raise_segments(const Line& from, const Line& to, float* up) {
  const auto bins = static_cast<float>(bins_);
  const std::int32_t first = std::max(from.first, to.first);
  const std::int32_t end = std::min(from.first + from.count(), to.first + to.count());
  for (std::int32_t i = first; i < end; ++i) {
    const auto a = static_cast<std::size_t>(i - from.first),
               b = static_cast<std::size_t>(i - to.first);
    const float low = std::min(from.t[a], to.t[b]) - slack();
    const float high = std::max(from.t[a], to.t[b]) + slack();
    if (high < 0 || low >= bins) continue;
    const bool is_void = from.is_void[a] || to.is_void[b];
    const float upper = std::max(from.s[a], to.s[b]);
    const auto first_bin = static_cast<std::int32_t>(std::max(low, 0.0F));
    const auto last_bin = static_cast<std::int32_t>(std::min(high, bins - 1));
    for (std::int32_t bin = first_bin; bin <= last_bin; ++bin) {
      if (is_void) {
        some_void_[static_cast<std::size_t>(bin)] = 1;
      } else {
        up[bin] = std::max(up[bin], upper);
      }
    }
  }
  // A segment that reaches into the part from a sample that was not taken would be missed.
  for (std::int32_t k = 0; k < to.count(); ++k) {
    const std::int32_t i = to.first + k;
    const float t = to.t[static_cast<std::size_t>(k)];
    if ((i < first || i >= end) && t > -1 && t < bins + 1) bounds_hold_ = false;
  }
}

/// Bounds of a line's picture in each bin: at the bin's two edges and at the samples between.
void PartSweep::Run::raise_line(const Line& line, float* up) {
  const std::int32_t n = line.count();
  const auto edges = static_cast<std::size_t>(bins_) + 1;
  edge_low_.resize(edges);
  edge_high_.resize(edges);
  edge_before_.resize(edges);
  const auto is_void = [&](std::int32_t k) { return line.is_void[static_cast<std::size_t>(k)]; };
  std::int32_t j = -1;
  for (std::size_t e = 0; e < edges; ++e) {
    const auto at = static_cast<float>(static_cast<std::int32_t>(e));
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
    low_[b] = std::max(low_[b], low);
    up[b] = std::max(up[b], high);
  }
}

void PartSweep::Run::mark_void(const Line& line) {
  std::int32_t j = 0;
  const auto t = [&](std::int32_t k) { return line.t[static_cast<std::size_t>(k)]; };
  const auto is_void = [&](std::int32_t k) { return line.is_void[static_cast<std::size_t>(k)]; };
  for (std::int32_t bin = 0; bin < bins_; ++bin) {
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

void PartSweep::Run::sweep_line(std::int32_t line, bool is_first) {
  // One to two bins a sample, everywhere.
  const double run = std::abs(line - eye_line_);
  const std::int32_t bins_before = bins_;
  while (bins_per_tangent() < run) halve_bins();
  if (bins_ != bins_before && !is_first && before_->is_whole) find_edges(*before_);
  fill(*line_, line);
  const Line* before = is_first ? nullptr : before_;
  if (least_m_.empty())
    decide(*line_, before);
  else
    climb(*line_, before);
  if (line_->is_whole && (!before || before->is_whole))
    add_whole(*line_, before);
  else
    add_in_pieces(*line_, before);
  std::swap(line_, before_);
}

PartSweep::PartSweep(const GridSight& sight, const GroundGrid& stands, const SweepGround& ground,
                     double target_height_m, const SampleWindow& window)
    : sight_(sight),
      stands_(stands),
      ground_(ground),
      target_height_m_(target_height_m),
      window_(window) {}

SweepCounts PartSweep::run(const SweepPart& part, std::span<Seen> result) {
  return Run(*this, part, result, {}).run();
}

SweepCounts PartSweep::run_heights(const SweepPart& part, std::span<float> least_m) {
  return Run(*this, part, {}, least_m).run();
}

SweepCounts PartSweep::lower_heights(const SweepPart& part, std::span<float> least_m,
                                     const LeastSoFar& so_far) {
  return Run(*this, part, {}, least_m, &so_far).run();
}

namespace {

constexpr std::size_t kWedges = 4;
constexpr auto kParts = static_cast<std::size_t>(SweepPart::kPartsInWedge);

template <typename Value>
void fill_window(const GroundGrid& grid, const SampleWindow& window, Value value,
                 std::span<Value> result) {
  parallel_for(
      static_cast<std::size_t>(window.last_row - window.first_row + 1), [&](std::size_t r) {
        const auto begin = result.begin() + static_cast<std::ptrdiff_t>(
                                                r + static_cast<std::size_t>(window.first_row)) *
                                                grid.columns();
        std::fill(begin + window.first_column, begin + window.last_column + 1, value);
      });
}

/// Runs all parts on all threads. @param run  (part) -> counts
template <typename RunPart>
SweepCounts for_parts(const RunPart& run) {
  std::array<SweepCounts, kWedges * kParts> counts;
  parallel_for(counts.size(), [&](std::size_t i) {
    counts[i] = run(SweepPart{static_cast<SweepPart::Wedge>(i % kWedges),
                              static_cast<std::int32_t>(i / kWedges)});
  });
  SweepCounts sum;
  for (const SweepCounts& of_part : counts) sum.add(of_part);
  return sum;
}

/// The known sample of the window that lies under the eye, which belongs to no part.
struct Under {
  std::int32_t column = 0, row = 0;
};
std::optional<Under> sample_under(const GridSight& sight, const SampleWindow& window) {
  const GroundGrid& grid = sight.grid();
  const auto near = [](double at, std::int32_t count) {
    return static_cast<std::int32_t>(std::lround(std::clamp(at, 0.0, count - 1.0)));
  };
  const Under under{near(sight.frame().eye_column, grid.columns()),
                    near(sight.frame().eye_row, grid.rows())};
  const Position p = grid.at(under.column, under.row);
  if (sight.frame().across(p.x_m, p.y_m) != 0 || sight.frame().down(p.x_m, p.y_m) != 0 ||
      !window.contains(under.column, under.row) || !grid.is_known(under.column, under.row))
    return {};
  return under;
}

std::size_t index_in(const GroundGrid& grid, const Under& under) {
  return static_cast<std::size_t>(under.row) * static_cast<std::size_t>(grid.columns()) +
         static_cast<std::size_t>(under.column);
}

}  // namespace

SweepCounts sweep_viewshed(const GroundGrid& grid, const Position& eye, double target_height_m,
                           const SampleWindow& window, std::span<Seen> result,
                           const GroundGrid* stands) {
  assert(result.size() ==
         static_cast<std::size_t>(grid.columns()) * static_cast<std::size_t>(grid.rows()));
  if (window.last_column < window.first_column || window.last_row < window.first_row) return {};
  const GridSight sight(grid, eye);
  // On grounds of their own targets stand off the grid's lines, however little they are raised.
  const SweepGround ground(grid, sight.frame(), stands && stands != &grid ? 1 : target_height_m,
                           window);
  fill_window(grid, window, Seen::kUnknown, result);
  SweepCounts counts = for_parts([&](const SweepPart& part) {
    return PartSweep(sight, stands ? *stands : grid, ground, target_height_m, window)
        .run(part, result);
  });
  if (const auto under = sample_under(sight, window)) {
    result[index_in(grid, *under)] =
        sight.judge((stands ? *stands : grid).raised(under->column, under->row, target_height_m),
                    under->column, under->row);
    ++counts.targets;
    ++counts.traced_whole;
  }
  return counts;
}

SweepCounts sweep_heights(const GroundGrid& grid, const Position& eye, const SampleWindow& window,
                          std::span<float> least_m, const GroundGrid* stands) {
  assert(least_m.size() ==
         static_cast<std::size_t>(grid.columns()) * static_cast<std::size_t>(grid.rows()));
  if (window.last_column < window.first_column || window.last_row < window.first_row) return {};
  const GridSight sight(grid, eye);
  const SweepGround ground(grid, sight.frame(), 0, window);
  fill_window(grid, window, std::numeric_limits<float>::quiet_NaN(), least_m);
  SweepCounts counts = for_parts([&](const SweepPart& part) {
    return PartSweep(sight, stands ? *stands : grid, ground, 0, window).run_heights(part, least_m);
  });
  if (const auto under = sample_under(sight, window)) {
    least_m[index_in(grid, *under)] =
        least_height_m(sight, stands ? *stands : grid, under->column, under->row);
    ++counts.targets;
  }
  return counts;
}

SweepCounts lower_heights(const GroundGrid& grid, const Position& eye, const SampleWindow& window,
                          const HeightLimit& limit, std::span<float> least_m,
                          const GroundGrid* stands) {
  assert(least_m.size() ==
         static_cast<std::size_t>(grid.columns()) * static_cast<std::size_t>(grid.rows()));
  if (window.last_column < window.first_column || window.last_row < window.first_row) return {};
  const GridSight sight(grid, eye);
  const SweepGround ground(grid, sight.frame(), 0, window);
  const LeastSoFar so_far{limit};
  SweepCounts counts = for_parts([&](const SweepPart& part) {
    return PartSweep(sight, stands ? *stands : grid, ground, 0, window)
        .lower_heights(part, least_m, so_far);
  });
  if (const auto under = sample_under(sight, window)) {
    float& to = least_m[index_in(grid, *under)];
    const float found_m = least_height_m(sight, stands ? *stands : grid, under->column, under->row);
    if (std::isfinite(found_m))
      to = std::fmin(to, limit ? limit(under->column, under->row, found_m) : found_m);
    ++counts.targets;
  }
  return counts;
}

}  // namespace scarp
