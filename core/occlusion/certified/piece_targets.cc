#include "core/occlusion/certified/piece_targets.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/horizon/certified/edge_plane.h"
#include "core/threads/for_each_target.h"

namespace scarp {
namespace {

/// The half-planes left of the line from one end of a piece that opens by the fan's half angle.
/// @param way  +1: the region beyond the piece, -1: behind it
HalfPlane opening_from(const FanView& view, const FanPlace& end, int side, int way) {
  const double tan_half = view.fan.tan_half;
  return {side * -end.v_m - way * end.u_m * tan_half + 4 * view.error_m, way * tan_half,
          static_cast<double>(side)};
}

/// The region ahead of a border edge.
HalfPlane ahead_of(const FanEdge& edge) {
  const double du_m = edge.b.u_m - edge.a.u_m, dv_m = edge.b.v_m - edge.a.v_m;
  const double length_m = std::sqrt(du_m * du_m + dv_m * dv_m);
  const double nu = dv_m / length_m, nv = -du_m / length_m;
  return {-nu * edge.a.u_m - nv * edge.a.v_m, nu, nv};
}

/// The region behind a piece that rays of the fan over it can come from.
struct Wedge {
  HalfPlane low, high, behind;
};

/// Rays over a piece. Where they cross it both ways, of the box around it.
void open_piece(const FanView& view, const ExitPiece& piece, bool is_proper, Wedge& wedge,
                Beam& beam) {
  const double low_v_m = std::min(piece.a.v_m, piece.b.v_m);
  const double high_v_m = std::max(piece.a.v_m, piece.b.v_m);
  const double low_u_m = std::min(piece.a.u_m, piece.b.u_m);
  const double high_u_m = std::max(piece.a.u_m, piece.b.u_m);
  beam.from = piece.a, beam.to = piece.b;
  if (is_proper) {
    wedge.low = opening_from(view, piece.a, 1, -1);
    wedge.high = opening_from(view, piece.b, -1, -1);
    beam.low = opening_from(view, piece.a, 1, 1);
    beam.high = opening_from(view, piece.b, -1, 1);
    beam.ahead = ahead_of(*piece.edge);
    wedge.behind = {-beam.ahead.c0, -beam.ahead.cu, -beam.ahead.cv};
  } else {
    wedge.low = opening_from(view, {high_u_m, low_v_m, 0}, 1, -1);
    wedge.high = opening_from(view, {high_u_m, high_v_m, 0}, -1, -1);
    beam.low = opening_from(view, {low_u_m, low_v_m, 0}, 1, 1);
    beam.high = opening_from(view, {low_u_m, high_v_m, 0}, -1, 1);
    beam.ahead = {-high_u_m, 1, 0};
    wedge.behind = {high_u_m + 4 * view.error_m, -1, 0};
  }
}

/// How far each corner is within each side of a wedge.
SCARP_FOR_EACH_TARGET
void measure_corners(const double* u_m, const double* v_m, std::size_t count, const Wedge& wedge,
                     double* within_low, double* within_high, double* within_behind) {
  const HalfPlane low = wedge.low, high = wedge.high, behind = wedge.behind;
  for (std::size_t i = 0; i < count; ++i) {
    within_low[i] = low.c0 + low.cu * u_m[i] + low.cv * v_m[i];
    within_high[i] = high.c0 + high.cu * u_m[i] + high.cv * v_m[i];
    within_behind[i] = behind.c0 + behind.cu * u_m[i] + behind.cv * v_m[i];
  }
}

bool is_same(const FanPlace& p, const FanPlace& q) {
  return p.u_m == q.u_m && p.v_m == q.v_m && p.z_m == q.z_m;
}

/// Lists the ends of crests within a wedge, corners that crests share once, and has the plane
/// through the border hold them.
class TargetList {
 public:
  TargetList(const FanView& view, const ExitPiece& piece, const FanCrests& crests,
             std::size_t most_crests, PieceTargets& targets)
      : border_(*piece.edge),
        crests_(crests),
        targets_(targets),
        plane_(view, border_.a, border_.b),
        at_corner_m_(kTooNear * 32 * view.error_m) {
    targets.listed.resize(crests.u_m.size());
    targets.held.resize(crests.u_m.size());
    if (++targets.turn == 0) {
      std::fill(targets.listed.begin(), targets.listed.end(), 0);
      std::fill(targets.held.begin(), targets.held.end(), 0);
      targets.turn = 1;
    }
    targets.places.clear(2 + 2 * most_crests);
    targets.under_plane.clear(2 * most_crests);
    for (const auto& [place, corner] :
         {std::pair{piece.a, border_.from}, std::pair{piece.b, border_.to}}) {
      targets.places.push_back(place);
      if (is_same(place, crests.corner(corner))) targets.listed[corner] = targets.turn;
    }
  }

  /// The part of a crest from one share of it to another.
  void add(const FanCrests::Ends& ends, double from, double to) {
    const FanPlace a = crests_.corner(ends[0]), b = crests_.corner(ends[1]);
    for (const double share : {from, to}) {
      const FanPlace place = between(a, b, share);
      if (is_same(place, a)) {
        add(place, ends[0], ends);
      } else if (is_same(place, b)) {
        add(place, ends[1], ends);
      } else {
        targets_.places.push_back(place);
        if (!is_of_border(place, ends)) targets_.under_plane.push_back(place);
      }
    }
  }

  /// The plane that holds all of them.
  const EdgePlane& plane() {
    if (targets_.under_plane.size() > 0) {
      targets_.under_plane.complete(0);
      plane_.hold(targets_.under_plane);
    }
    return plane_;
  }

 private:
  /// A place at a corner.
  void add(const FanPlace& place, std::uint32_t corner, const FanCrests::Ends& ends) {
    // Of a border's own corner some crests say nothing, and others do.
    if (targets_.held[corner] == targets_.turn) return;
    if (std::exchange(targets_.listed[corner], targets_.turn) != targets_.turn)
      targets_.places.push_back(place);
    if (is_of_border(place, ends)) return;
    targets_.held[corner] = targets_.turn;
    targets_.under_plane.push_back(place);
  }

  /// The end that a crest has in common with the border says nothing: the ground around it rises
  /// from the border as it does further back, where other crests bound it.
  bool is_of_border(const FanPlace& place, const FanCrests::Ends& ends) const {
    if (!plane_.is_too_near(place)) return false;
    const auto is_common = [&](std::uint32_t corner, const FanPlace& end) {
      return (ends[0] == corner || ends[1] == corner) && is_at(end, place);
    };
    return is_common(border_.from, border_.a) || is_common(border_.to, border_.b);
  }

  bool is_at(const FanPlace& end, const FanPlace& place) const {
    return std::abs(end.u_m - place.u_m) + std::abs(end.v_m - place.v_m) <= at_corner_m_;
  }

  const FanEdge& border_;
  const FanCrests& crests_;
  PieceTargets& targets_;
  EdgePlane plane_;
  double at_corner_m_;
};

}  // namespace

void FanCrests::place_corners(const FanView& view, std::span<const VertexIndex> vertices) {
  const std::size_t size = (vertices.size() + kPlacesAtOnce - 1) / kPlacesAtOnce * kPlacesAtOnce;
  u_m.resize(size), v_m.resize(size), z_m.resize(size);
  for (std::size_t i = 0; i < size; ++i) {
    const FanPlace& place = view.vertices[vertices[i < vertices.size() ? i : 0]];
    u_m[i] = place.u_m, v_m[i] = place.v_m, z_m[i] = place.z_m;
  }
}

void find_targets(const FanView& view, const ExitPiece& piece, const FanCrests& crests,
                  std::span<const std::uint32_t> candidates, PieceTargets& targets) {
  const FanEdge& border = *piece.edge;
  const bool is_proper = is_exit(view, border);
  Wedge wedge;
  open_piece(view, piece, is_proper, wedge, targets.beam);
  std::vector<double>&low = targets.within_low, &high = targets.within_high,
  &behind = targets.within_behind;
  for (auto* column : {&low, &high, &behind}) column->resize(crests.u_m.size());
  measure_corners(crests.u_m.data(), crests.v_m.data(), crests.u_m.size(), wedge, low.data(),
                  high.data(), behind.data());
  TargetList list(view, piece, crests, candidates.size(), targets);
  targets.crests.clear();
  for (const std::uint32_t i : candidates) {
    const auto [a, b] = crests.ends[i];
    // Most lie wholly outside one of the sides, or within all.
    if (std::min({std::max(low[a], low[b]), std::max(high[a], high[b]),
                  std::max(behind[a], behind[b])}) < 0)
      continue;
    double from = 0, to = 1;
    if (!(std::min({low[a], low[b], high[a], high[b], behind[a], behind[b]}) >= 0)) {
      cut(low[a], low[b], from, to);
      cut(high[a], high[b], from, to);
      cut(behind[a], behind[b], from, to);
      if (!(from <= to)) continue;
    }
    targets.crests.push_back(i);
    if (a == border.from && b == border.to) continue;
    list.add(crests.ends[i], from, to);
  }
  targets.plane.reset();
  if (is_proper)
    if (const EdgePlane& plane = list.plane(); plane.is_held())
      targets.plane = plane.plane(piece.a, piece.b);
  targets.places.complete(2 * view.height_error_m);
}

}  // namespace scarp
