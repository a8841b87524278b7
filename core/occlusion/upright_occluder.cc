#include "core/occlusion/upright_occluder.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

#include "core/geodesy/predicates.h"

namespace scarp {
namespace {

/// Allowances for rounding of a share of the polyline and of a height: what may_hide says wrongly
/// is only that something is not hidden.
constexpr double kRounding = 0x1p-30, kHeightRoundingM = 0x1p-10;

/// The upper corners: from them, and to them, lines run highest.
std::array<Position, 4> upper_corners(const Bounds& box) {
  const auto& [low, high] = box;
  return {{{low.x_m, low.y_m, high.z_m},
           {high.x_m, low.y_m, high.z_m},
           {high.x_m, high.y_m, high.z_m},
           {low.x_m, high.y_m, high.z_m}}};
}

int rounded_orient2d(const Position& a, const Position& b, const Position& c) {
  const double side = (b.x_m - a.x_m) * (c.y_m - a.y_m) - (b.y_m - a.y_m) * (c.x_m - a.x_m);
  return (side > 0) - (side < 0);
}

/// The side of a line in the plane that all places are strictly on, 0 where there is none.
template <class Orient>
int side_of(Orient orient, const Position& a, const Position& b, std::span<const Position> places) {
  int side = 0;
  for (const Position& corner : places) {
    const int here = orient(a, b, corner);
    if (here == 0 || here == -side) return 0;
    side = here;
  }
  return side;
}

/// Least and greatest side of a place against the lines from eyes to targets.
template <class Orient>
std::pair<int, int> sides_against_lines(Orient orient, std::span<const Position> eyes,
                                        std::span<const Position> targets, const Position& place) {
  std::pair<int, int> sides{1, -1};
  for (const Position& eye : eyes)
    for (const Position& target : targets) {
      const int side = orient(eye, target, place);
      sides = {std::min(sides.first, side), std::max(sides.second, side)};
    }
  return sides;
}

/// What the plane tells: kHidden where all lines cross the occluder's own.
/// @param eye_side[out]  of the eyes, against from -> to
template <class Orient>
FullOcclusion judge_in_plane(Orient orient, const Position& from, const Position& to,
                             std::span<const Position> eyes, std::span<const Position> targets,
                             int& eye_side) {
  eye_side = side_of(orient, from, to, eyes);
  if (eye_side == 0) return FullOcclusion::kNever;
  const int target_side = side_of(orient, from, to, targets);
  if (target_side == eye_side) return FullOcclusion::kNever;
  // Looking across from the left of from -> to, `to` is on the left and `from` on the right.
  const auto at_to = sides_against_lines(orient, eyes, targets, to);
  const auto at_from = sides_against_lines(orient, eyes, targets, from);
  const bool all_beyond_to = eye_side > 0 ? at_to.second < 0 : at_to.first > 0;
  const bool all_beyond_from = eye_side > 0 ? at_from.first > 0 : at_from.second < 0;
  if (all_beyond_to || all_beyond_from) return FullOcclusion::kNever;
  const bool within_to = eye_side > 0 ? at_to.first >= 0 : at_to.second <= 0;
  const bool within_from = eye_side > 0 ? at_from.second <= 0 : at_from.first >= 0;
  return target_side != 0 && within_to && within_from ? FullOcclusion::kHidden
                                                      : FullOcclusion::kOpen;
}

}  // namespace

UprightOccluder::UprightOccluder(std::vector<Position> top) : top_(std::move(top)) {
  assert(top_.size() >= 2);
  highest_m_ = std::max_element(top_.begin(), top_.end(), [](const Position& a, const Position& b) {
                 return a.z_m < b.z_m;
               })->z_m;
  for (const Position& p : top_) along_.push_back(along(p.x_m, p.y_m));
  terms_.push_back({});
  grow(0, 0, static_cast<std::uint32_t>(top_.size() - 1), true);
}

double UprightOccluder::along(double x_m, double y_m) const {
  const Position &from = top_.front(), &to = top_.back();
  const double dx_m = to.x_m - from.x_m, dy_m = to.y_m - from.y_m;
  return ((x_m - from.x_m) * dx_m + (y_m - from.y_m) * dy_m) / (dx_m * dx_m + dy_m * dy_m);
}

/// Whether one line may cross the plane below the polyline, in double: only to leave work out.
bool UprightOccluder::may_hide(const Position& eye, const Position& target) const {
  const Position &from = top_.front(), &to = top_.back();
  const auto side = [&](const Position& p) {
    return (to.x_m - from.x_m) * (p.y_m - from.y_m) - (to.y_m - from.y_m) * (p.x_m - from.x_m);
  };
  const double at_eye = side(eye), at_target = side(target);
  if (at_eye * at_target >= 0) return false;
  const double share = at_eye / (at_eye - at_target);
  const double at =
      along(eye.x_m + share * (target.x_m - eye.x_m), eye.y_m + share * (target.y_m - eye.y_m));
  if (!(at >= -kRounding && at <= 1 + kRounding)) return false;
  const auto next = std::upper_bound(along_.begin() + 1, along_.end() - 1, at);
  const auto i = static_cast<std::size_t>(next - along_.begin());
  const double within = (at - along_[i - 1]) / (along_[i] - along_[i - 1]);
  const double top_m = top_[i - 1].z_m + within * (top_[i].z_m - top_[i - 1].z_m);
  return eye.z_m + share * (target.z_m - eye.z_m) <= top_m + kHeightRoundingM;
}

bool UprightOccluder::hides(const Bounds& eyes, std::span<const Position> targets) const {
  for (const Position& target : targets)
    if (!may_hide(eyes.high, target)) return false;
  return judge(eyes, targets) == FullOcclusion::kHidden;
}

void UprightOccluder::grow(std::uint32_t term, std::uint32_t from, std::uint32_t to,
                           bool is_upper) {
  // The hull of the polyline on one side; places on its edges stay corners.
  std::vector<std::uint32_t> hull;
  const int inner = is_upper ? -1 : 1;
  for (std::uint32_t p = from; p <= to; ++p) {
    while (hull.size() >= 2 &&
           above_line(top_[hull[hull.size() - 2]], top_[p], top_[hull.back()]) == inner)
      hull.pop_back();
    hull.push_back(p);
  }
  const auto first = static_cast<std::uint32_t>(terms_.size());
  const auto count = static_cast<std::uint32_t>(hull.size() - 1);
  terms_[term] = {is_upper ? Term::kAll : Term::kAny, first, count};
  terms_.resize(first + count);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (hull[i + 1] == hull[i] + 1)
      terms_[first + i] = {Term::kEdge, hull[i], 1};
    else
      grow(first + i, hull[i], hull[i + 1], !is_upper);
  }
}

bool UprightOccluder::holds(const Term& term, int eye_side, std::span<const Position> eyes,
                            std::span<const Position> targets) const {
  if (term.kind != Term::kEdge) {
    const bool is_any = term.kind == Term::kAny;
    for (std::uint32_t i = term.first; i < term.first + term.count; ++i)
      if (holds(terms_[i], eye_side, eyes, targets) == is_any) return is_any;
    return !is_any;
  }
  const Position &a = top_[term.first], &b = top_[term.first + 1];
  for (const Position& eye : eyes)
    for (const Position& target : targets)
      if (orient3d(a, b, eye, target) * eye_side > 0) return false;
  return true;
}

FullOcclusion UprightOccluder::judge(const Bounds& eyes, const Bounds& targets) const {
  return judge(eyes, upper_corners(targets), targets.low.z_m);
}

FullOcclusion UprightOccluder::judge(const Bounds& eyes, std::span<const Position> targets) const {
  double lowest_m = targets.front().z_m;
  for (const Position& target : targets) lowest_m = std::min(lowest_m, target.z_m);
  return judge(eyes, targets, lowest_m);
}

FullOcclusion UprightOccluder::judge(const Bounds& eye_box, std::span<const Position> targets,
                                     double lowest_m) const {
  if (eye_box.low.z_m > highest_m_ && lowest_m > highest_m_) return FullOcclusion::kNever;
  const std::array<Position, 4> eyes = upper_corners(eye_box);
  const Position &from = top_.front(), &to = top_.back();
  // Most are not hidden, which rounding may say: only kHidden has to be exact.
  int eye_side = 0;
  const FullOcclusion rounded = judge_in_plane(rounded_orient2d, from, to, eyes, targets, eye_side);
  if (rounded != FullOcclusion::kHidden) return rounded;
  for (const Position& target : targets)
    if (!may_hide(eyes.front(), target)) return FullOcclusion::kOpen;
  if (judge_in_plane(orient2d, from, to, eyes, targets, eye_side) != FullOcclusion::kHidden)
    return FullOcclusion::kOpen;
  return holds(terms_[0], eye_side, eyes, targets) ? FullOcclusion::kHidden : FullOcclusion::kOpen;
}

std::string UprightOccluder::text_of(std::uint32_t index) const {
  const Term& term = terms_[index];
  if (term.kind == Term::kEdge) return "F" + std::to_string(term.first);
  std::string text;
  for (std::uint32_t i = term.first; i < term.first + term.count; ++i) {
    if (!text.empty()) text += term.kind == Term::kAll ? " & " : " | ";
    const bool is_joined = terms_[i].kind != Term::kEdge && term.count > 1;
    text += is_joined ? "(" + text_of(i) + ")" : text_of(i);
  }
  return text;
}

}  // namespace scarp
