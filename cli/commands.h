#pragma once

#include "cli/options.h"

namespace scarp {

/// One function a subcommand, each in the file of its name. They print to standard output, throw
/// Error, and return the exit code.
int run_build(const BuildOptions& options);
int run_cull(const CullOptions& options);
int run_verify(const VerifyOptions& options);
int run_compare(const CompareOptions& options);
int run_fly(const FlyOptions& options);
int run_preview(const PreviewCommandOptions& options);
int run_viewshed(const ViewshedOptions& options);
int run_sight(const SightOptions& options);
int run_horizon(const HorizonOptions& options);
/// Horizons of all samples of a DEM, and what is made of them.
int run_all_horizons(const HorizonOptions& options);
int run_check(const CheckOptions& options);
int run_serve(const ServeOptions& options);

/// Parses the command line and runs the subcommand. Exit code: 0 done, 1 the input or a resource
/// is at fault (one line on standard error), 2 wrong use.
int run_command_line(int argc, char** argv);

}  // namespace scarp
