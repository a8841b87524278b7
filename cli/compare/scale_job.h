#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cli/compare/compared_job.h"
#include "core/threads/progress.h"
#include "ingest/dem/dem.h"

namespace scarp {

struct ScaleQuestion {
  std::vector<std::string> files;
  DemOptions dem;
  std::uint64_t seed = 1;
  double limit_s = 60;             ///< sizes that would not fit are left out
  std::uint64_t memory_bytes = 0;  ///< what a size may take; 0: half of the machine's
};

/// Slope of a line through the logarithms of points: the power of the samples that a figure grows
/// with. Requires two points or more that have the figure and differ in samples.
double fitted_exponent(std::span<const ComparedPoint> points, const std::string& figure);

/// Time and memory of a viewshed, of the horizons of all samples, and of a mesh, against samples:
/// of the DEM, and of squares around its middle, each with half the side of the one before.
/// @param why[out]  why there is nothing, where there is not
/// Throws Error as reading a DEM does.
std::optional<ComparedJob> compare_scale(const ScaleQuestion& question, const Progress& progress,
                                         std::string& why);

}  // namespace scarp
