#pragma once

#include <cstddef>
#include <cstdint>

namespace scarp {

/// The loops of a march over plain arrays: kBundle rays of neighbouring cells side by side, in
/// groups of kGroup. Each is written once in vectors of any length (Highway), compiled for several
/// instruction sets, and the processor chooses at run time. Every operation is rounded by itself
/// and the only reductions are maxima, so that all of them give the same bits.
inline constexpr std::int32_t kBundle = 256, kGroup = 16, kGroups = kBundle / kGroup;

/// Rays of neighbouring cells and what is known of their horizons, as slopes.
struct RayBundle {
  static constexpr float kNone = -1e15F;  ///< slopes below are of no ground at all

  alignas(64) float eye_z[kBundle];
  /// Of crossings that are certain: the greatest slope, and the greatest error of any.
  alignas(64) float slope[kBundle];
  alignas(64) float error[kBundle];
  /// Of the others: never above the horizon, and never below what was met of it.
  alignas(64) float low[kBundle];
  alignas(64) float high[kBundle];
  /// Never below what was left out.
  alignas(64) float rest[kBundle];
  /// Where slope and high were met, metres; only with distances.
  alignas(64) float slope_run[kBundle];
  alignas(64) float run[kBundle];
  alignas(64) float over_void[kBundle];    ///< 1: void was met so far
  alignas(64) float void_before[kBundle];  ///< 1: ... and known ground behind it
};

/// A grid segment from a to b, which the rays of a bundle cross at `share` of it, the i-th ray at
/// share + i share_step, all strictly inside.
struct Crossing {
  const float* a;  ///< of the bundle's first lane
  const float* b;
  float share, share_step;
  float inverse_run, inverse_run_step;  ///< 1 / metres, of the first ray and from ray to ray
  float slack;                          ///< share's error times inverse_run
};

/// What a comparison does besides raising slopes.
struct MeetNotes {
  bool error = true;      ///< raises `error`; else the caller knows a bound of it
  bool distance = false;  ///< notes slope_run
  bool fans = true;       ///< places or runs differ from ray to ray
};

/// Compares rays with segments.
/// @param shift   added to all samples
/// @param groups  bit g: the rays of group g take part
/// @return the groups of which a slope rose
unsigned meet(const Crossing* crossings, std::size_t count, std::ptrdiff_t shift, unsigned groups,
              const MeetNotes& notes, RayBundle& rays);

/// A line that all rays cross so near to a sample that it does not matter on which side.
struct SampleCrossing {
  const float* z;     ///< of the bundle's first lane
  float inverse_run;  ///< 1 / metres
  float error;        ///< of the slope, where ground is steepest
};
/// Raises slope where the samples on both sides are known, and else high: the ray may pass on the
/// side where there is nothing.
/// @return the groups of which a slope rose
unsigned meet_samples(const SampleCrossing* crossings, std::size_t count, std::ptrdiff_t shift,
                      unsigned groups, RayBundle& rays);

/// A segment that rays may cross, at a share known within `reach`, or not at all.
struct PossibleCrossing {
  const float* a;  ///< of the bundle's first lane
  const float* b;
  float share, share_step, reach;
  float inverse_near, inverse_far;  ///< 1 / metres, bounds
};
/// Raises high only.
void meet_high(const PossibleCrossing& crossing, unsigned groups, RayBundle& rays);

/// Some rays meet a line near its samples, or not all in the same segment.
struct LooseCrossing {
  int first_ray, end_ray;   ///< that take part
  const float* z;           ///< of the bundle's first lane, and the next two lanes
  float place, place_step;  ///< lanes from there, growing from ray to ray; in [reach, 2 - reach]
                            ///< for those that take part
  float reach;              ///< the place's error, lanes
  float inverse_run;        ///< 1 / metres
};
/// Raises low and high.
/// @return the groups of which a low rose
unsigned meet_loosely(const LooseCrossing& crossing, RayBundle& rays);

/// Notes void on segments and known ground behind it. Call in order along the rays.
void note_void(const float* a, const float* b, unsigned groups, RayBundle& rays);
void note_void_loosely(const LooseCrossing& crossing, RayBundle& rays);

/// Ground that is no higher than the greatest of some heights, within a range of distances.
struct Square {
  const float* highest[8];  ///< of the bundle's first lane
  int count;
  float inverse_near, inverse_far;
};

/// Which groups have a ray that the ground might block more than `tolerance` above what it has met?
/// The others' `rest` rises to what the ground can do.
/// @param groups     that are asked
/// @param open[out]  [count]
void may_block(const Square* squares, std::size_t count, float tolerance, unsigned groups,
               RayBundle& rays, unsigned* open);

/// Rays that have met void see known ground in the square.
void note_ground_behind(const Square& square, unsigned groups, RayBundle& rays);

/// Final slopes' tangents of elevation.
struct ElevationRow {
  float level, level_step;  ///< of the first ray, and from ray to ray
  float rise, rise_step;
  float level_z, rise_z;  ///< per metre of the eye's z
  float bend;
  float shrink, shrink_step;  ///< slopes are multiplied by shrink + i shrink_step
  float error;                ///< tangent_error
  float slope_error;          ///< of the heights' rounding
  float least_error;          ///< of crossings that were not measured
  float drift;                ///< relative error of the runs at certain crossings
  bool has_unknown;           ///< some rays have no eye, or there is void
};

/// Elevation in steps of 0.01 degree from slopes, rounded down and up.
/// @param count  rays, at most kBundle
/// Where no ground was met: kNothingSeen in all three.
inline constexpr std::int16_t kNothingSeen = -9000, kUnknownElevation = -32768;
void elevations(const ElevationRow& row, const RayBundle& rays, std::int16_t* estimate,
                std::int16_t* lower, std::int16_t* upper);

}  // namespace scarp
