#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/culling/camera.h"
#include "core/terrain/tin.h"

namespace scarp {

/// A place as an eye sees it that looks in a level direction: metres ahead in the plane, and to the
/// right and up for each metre ahead. Straight lines stay straight in (across, up).
struct AheadPoint {
  double ahead_m = 0;
  double right_m = 0;
  double across = 0, up = 0;  ///< meaningless where ahead_m < kNearestAheadM
};
inline constexpr double kNearestAheadM = 0.5;

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
  static constexpr int kBins = 512;
  /// Views that are wider are not asked: far sideways a metre ahead counts for little.
  static constexpr double kWidestRad = 2.6;

  /// An eye that sees everything.
  /// @return whether the view is narrow enough; otherwise nothing else may be called
  bool begin(const Position& eye, const ViewRange& view);

  AheadPoint place(const Position& position) const;

  /// The least metres ahead of a box; may be below zero.
  double nearest_m(const Bounds& box) const;

  /// Whether all of a box, or of the upper side of a triangle of the surface (its corners
  /// counter-clockwise from above), is hidden by what was added, or beside the view.
  /// Cost: the bins it spans.
  bool hides(const Bounds& box) const;
  bool hides(const std::array<AheadPoint, 3>& triangle) const;

  /// Adds a triangle of the surface. Cost: the bins it spans.
  void add(const std::array<AheadPoint, 3>& triangle);

 private:
  bool is_beside(const std::array<AheadPoint, 3>& triangle) const;
  double border(int bin) const { return left_ + bin * width_; }
  int bin_of(double across) const;

  Position eye_{};
  double ahead_x_ = 1, ahead_y_ = 0;         // unit vector, but for rounding
  double left_ = 0, right_ = 0, width_ = 0;  // of the view, across
  std::array<double, kBins> up_;             // what is lower is hidden
  std::array<double, kBins> farthest_m_;     // where it is farther ahead than this
};

}  // namespace scarp
