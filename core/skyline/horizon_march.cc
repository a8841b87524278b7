#include "core/skyline/horizon_march.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "core/skyline/crossing_kernels.h"
#include "core/threads/for_each_target.h"

namespace scarp {
namespace {

/// Lines that every ray crosses one by one; then strips take over.
constexpr std::int32_t kNearLines = 16;

/// Strips are asked first as deep as this share of their distance.
constexpr std::int32_t kDistanceInStrips = 2;

/// Where nothing is known of the neighbours' horizons, lines this share of their distance apart are
/// crossed beforehand.
constexpr std::int32_t kDistanceInSteps = 8;

/// Of the nearest lines the errors of crossings are measured; farther ones take the greatest that
/// the steepest ground of all makes possible, where that is no more than this, as a slope.
constexpr std::int32_t kMeasuredLines = 4;
constexpr double kCheapError = 1e-4;

constexpr unsigned kAllGroups = (1U << kGroups) - 1;

/// Places this near to a sample are looked at with both of its segments, lanes.
constexpr double kNearSample = 1e-6;

/// One bundle of rays on its way.
class BundleMarch {
 public:
  BundleMarch(const MarchGround& ground, const RayFan& fan, const MarchTile& tile,
              const MarchSearch& search)
      : ground_(ground),
        fan_(fan),
        tile_(tile),
        search_(search),
        exact_(fan.slack_fixed == 0 && fan.slack_rate == 0),
        steps_(fan.place.size()),
        most_along_(most_along()),
        fans_(fan.turn.per_lane != 0) {}

  /// Lines of cells that share the places of their crossings: so many that these are off by
  /// kStripeSlack at most, or kStripeSlackBesideVoid.
  std::int32_t stripe_lines() const {
    const double change = std::abs(fan_.turn.per_line);
    const double slack = ground_.has_void() ? kStripeSlackBesideVoid : kStripeSlack;
    return change * kMostStripeLines <= slack
               ? kMostStripeLines
               : std::max(1, static_cast<std::int32_t>(slack / change));
  }

  /// Relative error of the runs of the crossings so far in the stripe.
  double drift() const { return drift_; }

  /// Bound of the error of crossings that were not measured so far in the bundle, as a slope.
  double least_error() const { return std::max(least_error_, stripe_error_); }

  /// Begins a stripe of bundles, one above the other.
  void begin_stripe(std::int32_t lane, std::int32_t first_line, std::int32_t lines) {
    if (lane != lane_ || stripe_ == 0) {
      knows_strips_ = false;
      productive_.clear();
    }
    lane_ = lane;
    const double p = lane - tile_.first_lane - (tile_.lanes - 1) / 2.0;
    const double q = first_line + (lines - 1) / 2.0 - tile_.first_line - (tile_.lines - 1) / 2.0;
    turn_ = fan_.turn.at(p, q);
    stripe_slack_ = exact_ ? 0 : std::abs(fan_.turn.per_line) * (lines - 1) / 2;
    ++stripe_;
    drift_ = 0;
    first_line_ = first_line;
    stripe_error_ = 0;
    sure_.clear();
    at_samples_.clear();
    samples_end_.assign(1, 0);
    sure_end_.assign(1, 0);
    between_end_.assign(1, 0);
    slack_up_to_.assign(1, 0);
    unsure_.clear();
  }

  /// Requires rays with eyes, from the stripe's first lane on.
  void run(std::int32_t line, RayBundle& rays) {
    line_ = line;
    rays_ = &rays;
    reach_ = std::min(fan_.reach(), fan_.line_step > 0 ? ground_.lines() - 1 - line : line);
    if (reach_ < 1) return;
    notes_void_ = ground_.has_void();
    const std::int32_t near = last_near_line();
    least_error_ = 0;
    cross_lines(1, near, kAllGroups);
    crossed_.clear();
    if (knows_strips_)
      cross_productive(near);
    else
      cross_some(near + 1);
    knows_strips_ = true;
    list_spans(near + 1);
    if (notes_void_)
      for (const Span& span : spans_) search_span(span, kAllGroups);
    else
      search_spans();
  }

 private:
  /// Lines [first, last], counted from the rays' begins, that a strip holds; rays enter it with the
  /// first.
  struct Span {
    int level;
    std::int32_t strip, first, last;
  };
  /// A strip of the least level, and groups of the bundle.
  struct StripGroups {
    std::int32_t strip;
    unsigned groups;
  };

  /// Lanes by which any ray of the tile moves from a line to the next at most.
  double most_along() const {
    double most = 0;
    for (std::size_t k = 1; k < fan_.place.size(); ++k)
      most = std::max(most, std::abs(fan_.place[k] - fan_.place[k - 1]));
    return most + std::abs(fan_.turn.middle) + std::abs(fan_.turn.per_lane) * tile_.lanes +
           std::abs(fan_.turn.per_line) * tile_.lines;
  }

  std::int32_t line_at(std::int32_t k) const { return line_ + fan_.line_step * k; }
  /// Lanes from the begin of the bundle's first ray at the k-th line, and from ray to ray.
  double place(std::int32_t k) const { return fan_.place[static_cast<std::size_t>(k)] + k * turn_; }
  double slack(std::int32_t k) const { return fan_.slack(k) + k * stripe_slack_; }
  double place_step(std::int32_t k) const { return k * fan_.turn.per_lane; }
  double inverse_run(std::int32_t k) const { return fan_.inverse_run[static_cast<std::size_t>(k)]; }
  /// Samples of a line by lane offset from the bundle's first ray.
  const float* samples(std::int32_t k, std::int32_t offset) const {
    return ground_.line(line_at(k)) + lane_ + offset;
  }
  bool is_off_grid(std::int32_t offset) const {
    return lane_ + offset + kBundle < 0 || lane_ + offset > ground_.lanes() - 1;
  }

  std::int32_t last_near_line() const {
    std::int32_t k = std::min(kNearLines, reach_);
    while (k < reach_ && !begins_strip(k + 1, MarchGround::kLeastLevel)) ++k;
    return k;
  }
  bool begins_strip(std::int32_t k, int level) const {
    const std::int32_t line = line_at(k) + (fan_.line_step > 0 ? 0 : 1);
    return (line & ((1 << level) - 1)) == 0;
  }

  /// Makes lists of the crossings up to the k-th line that all rays of the stripe have alike, but
  /// for the lines' numbers: between the lines before and it, then with it.
  void list_crossings(std::int32_t last) {
    for (auto k = static_cast<std::int32_t>(sure_end_.size()); k <= last; ++k) {
      const Step& step = step_at(k);
      // The sample may belong to a strip that is not opened.
      if (step.leaves_out) stripe_error_ = kCheapError;
      const std::ptrdiff_t shift = (first_line_ - step.line) * ground_.stride();
      double slack = slack_up_to_.back();
      const auto keep = [&](const Crossing& crossing) {
        if (k > kMeasuredLines) slack = std::max(slack, double{crossing.slack});
        sure_.push_back(crossing);
        sure_.back().a += shift;
        sure_.back().b += shift;
      };
      if (step.is_between_sure) std::for_each_n(step.between.begin(), step.betweens, keep);
      between_end_.push_back(sure_.size());
      if (step.is_at_samples) {
        at_samples_.push_back(step.sample_crossing);
        at_samples_.back().z += shift;
      } else if (step.is_line_sure) {
        keep(step.at_line);
      }
      samples_end_.push_back(at_samples_.size());
      if (!step.is_between_sure || !step.is_line_sure) unsure_.push_back(k);
      sure_end_.push_back(sure_.size());
      slack_up_to_.push_back(slack);
    }
  }

  /// Crosses lines and what lies between them and their neighbours.
  /// @return the groups of which a ray's low bound rose
  unsigned cross_lines(std::int32_t first, std::int32_t last, unsigned groups) {
    raised_ = 0;
    if (notes_void_) {
      cross_in_order(first, last, groups);
      return raised_;
    }
    const std::int32_t after = std::min(last + 1, reach_);
    list_crossings(after);
    const auto index = [](std::int32_t k) { return static_cast<std::size_t>(k); };
    const std::size_t end = after > last ? between_end_[index(after)] : sure_end_[index(last)];
    const std::ptrdiff_t shift = (line_ - first_line_) * ground_.stride();
    std::size_t from = sure_end_[index(first - 1)];
    const auto meet_up_to = [&](std::size_t to, const MeetNotes& notes) {
      raised_ |= meet(&sure_[from], to - from, shift, groups, notes, *rays_);
      from = to;
    };
    if (first <= kMeasuredLines)
      meet_up_to(std::min(end, sure_end_[index(std::min(kMeasuredLines, last))]),
                 {true, search_.measures_distance, fans_});
    meet_up_to(end, notes_for(slack_up_to_[index(after)]));
    cross_samples(samples_end_[index(first - 1)], samples_end_[index(last)], shift, groups);
    for (auto it = std::lower_bound(unsure_.begin(), unsure_.end(), first);
         it != unsure_.end() && *it <= after; ++it) {
      const Step& step = step_at(*it);
      if (!step.is_between_sure) cross_between(*it, groups);
      if (!step.is_line_sure && *it <= last) cross_line(*it, groups);
    }
    flush(groups);
    return raised_;
  }

  /// Of at_samples_.
  void cross_samples(std::size_t from, std::size_t to, std::ptrdiff_t shift, unsigned groups) {
    if (from == to) return;
    for (std::size_t i = from; i < to; ++i)
      least_error_ = std::max(least_error_, double{at_samples_[i].error});
    raised_ |= meet_samples(&at_samples_[from], to - from, shift, groups, *rays_);
  }

  /// What to measure of crossings with slacks up to this.
  MeetNotes notes_for(double slack) {
    const double error = slack * ground_.steepest_m();
    const bool is_cheap = error <= kCheapError;
    if (is_cheap) least_error_ = std::max(least_error_, error);
    return {!is_cheap, search_.measures_distance, fans_};
  }

  /// Strips in which rays of the bundle before this one met their horizons, so that low bounds are
  /// good before strips are asked. The last that raised them come first, so that those which they
  /// surpass are forgotten.
  void cross_productive(std::int32_t near) {
    before_.swap(productive_);
    productive_.clear();
    notes_void_ = false;  // out of order here
    for (auto it = before_.rbegin(); it != before_.rend(); ++it) {
      const std::int32_t line = it->strip * kLeastLines;
      const std::int32_t first = fan_.line_step > 0 ? line - line_ : line_ - line - kLeastLines + 1;
      if (first <= near || first > reach_) continue;
      const std::int32_t last = std::min(first + kLeastLines - 1, reach_);
      const unsigned raised = cross_lines(first, last, it->groups);
      if (raised != 0) productive_.push_back({it->strip, raised});
      // Where there is void, lines are crossed once more in their order.
      if (!ground_.has_void()) crossed_.push_back(*it);
    }
    notes_void_ = ground_.has_void();
  }

  /// Some lines at growing distances, for the same. They are lines that the neighbouring bundles
  /// cross too, where they can be.
  void cross_some(std::int32_t first) {
    notes_void_ = false;  // out of order here
    for (std::int32_t k = first; k <= reach_;) {
      cross_line(k, kAllGroups);
      const std::int32_t step = std::max(k / kDistanceInSteps, 2);
      const int level = std::bit_width(static_cast<unsigned>(step)) - 1;
      k += 1 << level;
      while (k <= reach_ && !begins_strip(k, level)) ++k;
    }
    flush(kAllGroups);
    notes_void_ = ground_.has_void();
  }

  void list_spans(std::int32_t first) {
    spans_.clear();
    int level = MarchGround::kLeastLevel;
    for (std::int32_t k = first; k <= reach_;) {
      while (level < ground_.greatest_level() && (kDistanceInStrips << (level + 1)) <= k &&
             begins_strip(k, level + 1))
        ++level;
      const Span span{level, line_at(k) >> level, k, std::min(k + (1 << level) - 1, reach_)};
      const double at = place(k), end = at + place_step(k) * (kBundle - 1);
      if (std::min(at, end) + lane_ > ground_.lanes() + kSwerveLanes ||
          std::max(at, end) + lane_ + kBundle < -kSwerveLanes)
        return;  // all rays have left the grid
      spans_.push_back(span);
      k = span.last + 1;
    }
  }

  /// All at once. Requires ground without void.
  void search_spans() {
    squares_.clear();
    asked_.clear();
    open_.clear();
    for (const Span& span : spans_) {
      Square square;
      if (!make_square(span, square)) continue;
      if (square.count > 0) {
        squares_.push_back(square);
        asked_.push_back(span);
      } else {
        open_span(span, kAllGroups);
      }
    }
    open_.resize(squares_.size());
    may_block(squares_.data(), squares_.size(), search_.tolerance, kAllGroups, *rays_,
              open_.data());
    for (std::size_t i = 0; i < asked_.size(); ++i)
      if (open_[i] != 0) open_span(asked_[i], open_[i]);
  }

  void search_span(const Span& span, unsigned groups) {
    Square square;
    unsigned open = groups;
    if (!make_square(span, square)) return;
    if (square.count > 0) {
      may_block(&square, 1, search_.tolerance, groups, *rays_, &open);
      if (ground_.has_void()) open |= note_void_of(span, square, groups & ~open);
    }
    if (open != 0) open_span(span, open);
  }

  void open_span(const Span& span, unsigned open) {
    if (span.level == MarchGround::kLeastLevel) {
      for (const StripGroups& crossed : crossed_)
        if (crossed.strip == span.strip) open &= ~crossed.groups;
      if (open == 0) return;
      const unsigned raised = cross_lines(span.first, span.last, open);
      if (raised != 0) productive_.push_back({span.strip, raised});
      return;
    }
    const int level = span.level - 1;
    const std::int32_t middle = std::min(span.first + (1 << level), span.last + 1);
    const Span near{level, line_at(span.first) >> level, span.first, middle - 1};
    if (middle > span.last) {
      search_span(near, open);
      return;
    }
    const Span far{level, line_at(middle) >> level, middle, span.last};
    if (notes_void_) {
      search_span(near, open);
      search_span(far, open);
      return;
    }
    std::array<Square, 2> squares;
    const bool is_near = make_square(near, squares[0]), is_far = make_square(far, squares[1]);
    if (!is_near || !is_far || squares[0].count == 0 || squares[1].count == 0) {
      if (is_near) search_span(near, open);
      if (is_far) search_span(far, open);
      return;
    }
    std::array<unsigned, 2> parts;
    may_block(squares.data(), 2, search_.tolerance, open, *rays_, parts.data());
    if (parts[0] != 0) open_span(near, parts[0]);
    if (parts[1] != 0) open_span(far, parts[1]);
  }

  /// The highest ground that the rays can meet within a span. Count 0: it is not known.
  /// @return false where the rays meet nothing there
  bool make_square(const Span& span, Square& square) const {
    const StripLean& lean = ground_.leaning();
    const bool squares = lean.are_squares;
    const double lean_lanes = squares ? 0 : lean.lanes_per_line * (span.last - span.first);
    // Of the first ray, and of the last, where rays fan.
    const double from = place(span.first), to = place(span.last) - lean_lanes;
    const double fan = fans_ ? place_step(span.first) * (kBundle - 1) : 0;
    const double end_fan = fans_ ? place_step(span.last) * (kBundle - 1) : 0;
    const double half = (1 << span.level) / 2.0;
    // Samples on both sides of a ray, and those between its crossings with this line and the next.
    const double margin =
        std::max(1.0, most_along_) + slack(span.last) + fan_.bulge * half * half + kWindowMargin;
    const double first = std::min(from + std::min(fan, 0.0), to + std::min(end_fan, 0.0)) - margin;
    const double last = std::max(from + std::max(fan, 0.0), to + std::max(end_fan, 0.0)) + margin;
    square.count = 0;
    square.inverse_near = static_cast<float>(inverse_run(span.first));
    square.inverse_far = static_cast<float>(inverse_run(span.last));
    if (lane_ + last + std::max(lean_lanes, 0.0) + kBundle < 0 ||
        lane_ + first + std::min(lean_lanes, 0.0) > ground_.lanes() - 1)
      return false;
    if (!squares && lean.line_step != fan_.line_step) return true;
    const float* highest = ground_.highest(span.level, span.strip);
    const std::int32_t width = ground_.width(span.level);
    const auto after = static_cast<std::int32_t>(std::floor(last)) - width;
    int count = 0;
    for (auto at = static_cast<std::int32_t>(std::floor(first));;) {
      const std::int32_t read = squares ? clamped(at) : at;
      if (count == kMostSquares || read != clamped(read)) return true;
      square.highest[count++] = highest + lane_ + read;
      if (squares ? at >= after : at + width >= last) break;
      at += squares ? width + 1 : width;
    }
    square.count = count;
    return true;
  }

  /// Lane offsets at which a bundle can be read.
  std::int32_t clamped(std::int32_t offset) const {
    return std::clamp(offset, -MarchGround::kPad - lane_,
                      ground_.lanes() + MarchGround::kPad - kBundle - lane_);
  }

  /// Groups, of those that are not opened anyway, that must be because there is void.
  unsigned note_void_of(const Span& span, const Square& square, unsigned groups) {
    unsigned open = 0;
    const std::uint8_t* any_void = ground_.any_void(span.level, span.strip);
    const float* highest = ground_.highest(span.level, span.strip);
    for (int g = 0; g < kGroups; ++g) {
      bool found = false;
      for (int i = 0; i < square.count; ++i)
        for (int ray = g * kGroup; ray < (g + 1) * kGroup; ++ray)
          found |= any_void[square.highest[i] - highest + ray] != 0 && rays_->void_before[ray] <= 0;
      if (found) open |= 1U << g & groups;
    }
    note_ground_behind(square, groups & ~open, *rays_);
    return open;
  }

  /// The same, in the order of the rays.
  void cross_in_order(std::int32_t first, std::int32_t last, unsigned groups) {
    for (std::int32_t k = first; k <= last; ++k) {
      cross_between(k, groups);
      cross_line(k, groups);
    }
    if (last < reach_) cross_between(last + 1, groups);
    flush(groups);
  }

  /// Crossings that all rays of a bundle have for certain, alike for the bundles of a stripe but
  /// for the lines' numbers.
  struct Step {
    std::int32_t stripe = 0;  ///< that it holds for
    bool is_line_sure = false, is_between_sure = false;
    bool leaves_out = false;     ///< what is between lines, because a line's sample stands for it
    bool is_at_samples = false;  ///< of the line, sample_crossing stands for at_line
    std::int32_t line = 0;       ///< of the bundle that it was made for
    int betweens = 0;
    double drift = 0;  ///< relative error of the runs between lines
    Crossing at_line;
    SampleCrossing sample_crossing;
    std::array<Crossing, 2> between;
  };

  Step& step_at(std::int32_t k) {
    Step& step = steps_[static_cast<std::size_t>(k)];
    if (step.stripe == stripe_) return step;
    step.stripe = stripe_;
    step.line = line_;
    step.is_at_samples = make_sample_crossing(k, step);
    step.is_line_sure = step.is_at_samples || make_line(k, step);
    step.betweens = 0;
    step.leaves_out = false;
    step.drift = 0;
    step.is_between_sure = make_between(k, step);
    if (step.is_between_sure) drift_ = std::max(drift_, step.drift);
    return step;
  }
  std::ptrdiff_t shift_of(const Step& step) const { return (line_ - step.line) * ground_.stride(); }

  void cross_line(std::int32_t k, unsigned groups) {
    const Step& step = step_at(k);
    if (step.is_at_samples) {
      SampleCrossing crossing = step.sample_crossing;
      crossing.z += shift_of(step);
      least_error_ = std::max(least_error_, double{crossing.error});
      raised_ |= meet_samples(&crossing, 1, 0, groups, *rays_);
    } else if (step.is_line_sure)
      add(step.at_line, shift_of(step), groups);
    else
      cross_loosely(k, 0, kBundle);
  }

  /// How far from a sample it makes no difference, lanes; 0: nowhere. What rays meet so near to it,
  /// on a line or between lines, is of the sample's height but for an error of no more than
  /// kCheapError, as a slope.
  double sample_reach(std::int32_t k) const {
    if (exact_ || ground_.has_void()) return 0;
    const double least = 4 * slack(k) + 2 * kNearSample;
    const double steepest_m = std::max(ground_.steepest_m(), 1e-3);
    const double most = kCheapError / (2 * steepest_m * inverse_run(k));
    return most < least ? 0 : std::min(most, kMostBeside);
  }
  double sample_error(std::int32_t k, double reach) const {
    return 2 * reach * ground_.steepest_m() * inverse_run(k);
  }

  /// @return false where some ray is not near its sample
  bool make_sample_crossing(std::int32_t k, Step& to) const {
    const double reach = sample_reach(k);
    const double at = place(k), end = at + place_step(k) * (kBundle - 1);
    const double nearest = std::round(at);
    if (std::abs(at - nearest) >= reach || std::abs(end - nearest) >= reach) return false;
    const auto offset = static_cast<std::int32_t>(nearest);
    if (is_off_grid(offset)) return false;
    to.sample_crossing = {samples(k, offset), static_cast<float>(inverse_run(k)),
                          static_cast<float>(sample_error(k, reach))};
    return true;
  }

  /// @return false where some ray is near a sample or in another segment
  bool make_line(std::int32_t k, Step& to) const {
    const double at = place(k), step = place_step(k), slack_lanes = slack(k);
    const double near = exact_ ? 0 : 2 * slack_lanes + kNearSample;
    const double end = at + step * (kBundle - 1);
    const double whole = std::floor(std::min(at, end));
    const auto offset = static_cast<std::int32_t>(whole);
    if (is_off_grid(offset)) return false;
    if (std::min(at, end) - whole < near || std::max(at, end) - whole > 1 - near) return false;
    const float* a = samples(k, offset);
    const bool on_samples = exact_ && at == whole;
    to.at_line = {a,
                  on_samples ? a : a + 1,
                  static_cast<float>(at - whole),
                  static_cast<float>(step),
                  static_cast<float>(inverse_run(k)),
                  0,
                  static_cast<float>(slack_lanes * inverse_run(k))};
    return true;
  }

  /// Rays that meet a line near samples or in several segments.
  void cross_loosely(std::int32_t k, int first_ray, int end_ray) {
    const double step = place_step(k), at = place(k) + step * first_ray;
    const double end = at + step * (end_ray - first_ray - 1);
    const double reach = slack(k) + kNearSample / 4;
    const double base = std::floor(std::min(at, end) - 2 * reach);
    if (std::max(at, end) + 2 * reach > base + 2 && end_ray - first_ray > 1) {
      const int middle = (first_ray + end_ray) / 2;
      cross_loosely(k, first_ray, middle);
      cross_loosely(k, middle, end_ray);
      return;
    }
    const auto offset = static_cast<std::int32_t>(base);
    if (is_off_grid(offset)) return;
    const LooseCrossing crossing{first_ray,
                                 end_ray,
                                 samples(k, offset),
                                 static_cast<float>(place(k) - base),
                                 static_cast<float>(step),
                                 static_cast<float>(reach),
                                 static_cast<float>(inverse_run(k))};
    raised_ |= meet_loosely(crossing, *rays_);
    if (notes_void_) note_void_loosely(crossing, *rays_);
  }

  /// Segments that join a line's samples to those of the line before.
  void cross_between(std::int32_t k, unsigned groups) {
    const Step& step = step_at(k);
    if (!step.is_between_sure) {
      visit_between(k, [&](const BetweenPlace& place) { add_unsurely(k, place, groups); });
      return;
    }
    for (int i = 0; i < step.betweens; ++i)
      add(step.between[static_cast<std::size_t>(i)], shift_of(step), groups);
  }

  /// Where rays cross between the k-th line and the one before: in column `lane_offset`, the first
  /// and the last ray at a share of the way.
  struct BetweenPlace {
    std::int32_t lane_offset;
    double at, end, reach;
    bool anywhere;  ///< the share is not known at all
  };

  template <typename Visit>
  void visit_between(std::int32_t k, const Visit& visit) const {
    const double from = place(k - 1), to = place(k);
    const double last_from = from + place_step(k - 1) * (kBundle - 1);
    const double last_to = to + place_step(k) * (kBundle - 1);
    const double along = to - from, last_along = last_to - last_from;
    constexpr double kParallel = 1e-9;
    const bool is_parallel = std::abs(along) < kParallel || along * last_along <= 0;
    if (is_parallel && exact_) return;
    const auto [low, high] = std::minmax({from, last_from, to, last_to});
    const double slack_lanes = slack(k);
    const auto first = static_cast<std::int32_t>(std::ceil(low - slack_lanes));
    const auto last = static_cast<std::int32_t>(std::floor(high + slack_lanes));
    if (first > last) return;
    const double bent = is_parallel ? 0 : (last_along - along) / along;
    const double reach =
        is_parallel ? 1 : std::min(1.0, slack_lanes / std::abs(along) + bent * bent / 4);
    // In the order of the rays, which void asks for.
    const std::int32_t step = along < 0 ? -1 : 1;
    for (std::int32_t n = 0; n <= last - first; ++n) {
      const std::int32_t j = (step > 0 ? first : last) + n * step;
      // Not the cell's own column at the begin of its ray.
      if ((k == 1 && j == 0) || is_off_grid(j)) continue;
      const BetweenPlace found{j, is_parallel ? 0.5 : (j - from) / along,
                               is_parallel ? 0.5 : (j - last_from) / last_along, reach,
                               reach > kSureReach};
      if (std::max(found.at, found.end) < -reach || std::min(found.at, found.end) > 1 + reach)
        continue;
      visit(found);
    }
  }

  /// @return false where it is not certain that each ray crosses
  bool make_between(std::int32_t k, Step& to) const {
    bool is_sure = true;
    visit_between(k, [&](const BetweenPlace& found) {
      const double near = 2 * found.reach + kNearSample;
      const double least = std::min(found.at, found.end), most = std::max(found.at, found.end);
      // At a sample, which the line has as well.
      const double along = std::abs(place(k) - place(k - 1));
      const double beside = along < kLeastBeside ? 0 : sample_reach(k - 1) / along - near;
      if (!found.anywhere && ((std::abs(least) < beside && std::abs(most) < beside) ||
                              (std::abs(least - 1) < beside && std::abs(most - 1) < beside))) {
        to.drift = std::max(to.drift, (beside + near) / (k - 1 + std::max(least - near, 0.0)));
        to.leaves_out = true;
        return;
      }
      is_sure = is_sure && !found.anywhere && least >= near && most <= 1 - near &&
                static_cast<std::size_t>(to.betweens) < to.between.size();
      if (!is_sure) return;
      const double inverse = 1 / run_at(k, found.at), last_inverse = 1 / run_at(k, found.end);
      to.between[static_cast<std::size_t>(to.betweens++)] = {
          samples(k - 1, found.lane_offset),
          samples(k, found.lane_offset),
          static_cast<float>(found.at),
          fans_ ? static_cast<float>((found.end - found.at) / (kBundle - 1)) : 0,
          static_cast<float>(inverse),
          fans_ ? static_cast<float>((last_inverse - inverse) / (kBundle - 1)) : 0,
          static_cast<float>(found.reach * inverse)};
      to.drift = std::max(to.drift, found.reach / (k - 1 + least));
    });
    return is_sure;
  }

  /// One of several segments of which some are not crossed by all rays for certain.
  void add_unsurely(std::int32_t k, const BetweenPlace& found, unsigned groups) {
    const float* a = samples(k - 1, found.lane_offset);
    const float* b = samples(k, found.lane_offset);
    if (found.anywhere) {
      // No place on it is seen higher than both of its ends.
      const auto inverse = static_cast<float>(inverse_run(k));
      add_possible({a, b, 1, 0, 0, inverse, inverse}, groups);
      if (k == 1) return;
      const auto before = static_cast<float>(inverse_run(k - 1));
      add_possible({a, b, 0, 0, 0, before, before}, groups);
      return;
    }
    const double least = std::min(found.at, found.end), most = std::max(found.at, found.end);
    add_possible({a, b, static_cast<float>(found.at),
                  static_cast<float>((found.end - found.at) / (kBundle - 1)),
                  static_cast<float>(found.reach),
                  static_cast<float>(1 / run_at(k, std::max(least - found.reach, 0.0))),
                  static_cast<float>(1 / run_at(k, std::min(most + found.reach, 1.0)))},
                 groups);
  }

  /// Metres to a place at a share of the way from the line before to the k-th.
  double run_at(std::int32_t k, double share) const {
    const double from = k == 1 ? 0 : 1 / inverse_run(k - 1);
    const double step = 1 / inverse_run(k) - from;
    constexpr double kLeastShare = 0.01;  // of a line: nothing is met nearer
    return std::max(from + share * step, kLeastShare * step);
  }

  /// @param shift  of the samples, from where the crossing was made
  void add(const Crossing& crossing, std::ptrdiff_t shift, unsigned groups) {
    Crossing& added = crossings_[count_++];
    added = crossing;
    added.a += shift;
    added.b += shift;
    if (notes_void_) note_void(added.a, added.b, groups, *rays_);
    if (count_ == crossings_.size()) flush(groups);
  }
  void flush(unsigned groups) {
    if (count_ == 0) return;
    double slack = 0;
    for (std::size_t i = 0; i < count_; ++i) slack = std::max(slack, double{crossings_[i].slack});
    raised_ |= meet(crossings_.data(), count_, 0, groups, notes_for(slack), *rays_);
    count_ = 0;
  }
  void add_possible(const PossibleCrossing& crossing, unsigned groups) {
    if (notes_void_) note_void(crossing.a, crossing.b, groups, *rays_);
    meet_high(crossing, groups, *rays_);
  }

  static constexpr int kMostSquares = 8;
  static constexpr std::int32_t kLeastLines = 1 << MarchGround::kLeastLevel;
  static constexpr double kSwerveLanes = 64;
  static constexpr double kSureReach = 0.05;
  /// How near a sample may stand for what is beside it, lanes, and for rays that run so much along.
  static constexpr double kLeastBeside = 0.5;
  static constexpr double kMostBeside = 0.002;   ///< of the way between lines
  static constexpr double kWindowMargin = 1e-3;  ///< lanes
  static constexpr std::int32_t kMostStripeLines = 256;
  /// Lanes per line crossed; where there is void, rays that are not certain to miss it are unknown.
  static constexpr double kStripeSlack = 1e-4, kStripeSlackBesideVoid = 2e-5;

  const MarchGround& ground_;
  const RayFan& fan_;
  const MarchTile& tile_;
  const MarchSearch& search_;
  const bool exact_;
  std::int32_t lane_ = 0, line_ = 0, reach_ = 0;
  double turn_ = 0, stripe_slack_ = 0;
  std::int32_t stripe_ = 0;
  double drift_ = 0;
  std::vector<Step> steps_;  ///< by line crossed
  double most_along_;
  bool fans_;  ///< places differ from ray to ray
  std::int32_t first_line_ = 0;
  std::vector<Crossing> sure_;  ///< of the stripe's first line
  /// In sure_, by line crossed: after what lies between it and the one before, and after it.
  std::vector<std::size_t> between_end_, sure_end_;
  std::vector<SampleCrossing> at_samples_;  ///< lines that sure_ does not have
  std::vector<std::size_t> samples_end_;    ///< in at_samples_, by line crossed
  std::vector<double> slack_up_to_;         ///< the greatest of those not measured, by line crossed
  std::vector<std::int32_t> unsure_;        ///< lines crossed that sure_ does not have whole
  RayBundle* rays_ = nullptr;
  std::vector<Span> spans_, asked_;
  std::vector<Square> squares_;  ///< of asked_
  std::vector<unsigned> open_;   ///< likewise
  bool knows_strips_ = false;
  std::vector<StripGroups> productive_, before_;  ///< that raised low bounds; of the bundle before
  std::vector<StripGroups> crossed_;              ///< already, in this bundle
  double least_error_ = 0, stripe_error_ = 0;
  unsigned raised_ = 0;
  std::array<Crossing, 64> crossings_;
  std::size_t count_ = 0;
  bool notes_void_ = false;
};

/// Rays begin at known samples; others take no part.
SCARP_FOR_EACH_TARGET
void begin_rays(const float* __restrict z, RayBundle& rays) {
  for (int i = 0; i < kBundle; ++i) {
    const bool known = MarchGround::is_ground(z[i]);
    const float slope = known ? MarchGround::kNothing : -MarchGround::kNothing;
    rays.eye_z[i] = known ? z[i] : 0;
    rays.slope[i] = slope;
    rays.low[i] = slope;
    rays.high[i] = slope;
    rays.rest[i] = slope;
    rays.error[i] = 0;
    rays.slope_run[i] = 0;
    rays.run[i] = 0;
    rays.over_void[i] = 0;
    rays.void_before[i] = known ? 0 : 1;
  }
}

/// Eyes over a line's samples.
void place_eyes(const GroundGrid& grid, const MarchGround& ground, std::int32_t lane,
                std::int32_t line, double height_m, RayBundle& rays) {
  const float* z = ground.line(line) + lane;
  begin_rays(z, rays);
  if (height_m <= 0) return;
  const bool rows = ground.march() == March::kOverRows;
  for (int i = 0; i < std::min(kBundle, ground.lanes() - lane); ++i) {
    if (!MarchGround::is_ground(z[i])) continue;
    const double raised_z_m =
        grid.raised(rows ? lane + i : line, rows ? line : lane + i, height_m).z_m;
    const double above_m = raised_z_m - ground.middle_z_m();
    rays.eye_z[i] = static_cast<float>(ground.is_upside_down() ? -above_m : above_m);
  }
}

/// Of the bundle whose first lane is the tile's i-th.
void write_elevations(const MarchGround& ground, const RayFan& fan, const MarchTile& tile,
                      std::int32_t i, std::int32_t line, const RayBundle& rays,
                      const BundleMarch& march, const MarchSearch& search, TileHorizons& horizons) {
  const double p = i - (tile.lanes - 1) / 2.0;
  const double q = line - tile.first_line - (tile.lines - 1) / 2.0;
  const double z_m = ground.middle_z_m() - fan.middle_z_m;
  const double shrink = 1 / fan.stretch.at(p, q);
  const double nearest = fan.reach() > 0 ? fan.inverse_run[1] : 0;
  ElevationRow row{static_cast<float>(fan.level.at(p, q) + fan.level_z * z_m),
                   static_cast<float>(fan.level.per_lane),
                   static_cast<float>(fan.rise.at(p, q) + fan.rise_z * z_m),
                   static_cast<float>(fan.rise.per_lane),
                   static_cast<float>(fan.level_z),
                   static_cast<float>(fan.rise_z),
                   static_cast<float>(fan.bend),
                   static_cast<float>(shrink),
                   static_cast<float>(-fan.stretch.per_lane * shrink * shrink),
                   static_cast<float>(fan.tangent_error),
                   static_cast<float>(4 * ground.rounding_m() * nearest),
                   static_cast<float>(march.least_error()),
                   static_cast<float>(march.drift()),
                   ground.has_void()};
  if (ground.is_upside_down()) {
    // Slopes s and heights z are those of the ground times -1, and so shall tangents be.
    for (float* part : {&row.level, &row.level_step, &row.rise_z, &row.bend}) *part = -*part;
  }
  std::array<std::int16_t, kBundle> estimate, lower, upper;
  elevations(row, rays, estimate.data(), lower.data(), upper.data());
  const auto count = static_cast<std::ptrdiff_t>(std::min(kBundle, tile.lanes - i));
  const std::size_t to =
      static_cast<std::size_t>(line - tile.first_line) * static_cast<std::size_t>(tile.lanes) +
      static_cast<std::size_t>(i);
  std::copy_n(estimate.begin(), count, &horizons.estimate[to]);
  std::copy_n(lower.begin(), count, &horizons.lower[to]);
  std::copy_n(upper.begin(), count, &horizons.upper[to]);
  if (search.measures_distance)
    for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k)
      horizons.run_m[to + k] = rays.high[k] > rays.slope[k] ? rays.run[k] : rays.slope_run[k];
}

}  // namespace

void march_tile(const GroundGrid& grid, const MarchGround& ground, const RayFan& fan,
                const MarchTile& tile, const MarchSearch& search, TileHorizons& horizons) {
  const auto lanes = static_cast<std::size_t>(tile.lanes);
  const std::size_t cells = lanes * static_cast<std::size_t>(tile.lines);
  horizons.estimate.resize(cells);
  horizons.lower.resize(cells);
  horizons.upper.resize(cells);
  if (search.measures_distance) horizons.run_m.resize(cells);
  BundleMarch march(ground, fan, tile, search);
  RayBundle rays;
  const std::int32_t stripe_lines = march.stripe_lines();
  const std::int32_t end_line = tile.first_line + tile.lines;
  for (std::int32_t stripe = tile.first_line; stripe < end_line; stripe += stripe_lines) {
    const std::int32_t stripe_end = std::min(stripe + stripe_lines, end_line);
    for (std::int32_t i = 0; i < tile.lanes; i += kBundle) {
      march.begin_stripe(tile.first_lane + i, stripe, stripe_end - stripe);
      for (std::int32_t line = stripe; line < stripe_end; ++line) {
        place_eyes(grid, ground, tile.first_lane + i, line, search.eye_height_m, rays);
        march.run(line, rays);
        write_elevations(ground, fan, tile, i, line, rays, march, search, horizons);
      }
    }
  }
}

}  // namespace scarp
