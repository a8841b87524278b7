#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/horizon/certified/edge_plane.h"
#include "core/horizon/certified/fan.h"
#include "core/horizon/certified/places.h"
#include "core/horizon/certified/ridges.h"

namespace scarp {

/// c0 + cu * u + cv * v: the signed distance from a line in the fan's frame, or a multiple of it.
struct HalfPlane {
  double c0, cu, cv;

  double at(const FanPlace& p) const { return c0 + cu * p.u_m + cv * p.v_m; }
};

/// Cuts [from, to], shares of an edge whose ends are at `p` and `q` by a half-plane, to where it is
/// not negative; from > to where nothing is left.
inline void cut(double p, double q, double& from, double& to) {
  if (p < 0 && q < 0) to = -1;
  if (p < 0 && q >= 0) from = from > p / (p - q) ? from : p / (p - q);
  if (p >= 0 && q < 0) to = to < p / (p - q) ? to : p / (p - q);
}

inline FanPlace between(const FanPlace& p, const FanPlace& q, double share) {
  return {p.u_m + share * (q.u_m - p.u_m), p.v_m + share * (q.v_m - p.v_m),
          p.z_m + share * (q.z_m - p.z_m)};
}

/// Where rays of a fan can be, beyond the line from `from` to `to` that they have come through: not
/// negative in all three.
struct Beam {
  HalfPlane low, high, ahead;
  FanPlace from, to;
};

/// What a chain of edges across a beam hides: cameras beyond every edge (SkyPlane::beyond_m) and
/// strictly under every plane. A ray crosses one of the edges at least, and it is enough that its
/// camera is beyond that one and under its plane: so only those planes count that a ray of its
/// direction can come through (SkyPlane::low_turn).
struct Wall {
  std::vector<SkyPlane> planes;
  std::vector<VertexIndex> chain;  ///< by rising v; its memory is reused
};

/// Raises a wall on a ridge: follows it both ways, along the edges that look highest, until it
/// spans the beam, and hangs from each of its edges the plane that has all targets under it: the
/// plane through the edge where all targets are behind it (EdgePlane), and one level across the fan
/// where they are not, as from an edge that leads along the fan round a void (CurtainPlane).
///
/// Why it is right. What of the chain is within the beam lies ahead of where the beam begins, and
/// leads from one side of the beam to the other, so every ray crosses it after it has come through
/// what the beam begins with, and before any camera beyond what it crosses. Where it
/// crosses an EdgePlane's edge it comes from behind, since all targets are there; a CurtainPlane
/// holds whichever way it is crossed. Under that edge's plane the ray is stopped, and a camera
/// under all of the planes sees none of the targets.
///
/// @param targets  all that may be seen, as the corners of its hull, heights rounded up
/// @param slope    of the sight lines that the wall is to stop; guides where the chain goes
/// @return whether there is such a wall
/// Side: planes never above the true ones. Cost: O(chain * (targets + edges at a vertex)).
bool raise_wall(const RidgeEdges& ridges, const FanView& view, const Beam& beam,
                const Places& targets, std::uint32_t edge, double slope, Wall& wall);

}  // namespace scarp
