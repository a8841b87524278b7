#include <gdal_priv.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "core/horizon/stewart.h"
#include "tests/support/shared_data.h"

namespace scarp {
namespace {

/// A random subset of a raster's samples, in the raster's own plane: irregular, like a mesh.
std::vector<Position> random_samples(const std::string& path, std::size_t count) {
  GDALAllRegister();
  const GDALDatasetUniquePtr dataset(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER));
  if (!dataset) return {};
  const int columns = dataset->GetRasterXSize(), rows = dataset->GetRasterYSize();
  std::vector<float> heights(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  GDALRasterBand* band = dataset->GetRasterBand(1);
  if (band->RasterIO(GF_Read, 0, 0, columns, rows, heights.data(), columns, rows, GDT_Float32, 0,
                     0) != CE_None)
    return {};
  int has_void = 0;
  const double void_value = band->GetNoDataValue(&has_void);
  double t[6] = {};
  dataset->GetGeoTransform(t);
  std::vector<Position> samples;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const auto height_m = static_cast<double>(heights[i]);
    if (has_void && height_m == void_value) continue;
    const double column = static_cast<double>(i % static_cast<std::size_t>(columns)) + 0.5;
    const double row = static_cast<double>(i / static_cast<std::size_t>(columns)) + 0.5;
    samples.push_back(round_to_lattice(
        Position{t[0] + column * t[1] + row * t[2], t[3] + column * t[4] + row * t[5], height_m}));
  }
  std::shuffle(samples.begin(), samples.end(), std::mt19937_64(1));
  samples.resize(std::min(samples.size(), count));
  return samples;
}

TEST(HorizonReal, SameAsExhaustiveOnTenThousandSamplesOfBigTujunga) {
  SCARP_SHARED_OR_SKIP(path, "projected/bigtujunga_srtm30m_utm11.tif");
  const std::vector<Position> vertices = random_samples(path, 10'000);
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
