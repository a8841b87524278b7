#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/culling/camera.h"
#include "core/culling/horizon_kernels.h"
#include "core/culling/horizon_triangles.h"
#include "core/terrain/tin.h"

namespace scarp {

/// A place as an eye sees it that looks in a level direction: metres ahead in the plane, and to the
/// right and up for each metre ahead. Straight lines stay straight in (across, up).
struct AheadPoint {
  double ahead_m = 0;
  double right_m = 0;
  double across = 0, up = 0;  ///< meaningless where ahead_m < kNearestAheadM
};

/// How much of a view ground hides, by direction: a horizon from below, that rises as ground is
/// added, with the distance at which it hides. The surface is a height field, so that what is
/// farther and lower in the same direction is hidden.
///
/// For each of kBins equal parts of the view it keeps what the best single triangle that spans the
/// part holds over all of it. Whether something is seen does not depend on the order in which
/// triangles are added; how much is found hidden does: it finds most from near to far.
///
/// Side: never calls hidden what any ray of the view reaches; computed in double, with kRounding to
/// spare in every comparison. What lies beside the view counts as hidden. Views upwards and
/// downwards are of no account: a ray counts whatever its height.
/// Source: own, of the occlusion horizons of Downs, Möller and Séquin 2001.
class RisingHorizon {
 public:
  static constexpr int kBins = HorizonBins::kBins;
  /// Views that are wider are not asked: far sideways a metre ahead counts for little.
  static constexpr double kWidestRad = 2.6;

  /// An eye that sees everything.
  /// @return whether the view is narrow enough; otherwise nothing else may be called
  bool begin(const Position& eye, const ViewRange& view);

  AheadPoint place(const Position& position) const;

  /// The least metres ahead of a box; may be below zero.
  double nearest_m(const Bounds& box) const;

  /// Whether all of a box lies beside the view, or behind the eye.
  bool is_beside(const Bounds& box) const;

  /// Whether all of a box, or of the upper side of a triangle of the surface (its corners
  /// counter-clockwise from above), is hidden by what was added, or beside the view.
  /// Cost: the bins it spans.
  bool hides(const Bounds& box) const;
  bool hides(const std::array<AheadPoint, 3>& triangle) const;

  /// Adds a triangle of the surface; one that is seen from behind adds nothing, because those
  /// before it are as high. Cost: the bins it spans.
  void add(const std::array<AheadPoint, 3>& triangle);

  /// Whether any of some triangles may be seen: is not hidden. If so, and where `adds`, adds all of
  /// them. The same as for one after the other, in vectors, about 15 nanoseconds a triangle.
  bool shows(const HorizonTriangles::Group& triangles, bool adds);

  /// As it stands.
  const HorizonBins& bins() const { return bins_; }

 private:
  bool are_beside(std::span<const AheadPoint> corners) const;
  bool is_under_in_parts(const std::array<AheadPoint, 3>& from_left, double nearest_m, int first,
                         int last) const;
  bool shows_any(const SeenTriangles& seen) const;
  double border(int bin) const { return bins_.left + bin * bins_.width; }
  int bin_of(double across) const;

  HorizonEye eye_;
  HorizonBins bins_;
  std::vector<SeenTriangles> seen_;  // of the triangles that are asked for, kSetUp each
};

}  // namespace scarp
