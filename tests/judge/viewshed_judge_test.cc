#include <gdal_priv.h>
#include <gdal_utils.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/threads/parallel_for.h"
#include "core/viewshed/grid_sight.h"
#include "core/viewshed/part_sweep.h"
#include "ingest/dem/dem.h"
#include "ingest/dem/ground_placement.h"
#include "tests/support/shared_data.h"
#include "tests/support/temp_folder.h"

namespace scarp {
namespace {

/// SCARP_PROVE_VIEWSHEDS=1 takes whole DEMs instead of windows.
bool proving() {
  return std::getenv("SCARP_PROVE_VIEWSHEDS") != nullptr;
}

/// Side of the windows that are taken from the middle of a DEM.
constexpr int kWindow = 90;

/// A window as a file of its own, which keeps CRS and nodata.
std::string window_of(const std::string& dem, const test::TempFolder& folder) {
  GDALAllRegister();
  const GDALDatasetUniquePtr from(GDALDataset::Open(dem.c_str(), GDAL_OF_RASTER));
  const int columns = from->GetRasterXSize(), rows = from->GetRasterYSize();
  const int width = proving() ? columns : std::min(columns, kWindow);
  const int height = proving() ? rows : std::min(rows, kWindow - 13);
  std::vector<std::string> words = {"-of", "VRT", "-srcwin"};
  for (const int n : {(columns - width) / 2, (rows - height) / 2, width, height})
    words.push_back(std::to_string(n));
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  GDALTranslateOptions* options = GDALTranslateOptionsNew(arguments.data(), nullptr);
  const std::string window = folder.path("window.vrt");
  const GDALDatasetUniquePtr made(GDALDataset::FromHandle(
      GDALTranslate(window.c_str(), GDALDataset::ToHandle(from.get()), options, nullptr)));
  GDALTranslateOptionsFree(options);
  return window;
}

struct Eye {
  std::int32_t column = 0, row = 0;
};

/// Highest, lowest and middle known sample: on a ridge, in a valley, on a slope.
std::vector<Eye> eyes_of(const GroundGrid& grid) {
  Eye highest{-1, 0}, lowest{-1, 0}, middle{-1, 0};
  for (std::int32_t r = 0; r < grid.rows(); ++r) {
    for (std::int32_t c = 0; c < grid.columns(); ++c) {
      if (!grid.is_known(c, r)) continue;
      const double h = grid.height_m(c, r);
      if (highest.column < 0 || h > grid.height_m(highest.column, highest.row)) highest = {c, r};
      if (lowest.column < 0 || h < grid.height_m(lowest.column, lowest.row)) lowest = {c, r};
      if (middle.column < 0 ||
          std::abs(c - grid.columns() / 2) + std::abs(r - grid.rows() / 2) <
              std::abs(middle.column - grid.columns() / 2) + std::abs(middle.row - grid.rows() / 2))
        middle = {c, r};
    }
  }
  return {highest, lowest, middle};
}

struct Heights {
  double eye_m, target_m;
};
constexpr Heights kHeights[] = {{2, 0}, {2, 1.5}, {100, 0}, {10'000, 1.5}};

/// Names the cells on which sweep and judge differ, over eyes on and between samples.
void expect_equal(const std::string& file, const DemOptions& options) {
  const GroundGrid grid = read_ground({file}, options, {}).grid;
  const auto columns = static_cast<std::size_t>(grid.columns());
  const std::size_t cells = columns * static_cast<std::size_t>(grid.rows());
  std::vector<Seen> judged(cells), swept(cells);
  for (const Eye& at : eyes_of(grid)) {
    for (const auto& [eye_m, target_m] : kHeights) {
      const bool between = target_m > 0 && at.column > 0 && at.row > 0;
      const Position eye =
          grid.place(at.column - (between ? 0.37 : 0), at.row - (between ? 0.81 : 0),
                     grid.height_m(at.column, at.row) + eye_m);
      exhaustive_viewshed(grid, eye, target_m, judged);
      sweep_viewshed(grid, eye, target_m, whole_window(grid), swept);
      for (std::size_t i = 0; i < cells; ++i)
        EXPECT_EQ(judged[i], swept[i])
            << "eye over " << at.column << "," << at.row << " at " << eye_m << " m, target "
            << target_m << " m: column " << i % columns << " row " << i / columns;
    }
  }
}

class RealDems : public testing::TestWithParam<const char*> {};

TEST_P(RealDems, SweepEqualsJudge) {
  SCARP_SHARED_OR_SKIP(dem, GetParam());
  const test::TempFolder folder;
  const std::string window = window_of(dem, folder);
  const std::string name = GetParam();
  DemOptions options;
  if (name.find("crater_lake_30m") != std::string::npos) options.nodata = -32767;
  const bool has_crs = name.find(".asc") == std::string::npos && name[0] != 'l';
  const bool degrees = name.rfind("geographic/", 0) == 0;
  if (has_crs) expect_equal(window, options);
  if (!degrees || !has_crs) {
    options.earth = Earth::kFlat;
    expect_equal(window, options);
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, RealDems,
    testing::Values("projected/bigtujunga_srtm30m_utm11.tif", "projected/mt_st_helens_usgs30m.dem",
                    "projected/mandakini_srtm90_utm44.bil", "projected/meghalaya_50m_utm46.bil",
                    "projected/gabilan_lidar1m.bil", "projected/slovenia_lidar1m_nan_nodata.tif",
                    "projected/vinschgau_alps_250m_utm32.tif", "projected/new_zealand_1km_nztm.tif",
                    "projected/taiwan_xueshan_z13_webmercator.tif",
                    "geographic/N46E008_swiss_alps_srtm3.tif", "geographic/S33W071_aconcagua.dt1",
                    "geographic/N27E086_everest_srtm3_voids.tif",
                    "geographic/N35E138_fuji_srtm3.tif", "geographic/crater_lake_30m_wgs84.tif",
                    "geographic/zion_srtm3_uint16.tif", "geographic/front_range_srtmgl3.asc",
                    "literature/ashby_gap_va_i16.tif", "literature/crater_lake_west_i16.tif",
                    "urban/czech_village_dsm1m_krovak.tif"),
    [](const testing::TestParamInfo<const char*>& param) {
      std::string name = param.param;
      name = name.substr(name.find('/') + 1);
      name = name.substr(0, name.find('.'));
      return name;
    });

/// Positions may differ from the exact ones by what ground_placement promises and by the lattice.
TEST(GroundPlacement, LiesWithinAMillimetreOfTheExactPlace) {
  for (const char* name :
       {"projected/bigtujunga_srtm30m_utm11.tif", "geographic/N46E008_swiss_alps_srtm3.tif",
        "projected/new_zealand_1km_nztm.tif", "projected/taiwan_xueshan_z13_webmercator.tif"}) {
    SCARP_SHARED_OR_SKIP(file, name);
    const Ground ground = read_ground({file}, {}, {});
    const Dem dem = read_dem({file}, {}, {});
    const GeoFrame::Placer placer(*dem.frame);
    double most_m = 0;
    for (std::int32_t r = 0; r < dem.rows; r += 7) {
      for (std::int32_t c = 0; c < dem.columns; c += 5) {
        if (!ground.grid.is_known(c, r)) continue;
        const Position exact = placer.place_unrounded(
            {dem.x_of(c), dem.y_of(r),
             dem.heights_m[static_cast<std::size_t>(r) * static_cast<std::size_t>(dem.columns) +
                           static_cast<std::size_t>(c)]});
        const Position p = ground.grid.at(c, r);
        most_m =
            std::max(most_m, std::hypot(p.x_m - exact.x_m, p.y_m - exact.y_m, p.z_m - exact.z_m));
      }
    }
    EXPECT_LT(most_m, kInterpolationErrorM + kLatticeStepM) << name;
    EXPECT_GT(most_m, 0) << name;
  }
}

}  // namespace
}  // namespace scarp
