#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "cli/build/step_run.h"
#include "cli/options.h"
#include "core/horizon/sectors.h"
#include "ingest/crs/geo_frame.h"

namespace scarp {

/// Sectors of the horizons that a build makes, if it makes any.
SectorLayout stewart_layout(const BuildOptions& options);

/// What report.json tells of a build whose other steps are done. Docs: docs/formats.md.
/// @param run  of the last step, with the parts that it has done so far
nlohmann::json build_report(const StepRun& run, const std::optional<MapPoint>& observer);

/// Versions of this program and of the libraries that shape its results.
nlohmann::json library_versions();

}  // namespace scarp
