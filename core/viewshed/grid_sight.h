#pragma once

#include <cstdint>
#include <span>
#include <utility>

#include "core/geodesy/position.h"
#include "core/sight/ground_along.h"
#include "core/terrain/ground_grid.h"
#include "core/viewshed/plan_frame.h"

namespace scarp {

/// What an eye has of a target. The values are those of the output rasters.
enum class Seen : std::uint8_t { kHidden = 0, kVisible = 1, kUnknown = 255 };

/// The judge of sight lines on the surface `grid` (model R3), exact.
///
/// The open segment from the eye to a target is compared with the ground wherever its plan
/// crosses the segment between two neighbouring samples of a row or a column (heights linear
/// along it), and wherever it passes exactly over a sample. Strictly under the ground is blocked,
/// touching is not. Where it crosses a segment with a void end, or passes over a void sample, it
/// is over void ground: unknown, unless known ground blocks it elsewhere. Along a grid segment
/// that it runs on, only the samples count. A vertical segment is blocked where its lower end is
/// strictly under a sample or a segment that it stands on.
///
/// The eye may be anywhere: between samples, outside the data, under ground.
/// Errors: none; every decision is by exact predicates (core/geodesy/predicates.h).
/// Requires that a straight line crosses each grid line once at most where it runs more across
/// than along it, so grid lines may bend, by less than 45 degrees in all.
/// Cost: O(columns + rows) predicates a target, O(1) memory. Thread-safe.
class GridSight {
 public:
  /// grid is kept by reference.
  GridSight(const GroundGrid& grid, const Position& eye);

  /// Is a target seen that stands at or above a sample?
  /// @param target  GroundGrid::raised(column, row, height)
  Seen judge(const Position& target, std::int32_t column, std::int32_t row) const;
  /// The same for a target anywhere, as free as the eye.
  Seen judge(const Position& target) const;

  /// The ground wherever the segment to a target anywhere crosses the grid. A crossing blocks
  /// exactly where it makes judge say kHidden.
  /// Requires a target that is not at the eye's place in plan. Cost: as judge.
  GroundAlong ground_along(const Position& target) const;

  /// Does known ground block the target near some of the grid lines that its segment crosses?
  /// Looked at are the lines [first_line, last_line] (either order) and the segments that join
  /// each of them to the next within that range.
  /// @param over_columns  lines are columns, for segments that run about as much across as down
  ///                      or more; otherwise rows
  bool is_blocked_between(const Position& target, std::int32_t column, std::int32_t row,
                          bool over_columns, std::int32_t first_line, std::int32_t last_line) const;

  /// The flattened height that a target over a sample must have at least to be seen, were it to
  /// stand exactly over the sample; minus infinity where nothing is in between.
  /// @param over_void[out]  is the segment over void ground, so that nothing is known for certain?
  /// Accuracy: rounded up, by less than 0.1 mm for segments up to 1000 km.
  double least_z_m(const Position& sample, std::int32_t column, std::int32_t row,
                   bool& over_void) const;
  /// The same over the lines of is_blocked_between, without void.
  double least_z_between_m(const Position& sample, std::int32_t column, std::int32_t row,
                           bool over_columns, std::int32_t first_line,
                           std::int32_t last_line) const;

  const PlanFrame& frame() const { return frame_; }
  const Position& eye() const { return eye_; }
  const GroundGrid& grid() const { return grid_; }

 private:
  struct Walk;
  Walk start_walk(const Position& target, std::int32_t column, std::int32_t row,
                  bool over_columns) const;
  bool runs_across(const Position& target) const;
  std::pair<std::int32_t, std::int32_t> nearest_sample(const Position& target) const;
  template <typename Visit>
  void visit_lines(const Walk& walk, std::int32_t first_line, std::int32_t last_line,
                   const Visit& visit) const;
  Seen walk_lines(const Walk& walk, std::int32_t first_line, std::int32_t last_line) const;
  double climb_lines_m(const Walk& walk, std::int32_t first_line, std::int32_t last_line,
                       bool& over_void) const;
  std::pair<std::int32_t, std::int32_t> all_lines(const Walk& walk) const;
  Seen judge_vertical(const Position& target) const;

  const GroundGrid& grid_;
  Position eye_;
  PlanFrame frame_;
};

/// The definition word by word: every segment and every sample of the grid is tested. For tests
/// of the judge. Cost: O(columns * rows). Requires nothing of the grid lines.
Seen sight_by_every_segment(const GroundGrid& grid, const Position& eye, const Position& target);

/// Judges every sample, raised by the target height.
/// @param sight[out]  [rows * columns], kUnknown where the sample is void
/// Cost: O(columns + rows) predicates a sample, on all threads; the same bits for any number.
void exhaustive_viewshed(const GroundGrid& grid, const Position& eye, double target_height_m,
                         std::span<Seen> sight);

}  // namespace scarp
