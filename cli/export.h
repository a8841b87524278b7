#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string_view>

#include "cli/options.h"
#include "tiles/store/part_folder.h"

namespace scarp {

class SceneTiles;
class Stages;

/// A format that `scarp export` writes: its name for --to, what it is in a word, the file by which
/// an earlier export of it is known (--overwrite), and what writes it.
struct Exporter {
  const char* name;
  const char* help;
  const char* mark;
  /// Fills the folder. Adds to `result` what the command shall tell. Throws Error.
  void (*write)(const ExportOptions& options, SceneTiles& scene, const PartFolder& folder,
                Stages& stages, nlohmann::json& result);
};

/// All of them: the table in export.cc.
std::span<const Exporter> exporters();
/// By name, or null.
const Exporter* find_exporter(std::string_view name);

// Each in the file of its name.
void export_groups(const ExportOptions& options, SceneTiles& scene, const PartFolder& folder,
                   Stages& stages, nlohmann::json& result);
void export_vdb(const ExportOptions& options, SceneTiles& scene, const PartFolder& folder,
                Stages& stages, nlohmann::json& result);
void export_tileset(const ExportOptions& options, SceneTiles& scene, const PartFolder& folder,
                    Stages& stages, nlohmann::json& result);
void export_geopackage(const ExportOptions& options, SceneTiles& scene, const PartFolder& folder,
                       Stages& stages, nlohmann::json& result);
void export_ugrid(const ExportOptions& options, SceneTiles& scene, const PartFolder& folder,
                  Stages& stages, nlohmann::json& result);

}  // namespace scarp
