#include "core/viewshed/sweep_run.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geodesy/predicates.h"
#include "core/memory/large_array.h"

namespace scarp {
namespace {

constexpr std::int32_t kFirstBins = 8;

/// Bins that are passed over, or not, together.
constexpr std::int32_t kGroupBins = 64;

constexpr std::int32_t kLinesInSlab = GroundTops::kSide;

std::int32_t groups_of(std::int32_t bins) {
  return (bins + kGroupBins - 1) / kGroupBins;
}

}  // namespace

SweepRun::SweepRun(const SweepGround& ground, const SweepPart& part, const SweepOutput& output)
    : ground_(ground),
      sight_(ground.sight),
      grid_(ground.blocks),
      frame_(sight_.frame()),
      output_(output),
      part_(part),
      bins_(kFirstBins),
      low_(kFirstBins, kNoGround),
      high_(kFirstBins, kNoGround),
      top_(kFirstBins, -1),
      some_void_(kFirstBins, 0),
      all_void_(kFirstBins, 0),
      bends_(2, 0) {
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

SweepCounts SweepRun::run() {
  const auto at_least = [&](double cells) {
    const double from = eye_line_ + outwards_ * cells;
    return static_cast<std::int64_t>(outwards_ > 0 ? std::ceil(from) : std::floor(from));
  };
  // Lines behind the eye begin segments that reach in front of it.
  const std::int64_t near_begin = at_least(-kNearCells);
  const std::int64_t far_begin = at_least(kNearCells);
  // Nothing beyond a target's line can block it.
  const std::int64_t border =
      outwards_ > 0 ? (over_columns_ ? ground_.window.last_column : ground_.window.last_row) + 1
                    : (over_columns_ ? ground_.window.first_column : ground_.window.first_row) - 1;
  const auto inside = [&](std::int64_t line) { return line >= 0 && line < lines_; };
  for (std::int64_t line = near_begin; line != far_begin + outwards_; line += outwards_)
    if (inside(line)) sweep_near(static_cast<std::int32_t>(line), line != far_begin);
  std::int64_t begin = far_begin;
  if (!inside(begin))
    begin = outwards_ > 0 ? std::max<std::int64_t>(begin, 0)
                          : std::min<std::int64_t>(begin, lines_ - 1);
  if (!inside(begin)) return counts_;
  first_line_ = static_cast<std::int32_t>(begin);
  if (over_columns_ && output_.least_m.empty()) tile_.emplace(samples_);
  for (std::int64_t at = begin; (border - at) * outwards_ > 0;) {
    const auto line = static_cast<std::int32_t>(at);
    // One to two bins a sample, everywhere.
    const auto run_of = [&](std::int64_t of) {
      return std::abs(static_cast<double>(of) - eye_line_);
    };
    while (bins_per_tangent() < run_of(line)) halve_bins();
    std::int64_t end = at + outwards_;
    while (end != border && end / kLinesInSlab == at / kLinesInSlab &&
           run_of(end) <= bins_per_tangent())
      end += outwards_;
    sweep_slab(line, static_cast<std::int32_t>((end - at) * outwards_));
    const auto last = static_cast<std::int32_t>(end - outwards_);
    if (tile_ && (end == border || ColumnTile::is_last_in_tile(last, outwards_)))
      tile_->flush(last, grid_.columns(), output_.result);
    relieve_large_memory();
    at = end;
  }
  return counts_;
}

SweepRun::Picture SweepRun::picture(const Position& p) const {
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
bool SweepRun::owns(const Picture& p) const {
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
void SweepRun::sweep_near(std::int32_t line, bool judge_targets) {
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
  history_.begin_slab(line, outwards_, 1, bins_);
  float* up = history_.line(0);
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
      if (output_.least_m.empty())
        output_.result[result_index(line, i)] = judge(line, i);
      else
        offer(line, i, climb_all(line, i));
    }
  }
  std::copy(edge_high_.begin(), edge_high_.end(), up);
  history_.end_line(0, 0, bins_);
  for (std::size_t b = 0; b < edge_high_.size(); ++b) {
    low_[b] = std::max(low_[b], line_low_[b]);
    high_[b] = std::max(high_[b], edge_high_[b]);
  }
  mark_top(line, 0, bins_, up);
}

void SweepRun::add_near_segment(const Position& u, bool u_known, const Position& v, bool v_known,
                                bool along_line) {
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

void SweepRun::halve_bins() {
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
  if (static_cast<std::size_t>(groups_of(bins_)) < bends_.size()) return;
  std::vector<double> bends(2 * bends_.size() - 1);
  for (std::size_t e = 0; e < bends.size(); ++e)
    bends[e] = (bends_[e / 2] + bends_[(e + 1) / 2]) / 2;
  bends_ = std::move(bends);
}

void SweepRun::sweep_slab(std::int32_t first, std::int32_t count) {
  history_.begin_slab(first, outwards_, count, bins_);
  choose_strips(first, first + outwards_ * (count - 1));
  for (const Strip& strip : strips_) sweep_strip(strip, first, count);
}

void SweepRun::sweep_strip(const Strip& strip, std::int32_t first, std::int32_t count) {
  strip_ = strip;
  const Line* before = nullptr;
  if (first != first_line_) {
    fill(*before_, first - outwards_);
    before = before_;
  }
  for (std::int32_t place = 0; place < count; ++place) {
    fill(*line_, first + outwards_ * place);
    line_->place = place;
    if (output_.least_m.empty())
      decide(*line_, before);
    else
      climb(*line_, before);
    add(*line_, before);
    std::swap(line_, before_);
    before = before_;
  }
  bends_[static_cast<std::size_t>(strip_.first_bin / kGroupBins)] = strip_.low_bend;
  bends_[static_cast<std::size_t>(groups_of(strip_.end_bin))] = strip_.high_bend;
}

/// Where an edge of bins meets a line. @param bend[in, out]  by how much that is beside a straight
/// grid's place, in samples; a good guess saves time
SweepRun::EdgePlace SweepRun::place_edge(std::int32_t line, std::int32_t bin, double& bend) const {
  const double tangent = low_tangent_ + bin / bins_per_tangent();
  const double straight = eye_sample_ + tangent * std::abs(line - eye_line_);
  if (!ground_.across_of_column.empty()) {
    const auto& outwards = over_columns_ ? ground_.across_of_column : ground_.down_of_row;
    return {straight, outwards_ * outwards[static_cast<std::size_t>(line)]};
  }
  constexpr int kSteps = 8;
  constexpr double kNear = 2;
  for (int step = 0; step < kSteps; ++step) {
    const double guess = std::clamp(std::floor(straight + bend + 0.5), 0.0, samples_ - 1.0);
    const auto i = static_cast<std::int32_t>(guess);
    if (!is_known(line, i)) break;
    const Picture p = picture(position(line, i));
    const double beside = p.sideways - tangent * p.forwards;
    const double found = guess - beside;
    bend = found - straight;
    const bool outside = (i == 0 && found < 0) || (i == samples_ - 1 && found > i);
    if (std::abs(beside) <= kNear || outside) return {found, p.forwards};
  }
  return {std::numeric_limits<double>::quiet_NaN(), 0};
}

/// Sets strips_ to the groups of bins in which something may be seen, or rise above the horizon,
/// between two lines in one row of tiles.
void SweepRun::choose_strips(std::int32_t first, std::int32_t last) {
  strips_.clear();
  const std::int32_t groups = groups_of(bins_);
  if (!ground_.tops || !bounds_hold_) {
    strips_.push_back({0, bins_, static_cast<std::int32_t>(std::floor(bends_.front())),
                       static_cast<std::int32_t>(std::ceil(bends_.back()))});
    return;
  }
  // By what place_edge errs, by what a line is beside the one before, and room for targets aside.
  const double room = 4 + std::ceil(ground_.uneven_samples + ground_.most_aside_samples);
  struct Edge {
    EdgePlace first, last;
    double bend;
  };
  const auto edge_at = [&](std::int32_t group) {
    double& bend = bends_[static_cast<std::size_t>(group)];
    const std::int32_t bin = std::min(bins_, group * kGroupBins);
    const EdgePlace at_last = place_edge(last, bin, bend);
    double other = bend;
    const EdgePlace at_first = place_edge(first, bin, other);
    return Edge{at_first, at_last, bend};
  };
  bool joins = false;
  Edge low = edge_at(0);
  for (std::int32_t group = 0; group < groups; ++group) {
    const Edge high = edge_at(group + 1);
    const double begin = std::min(low.first.sample, low.last.sample) - room;
    const double end = std::max(high.first.sample, high.last.sample) + room;
    const auto [least, most] = std::minmax(
        {low.first.forwards, low.last.forwards, high.first.forwards, high.last.forwards});
    const std::int32_t first_bin = group * kGroupBins;
    const std::int32_t end_bin = std::min(bins_, first_bin + kGroupBins);
    // False where an edge was not found as well.
    const bool crosses = begin <= samples_ - 1 && end >= 0;
    const bool placed = !std::isnan(begin + end + low.first.sample + high.first.sample);
    const bool over =
        placed &&
        (!crosses ||
         is_passed_over(first, last, first_bin, end_bin,
                        static_cast<std::int32_t>(std::max(begin, 0.0)),
                        static_cast<std::int32_t>(std::min(end, samples_ - 1.0)), least, most));
    // What the border of the grid cuts is swept in pieces, and so by itself.
    const bool whole = placed && begin > kBeyondStrip && end < samples_ - 1 - kBeyondStrip;
    if (!over && joins && whole) {
      strips_.back().end_bin = end_bin;
      strips_.back().high_bend = static_cast<std::int32_t>(std::ceil(high.bend));
    } else if (!over) {
      strips_.push_back({first_bin, end_bin, static_cast<std::int32_t>(std::floor(low.bend)),
                         static_cast<std::int32_t>(std::ceil(high.bend))});
    }
    joins = !over && whole;
    low = high;
  }
}

/// Does everything that stands on these samples lie under the horizon of all these bins?
bool SweepRun::is_passed_over(std::int32_t first_line, std::int32_t last_line,
                              std::int32_t first_bin, std::int32_t end_bin,
                              std::int32_t first_sample, std::int32_t last_sample,
                              double least_forwards, double most_forwards) const {
  // A line's width around: what bends between the edges, and the line before.
  const double least = least_forwards - 2, most = most_forwards + 2;
  if (!(least > kNearCells)) return false;
  const std::int32_t tile_line = std::min(first_line, last_line) / GroundTops::kSide;
  double top_m = -std::numeric_limits<double>::infinity();
  for (std::int32_t tile = first_sample / GroundTops::kSide;
       tile <= last_sample / GroundTops::kSide; ++tile) {
    const std::int32_t across = over_columns_ ? tile_line : tile;
    const std::int32_t down = over_columns_ ? tile : tile_line;
    const std::int32_t top = ground_.tops->of_tile(across, down);
    if (top == GroundTops::kUnknown) return false;
    top_m = std::max(top_m, top * kLatticeStepM + ground_.most_raise_m);
    if (output_.lowers()) top_m = std::max(top_m, ground_.least_tops->of_tile(across, down));
  }
  const double rise_m = top_m - sight_.eye().z_m;
  const double slope = rise_m / (rise_m > 0 ? least : most);
  const double low = *std::min_element(low_.begin() + first_bin, low_.begin() + end_bin);
  return slope + 4 * kSlopeMargin * std::abs(slope) < low - 4 * kSlopeMargin * std::abs(low);
}

}  // namespace scarp
