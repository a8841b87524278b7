#pragma once

#include "cli/build/workspace.h"
#include "cli/progress_bar.h"

namespace scarp {

/// Does all steps of a plan that are not done, in the plan's order; meshes of several tiles at once
/// as far as --memory allows. The last one makes the scene.
/// @param bar  shows each stage with the time left for all of its steps
void run_plan(Workspace& work, ProgressBar& bar);

/// Does one step. Throws Error{kUsage} where there is no such step, or one before it is not done.
/// @return false where it was done already
bool run_one_step(Workspace& work, std::size_t step, ProgressBar& bar);

}  // namespace scarp
