#pragma once

#include <optional>

#include "core/geodesy/position.h"

namespace scarp {

/// Azimuths in the flattened plane that a camera looks at, counter-clockwise from +x, both ends
/// included: from from_rad on to to_rad. All of them where to_rad - from_rad >= 2 pi.
/// Requires both within +-4 pi.
struct ViewRange {
  double from_rad;
  double to_rad;
};

/// A place to look from, and where to. The eye need not be over the surface.
struct Camera {
  Position eye;
  std::optional<ViewRange> view;  ///< none: all around
};

}  // namespace scarp
