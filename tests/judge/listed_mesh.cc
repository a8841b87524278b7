#include "tests/judge/listed_mesh.h"

#include <string>

#include "ingest/dem/dem.h"
#include "ingest/mesh/mesh.h"
#include "tests/support/shared_data.h"

namespace scarp::test {

std::optional<Tin> mesh_of(const ListedDem& listed, std::uint32_t vertices) {
  const auto path = shared_data(listed.file);
  if (!path) return {};
  DemOptions dem;
  if (listed.flat) dem.earth = Earth::kFlat;
  dem.nodata = listed.nodata;
  MeshOptions options;
  options.vertex_budget = vertices;
  return mesh_samples(place_samples(read_dem({*path}, dem, {})), options, {}).tin;
}

bool is_asked_for(const ListedDem& listed, const std::string& names) {
  return names.empty() ||
         ("," + names + ",").find("," + std::string(listed.name) + ",") != std::string::npos;
}

}  // namespace scarp::test
