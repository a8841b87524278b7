#include <gdal_priv.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/viewshed/part_sweep.h"
#include "ingest/dem/dem.h"
#include "tests/support/shared_data.h"

namespace scarp {
namespace {

/// An eye 1.75 m over a sample on the flat earth, from which others have made viewsheds.
struct PeerEye {
  const char* dem;
  const char* extension;
  const char* name;
  std::int32_t column, row;
};

std::vector<std::uint8_t> read_raster(const std::string& path) {
  GDALAllRegister();
  const GDALDatasetUniquePtr file(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER));
  const int columns = file->GetRasterXSize(), rows = file->GetRasterYSize();
  std::vector<std::uint8_t> values(static_cast<std::size_t>(columns) *
                                   static_cast<std::size_t>(rows));
  EXPECT_EQ(file->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, columns, rows, values.data(), columns,
                                             rows, GDT_Byte, 0, 0, nullptr),
            CE_None);
  return values;
}

double share_that_differs(const std::vector<Seen>& seen, const std::vector<std::uint8_t>& theirs) {
  std::size_t compared = 0, differs = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i] == Seen::kUnknown || theirs[i] == 255) continue;
    ++compared;
    differs += (seen[i] == Seen::kVisible) != (theirs[i] == 1);
  }
  return static_cast<double>(differs) / static_cast<double>(compared);
}

class Peers : public testing::TestWithParam<PeerEye> {};

/// r.viewshed interpolates in its own way, another exhaustive search samples a bilinear surface:
/// neither is right to the cell, and neither can be far off.
TEST_P(Peers, AgreeWithinTheirBounds) {
  constexpr double kGrassBound = 0.012, kBilinearBound = 0.003;
  const PeerEye& at = GetParam();
  const std::string made = std::string("reference/computed/") + at.dem + "__" + at.name + "__";
  SCARP_SHARED_OR_SKIP(dem, std::string("projected/") + at.dem + at.extension);
  SCARP_SHARED_OR_SKIP(grass, made + "grass_rviewshed.tif");
  SCARP_SHARED_OR_SKIP(bilinear, made + "bruteforce_bilinear.tif");
  DemOptions options;
  options.earth = Earth::kFlat;
  const GroundGrid grid = read_ground({dem}, options, {}).grid;
  std::vector<Seen> seen(static_cast<std::size_t>(grid.columns()) *
                         static_cast<std::size_t>(grid.rows()));
  sweep_viewshed(grid, grid.raised(at.column, at.row, 1.75), 0, whole_window(grid), seen);
  EXPECT_LT(share_that_differs(seen, read_raster(grass)), kGrassBound);
  EXPECT_LT(share_that_differs(seen, read_raster(bilinear)), kBilinearBound);
  RecordProperty("grass", std::to_string(share_that_differs(seen, read_raster(grass))));
  RecordProperty("bilinear", std::to_string(share_that_differs(seen, read_raster(bilinear))));
}

INSTANTIATE_TEST_SUITE_P(
    All, Peers,
    testing::Values(PeerEye{"bigtujunga_srtm30m_utm11", ".tif", "summit", 952, 96},
                    PeerEye{"bigtujunga_srtm30m_utm11", ".tif", "valley", 54, 508},
                    PeerEye{"bigtujunga_srtm30m_utm11", ".tif", "random0", 504, 560},
                    PeerEye{"mt_st_helens_usgs30m", ".dem", "summit", 148, 220},
                    PeerEye{"mt_st_helens_usgs30m", ".dem", "valley", 176, 440},
                    PeerEye{"mt_st_helens_usgs30m", ".dem", "random0", 79, 418},
                    PeerEye{"gabilan_lidar1m", ".bil", "summit", 690, 672},
                    PeerEye{"gabilan_lidar1m", ".bil", "valley", 71, 204},
                    PeerEye{"gabilan_lidar1m", ".bil", "random0", 458, 748}));

}  // namespace
}  // namespace scarp
