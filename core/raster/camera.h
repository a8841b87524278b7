#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/geodesy/position.h"
#include "core/terrain/tin.h"

namespace scarp {

/// A point after projection, before division by w. On the screen: x/w to the right and y/w up,
/// both in [-1, 1]; z/w in [0, 1] is the depth, 1 at the near plane, 0 farthest (reversed, so
/// that float keeps its precision at a distance). w > 0 wherever z <= w.
struct ClipPosition {
  double x = 0;
  double y = 0;
  double z = 0;
  double w = 0;
};

/// A 4x4 matrix, row by row: clip = rows * (x_m, y_m, z_m, 1).
struct Projection {
  std::array<double, 16> rows{};

  ClipPosition project(const Position& p) const;
};

/// What a perspective picture is taken with. Lengths in metres, flattened frame, heights already
/// multiplied by the vertical exaggeration (see exaggerated()); neither point needs the lattice.
struct View {
  Position eye;
  Position target;
  Position up = {0, 0, 1};  ///< a direction; not that of the line of sight
  double vertical_field_of_view_rad = 0.7;
  double near_m = 0.1;  ///< nothing nearer than this, along the view, is seen
  /// How many times steeper than it is the terrain is drawn; to be told beside the picture.
  double vertical_exaggeration = 1;
  double base_z_m = 0;  ///< the height that exaggeration leaves where it is
};

/// The point with its height exaggerated as the view says.
Position exaggerated(const View& view, const Position& p);

/// Perspective projection without a far plane: depth is near_m over the distance along the view.
/// Where the view looks along `up`, north (+y) is up instead.
/// Requires (asserted): eye and target apart, positive sizes and near_m, field of view in (0, pi).
Projection look_at(const View& view, int width_px, int height_px);

/// The direction of the ray that a perspective projection puts at (x, y) of the screen, both in
/// [-1, 1]; its part along the view is 1.
Position ray_through(const Projection& projection, double x, double y);

/// Parallel projection straight down, north up: the whole of `bounds` centred in the picture, with
/// square pixels and `margin_px` left free at the narrower side; the highest point has depth 1,
/// the lowest 0. Requires (asserted) a picture larger than its margins.
Projection ortho_from_above(const Bounds& bounds, int width_px, int height_px,
                            double margin_px = 0);

/// How far below the lowest ground a block of ground goes, as a share of its greater extent.
inline constexpr double kBlockBaseShare = 0.02;

/// A view from the south-south-west and above in which all of the ground, as a block, is just seen.
/// Flat scenes are exaggerated until their relief is a tenth of their extent (at most 20 times).
/// Requires at least one position. Cost: O(n).
View default_view(std::span<const Position> ground, int width_px, int height_px);

/// Projects every point. Cost: O(n), in parallel.
std::vector<ClipPosition> project_all(const Projection& projection,
                                      std::span<const Position> positions);

}  // namespace scarp
