#include "core/occlusion/certified/piece_targets.h"

#include <algorithm>
#include <cmath>

#include "core/horizon/certified/edge_plane.h"

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

}  // namespace

void find_targets(const FanView& view, const ExitPiece& piece, std::span<const FanEdge> crests,
                  std::span<const std::uint32_t> candidates, PieceTargets& targets) {
  const FanEdge& border = *piece.edge;
  const bool is_proper = is_exit(view, border);
  Wedge wedge;
  open_piece(view, piece, is_proper, wedge, targets.beam);
  EdgePlane plane(view, border.a, border.b);
  const auto is_at = [&](const FanPlace& end, const FanPlace& place) {
    return std::abs(end.u_m - place.u_m) + std::abs(end.v_m - place.v_m) <=
           kTooNear * 32 * view.error_m;
  };
  targets.places = {piece.a, piece.b};
  targets.crests.clear();
  for (const std::uint32_t i : candidates) {
    const FanEdge& crest = crests[i];
    double from = 0, to = 1;
    cut(wedge.low.at(crest.a), wedge.low.at(crest.b), from, to);
    if (!(from <= to)) continue;
    cut(wedge.high.at(crest.a), wedge.high.at(crest.b), from, to);
    if (!(from <= to)) continue;
    cut(wedge.behind.at(crest.a), wedge.behind.at(crest.b), from, to);
    if (!(from <= to)) continue;
    targets.crests.push_back(i);
    if (crest.from == border.from && crest.to == border.to) continue;
    const bool touches_a = crest.from == border.from || crest.to == border.from;
    const bool touches_b = crest.from == border.to || crest.to == border.to;
    for (const double share : {from, to}) {
      const FanPlace place = between(crest.a, crest.b, share);
      targets.places.push_back(place);
      // The end that a crest has in common with the border says nothing: the ground around it
      // rises from the border as it does further back, where other crests bound it.
      if (plane.is_too_near(place) &&
          ((touches_a && is_at(border.a, place)) || (touches_b && is_at(border.b, place))))
        continue;
      plane.hold(place);
    }
  }
  targets.plane.reset();
  if (is_proper && plane.is_held()) targets.plane = plane.plane(piece.a, piece.b);
  for (FanPlace& place : targets.places) place.z_m += 2 * view.height_error_m;
}

}  // namespace scarp
