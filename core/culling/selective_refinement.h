#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/culling/camera.h"
#include "core/occlusion/groups.h"
#include "core/terrain/edge_collapse.h"

namespace scarp {

/// Draws a surface with as many triangles as a picture needs, and fine ones only where something
/// is seen.
///
/// The levels are the collapses of the whole surface. A collapse is undone where a triangle that it
/// made is in the picture, over ground that may be seen, and may be wrong by more pixels than
/// allowed; so is what rests on it. The rest stays as it is. What is active is then one whole
/// surface of corner-to-corner triangles, so there are no cracks between levels, and no seams along
/// groups. Triangles over ground of which all is hidden are not drawn; along their borders a
/// silhouette that was moved by the allowed error can let one look into them.
///
/// Side: errors are bounds of the vertical gap, seen from the nearest corner.
/// Keeps references. Cost: the collapses, once; O(collapses) a picture.
/// Source: Law and Tan 1999, 6, after Hoppe 1997; collapses that rest on each other as in the
///   multi-triangulations of De Floriani, Magillo and Puppo 1997.
class SelectiveRefinement {
 public:
  SelectiveRefinement(const Tin& tin, const Groups& groups);

  struct Drawing {
    std::vector<std::array<VertexIndex, 3>> triangles;  ///< of the surface's vertices
    std::vector<std::uint32_t> objects;  ///< their numbers, as in CollapseHistory::triangles
    std::vector<TriangleIndex> active;   ///< of the whole surface that they are part of
    std::uint64_t undone = 0;            ///< collapses
  };

  /// @param most_px         that a place may be off in the picture
  /// @param visible_groups  ground that may be seen; none: all of it
  Drawing draw(const Shot& shot, double most_px,
               std::optional<std::span<const GroupIndex>> visible_groups) const;

  /// Leaves out of a drawing what lies under the outline of what is nearer in it (over_outline).
  /// Where the eye is not over the drawing's surface, nothing is.
  /// Side: no pixel of its picture changes, but those that show a triangle from below, through
  /// void. Cost: O(active + n log n).
  void leave_out_hidden(const Shot& shot, Drawing& drawing) const;

  const CollapseHistory& history() const { return history_; }
  std::uint64_t bytes() const;

 private:
  /// Bins of the plane: their columns and rows, counted.
  struct BinRange {
    std::uint32_t first_column, last_column, first_row, last_row;
  };

  /// What a picture's groups are in the plane; nothing where all is seen.
  struct SeenGround {
    std::vector<std::uint8_t> groups;
    /// How many bins that they touch lie before a bin in both directions: [rows + 1][columns + 1],
    /// so that those in a rectangle are four look-ups.
    std::vector<std::uint32_t> bins_before;
    std::size_t stride = 0;

    std::uint32_t bins_in(const BinRange& range) const {
      const auto before = [&](std::size_t row, std::size_t column) {
        return bins_before[row * stride + column];
      };
      return before(range.last_row + 1, range.last_column + 1) -
             before(range.first_row, range.last_column + 1) -
             before(range.last_row + 1, range.first_column) +
             before(range.first_row, range.first_column);
    }
  };

  void lay_out_bins();
  BinRange bins_of(const std::array<VertexIndex, 3>& triangle) const;
  SeenGround seen_ground(std::span<const GroupIndex> visible_groups) const;
  bool is_over_seen(const SeenGround& seen, TriangleIndex triangle) const;
  bool touches(const std::array<VertexIndex, 3>& triangle, std::uint32_t column,
               std::uint32_t row) const;
  bool is_over(const Position& eye, const Drawing& drawing) const;

  const Tin& tin_;
  const Groups& groups_;
  CollapseHistory history_;
  std::vector<float> error_m_;  // [triangles]
  std::vector<std::uint32_t> made_by_;
  double low_x_m_ = 0, low_y_m_ = 0, bin_m_ = 1;
  std::uint32_t columns_ = 1, rows_ = 1;
  std::vector<std::uint32_t> first_bin_;  // [groups + 2] into group_bins_; the last is the orphans'
  std::vector<std::uint32_t> group_bins_;
};

}  // namespace scarp
