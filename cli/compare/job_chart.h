#pragma once

#include <string>

#include "cli/compare/compared_job.h"

namespace scarp {

/// Draws one of a job's charts as SVG: filled marks, hollow where unsafe, a ring around defaults, a
/// diamond for the judge, the front as steps, a line from the least to the most of several runs. An
/// error of zero has a line of its own under a logarithmic axis. Requires a point with both
/// figures, x above zero, y not negative.
std::string draw_chart(const ComparedJob& job, const ComparedChart& chart);

}  // namespace scarp
