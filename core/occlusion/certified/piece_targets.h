#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/horizon/certified/fan.h"
#include "core/horizon/certified/wall.h"
#include "core/occlusion/certified/group_edges.h"
#include "core/terrain/tin.h"

namespace scarp {

/// Crests of a group in a fan's frame. Their corners are numbered within the group, and kept as
/// columns, so that they are measured side by side.
struct FanCrests {
  using Ends = std::array<std::uint32_t, 2>;  ///< corners

  std::vector<double> u_m, v_m, z_m;  ///< [corners, and repeated up to a multiple of kPlacesAtOnce]
  std::span<const Ends> ends;         ///< [crests]

  FanPlace corner(std::uint32_t i) const { return {u_m[i], v_m[i], z_m[i]}; }

  /// @param vertices  of the corners, at least one
  void place_corners(const FanView& view, std::span<const VertexIndex> vertices);
};

/// A border edge in a fan's frame.
struct FanEdge {
  FanPlace a, b;
  std::uint32_t from, to;  ///< corners, as in FanCrests
};

/// A part of a border edge of a group, over which rays of a fan leave the group; directed like the
/// edge, with the group on the left. v rises from a to b but for edges along the fan.
struct ExitPiece {
  FanPlace a, b;
  const FanEdge* edge;
};

/// Whether every ray of the fan that meets the edge's line crosses it from left to right.
inline bool is_exit(const FanView& view, const FanEdge& edge) {
  const double du_m = edge.b.u_m - edge.a.u_m, dv_m = edge.b.v_m - edge.a.v_m;
  return dv_m - (du_m < 0 ? -du_m : du_m) * view.fan.tan_half > 8 * view.error_m;
}

/// Whether no ray of the fan does.
inline bool is_entry(const FanView& view, const FanEdge& edge) {
  const double du_m = edge.b.u_m - edge.a.u_m, dv_m = edge.b.v_m - edge.a.v_m;
  return dv_m + (du_m < 0 ? -du_m : du_m) * view.fan.tan_half < -8 * view.error_m;
}

/// All that rays over a piece can come from, and where they go.
struct PieceTargets {
  /// A camera on a ray over the piece, beyond it, is hidden from all of them by the piece itself
  /// if it is strictly under the plane.
  std::optional<SkyPlane> plane;
  Places places;                      ///< corners of what is seen of the group, rounded up
  std::vector<std::uint32_t> crests;  ///< those of the candidates that touch the wedge
  Beam beam;                          ///< of the rays beyond the piece

  // For find_targets: how far corners are within each side of the wedge, and in which turn they
  // became a place, and one that the plane holds.
  std::vector<double> within_low, within_high, within_behind;
  std::vector<std::uint32_t> listed, held;
  std::uint32_t turn = 0;
  Places under_plane;  // those that the plane holds, not rounded
};

/// Finds the ground of a group from which rays of the fan can reach a piece: the wedge behind it.
/// A camera strictly under the plane through the border edge that has all of this ground under it
/// sees none of it over the piece (EdgePlane).
///
/// Side: the plane never above the true one; places never below the ground.
/// @param candidates  crests that can matter
/// @param targets[in,out]  its memory is reused
/// Cost: O(corners + candidates).
void find_targets(const FanView& view, const ExitPiece& piece, const FanCrests& crests,
                  std::span<const std::uint32_t> candidates, PieceTargets& targets);

}  // namespace scarp
