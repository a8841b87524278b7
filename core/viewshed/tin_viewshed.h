#pragma once

#include <cstdint>
#include <span>

#include "core/geodesy/position.h"
#include "core/sight/tin_index.h"
#include "core/terrain/ground_grid.h"
#include "core/threads/progress.h"
#include "core/viewshed/grid_sight.h"
#include "core/viewshed/view_limits.h"

namespace scarp {

/// Puts the samples of a raster on a TIN: each at the lattice height at or next above the ground at
/// its place. Where it lies over void, or outside, it becomes void.
///
/// A border sample of a raster whose lines bend may lie a fraction of a cell outside the mesh: it
/// then has the height of the nearest ground inwards.
/// @param samples[in, out]  heights are set; places and marks as they come do not matter
/// Side: a sample is never under the ground, at most two lattice steps above it.
/// Cost: some look-ups in the index a sample, on all threads.
void stand_on(const TinIndex& index, GroundGrid& samples);

/// What an eye sees of targets above the samples of a window, with the TIN in the way: for each
/// what line_of_sight says.
/// @param sight[out]  [rows * columns]; the window is written, kUnknown where a sample is void
/// @return how many samples were judged by line_of_sight: those that TinHorizon leaves open
/// Cost: TinHorizon's, and two tenths of a microsecond a sample; on all threads, the same bits for
/// any number.
std::uint64_t tin_viewshed(const TinIndex& index, const GroundGrid& samples, const Position& eye,
                           double target_height_m, const SampleWindow& window,
                           std::span<Seen> sight, const Progress& progress = {});

/// The same by line_of_sight alone: slow beside what it judges.
void judge_tin_viewshed(const TinIndex& index, const GroundGrid& samples, const Position& eye,
                        double target_height_m, const SampleWindow& window, std::span<Seen> sight);

/// How high above each sample, along its normal, a target must be at least to be seen.
/// @param least_m[out]  [rows * columns] metres, as sweep_heights has them: 0 exactly where
///                      tin_viewshed says kVisible of the ground, NaN where void or over void
///                      ground, infinite where no height helps; otherwise a lattice step and more
///                      above what the line needs, by less than 1 mm and float's own step
/// @return how many samples were judged by line_of_sight
/// Cost: where the ground is hidden, ground_along and some lines of sight besides.
std::uint64_t tin_heights(const TinIndex& index, const GroundGrid& samples, const Position& eye,
                          const SampleWindow& window, std::span<float> least_m);

}  // namespace scarp
