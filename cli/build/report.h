#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "cli/build/certified_settings.h"
#include "cli/options.h"
#include "cli/stage_clock.h"
#include "core/occlusion/build_groups.h"
#include "core/occlusion/groups.h"
#include "ingest/dem/dem.h"
#include "ingest/mesh/mesh.h"

namespace scarp {

/// The error that the mesh is asked for where the user names none: a tenth of the cell size.
inline constexpr double kDefaultErrorCells = 0.1;

/// As they are typed and recorded.
std::string growth_name(Growth growth);
std::string horizon_name(Hiding horizon);

/// Sectors of the horizons that a build makes, if it makes any.
SectorLayout stewart_layout(const BuildOptions& options);

/// What report.json tells of a build. Docs: docs/formats.md.
nlohmann::json build_report(const BuildOptions& options, const Dem& dem, const Mesh& mesh,
                            const MeshOptions& mesh_options, const Groups& groups,
                            const std::optional<CertifiedSettings>& certified,
                            const std::optional<BudgetChoice>& budget,
                            const GroupingReport& grouping, const MapPoint& observer,
                            const std::vector<StageCost>& stages);

/// Versions of this program and of the libraries that shape its results.
nlohmann::json library_versions();

}  // namespace scarp
