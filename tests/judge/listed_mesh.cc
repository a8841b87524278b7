#include "tests/judge/listed_mesh.h"

#include <algorithm>
#include <string>

#include "cli/build/build_plan.h"
#include "ingest/dem/dem.h"
#include "ingest/dem/dem_windows.h"
#include "ingest/mesh/mesh.h"
#include "tests/support/shared_data.h"

namespace scarp::test {
namespace {

DemOptions dem_options(const ListedDem& listed) {
  DemOptions options;
  if (listed.flat) options.earth = Earth::kFlat;
  options.nodata = listed.nodata;
  return options;
}

}  // namespace

std::optional<Tin> mesh_of(const ListedDem& listed, std::uint32_t vertices) {
  const auto path = shared_data(listed.file);
  if (!path) return {};
  MeshOptions options;
  options.vertex_budget = vertices;
  return mesh_samples(place_samples(read_dem({*path}, dem_options(listed), {})), options, {}).tin;
}

std::optional<Tin> built_mesh_of(const ListedDem& listed) {
  const auto path = shared_data(listed.file);
  if (!path) return {};
  const DemWindows source({*path}, dem_options(listed));
  const Dem& dem = source.dem();
  const std::int32_t columns = std::min(dem.columns, kMostBuiltSamples);
  const std::int32_t rows = std::min(dem.rows, kMostBuiltSamples);
  const SampleGrid grid = place_window(
      dem, source.read({(dem.columns - columns) / 2, (dem.rows - rows) / 2, columns, rows}));
  const CellMeasures cells = measure_cells(dem);
  constexpr double kErrorCells = 0.1;  // what scarp build asks for unless told otherwise
  MeshOptions options;
  options.max_error_m = kErrorCells * std::min(cells.cell_x_m, cells.cell_y_m);
  return mesh_samples(grid, options, {}).tin;
}

bool is_asked_for(const ListedDem& listed, const std::string& names) {
  return names.empty() ||
         ("," + names + ",").find("," + std::string(listed.name) + ",") != std::string::npos;
}

}  // namespace scarp::test
