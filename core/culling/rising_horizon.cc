#include "core/culling/rising_horizon.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace scarp {
namespace {

/// Relative allowance in every comparison: far above what double loses between the lattice and
/// here, as no edge is interpolated that is shorter than kLeastEdge.
constexpr double kRounding = 0x1p-30;

/// Across: shorter edges are not interpolated along, because a place on them is not exact enough.
constexpr double kLeastEdge = 0x1p-12;

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
  return kRounding * (std::abs(t[0].up) + std::abs(t[1].up) + std::abs(t[2].up));
}

/// Farther beside the view than this no place is exact enough.
constexpr double kMostAcross = 1024;

bool is_placed(const AheadPoint& p) {
  return p.ahead_m >= kNearestAheadM && std::abs(p.across) <= kMostAcross;
}

bool are_placed(const std::array<AheadPoint, 3>& t) {
  return is_placed(t[0]) && is_placed(t[1]) && is_placed(t[2]);
}

/// Whether the eye is under the triangle's plane for certain: then it sees none of its upper side.
bool faces_away(const std::array<AheadPoint, 3>& t) {
  constexpr double kAreaRounding = 0x1p-44;  // of products of two places
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
  eye_ = eye;
  const double middle_rad = view.from_rad + width_rad / 2;
  ahead_x_ = std::cos(middle_rad), ahead_y_ = std::sin(middle_rad);
  right_ = std::tan(width_rad / 2) * (1 + kRounding) + kRounding;
  left_ = -right_;
  width_ = (right_ - left_) / kBins;
  up_.fill(-HUGE_VAL);
  farthest_m_.fill(0);
  return true;
}

AheadPoint RisingHorizon::place(const Position& position) const {
  const double x_m = position.x_m - eye_.x_m, y_m = position.y_m - eye_.y_m;
  AheadPoint p;
  p.ahead_m = ahead_x_ * x_m + ahead_y_ * y_m;
  p.right_m = ahead_y_ * x_m - ahead_x_ * y_m;
  const double each = 1 / p.ahead_m;
  p.across = p.right_m * each;
  p.up = (position.z_m - eye_.z_m) * each;
  return p;
}

double RisingHorizon::nearest_m(const Bounds& box) const {
  return ahead_x_ * ((ahead_x_ > 0 ? box.low.x_m : box.high.x_m) - eye_.x_m) +
         ahead_y_ * ((ahead_y_ > 0 ? box.low.y_m : box.high.y_m) - eye_.y_m);
}

int RisingHorizon::bin_of(double across) const {
  return static_cast<int>(std::clamp((across - left_) / width_, 0.0, kBins - 1.0));
}

bool RisingHorizon::is_beside(const std::array<AheadPoint, 3>& t) const {
  // The view is the wedge between its borders ahead: convex, so that corners decide.
  bool is_left = true, is_right = true, is_behind = true;
  for (const AheadPoint& p : t) {
    is_left &= p.right_m < left_ * p.ahead_m;
    is_right &= p.right_m > right_ * p.ahead_m;
    is_behind &= p.ahead_m < 0;
  }
  return is_left || is_right || is_behind;
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
  if (most < left_ || least > right_) return true;
  top += kRounding * std::abs(top);
  const int last = bin_of(most + kRounding);
  for (int bin = bin_of(least - kRounding); bin <= last; ++bin) {
    const auto b = static_cast<std::size_t>(bin);
    if (!(top < up_[b] && farthest_m_[b] <= nearest_m)) return false;
  }
  return true;
}

bool RisingHorizon::hides(const std::array<AheadPoint, 3>& triangle) const {
  if (is_beside(triangle)) return true;
  if (!are_placed(triangle)) return false;
  if (faces_away(triangle)) return true;
  const auto t = sorted(triangle);
  const double nearest_m = std::min({t[0].ahead_m, t[1].ahead_m, t[2].ahead_m});
  const double margin = rounding_of(t);
  const int first = bin_of(t[0].across - kRounding), last = bin_of(t[2].across + kRounding);
  const Edge whole{t[0], t[2]}, one{t[0], t[1]}, other{t[1], t[2]};
  const double top = std::max({t[0].up, t[1].up, t[2].up}) + margin;
  for (int bin = first; bin <= last; ++bin) {
    const auto b = static_cast<std::size_t>(bin);
    if (farthest_m_[b] > nearest_m) return false;
    if (top < up_[b]) continue;
    if (last - first < 2) return false;
    const double low = border(bin) - kRounding, high = border(bin + 1) + kRounding;
    const double here = std::max(
        {whole.most_within(low, high), one.most_within(low, high), other.most_within(low, high)});
    if (!(here + margin < up_[b])) return false;
  }
  return true;
}

void RisingHorizon::add(const std::array<AheadPoint, 3>& triangle) {
  // First what most triangles of fine ground are: narrower than a part of the view.
  const double least =
      std::min({triangle[0].across, triangle[1].across, triangle[2].across}) + kRounding;
  const double most =
      std::max({triangle[0].across, triangle[1].across, triangle[2].across}) - kRounding;
  if (!(most - least >= width_ && most - least >= kLeastEdge)) return;
  if (!are_placed(triangle)) return;
  // Borders that it lies across: between two of them a straight line on it hides.
  const int first =
      static_cast<int>(std::ceil(std::clamp<double>((least - left_) / width_, 0, kBins)));
  const int last = static_cast<int>(std::floor(std::min<double>(kBins, (most - left_) / width_)));
  if (last <= first) return;
  const double highest = std::max({triangle[0].up, triangle[1].up, triangle[2].up});
  if (std::none_of(up_.begin() + first, up_.begin() + last,
                   [&](double up) { return up < highest; }))
    return;
  const auto t = sorted(triangle);
  const double farthest_m = std::max({t[0].ahead_m, t[1].ahead_m, t[2].ahead_m}) * (1 + kRounding);
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
    if (up > up_[b]) up_[b] = up, farthest_m_[b] = farthest_m;
    before = after;
  }
}

}  // namespace scarp
