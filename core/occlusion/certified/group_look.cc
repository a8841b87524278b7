#include "core/occlusion/certified/group_look.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace scarp {
namespace {

/// As many ridges that carry no wall are taken out of sight, for what is behind them.
constexpr int kMostFailures = 24;

/// Ridges that are tried before a place goes without a wall.
constexpr std::size_t kMostTries = 8;

/// The first crossing from one on that is over a line. Most are not: many are passed at once,
/// where the line is over the highest of them where it is lowest.
std::ptrdiff_t first_over(std::span<const RidgeCrossing> crossings, std::span<const float> highest,
                          const Places::Line& line, std::size_t i) {
  const auto is_over = [&](float z_m, float u_m) {
    return static_cast<double>(z_m) > line.base_m + line.slope * static_cast<double>(u_m);
  };
  if (!(line.slope > -HUGE_VAL)) return static_cast<std::ptrdiff_t>(i);
  while (i < crossings.size()) {
    if (i % kCrossingsAtOnce == 0) {
      const std::size_t end = std::min(i + kCrossingsAtOnce, crossings.size());
      const float lowest_u_m = crossings[line.slope > 0 ? i : end - 1].u_m;
      if (!is_over(highest[i / kCrossingsAtOnce], lowest_u_m)) {
        i = end;
        continue;
      }
    }
    if (is_over(crossings[i].z_m, crossings[i].u_m)) break;
    ++i;
  }
  return static_cast<std::ptrdiff_t>(i);
}

}  // namespace

/// The crossings that a line comes to, strip by strip.
class GroupLook::RidgeWalk {
 public:
  /// @param from  where the line begins
  /// @param turn  of the line: v for each metre of u, until it has drifted by most_drift_m
  RidgeWalk(const Ridges& ridges, const FanPlace& from, double turn, double most_drift_m)
      : ridges_(ridges), from_(from), turn_(turn), most_drift_m_(most_drift_m) {
    enter(ridges.strip_at(from.v_m), from.u_m);
  }

  /// Goes on to the first crossing from here on that is over a line; false where there is none.
  bool find_over(const Places::Line& line) {
    for (;;) {
      next_ = first_over(crossings_, highest_, line, static_cast<std::size_t>(next_));
      if (next_ < std::ssize(crossings_) && static_cast<double>(crossing().u_m) <= end_u_m_)
        return true;
      if (end_u_m_ == HUGE_VAL) return false;
      enter(turn_ > 0 ? strip_ + 1 : strip_ - 1, end_u_m_);
    }
  }

  const RidgeCrossing& crossing() const { return crossings_[static_cast<std::size_t>(next_)]; }
  std::size_t strip() const { return strip_; }
  std::ptrdiff_t place() const { return next_; }

  /// Goes on behind a crossing.
  void pass(std::size_t strip, std::ptrdiff_t place) {
    if (strip != strip_) enter(strip, from_.u_m);
    next_ = place + 1;
  }

 private:
  void enter(std::size_t strip, double u_m) {
    strip_ = strip;
    crossings_ = ridges_.along(strip);
    highest_ = ridges_.highest_along(strip);
    next_ = std::upper_bound(
                crossings_.begin(), crossings_.end(), u_m,
                [](double u, const RidgeCrossing& c) { return u < static_cast<double>(c.u_m); }) -
            crossings_.begin();
    end_u_m_ = HUGE_VAL;
    if (turn_ == 0 || strip == (turn_ > 0 ? ridges_.strips() - 1 : 0)) return;
    const double drift_m = ridges_.begin_of(strip + (turn_ > 0 ? 1 : 0)) - from_.v_m;
    if (std::abs(drift_m) < most_drift_m_) end_u_m_ = from_.u_m + std::max(0.0, drift_m / turn_);
  }

  const Ridges& ridges_;
  const FanPlace from_;
  double turn_, most_drift_m_;
  std::size_t strip_ = 0;
  std::span<const RidgeCrossing> crossings_;
  std::span<const float> highest_;
  std::ptrdiff_t next_ = 0;
  double end_u_m_ = HUGE_VAL;
};

NumberedGroup::NumberedGroup(std::span<const GroupEdges::Edge> crest_edges,
                             std::span<const GroupEdges::Edge> border_edges) {
  for (const auto& edge : crest_edges) corners.insert(corners.end(), edge.begin(), edge.end());
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  const auto ends_of = [&](const GroupEdges::Edge& edge) {
    FanCrests::Ends ends;
    for (std::size_t i = 0; i < 2; ++i)
      ends[i] = static_cast<std::uint32_t>(
          std::lower_bound(corners.begin(), corners.end(), edge[i]) - corners.begin());
    return ends;
  };
  for (const auto& edge : crest_edges) crests.push_back(ends_of(edge));
  for (const auto& edge : border_edges) borders.push_back(ends_of(edge));
}

void GroupLook::look(const FanView& view, const Ridges& ridges, const RingTable& rings,
                     const Turns& turns, const NumberedGroup& numbered, const LookedGroup& group) {
  view_ = &view, ridges_ = &ridges, rings_ = &rings, turns_ = &turns, group_ = group;
  const std::size_t sectors = settings_.borders.size();
  wanted_.resize(kRings / kCellsMarked * sectors);
  known_ = {group.bounds, group.hints, wanted_.data()};
  place_group(numbered);
  depth_ = 0;
  reached().mark(turns, static_cast<std::int32_t>(sectors), known_, wanted_.data());
  const FanPart rays = whole_of(view.fan);
  for (const FanEdge& edge : exits_) {
    find_behind(edge);
    look_from_piece({edge.a, edge.b, &edge, rays}, candidates_);
  }
}

/// Places a group's corners, crests and exits in the fan's frame.
void GroupLook::place_group(const NumberedGroup& numbered) {
  crests_.place_corners(*view_, numbered.corners);
  crests_.ends = numbered.crests;
  const std::size_t size = crests_.ends.size();
  low_u_m_.resize(size), low_v_m_.resize(size), high_v_m_.resize(size);
  for (std::size_t i = 0; i < size; ++i) {
    const auto [a, b] = crests_.ends[i];
    low_u_m_[i] = std::min(crests_.u_m[a], crests_.u_m[b]);
    low_v_m_[i] = std::min(crests_.v_m[a], crests_.v_m[b]);
    high_v_m_[i] = std::max(crests_.v_m[a], crests_.v_m[b]);
  }
  exits_.clear();
  const FanPart rays = whole_of(view_->fan);
  for (const auto& [a, b] : numbered.borders) {
    const FanEdge exit{crests_.corner(a), crests_.corner(b), a, b};
    if (!is_entry(*view_, rays, exit)) exits_.push_back(exit);
  }
  // What is high is seen first: it lowers bounds, and the rest needs no close look.
  std::sort(exits_.begin(), exits_.end(), [](const FanEdge& p, const FanEdge& q) {
    return p.a.z_m + p.b.z_m > q.a.z_m + q.b.z_m;
  });
}

/// Finds the crests that rays over an edge can have come from.
void GroupLook::find_behind(const FanEdge& edge) {
  const double error_m = 16 * view_->error_m;
  const double drift_m = 2 * group_.radius_m * view_->fan.tan_half + error_m;
  const double low_v_m = std::min(edge.a.v_m, edge.b.v_m) - drift_m;
  const double high_v_m = std::max(edge.a.v_m, edge.b.v_m) + drift_m;
  const double high_u_m = std::max(edge.a.u_m, edge.b.u_m) + error_m;
  const std::size_t size = crests_.ends.size();
  candidates_.resize(size);
  std::size_t count = 0;
  // Without a branch: which crests are taken follows no pattern.
  for (std::uint32_t i = 0; i < size; ++i) {
    candidates_[count] = i;
    count += static_cast<unsigned>(high_v_m_[i] >= low_v_m) &
             static_cast<unsigned>(low_v_m_[i] <= high_v_m) &
             static_cast<unsigned>(low_u_m_[i] <= high_u_m);
  }
  candidates_.resize(count);
}

/// Whether every ray over the piece leaves the group once more, over one edge: then it has been
/// looked at from there.
bool GroupLook::is_passed(const ExitPiece& piece) const {
  const auto [low_turn, high_turn] = piece.rays;
  const double reach_m = 2 * group_.radius_m, error_m = 16 * view_->error_m;
  const double low_v_m =
      std::min(piece.a.v_m, piece.b.v_m) + std::min(0.0, reach_m * low_turn) - error_m;
  const double high_v_m =
      std::max(piece.a.v_m, piece.b.v_m) + std::max(0.0, reach_m * high_turn) + error_m;
  for (const FanEdge& edge : exits_) {
    if (&edge == piece.edge || !(edge.a.v_m < low_v_m && edge.b.v_m > high_v_m) ||
        !is_exit(*view_, piece.rays, edge))
      continue;
    const double du_m = edge.b.u_m - edge.a.u_m, dv_m = edge.b.v_m - edge.a.v_m;
    const auto is_behind = [&](const FanPlace& p) {
      return du_m * (p.v_m - edge.a.v_m) - dv_m * (p.u_m - edge.a.u_m) >
             error_m * (std::abs(du_m) + std::abs(dv_m));
    };
    if (is_behind(piece.a) && is_behind(piece.b)) return true;
  }
  return false;
}

/// The cells that rays over a piece lead to; of a half, those that the whole leaves open.
/// @return the lane whose reach holds for all these rays
std::size_t GroupLook::reach_from(const ExitPiece& piece) {
  // Lanes: where rays over the piece pass the centre. One over a place (u, v) from there passes it
  // by v - turn * u, times the cosine of its angle.
  double least_m = HUGE_VAL, most_m = -HUGE_VAL;
  for (const FanPlace& p : {piece.a, piece.b})
    for (const double turn : {piece.rays.low_turn, piece.rays.high_turn}) {
      const double across_m = p.v_m - group_.centre.v_m - turn * (p.u_m - group_.centre.u_m);
      least_m = std::min({least_m, across_m, across_m * view_->fan.cos_half});
      most_m = std::max({most_m, across_m, across_m * view_->fan.cos_half});
    }
  const auto lane_of = [&](double offset_m) {
    const double lane = (offset_m / group_.radius_m + 1) * (kLanes / 2);
    return static_cast<std::size_t>(std::clamp(std::floor(lane), 0.0, kLanes - 1.0));
  };
  const std::size_t low = lane_of(least_m - 8 * view_->error_m);
  const std::size_t high = lane_of(most_m + 8 * view_->error_m);
  if (depth_ == 0)
    reached().reach(*rings_, *turns_, settings_.borders, low, high, known_);
  else
    reached().reach_part(reached_by_depth_[depth_ - 1], low, high, piece.rays);
  // The outer of the lanes has the least reach.
  return high + low >= kLanes ? high : low;
}

CellPlane GroupLook::in_cells(const SkyPlane& plane) const {
  const Fan& fan = view_->fan;
  CellPlane cell;
  cell.x = static_cast<float>(plane.ahead * fan.axis_x - plane.left * fan.axis_y);
  cell.y = static_cast<float>(plane.ahead * fan.axis_y + plane.left * fan.axis_x);
  const float steepness = std::abs(cell.x) + std::abs(cell.y);
  // Between its borders the least over a sector can be less by its sagitta.
  cell.slope_error =
      steepness * (settings_.sagitta + kSlopeRounding) + static_cast<float>(plane.slope_error * 2);
  const double du_m = group_.centre.u_m - plane.u_m, dv_m = group_.centre.v_m - plane.v_m;
  const double rise_m = plane.height_m - group_.height_m + plane.ahead * du_m + plane.left * dv_m -
                        plane.error_m - (std::abs(du_m) + std::abs(dv_m)) * plane.slope_error -
                        4 * view_->height_error_m;
  const auto rise = static_cast<float>(rise_m / group_.radius_m);
  cell.rise = rise - std::abs(rise) * kSlopeRounding;
  // A camera's u is at least `forward` of its distance, which counts where the line rises, and at
  // most the distance, which counts where it falls.
  const double line_rise_m = plane.line_m + plane.line_slope * group_.centre.u_m - group_.height_m -
                             4 * view_->height_error_m -
                             4 * std::abs(plane.line_slope) * view_->error_m;
  const auto line_rise = static_cast<float>(line_rise_m / group_.radius_m);
  cell.line_rise = line_rise - std::abs(line_rise) * kSlopeRounding;
  const auto line_slope = static_cast<float>(plane.line_slope);
  cell.rising = std::max(line_slope, 0.0F);
  cell.falling = std::min(line_slope, 0.0F) - std::abs(line_slope) * kSlopeRounding;
  // Rays have no other angles than the fan's.
  const double low_turn = std::clamp(plane.low_turn, -fan.tan_half, fan.tan_half);
  const double high_turn = std::clamp(plane.high_turn, -fan.tan_half, fan.tan_half);
  cell.low_rad = static_cast<float>(least_angle_rad(low_turn)) - kAngleRounding;
  cell.high_rad = static_cast<float>(greatest_angle_rad(high_turn)) + kAngleRounding;
  return cell;
}

/// From which ring on, `first` or a later one, cameras are beyond a place.
/// @param lane  whose reach holds for the rays
std::size_t GroupLook::ring_beyond(std::size_t lane, double u_m, std::size_t first) const {
  const double least = (u_m - group_.centre.u_m + 4 * view_->error_m) / group_.radius_m;
  const auto& reach = rings_->reach[lane];
  while (first < kRings && !(reach[first] > least)) ++first;
  return first;
}

/// Raises a wall on a ridge, if it carries one.
bool GroupLook::raise(const Sighted& sighted, const PieceTargets& targets, std::size_t lane) {
  if (!raise_wall(settings_.ridge_edges, *view_, targets.beam, targets.places, sighted.edge,
                  sighted.slope, wall_))
    return false;
  planes_.clear();
  for (const SkyPlane& plane : wall_.planes) {
    planes_.push_back(in_cells(plane));
    planes_.back().first_ring = ring_beyond(lane, plane.beyond_m, 0);
  }
  reached().raise(planes_);
  return true;
}

/// Raises a wall for the rings from ring_ to `end`, on the last ridge that carries one.
/// @return whether the last ridge does, if a wall is wanted
bool GroupLook::raise_before(std::size_t end, const PieceTargets& targets, std::size_t lane) {
  const std::size_t tries = std::min(kMostTries, sighted_.size());
  for (std::size_t i = 1; i <= tries; ++i) {
    Sighted& sighted = sighted_[sighted_.size() - i];
    if (!reached().is_promising(sighted.rise, static_cast<float>(sighted.slope), ring_, end))
      return true;
    // Its wall counts for all rings beyond it: once is enough.
    const bool was_tried = std::exchange(sighted.is_tried, true);
    if (was_tried ? sighted.is_walled : (sighted.is_walled = raise(sighted, targets, lane)))
      return true;
    if (i == 1 && failures_ < kMostFailures) return false;
  }
  return true;
}

/// Raises walls for the rays over a piece on the ridges that its middle ray sees: on the last ridge
/// before a ring that rises above all before it, if there are rings for which it counts.
void GroupLook::raise_walls(const ExitPiece& piece, const PieceTargets& targets, std::size_t lane) {
  sighted_.clear();
  const double first_slope = targets.plane ? targets.plane->line_slope : -HUGE_VAL;
  constexpr Places::Line kNoLine{-HUGE_VAL, -HUGE_VAL};
  const auto line_of = [&](double slope) {
    return slope > -HUGE_VAL ? targets.places.tangent(slope) : kNoLine;
  };
  Places::Line line = line_of(first_slope);  // lowest over what has been seen
  ring_ = 0, failures_ = 0;
  std::size_t open_end = reached().end_of_open();
  const double turn = (piece.rays.low_turn + piece.rays.high_turn) / 2;
  RidgeWalk walk(*ridges_, {std::max(piece.a.u_m, piece.b.u_m), (piece.a.v_m + piece.b.v_m) / 2, 0},
                 turn, settings_.most_drift_m);
  while (ring_ < open_end) {
    const bool is_last = !walk.find_over(line);
    const std::size_t end =
        is_last ? open_end : ring_beyond(lane, static_cast<double>(walk.crossing().u_m), ring_);
    if (end > ring_) {
      if (!raise_before(end, targets, lane)) {
        // As if the ridge were not there: it hid others from view.
        ++failures_;
        walk.pass(sighted_.back().strip, sighted_.back().crossing);
        sighted_.pop_back();
        line = line_of(sighted_.empty() ? first_slope : sighted_.back().slope);
        continue;
      }
      ring_ = end;
      open_end = reached().end_of_open();
    }
    if (is_last) return;
    const RidgeCrossing& crossing = walk.crossing();
    const auto u_m = static_cast<double>(crossing.u_m), z_m = static_cast<double>(crossing.z_m);
    line = targets.places.line_to(u_m, z_m, kLatticeStepM);
    const double rise_m = z_m + line.slope * (group_.centre.u_m - u_m) - group_.height_m;
    sighted_.push_back({crossing.edge, line.slope, static_cast<float>(rise_m / group_.radius_m),
                        walk.strip(), walk.place()});
    walk.pass(walk.strip(), walk.place());
  }
}

/// Lowers the bounds of cells by what rays over a piece can see of the group. Looks closer, at
/// halves, before it lowers any.
/// @param candidates  crests behind the edge
void GroupLook::look_from_piece(const ExitPiece& piece, std::span<const std::uint32_t> candidates) {
  if (is_entry(*view_, piece.rays, *piece.edge) || is_passed(piece)) return;
  const std::size_t lane = reach_from(piece);
  if (!reached().is_open()) return reached().lower(group_.bounds);
  PieceTargets& targets = targets_[depth_];
  find_targets(*view_, piece, crests_, candidates, targets);
  if (targets.plane) {
    planes_.assign(1, in_cells(*targets.plane));
    reached().raise(planes_);
    if (!reached().is_open()) return reached().lower(group_.bounds);
  }
  raise_walls(piece, targets, lane);
  const double du_m = piece.b.u_m - piece.a.u_m, dv_m = piece.b.v_m - piece.a.v_m;
  const double length_m = std::sqrt(du_m * du_m + dv_m * dv_m);
  const double fan_share = (piece.rays.high_turn - piece.rays.low_turn) / (2 * view_->fan.tan_half);
  const bool is_long = length_m > settings_.piece * group_.unit_m;
  const bool is_wide = fan_share > std::ldexp(1.5, -settings_.fan_halvings);
  if (!reached().is_open() || depth_ == kMostHalvings || !(is_long || is_wide))
    return reached().lower(group_.bounds);
  ExitPiece first = piece, second = piece;
  if (is_long) {
    first.b = second.a = {piece.a.u_m + du_m / 2, piece.a.v_m + dv_m / 2,
                          piece.a.z_m + (piece.b.z_m - piece.a.z_m) / 2};
  } else {
    const double middle_turn = (piece.rays.low_turn + piece.rays.high_turn) / 2;
    first.rays.high_turn = middle_turn;
    second.rays.low_turn = middle_turn;
  }
  reached().lower_closed(group_.bounds);
  ++depth_;
  look_from_piece(first, targets.crests);
  look_from_piece(second, targets.crests);
  --depth_;
}

}  // namespace scarp
