#include "core/culling/rising_horizon.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace scarp {
namespace {

/// An edge in (across, up), from left to right.
class Edge {
 public:
  Edge(const AheadPoint& from, const AheadPoint& to)
      : from_(from), to_(to), slope_((to.up - from.up) / (to.across - from.across)) {}

  bool is_long() const { return to_.across - from_.across >= kLeastEdge; }
  /// Requires an edge that is long, and a place on it.
  double up_at(double across) const { return from_.up + (across - from_.across) * slope_; }
  /// The highest of the edge between two places; -inf where it is not between them.
  double most_within(double low, double high) const {
    if (to_.across < low || from_.across > high) return -HUGE_VAL;
    if (!is_long()) return std::max(from_.up, to_.up);
    return std::max(up_at(std::max(low, from_.across)), up_at(std::min(high, to_.across)));
  }

 private:
  const AheadPoint& from_;
  const AheadPoint& to_;
  double slope_;
};

/// Corners from left to right.
std::array<AheadPoint, 3> sorted(std::array<AheadPoint, 3> t) {
  const auto order = [&](std::size_t i, std::size_t k) {
    if (t[k].across < t[i].across) std::swap(t[i], t[k]);
  };
  order(0, 1), order(1, 2), order(0, 1);
  return t;
}

double rounding_of(const std::array<AheadPoint, 3>& t) {
  return kHorizonRounding * (std::abs(t[0].up) + std::abs(t[1].up) + std::abs(t[2].up));
}

bool is_placed(const AheadPoint& p) {
  return p.ahead_m >= kNearestAheadM && std::abs(p.across) <= kMostAcross;
}

bool are_placed(const std::array<AheadPoint, 3>& t) {
  return is_placed(t[0]) && is_placed(t[1]) && is_placed(t[2]);
}

/// Whether the eye is under the triangle's plane for certain: then it sees none of its upper side.
bool faces_away(const std::array<AheadPoint, 3>& t) {
  const double ax = t[1].across - t[0].across, ay = t[1].up - t[0].up;
  const double bx = t[2].across - t[0].across, by = t[2].up - t[0].up;
  const double wide = 1 + std::abs(t[0].across) + std::abs(t[1].across) + std::abs(t[2].across);
  const double high = std::abs(t[0].up) + std::abs(t[1].up) + std::abs(t[2].up);
  return ax * by - ay * bx < -kAreaRounding * wide * wide * high;
}

}  // namespace

bool RisingHorizon::begin(const Position& eye, const ViewRange& view) {
  double width_rad = view.to_rad - view.from_rad;
  if (width_rad < 0)
    width_rad += 2 * std::numbers::pi * std::ceil(-width_rad / (2 * std::numbers::pi));
  if (width_rad > kWidestRad) return false;
  const double middle_rad = view.from_rad + width_rad / 2;
  eye_ = {eye, std::cos(middle_rad), std::sin(middle_rad)};
  bins_.right = std::tan(width_rad / 2) * (1 + kHorizonRounding) + kHorizonRounding;
  bins_.left = -bins_.right;
  bins_.width = (bins_.right - bins_.left) / kBins;
  bins_.up.fill(-HUGE_VAL);
  bins_.farthest_m.fill(0);
  return true;
}

AheadPoint RisingHorizon::place(const Position& position) const {
  const double x_m = position.x_m - eye_.at.x_m, y_m = position.y_m - eye_.at.y_m;
  AheadPoint p;
  p.ahead_m = eye_.ahead_x * x_m + eye_.ahead_y * y_m;
  p.right_m = eye_.ahead_y * x_m - eye_.ahead_x * y_m;
  const double each = 1 / p.ahead_m;
  p.across = p.right_m * each;
  p.up = (position.z_m - eye_.at.z_m) * each;
  return p;
}

double RisingHorizon::nearest_m(const Bounds& box) const {
  return eye_.ahead_x * ((eye_.ahead_x > 0 ? box.low.x_m : box.high.x_m) - eye_.at.x_m) +
         eye_.ahead_y * ((eye_.ahead_y > 0 ? box.low.y_m : box.high.y_m) - eye_.at.y_m);
}

int RisingHorizon::bin_of(double across) const {
  return static_cast<int>(std::clamp((across - bins_.left) / bins_.width, 0.0, kBins - 1.0));
}

bool RisingHorizon::are_beside(std::span<const AheadPoint> corners) const {
  // The view is the wedge between its borders ahead: convex, so that corners decide.
  bool is_left = true, is_right = true, is_behind = true;
  for (const AheadPoint& p : corners) {
    is_left &= p.right_m < bins_.left * p.ahead_m;
    is_right &= p.right_m > bins_.right * p.ahead_m;
    is_behind &= p.ahead_m < 0;
  }
  return is_left || is_right || is_behind;
}

bool RisingHorizon::is_beside(const Bounds& box) const {
  const std::array<AheadPoint, 4> corners{place(box.low), place({box.low.x_m, box.high.y_m, 0}),
                                          place({box.high.x_m, box.low.y_m, 0}), place(box.high)};
  return are_beside(corners);
}

bool RisingHorizon::hides(const Bounds& box) const {
  double least = HUGE_VAL, most = -HUGE_VAL, top = -HUGE_VAL, nearest_m = HUGE_VAL;
  for (const double x_m : {box.low.x_m, box.high.x_m})
    for (const double y_m : {box.low.y_m, box.high.y_m}) {
      const AheadPoint p = place({x_m, y_m, box.high.z_m});
      if (!is_placed(p)) return false;
      least = std::min(least, p.across), most = std::max(most, p.across);
      top = std::max(top, p.up), nearest_m = std::min(nearest_m, p.ahead_m);
    }
  if (most < bins_.left || least > bins_.right) return true;
  top += kHorizonRounding * std::abs(top);
  const int last = bin_of(most + kHorizonRounding);
  for (int bin = bin_of(least - kHorizonRounding); bin <= last; ++bin) {
    const auto b = static_cast<std::size_t>(bin);
    if (!(top < bins_.up[b] && bins_.farthest_m[b] <= nearest_m)) return false;
  }
  return true;
}

bool RisingHorizon::hides(const std::array<AheadPoint, 3>& triangle) const {
  if (are_beside(triangle)) return true;
  if (!are_placed(triangle)) return false;
  if (faces_away(triangle)) return true;
  const auto t = sorted(triangle);
  return is_under_in_parts(t, std::min({t[0].ahead_m, t[1].ahead_m, t[2].ahead_m}),
                           bin_of(t[0].across - kHorizonRounding),
                           bin_of(t[2].across + kHorizonRounding));
}

bool RisingHorizon::is_under_in_parts(const std::array<AheadPoint, 3>& t, double nearest_m,
                                      int first, int last) const {
  const double margin = rounding_of(t);
  const Edge whole{t[0], t[2]}, one{t[0], t[1]}, other{t[1], t[2]};
  const double top = std::max({t[0].up, t[1].up, t[2].up}) + margin;
  for (int bin = first; bin <= last; ++bin) {
    const auto b = static_cast<std::size_t>(bin);
    if (bins_.farthest_m[b] > nearest_m) return false;
    if (top < bins_.up[b]) continue;
    if (last - first < 2) return false;
    const double low = border(bin) - kHorizonRounding, high = border(bin + 1) + kHorizonRounding;
    const double here = std::max(
        {whole.most_within(low, high), one.most_within(low, high), other.most_within(low, high)});
    if (!(here + margin < bins_.up[b])) return false;
  }
  return true;
}

void RisingHorizon::add(const std::array<AheadPoint, 3>& triangle) {
  if (are_beside(triangle) || !are_placed(triangle)) return;
  const double least =
      std::min({triangle[0].across, triangle[1].across, triangle[2].across}) + kHorizonRounding;
  const double most =
      std::max({triangle[0].across, triangle[1].across, triangle[2].across}) - kHorizonRounding;
  if (!(most - least >= kLeastEdge)) return;
  // Borders that it lies across: between two of them a straight line on it hides.
  const auto border_of = [&](double across) {
    return std::clamp<double>((across - bins_.left) / bins_.width, 0, kBins);
  };
  const int first = static_cast<int>(std::ceil(border_of(least)));
  const int last = static_cast<int>(std::floor(border_of(most)));
  if (last <= first) return;
  const auto t = sorted(triangle);
  const double farthest_m =
      std::max({t[0].ahead_m, t[1].ahead_m, t[2].ahead_m}) * (1 + kHorizonRounding);
  const double margin = rounding_of(t);
  const Edge whole{t[0], t[2]}, one{t[0], t[1]}, other{t[1], t[2]};
  const auto top_at = [&](double across) {
    const double up = whole.up_at(across);
    const Edge& bent = across < t[1].across ? one : other;
    return bent.is_long() ? std::max(up, bent.up_at(across)) : up;
  };
  double before = top_at(border(first));
  for (int bin = first; bin < last; ++bin) {
    const auto b = static_cast<std::size_t>(bin);
    const double after = top_at(border(bin + 1));
    const double up = std::min(before, after) - margin;
    if (up > bins_.up[b]) bins_.up[b] = up, bins_.farthest_m[b] = farthest_m;
    before = after;
  }
}

/// Of triangles that were set up.
bool RisingHorizon::shows_any(const SeenTriangles& seen) const {
  if (seen.open != 0) return true;
  for (std::uint64_t left = seen.facing; left != 0; left &= left - 1) {
    const auto t = static_cast<std::size_t>(std::countr_zero(left));
    if (is_under(bins_, seen, t)) continue;
    const int first = static_cast<int>(seen.first[t]), last = static_cast<int>(seen.last[t]);
    if (last - first < 2) return true;
    const std::array<AheadPoint, 3> corners{AheadPoint{0, 0, seen.across0[t], seen.up0[t]},
                                            AheadPoint{0, 0, seen.across1[t], seen.up1[t]},
                                            AheadPoint{0, 0, seen.across2[t], seen.up2[t]}};
    if (!is_under_in_parts(corners, seen.nearest_m[t], first, last)) return true;
  }
  return false;
}

bool RisingHorizon::shows(const HorizonTriangles::Group& triangles, bool adds) {
  if (triangles.steps == nullptr) return true;
  const std::size_t parts = (triangles.count + kSetUp - 1) / kSetUp;
  if (seen_.size() < std::max<std::size_t>(1, parts)) seen_.resize(std::max<std::size_t>(1, parts));
  std::size_t ready = 0;
  const auto set_up_next = [&] {
    set_up(eye_, bins_, triangles.origin, triangles.steps + ready * 9 * kSetUp,
           std::min(kSetUp, triangles.count - ready * kSetUp), seen_[ready]);
    ++ready;
  };
  if (!adds) {
    // Of what is not added a few triangles mostly show that it may be seen.
    set_up(eye_, bins_, triangles.origin, triangles.steps,
           std::min(HorizonTriangles::kProbed, triangles.count), seen_[0]);
    if (shows_any(seen_[0])) return true;
  }
  bool shown = false;
  while (!shown && ready < parts) {
    set_up_next();
    shown = shows_any(seen_[ready - 1]);
  }
  if (!shown || !adds) return shown;
  while (ready < parts) set_up_next();
  for (std::size_t part = 0; part < parts; ++part) raise(seen_[part], bins_);
  return true;
}

}  // namespace scarp
