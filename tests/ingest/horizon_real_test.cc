#include <gtest/gtest.h>

#include <algorithm>

#include "core/horizon/stewart.h"
#include "ingest/dem/dem.h"
#include "ingest/mesh/mesh.h"
#include "tests/support/shared_data.h"

namespace scarp {
namespace {

TEST(HorizonReal, SameAsExhaustiveOnTheMeshOfBigTujunga) {
  SCARP_SHARED_OR_SKIP(path, "projected/bigtujunga_srtm30m_utm11.tif");
  MeshOptions options;
  options.vertex_budget = 10'000;
  const Mesh mesh = mesh_samples(place_samples(read_dem({path}, {}, {})), options, {});
  const std::vector<Position>& vertices = mesh.tin.vertices;
  ASSERT_EQ(vertices.size(), 10'000U);
  const SectorLayout layout{16, 4};
  const HorizonTable fast = stewart_horizons(vertices, layout, {});
  EXPECT_EQ(check_horizons(vertices, fast).value_or(""), "");
  const HorizonTable judge = stewart_horizons_exhaustive(vertices, layout, {});
  ASSERT_EQ(fast.horizon_vertex.size(), judge.horizon_vertex.size());
  for (std::size_t i = 0; i < fast.horizon_vertex.size(); ++i)
    ASSERT_EQ(fast.horizon_vertex[i], judge.horizon_vertex[i])
        << "vertex " << i / 16 << ", sector " << i % 16;
  const auto with_horizon = std::count_if(judge.horizon_vertex.begin(), judge.horizon_vertex.end(),
                                          [](VertexIndex v) { return v != kNone; });
  EXPECT_GT(with_horizon, 100'000);  // of 160,000: the comparison is not about nothing
}

}  // namespace
}  // namespace scarp
