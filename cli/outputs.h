#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "cli/options.h"
#include "cli/stages.h"
#include "ingest/crs/geo_frame.h"
#include "tiles/store/part_file.h"

namespace scarp {

/// What a command does where an output is there already: --overwrite.
Existing existing(const CommonOptions& common);

/// Before long work: throws Error{kInput} where an output is there and not to be replaced.
void check_new_file(const std::string& path, const CommonOptions& common);

/// What the surface and the frame are, for every output: {"surface", "earth", "refraction",
/// "heights"}.
struct SurfaceNote {
  std::string surface, earth, heights;
  double refraction = 0;
};
/// @param surface  "grid" or "tin"
SurfaceNote note_of(const std::string& surface, const FrameDescription& frame);

/// The same as metadata of a raster: SURFACE, EARTH, REFRACTION, HEIGHTS.
void write_note(const SurfaceNote& note, std::map<std::string, std::string>& metadata);

/// What each stage took, for a command's JSON.
nlohmann::json stages_json(const Stages& stages);

}  // namespace scarp
