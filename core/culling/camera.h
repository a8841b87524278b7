#pragma once

#include <optional>

#include "core/geodesy/position.h"
#include "core/raster/camera.h"

namespace scarp {

/// Azimuths in the flattened plane that a camera looks at, counter-clockwise from +x, both ends
/// included: from from_rad on to to_rad. All of them where to_rad - from_rad >= 2 pi.
/// Requires both within +-4 pi.
struct ViewRange {
  double from_rad;
  double to_rad;
};

/// A picture that is taken: which rays count. Methods that work on images need one.
struct Shot {
  View view;  ///< without exaggeration
  int width_px = 0;
  int height_px = 0;
};

/// A place to look from, and where to. The eye need not be over the surface.
struct Camera {
  Position eye;
  std::optional<ViewRange> view = {};  ///< none: all around
  std::optional<Shot> shot = {};
};

/// The camera that takes a picture: its view holds every ray of it, rounded outwards.
Camera camera_of(const Shot& shot);

}  // namespace scarp
