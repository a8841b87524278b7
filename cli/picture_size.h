#pragma once

#include "core/raster/preview.h"

namespace scarp {

/// Sets the height of a picture from above so that the bounds fill it at options.width_px, and the
/// width instead where the scene is tall.
void fit_to(const Bounds& bounds, PreviewOptions& options);

}  // namespace scarp
