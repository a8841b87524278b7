#include "cli/picture_size.h"

#include <algorithm>
#include <cmath>

namespace scarp {

void fit_to(const Bounds& bounds, PreviewOptions& options) {
  constexpr double kLongest = 4;  // a strip is not drawn longer than this times its width
  const double wide_m = std::max(bounds.high.x_m - bounds.low.x_m, 1.0);
  const double tall_m = std::max(bounds.high.y_m - bounds.low.y_m, 1.0);
  const double shape = std::clamp(tall_m / wide_m, 1 / kLongest, kLongest);
  const int longest_px = options.width_px;
  const auto scaled = [&](double part) {
    const int inner_px = longest_px - 2 * options.margin_px;
    return std::max(1, static_cast<int>(std::lround(part * inner_px))) + 2 * options.margin_px;
  };
  options.width_px = shape > 1 ? scaled(1 / shape) : longest_px;
  options.height_px = shape > 1 ? longest_px : scaled(shape);
}

}  // namespace scarp
