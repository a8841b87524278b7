#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/occlusion/groups.h"

namespace scarp {

/// Occlusion regions: where a camera is hidden from a vertex, a triangle, a group (groups.h).
///
/// Side: a region is never larger than the real one, so what it hides is hidden as far as the
/// horizon that it was made from is right. Rounding only shrinks it:
///  * a single ray is shifted and tilted by more than the error of its computation, see
///    region_of_vertex;
///  * a merged polyline goes through points on or under both of its sources. Those are concave,
///    and so is their lower envelope: chords between points under it, and a last ray that is no
///    steeper than it ever becomes, stay under it whatever the points' own errors are;
///  * hides() subtracts the error bound of its own evaluation.
/// Source: Edmondson 2004, 4.6.

/// Greatest error of distance_along: 2^-52 times |x axis.x| + |y axis.y|, at most sqrt(2) times
/// kLatticeReachM.
inline constexpr double kProjectionErrorM = 0x1p-24;

/// Horizontal allowance of a region for the projection errors of its horizon and of the camera,
/// and for the rounding of their sum: a quarter of a micrometre.
inline constexpr double kRegionShiftM = 4 * kProjectionErrorM;

/// The coordinate u of a place in a sector's plane, metres.
/// Requires |x_m|, |y_m| <= kLatticeReachM. Error: kProjectionErrorM.
inline double distance_along(const SectorAxis& axis, const Position& p) {
  return axis.x * p.x_m + axis.y * p.y_m;
}

/// A region under a single ray.
struct RayRegion {
  RegionPoint start;
  double slope;

  RegionView view() const { return {&start, 1, slope}; }
};

/// Region of a vertex whose horizon in a sector is made by another vertex: beyond that one, and
/// strictly under the ray from the vertex through it.
/// Requires the horizon to lie in the sector of `axis` as seen from the vertex, not at its place.
/// Accuracy: shifted by kRegionShiftM; slope lowered by 2^-50 of itself.
RayRegion region_of_vertex(const Position& vertex, const Position& horizon, const SectorAxis& axis);

/// A region that owns its points. No points: nothing is hidden.
struct Region {
  std::vector<RegionPoint> points;
  double end_slope = 0;

  RegionView view() const {
    return {points.data(), static_cast<std::uint32_t>(points.size()), end_slope};
  }
};

/// Intersection of two regions: starts where both have, lower envelope of both. Associative and
/// commutative but for rounding. `merged` must not own the points of a or b; its memory is reused.
/// Cost: O(points of a + points of b).
void merge_regions(const RegionView& a, const RegionView& b, Region& merged);

/// Height of a region's upper border at u_m, rounded down; exact at its points.
/// Requires a point, and u_m >= the first one's. Cost: O(log points).
double region_height_m(const RegionView& region, double u_m);

/// Whether a camera at (u_m, z_m) in the sector's plane is hidden. u_m as distance_along gives it.
/// Cost: O(log points).
bool hides(const RegionView& region, double u_m, double z_m);

/// Names the first broken invariant of the regions of `nodes` nodes, or nothing: a row for each
/// node and sector, finite numbers, points by rising u, each polyline with its last ray concave.
std::optional<std::string> check_regions(const Regions& regions, std::size_t nodes);

}  // namespace scarp
