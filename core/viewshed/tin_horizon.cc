#include "core/viewshed/tin_horizon.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/sight/line_of_sight.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Within this distance ahead perspective is not exact enough; ground there has one bound.
constexpr double kNearM = 0.25;

/// Relative allowance of everything that is interpolated along an edge. Tangents are off by 2^-52
/// and edges as wide as kLeastWidth at least, so that places along an edge are off by 2^-31 of it.
constexpr double kRounding = 0x1p-26;

/// Tangent: what is interpolated is wider; of narrower edges the greater end counts all along.
constexpr double kLeastWidth = 0x1p-20;

/// Tangent: bins take in this much on either side, above all rounding of tangents up to one.
constexpr double kBesideBin = 0x1p-48;

/// Relative: above the rounding of a target's own picture.
constexpr double kTargetRounding = 0x1p-40;

/// Edges that are asked for a target, the highest first.
constexpr std::size_t kEdgesAsked = 4;

}  // namespace

TinHorizon::TinHorizon(const TinIndex& index, const Position& eye,
                       const std::vector<Position>& outline, double spacing_m)
    : index_(index), eye_(eye) {
  constexpr double kBinsASample = 4;  // at the farthest sample
  constexpr int kFewestBins = 256, kMostBins = 8192;
  for (const Position& p : outline)
    reach_m_ = std::max({reach_m_, std::abs(p.x_m - eye.x_m), std::abs(p.y_m - eye.y_m)});
  reach_m_ += 2 * spacing_m + 1;
  bins_in_wedge_ = kFewestBins;
  while (bins_in_wedge_ < kMostBins && bins_in_wedge_ * spacing_m < 2 * kBinsASample * reach_m_)
    bins_in_wedge_ *= 2;
  bins_.resize(static_cast<std::size_t>(kWedges * bins_in_wedge_));
  choose_parts(outline);
  measure_near_ground();
  if (near_rise_ == kInfinity) return;  // nothing could be answered
  parallel_for(is_filled_.size(), [&](std::size_t i) {
    if (is_filled_[i]) fill(part_of(static_cast<int>(i)));
  });
}

int TinHorizon::wedge_of(double dx_m, double dy_m) {
  if (std::abs(dx_m) >= std::abs(dy_m)) return dx_m >= 0 ? 0 : 2;
  return dy_m >= 0 ? 1 : 3;
}

TinHorizon::Place TinHorizon::place(int wedge, const Position& p) const {
  const double dx = p.x_m - eye_.x_m, dy = p.y_m - eye_.y_m, dz = p.z_m - eye_.z_m;
  switch (wedge) {
    case 0:
      return {dx, dy, dz};
    case 1:
      return {dy, dx, dz};
    case 2:
      return {-dx, dy, dz};
    default:
      return {-dy, dx, dz};
  }
}

TinHorizon::Picture TinHorizon::picture(const Place& p) {
  const double nearness = 1 / p.ahead_m;
  return {p.aside_m * nearness, p.rise_m * nearness, nearness};
}

int TinHorizon::bin_of(double tangent) const {
  const double bin = std::floor((std::clamp(tangent, -2.0, 2.0) + 1) * (bins_in_wedge_ / 2));
  return static_cast<int>(bin);
}

TinHorizon::Part TinHorizon::part_of(int number) const {
  const int bins = bins_in_wedge_ / kPartsInWedge, in_wedge = number % kPartsInWedge;
  return {number / kPartsInWedge, in_wedge * bins, (in_wedge + 1) * bins};
}

/// Parts that have no place of the outline are left out, unless targets are all around.
void TinHorizon::choose_parts(const std::vector<Position>& outline) {
  bool left = false, right = false, above = false, below = false;
  for (const Position& p : outline) {
    const double dx = p.x_m - eye_.x_m, dy = p.y_m - eye_.y_m;
    left |= dx <= 0, right |= dx >= 0, below |= dy <= 0, above |= dy >= 0;
    const int wedge = wedge_of(dx, dy);
    const Place at = place(wedge, p);
    if (!(at.ahead_m > kNearM)) continue;
    const int bin = std::clamp(bin_of(picture(at).tangent), 0, bins_in_wedge_ - 1);
    is_filled_[static_cast<std::size_t>(wedge * kPartsInWedge +
                                        bin / (bins_in_wedge_ / kPartsInWedge))] = true;
  }
  if (left && right && above && below) is_filled_.fill(true);
}

/// Bounds the rise of all edges within kNearM of the eye, along both axes.
void TinHorizon::measure_near_ground() {
  near_rise_ = -kInfinity;
  std::vector<Position> corners;
  for (const double x : {-kNearM, kNearM})
    for (const double y : {-kNearM, kNearM}) corners.push_back({eye_.x_m + x, eye_.y_m + y, 0});
  index_.visit_edges(corners, HeightFloor(), [&](std::uint32_t e) {
    const Place u = place(0, index_.tin().vertices[index_.edges()[e].from]);
    const Place v = place(0, index_.tin().vertices[index_.edges()[e].to]);
    if (index_.edges()[e].is_border()) has_near_border_ = true;
    // From a foot under the eye rise for each metre ahead grows with the metres: what is farther
    // than kNearM stands for the rest.
    const auto is_foot = [](const Place& p) {
      return p.ahead_m == 0 && p.aside_m == 0 && p.rise_m <= 0;
    };
    const auto is_near = [](const Place& p) {
      return std::max(std::abs(p.ahead_m), std::abs(p.aside_m)) < kNearM;
    };
    if ((is_foot(u) && !is_near(v)) || (is_foot(v) && !is_near(u))) return false;
    double from = 0, to = 1;
    const auto cut = [&](double at_u, double at_v) {
      if (at_u == at_v) {
        if (std::abs(at_u) > kNearM) to = -1;
        return;
      }
      const double a = (-kNearM - at_u) / (at_v - at_u), b = (kNearM - at_u) / (at_v - at_u);
      from = std::max(from, std::min(a, b) - kRounding);
      to = std::min(to, std::max(a, b) + kRounding);
    };
    cut(u.ahead_m, v.ahead_m);
    cut(u.aside_m, v.aside_m);
    if (from > to) return false;
    from = std::clamp(from, 0.0, 1.0), to = std::clamp(to, 0.0, 1.0);
    const auto rise_at = [&](double part) { return u.rise_m + part * (v.rise_m - u.rise_m); };
    const double rise_m = std::max(rise_at(from), rise_at(to)) +
                          kRounding * (std::abs(u.rise_m) + std::abs(v.rise_m));
    near_rise_ = std::max(near_rise_, rise_m <= 0 ? rise_m / kNearM : kInfinity);
    return false;
  });
}

TinHorizon::Filling::Filling(const Part& of_bins)
    : part(of_bins),
      last(static_cast<std::size_t>(of_bins.end - of_bins.first), Record{0, -kInfinity, kNone}),
      seen(kRemembered, kNone) {}

/// Edges come in several bins of the index that lie next to each other.
bool TinHorizon::Filling::is_new(std::uint32_t edge) {
  std::uint32_t& at = seen[edge % kRemembered];
  if (at == edge) return false;
  at = edge;
  return true;
}

/// Edges from near to far, by shells that double in depth, because what is far is mostly lower than
/// what is kept already.
void TinHorizon::fill(const Part& part) {
  constexpr int kShells = 8;
  const auto place = [&](double ahead, double tangent) -> Position {
    const double aside = tangent * ahead;
    switch (part.wedge) {
      case 0:
        return {eye_.x_m + ahead, eye_.y_m + aside, 0};
      case 1:
        return {eye_.x_m + aside, eye_.y_m + ahead, 0};
      case 2:
        return {eye_.x_m - ahead, eye_.y_m + aside, 0};
      default:
        return {eye_.x_m + aside, eye_.y_m - ahead, 0};
    }
  };
  Filling filling(part);
  const double low = border(part.first), high = border(part.end);
  double near_m = 0;
  for (int shell = kShells - 1; shell >= 0; --shell) {
    const double far_m = std::ldexp(reach_m_, -shell);
    const std::array<Position, 4> corners{place(near_m, low), place(near_m, high),
                                          place(far_m, low), place(far_m, high)};
    index_.visit_edges(corners, HeightFloor(), [&](std::uint32_t e) {
      if (filling.is_new(e)) add(filling, e);
      return false;
    });
    near_m = far_m;
  }
}

void TinHorizon::add(Filling& filling, std::uint32_t e) {
  const Part& part = filling.part;
  const MeshEdge& edge = index_.edges()[e];
  Place u = place(part.wedge, index_.tin().vertices[edge.from]);
  Place v = place(part.wedge, index_.tin().vertices[edge.to]);
  if (u.ahead_m < v.ahead_m) std::swap(u, v);
  if (u.ahead_m < kNearM) return;
  if (v.ahead_m < kNearM) {
    // Distances ahead are exact, so the cut is off by 2^-51 of the edge, however it runs.
    const double cut = (u.ahead_m - kNearM) / (u.ahead_m - v.ahead_m);
    v = {kNearM, u.aside_m + cut * (v.aside_m - u.aside_m), u.rise_m + cut * (v.rise_m - u.rise_m)};
  }
  Picture p = picture(u), q = picture(v);
  if (q.tangent < p.tangent) std::swap(p, q);
  const int first = std::max(part.first, bin_of(p.tangent - kBesideBin));
  const int last = std::min(part.end - 1, bin_of(q.tangent + kBesideBin));
  if (first > last) return;
  const double rise_margin = kRounding * (std::abs(p.rise) + std::abs(q.rise));
  const double nearness_margin = kRounding * (p.nearness + q.nearness);
  const double width = q.tangent - p.tangent;
  const double per_tangent = width >= kLeastWidth ? 1 / width : 0;
  const auto part_at = [&](double tangent) {
    return std::clamp((tangent - p.tangent) * per_tangent, 0.0, 1.0);
  };
  const double top = std::max(p.rise, q.rise) + rise_margin;
  const double nearest = std::max(p.nearness, q.nearness) + nearness_margin;
  for (int i = first; i <= last; ++i) {
    Record& highest = filling.last[static_cast<std::size_t>(i - part.first)];
    if (top <= highest.rise && nearest <= highest.nearness && !edge.is_border()) continue;
    double from = 0, to = 1;
    if (width >= kLeastWidth) {
      from = part_at(border(i) - kBesideBin);
      to = part_at(border(i + 1) + kBesideBin);
    }
    const auto most = [&](double at_p, double at_q) {
      return std::max(at_p + from * (at_q - at_p), at_p + to * (at_q - at_p));
    };
    const Record record{most(p.nearness, q.nearness) + nearness_margin,
                        most(p.rise, q.rise) + rise_margin, e};
    Bin& here = bin(part.wedge, i);
    keep(here.records, record);
    highest = here.records.back();
    if (edge.is_border()) here.nearest_border = std::max(here.nearest_border, record.nearness);
  }
}

void TinHorizon::keep(std::vector<Record>& records, const Record& record) {
  std::size_t at = records.size();
  while (at > 0 && records[at - 1].nearness < record.nearness) --at;
  if (at > 0 && records[at - 1].rise >= record.rise) return;
  std::size_t end = at;
  while (end < records.size() && records[end].rise <= record.rise) ++end;
  const auto place = records.begin() + static_cast<std::ptrdiff_t>(at);
  if (end == at) {
    records.insert(place, record);
  } else {
    *place = record;
    records.erase(place + 1, records.begin() + static_cast<std::ptrdiff_t>(end));
  }
}

TinHorizon::Found TinHorizon::ask(const Position& target) const {
  const int wedge = wedge_of(target.x_m - eye_.x_m, target.y_m - eye_.y_m);
  const Place at = place(wedge, target);
  Found found;
  if (!(at.ahead_m > kNearM) || at.ahead_m >= reach_m_ || near_rise_ == kInfinity) return found;
  const Picture seen = picture(at);
  const int i = std::clamp(bin_of(seen.tangent), 0, bins_in_wedge_ - 1);
  if (!is_filled_[static_cast<std::size_t>(wedge * kPartsInWedge +
                                           i / (bins_in_wedge_ / kPartsInWedge))])
    return found;
  const Bin& here = bins_[static_cast<std::size_t>(wedge * bins_in_wedge_ + i)];
  const double nearness = seen.nearness * (1 - kTargetRounding);
  found.may_meet_border = has_near_border_ || here.nearest_border >= nearness;
  const auto end = std::partition_point(here.records.begin(), here.records.end(),
                                        [&](const Record& r) { return r.nearness >= nearness; });
  const double rise = seen.rise - kTargetRounding * std::abs(seen.rise);
  auto record = end;
  for (std::size_t asked = 0; record != here.records.begin() && asked < kEdgesAsked; ++asked) {
    --record;
    if (record->rise < rise) {
      if (asked == 0 && near_rise_ < rise) found.answer = Answer::kFree;
      return found;
    }
    if (is_blocked_by(index_, index_.edges()[record->edge], eye_, target)) {
      found.answer = Answer::kBlocked;
      return found;
    }
  }
  if (end == here.records.begin() && near_rise_ < rise) found.answer = Answer::kFree;
  return found;
}

}  // namespace scarp
