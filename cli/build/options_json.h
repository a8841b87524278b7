#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "cli/options.h"

namespace scarp {

/// As they are typed and recorded.
std::string growth_name(Growth growth);
std::string horizon_name(Hiding horizon);

/// The options that shape a scene, for plans and for telling builds apart: what two builds have to
/// share to make the same bits. Without the DEM files, the output, and how the work is done.
nlohmann::json to_json(const BuildOptions& options);

/// The inverse; what is missing keeps its default. Throws nlohmann's exceptions where a member is
/// of another type, Error{kUsage} where it is not understood.
BuildOptions build_options_from(const nlohmann::json& json);

}  // namespace scarp
