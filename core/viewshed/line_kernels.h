#pragma once

#include <cstddef>
#include <cstdint>

#include "core/terrain/ground_grid.h"
#include "core/viewshed/plan_frame.h"

namespace scarp {

/// The loops of a sweep, over plain arrays. Each is written once, as scalar code that the compiler
/// makes vectors of for several instruction sets and chooses from at run time. Every operation is
/// rounded by itself (no contraction), and the only reductions are maxima and minima, so that all
/// of them give the same bits.

/// Stands for "no ground" as a lower, and for "anything" as an upper bound of s.
inline constexpr float kNoGround = -1e30F;
inline constexpr float kAnyGround = 1e30F;

/// Heights in metres; where void, 0 and a mark.
/// @param stride     from one height to the next in steps
/// @return whether any is void
bool load_heights(const std::int32_t* steps, std::size_t stride, std::size_t count, double* z_m,
                  std::uint8_t* is_void);

/// Plan positions of a run of samples in one block, along a row or a column, in a plan frame.
/// Equal to GroundGrid::at and PlanFrame bit for bit.
/// @param u, v, du, dv  local place of the first sample, and from one to the next
void place_run(const BlockPlacement::Block& block, double u, double du, double v, double dv,
               std::size_t count, const double* z_m, const PlanFrame& frame, double* across,
               double* down);

/// Heights of targets on the normals of a run of samples, rounded to the lattice: z of
/// GroundGrid::raised.
void raise_run(const BlockPlacement::Block& block, double u, double du, double v, double dv,
               std::size_t count, const double* z_m, double height_m, double* raised_m);

/// The picture of samples: t in bins, s, from places in front of the eye.
/// @param is_void  null where none is
/// @return false where a sample is not in front by at least least_forwards
bool take_picture(std::size_t count, const double* forwards, const double* sideways,
                  const double* z_m, const std::uint8_t* is_void, double eye_z_m,
                  double low_tangent, double bins_per_tangent, double least_forwards, float* t,
                  float* s);

/// The same where all samples are equally far in front.
void take_level_picture(std::size_t count, double forwards, const double* sideways,
                        const double* z_m, const std::uint8_t* is_void, double eye_z_m,
                        double low_tangent, double bins_per_tangent, float* t, float* s);

/// Rises of s along a polyline: rise[i] of the segment after i, 0 where it has a void end; steep[i]
/// the greatest of that one and its two neighbours.
/// @param is_void  null where none is
/// @return whether neighbours are least_spacing apart in t, all of them
bool take_rises(std::size_t count, const float* t, const float* s, const std::uint8_t* is_void,
                float least_spacing, float* rise, float* steep);

/// Where bins' edges from first_edge on fall among samples that are nearly even: place[e] is the
/// sample before the edge, and how far the edge is towards the next. @return false where a first
/// guess misses by more than one sample; nothing holds then
bool near_even_places(std::int32_t first_edge, std::size_t edges, std::size_t count, const float* t,
                      float* place);

/// place[e] = e * per_edge + begin.
void even_places(std::size_t count, float per_edge, float begin, float* place);
void shift_places(std::size_t count, const float* place, float by, float* shifted);

/// Bounds of a polyline at the edges between bins.
/// @param place      [edges] sample before each edge, and how far the edge is towards the next
/// @param s, steep   of the polyline's samples
/// @param before, next_s, this_s [out]  the sample before each edge, s of the next and of itself
void edge_bounds(std::size_t edges, const float* place, const float* s, const float* steep,
                 float per_rise, float slope_margin, std::int32_t* before, float* this_s,
                 float* next_s, float* low, float* high);

/// Bounds of a polyline, and an upper one of the segments that lead to it, in each bin; they are
/// taken into those of the horizon.
/// @param place, place_before  [bins + 1] of the edges on this polyline and on the one before,
///                             both counted in samples of this one
/// @param higher               the higher end of each segment that leads here, by sample
/// @param higher_of_two        take_pairs of it
/// @param up[out]              [bins] upper bound of what this line and its segments reach
/// @return false where a bin has more than three segments; nothing holds then
bool bin_bounds(std::size_t bins, const float* place, const float* place_before, float slack,
                const float* higher, const float* higher_of_two, const std::int32_t* before,
                const float* this_s, const float* next_s, const float* edge_low,
                const float* edge_high, float* up, float* low, float* high);

/// pairs[i] = max(values[i], values[i + 1]); the last is alone.
void take_pairs(std::size_t count, const float* values, float* pairs);

/// For each bin the greater of two values.
void take_maximum(std::size_t count, const float* values, float* into);

/// Where a line's upper bound is the highest of all, it becomes the bin's line.
void take_top(std::size_t bins, const float* up, const float* high, std::int32_t line,
              std::int32_t* top);

enum class Decision : std::uint8_t { kHidden = 0, kVisible = 1, kOpen = 2 };

/// Targets against the bounds of their bins.
void classify(std::size_t count, const float* t, const float* s, std::int32_t bins,
              const float* low, const float* high, float slope_margin, Decision* decision);

}  // namespace scarp
