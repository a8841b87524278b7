#include "cli/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/outputs.h"
#include "cli/scene_tiles.h"
#include "cli/stages.h"
#include "core/error/error.h"

namespace scarp {
namespace {

/// Throws Error{kUsage} for an option that the format has no use for.
void check_used(const ExportOptions& options) {
  const auto refuse = [&](const char* option, const char* format) {
    throw Error(ErrorCode::kUsage, fmt::format("{} is for --to {}, and --to {} was given; leave it "
                                               "out",
                                               option, format, options.to));
  };
  const bool is_vdb = options.to == "vdb";
  if (options.observer && !is_vdb) refuse("--observer", "vdb");
  if (!options.altitudes_m.empty() && !is_vdb) refuse("--altitudes", "vdb");
  if (options.cell_m && !is_vdb) refuse("--cell", "vdb");
  if (options.compress && options.to != "3dtiles") refuse("--compress", "3dtiles");
  if (!options.dem_files.empty() && options.to != "ugrid") refuse("--dem", "ugrid");
}

constexpr std::array kExporters = {
    Exporter{"3dtiles", "a tileset of 3D Tiles 1.1", "tileset.json", export_tileset},
    Exporter{"groups", "what a simulator culls groups by", "groups.scarp", export_groups},
    Exporter{"vdb", "view cells of the airspace as OpenVDB", "cells.vdb", export_vdb},
    Exporter{"gpkg", "groups as polygons, a GeoPackage", "groups.gpkg", export_geopackage},
    Exporter{"ugrid", "the mesh as UGRID netCDF, with its groups, error and horizons", "mesh.nc",
             export_ugrid},
};

}  // namespace

std::span<const Exporter> exporters() {
  return kExporters;
}

const Exporter* find_exporter(std::string_view name) {
  const auto found = std::find_if(kExporters.begin(), kExporters.end(),
                                  [&](const Exporter& e) { return name == e.name; });
  return found == kExporters.end() ? nullptr : &*found;
}

int run_export(const ExportOptions& options) {
  check_used(options);
  const Exporter& exporter = *find_exporter(options.to);
  SceneTiles scene(options.scene);
  PartFolder folder(options.output, exporter.mark, existing(options.common));
  Stages stages(!options.common.json);
  nlohmann::json result = {{"format", exporter.name}, {"output", options.output}};
  exporter.write(options, scene, folder, stages, result);
  folder.commit();
  stages.finish();
  if (options.common.json) {
    result["stages"] = stages_json(stages);
    fmt::print("{}\n", result.dump(2));
    return 0;
  }
  fmt::print("{}: {}\n", options.output, exporter.help);
  for (const auto& [name, value] : result.items())
    if (value.is_number() || value.is_boolean()) fmt::print("  {}: {}\n", name, value.dump());
  return 0;
}

}  // namespace scarp
