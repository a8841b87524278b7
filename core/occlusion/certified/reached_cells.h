#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/horizon/certified/fan.h"
#include "core/occlusion/certified/cell_kernels.h"
#include "core/occlusion/certified/polar_cells.h"

namespace scarp {

/// Rays of one direction through a group are sorted by where they pass its centre, in lanes.
inline constexpr std::int32_t kLanes = 128;

using RingRow = std::array<float, kRings>;

/// Rings in units of a group's radius, for fans of one width: the same for every group.
struct RingTable {
  RingRow near_inverse{}, far_inverse{};                   // of distances
  std::array<RingRow, kLanes> forward{};                   // least u of a camera by its distance
  std::array<std::array<double, kRings>, kLanes> reach{};  // least u of a camera
  std::array<std::array<double, kRings>, kLanes> turn_low{}, turn_high{};  // camera azimuth - ray's

  RingTable(const PolarLayout& layout, const Fan& fan);
};

/// Directions of the two borders of a sector, widened by kCellOverlap.
struct SectorBorders {
  float low_x, low_y, high_x, high_y;
};

std::vector<SectorBorders> borders_of(const PolarLayout& layout);

/// Sectors that cameras in a lane and ring of a fan can be in, from that of the fan's middle.
struct Turns {
  std::int32_t middle = 0;
  std::array<std::array<std::int16_t, kRings>, kLanes> first, last;
  double half_rad = 0;             ///< of the fan
  std::vector<float> borders_rad;  ///< [sectors + 1] where sectors begin, from the fan's middle;
                                   ///< the first is sectors / 2 before `middle`

  void turn_to(const PolarLayout& layout, const Fan& fan, const RingTable& rings);
};

/// A plane as cells see it, in units of the group's radius.
struct CellPlane {
  float rise;  ///< of the plane over the group's height, at its centre
  float x, y;  ///< gradient
  float slope_error;
  float line_rise;        ///< of the lowest line that rays see, at u of the centre
  float rising, falling;  ///< its slope where it rises and where it falls
  /// Only rays between these angles from the fan's middle come through it.
  float low_rad = -std::numeric_limits<float>::infinity();
  float high_rad = std::numeric_limits<float>::infinity();
  std::size_t first_ring = 0;  ///< from which on cameras are beyond it
};

/// Allowance for the rounding of angles in float, radians: four roundings of angles below 8.
inline constexpr float kAngleRounding = 0x1p-20F;

/// Relative allowance for the rounding of a slope in float: about ten operations of 2^-24 each.
inline constexpr float kSlopeRounding = 0x1p-19F;

/// The cells of cameras that rays over a piece lead to, ring by ring, and the best bound that is
/// known for each: slopes that no camera under them sees the group over the piece.
///
/// Most cells are of no use: no camera can be there over ground and under what is known already.
/// For these one bound for each ring does.
class ReachedCells {
 public:
  /// What is known of the cells of a group from elsewhere.
  struct Known {
    const float* bounds;          ///< [kRings * sectors]: no higher one is of use
    const std::uint16_t* least;   ///< [kRings * sectors]: nor one under this, as a slope_hint
    const std::uint64_t* wanted;  ///< a bit a cell: 0 where bounds are not over least (mark)
  };

  /// Marks the cells of which more than is known is of use, of those that any ray of a fan leads
  /// to. Bounds only fall, so that a cell that is not marked never will be.
  /// @param wanted[out]  [kRings * sectors / kCellsMarked]
  void mark(const Turns& turns, std::int32_t sectors, const Known& known, std::uint64_t* wanted);

  /// All cells that rays over a piece lead to.
  /// @param low, high  lanes that the rays pass the group's centre in
  void reach(const RingTable& rings, const Turns& turns, std::span<const SectorBorders> borders,
             std::size_t low, std::size_t high, const Known& known);

  /// Those of a piece's cells that are open, as far as rays over a part of it lead to them.
  void reach_part(const ReachedCells& whole, std::size_t low, std::size_t high);

  /// Raises what is known of each cell to the lowest of those planes that rays over the piece come
  /// through to it, of all planes in cells of no use; where cameras are not beyond one of them,
  /// nothing. Some plane is come through by every ray.
  void raise(std::span<const CellPlane> planes);

  /// One past the last ring with a bound that is short of what is of use; 0 where there is none.
  /// Cost: O(1) over all calls for each cell, because bounds only rise.
  std::size_t end_of_open();
  bool is_open() { return end_of_open() > 0; }

  /// Whether a line that rises by `slope`, and is `rise` over the group's height at its centre, is
  /// over one of these bounds by more than a tolerance.
  bool is_promising(float rise, float slope, std::size_t first, std::size_t end) const;

  /// Lowers a group's bounds to these. The bounds are those of `known`.
  void lower(float* bounds);
  /// Where they are not open, that is.
  void lower_closed(float* bounds) const;

 private:
  std::size_t size() const { return first_[kRings]; }
  void make_room(std::size_t size);
  void find_runs();
  /// The outer of the lanes has the least reach.
  const RingRow& forward() const { return rings_->forward[high_ + low_ >= kLanes ? high_ : low_]; }
  /// What the cells of a ring have in common for the lanes.
  struct InRing {
    float forward, least_rad, most_rad;  // angles by which cameras pass the centre
  };
  std::array<InRing, kRings> in_rings() const;

  std::array<std::uint32_t, kRings + 1> first_{};  // of each ring
  std::vector<std::uint32_t> cell_;                // in the group's bounds
  std::vector<std::uint16_t> ring_;
  std::vector<std::uint32_t> taken_;  // of the whole, for a part
  std::size_t open_end_ = 0;          // no cell from here on is open
  std::vector<float> near_inverse_, far_inverse_, forward_;
  std::vector<float> low_x_, low_y_, high_x_, high_y_;   // SectorBorders
  std::vector<float> low_border_rad_, high_border_rad_;  // of the sector, from the fan's middle
  std::vector<float> low_rad_, high_rad_;                // of rays that lead to the cell
  std::vector<float> best_, wanted_, least_;

  // The lanes, and bounds for whole rings of them.
  const RingTable* rings_ = nullptr;
  const Turns* turns_ = nullptr;
  std::size_t low_ = 0, high_ = 0;
  std::int32_t sectors_ = 0;
  const std::uint16_t* hints_ = nullptr;
  RingRow ring_best_{}, ring_least_{};
  // The cells of each ring, then what of them goes round the end of the row. Of a part of a piece
  // they are found when they are needed.
  std::array<CellRun, kRings * 2> runs_{};
  bool has_runs_ = false, go_round_ = false;
  std::size_t run_count() const { return go_round_ ? kRings * 2 : kRings; }
};

/// Bounds are not worked on to raise them by less than this slope.
inline constexpr float kSlopeTolerance = 0.001F;

}  // namespace scarp
