#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/horizon/certified/curtains.h"
#include "core/horizon/certified/fan.h"

namespace scarp {

/// What a piece of the ground hides behind a curtain, for every ray of a fan that leaves any point
/// of the piece: a camera beyond u_m, at u_c, strictly under height_m + slope * (u_c - u_m).
struct SkyLine {
  double u_m;
  double height_m;
  double slope;
};

/// A straight piece of the ground, seen along a fan: two ends.
struct Piece {
  FanPlace a, b;
};

/// Walks outwards from a piece and calls visit(SkyLine) for curtains that hide more than all before
/// them: the slope rises from call to call and is greater than `slope`. Ends before end_u_m, where
/// a ray may leave the data sideways, or where visit returns true.
///
/// Why it is right. In a ray's own vertical plane the line from a point of the piece through the
/// top of the curtain is straight in (u, z), whatever the ray's direction. For a fixed top its
/// slope is a projective function of the place along the piece, hence greatest and least at the
/// ends; beyond the curtain the line with the lesser slope is the lower one. A ray passes a curtain
/// in one of the strips that it can have reached there, and the least of these is taken.
///
/// Side: never above the true line; errors of the frame and of heights are taken off.
/// Requires slope < infinity. Cost: O(strips reached) a curtain looked at; those that lie under
/// the line so far are passed over in blocks.
/// Source: own; walls of docs/architecture.md with a tilted target.
template <class Visit>
void visit_skyline(const Curtains& curtains, const FanView& view, const Piece& piece, double slope,
                   double end_u_m, Visit visit) {
  const double error_m = 4 * view.error_m;
  const double a_m = piece.a.z_m + view.height_error_m, b_m = piece.b.z_m + view.height_error_m;
  const double near_u_m = std::max(piece.a.u_m, piece.b.u_m);
  const double far_u_m = std::min(piece.a.u_m, piece.b.u_m);
  const double low_v_m = std::min(piece.a.v_m, piece.b.v_m) - error_m;
  const double high_v_m = std::max(piece.a.v_m, piece.b.v_m) + error_m;
  const auto middle =
      std::clamp(static_cast<std::int32_t>(curtains.strip_at(low_v_m + (high_v_m - low_v_m) / 2)),
                 0, curtains.strips() - 1);
  const double end_row = std::min(curtains.row_at(end_u_m), curtains.rows() - 1.0);
  if (!(end_row >= 0)) return;
  const auto last = static_cast<std::int32_t>(end_row);
  auto row = std::max(0, static_cast<std::int32_t>(curtains.row_at(near_u_m)));
  while (row <= last && !(curtains.u_of(row) > near_u_m + 4 * error_m)) ++row;
  double base_m = -std::numeric_limits<double>::infinity();
  const auto aim = [&] { base_m = std::max(a_m - slope * piece.a.u_m, b_m - slope * piece.b.u_m); };
  const bool has_slope = slope > -std::numeric_limits<double>::infinity();
  if (has_slope) aim();
  std::int32_t level = 0;
  while (row <= last) {
    // Whether a curtain of the block can reach above the line.
    const double best_u_m = slope >= 0 ? curtains.u_of(row) : curtains.u_of(row + (1 << level) - 1);
    const double line_m = base_m + (base_m > -HUGE_VAL ? slope * best_u_m : 0);
    if (!(static_cast<double>(curtains.highest(level, middle, row >> level)) > line_m)) {
      row += 1 << level;
      while (level + 1 < curtains.level_count() && (row & ((2 << level) - 1)) == 0) ++level;
      continue;
    }
    if (level > 0) {
      --level;
      continue;
    }
    const double u_m = curtains.u_of(row);
    const double spread_m = (u_m + error_m - far_u_m) * view.fan.tan_half + error_m;
    const double from = curtains.strip_at(low_v_m - spread_m);
    const double to = curtains.strip_at(high_v_m + spread_m);
    if (!(from >= 0 && to < curtains.strips())) return;
    const double line_here_m = base_m + (base_m > -HUGE_VAL ? slope * u_m : 0);
    const float* const end = curtains.row(row) + static_cast<std::int32_t>(to) + 1;
    float least = std::numeric_limits<float>::infinity();
    for (const float* s = curtains.row(row) + static_cast<std::int32_t>(from); s < end; ++s)
      least = std::min(least, *s);
    const auto height_m = static_cast<double>(least);
    if (height_m > line_here_m) {
      const auto slope_from = [&](const FanPlace& corner, double corner_m) {
        const double rise_m = height_m - corner_m;
        return rise_m / (u_m - corner.u_m + (rise_m > 0 ? error_m : -error_m));
      };
      const double steeper =
          std::min(slope_from(piece.a, a_m), slope_from(piece.b, b_m)) - view.height_error_m;
      if (steeper > slope) {
        slope = steeper;
        aim();
        if (visit(SkyLine{u_m, height_m, slope})) return;
      }
    }
    ++row;
    while (level + 1 < curtains.level_count() && (row & ((2 << level) - 1)) == 0) ++level;
  }
}

}  // namespace scarp
