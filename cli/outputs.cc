#include "cli/outputs.h"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/error/error.h"

namespace scarp {

Existing existing(const CommonOptions& common) {
  return common.overwrite ? Existing::kReplace : Existing::kRefuse;
}

void check_new_file(const std::string& path, const CommonOptions& common) {
  if (!path.empty() && !common.overwrite && std::filesystem::exists(path))
    throw Error(
        ErrorCode::kInput,
        fmt::format("'{}': exists; a new file was expected; give --overwrite to replace it", path));
}

SurfaceNote note_of(const std::string& surface, const FrameDescription& frame) {
  SurfaceNote note;
  note.surface = surface;
  note.earth = frame.earth == Earth::kFlat ? "flat" : "ellipsoid";
  note.heights = frame.earth == Earth::kFlat ? "above the map plane"
                 : frame.geoid_file.empty()  ? "taken as ellipsoidal"
                                             : "geoid added";
  note.refraction = frame.refraction;
  return note;
}

void write_note(const SurfaceNote& note, std::map<std::string, std::string>& metadata) {
  metadata["SURFACE"] = note.surface;
  metadata["EARTH"] = note.earth;
  metadata["REFRACTION"] = fmt::format("{:g}", note.refraction);
  metadata["HEIGHTS"] = note.heights;
}

nlohmann::json stages_json(const Stages& stages) {
  nlohmann::json result = nlohmann::json::array();
  for (const StageCost& cost : stages.costs())
    result.push_back(
        {{"name", cost.name}, {"seconds", cost.seconds}, {"peak_bytes", cost.peak_bytes}});
  return result;
}

}  // namespace scarp
