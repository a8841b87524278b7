#include <gdal_priv.h>
#include <gdal_utils.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include "core/threads/parallel_for.h"
#include "core/viewshed/grid_sight.h"
#include "core/viewshed/part_sweep.h"
#include "core/viewshed/tin_viewshed.h"
#include "ingest/dem/dem.h"
#include "ingest/dem/dem_windows.h"
#include "ingest/dem/ground_placement.h"
#include "ingest/mesh/mesh.h"
#include "tests/support/dem_list.h"
#include "tests/support/shared_data.h"
#include "tests/support/temp_folder.h"

namespace scarp {
namespace {

/// SCARP_PROVE_VIEWSHEDS=SIDE takes windows of up to SIDE x SIDE samples, which of most DEMs is
/// all.
int proved_side() {
  const char* side = std::getenv("SCARP_PROVE_VIEWSHEDS");
  return side ? std::atoi(side) : 0;
}

/// Side of the windows that are taken from the middle of a DEM otherwise.
constexpr int kWindow = 80;

/// A window as a file of its own, which keeps CRS and nodata.
std::string window_of(const std::string& dem, const test::TempFolder& folder) {
  GDALAllRegister();
  const GDALDatasetUniquePtr from(GDALDataset::Open(dem.c_str(), GDAL_OF_RASTER));
  const int columns = from->GetRasterXSize(), rows = from->GetRasterYSize();
  const int side = proved_side();
  const int width = std::min(columns, side > 0 ? side : kWindow);
  const int height = std::min(rows, side > 0 ? side : kWindow - 13);
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

/// Greatest difference of height in the square around a sample; infinite where that is not all
/// known ground.
double relief_m(const GroundGrid& grid, std::int32_t column, std::int32_t row) {
  constexpr std::int32_t kReach = 4;
  double low_m = std::numeric_limits<double>::infinity(), high_m = -low_m;
  for (std::int32_t r = row - kReach; r <= row + kReach; ++r) {
    for (std::int32_t c = column - kReach; c <= column + kReach; ++c) {
      if (c < 0 || r < 0 || c >= grid.columns() || r >= grid.rows() || !grid.is_known(c, r))
        return std::numeric_limits<double>::infinity();
      low_m = std::min(low_m, grid.height_m(c, r));
      high_m = std::max(high_m, grid.height_m(c, r));
    }
  }
  return high_m - low_m;
}

/// The highest known sample, the lowest and the flattest: on a ridge, in a valley, on a plain. Of
/// equal ones that nearest to the middle.
std::vector<Eye> eyes_of(const GroundGrid& grid) {
  struct Best {
    Eye at;
    double value = std::numeric_limits<double>::infinity();
    std::int32_t off_middle = 0;
  };
  Best ridge, valley, plain;
  for (std::int32_t r = 0; r < grid.rows(); ++r) {
    for (std::int32_t c = 0; c < grid.columns(); ++c) {
      if (!grid.is_known(c, r)) continue;
      const std::int32_t off = std::abs(c - grid.columns() / 2) + std::abs(r - grid.rows() / 2);
      const auto offer = [&](Best& best, double value) {
        if (value < best.value || (value == best.value && off < best.off_middle))
          best = {{c, r}, value, off};
      };
      offer(ridge, -grid.height_m(c, r));
      offer(valley, grid.height_m(c, r));
      offer(plain, relief_m(grid, c, r));
    }
  }
  std::vector<Eye> eyes;
  for (const Best& best : {ridge, valley, plain})
    if (std::isfinite(best.value)) eyes.push_back(best.at);
  return eyes;
}

struct Heights {
  double eye_m, target_m;
};
constexpr Heights kHeights[] = {{2, 0}, {2, 1.5}, {100, 0}, {10'000, 0}, {10'000, 1.5}};

/// Names the cells on which sweep and judge differ, over eyes on and between samples.
void expect_equal(const std::string& file, const DemOptions& options) {
  const GroundGrid grid = read_ground({file}, options, {}).grid;
  const auto columns = static_cast<std::size_t>(grid.columns());
  const std::size_t cells = columns * static_cast<std::size_t>(grid.rows());
  std::vector<Seen> judged(cells), swept(cells);
  std::vector<float> least_m(cells);
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
      if (target_m > 0) continue;
      sweep_heights(grid, eye, whole_window(grid), least_m);
      for (std::size_t i = 0; i < cells; ++i)
        EXPECT_EQ(judged[i] == Seen::kVisible, least_m[i] == 0)
            << "eye over " << at.column << "," << at.row << " at " << eye_m << " m: column "
            << i % columns << " row " << i / columns << " least height " << least_m[i];
    }
  }
}

/// The same over the mesh of a scene, whose triangles are larger than its cells where they may be.
void expect_equal_on_mesh(const std::string& file, const DemOptions& options) {
  const Dem dem = read_dem({file}, options, {});
  const CellMeasures cells = measure_cells(dem);
  MeshOptions meshing;
  meshing.max_error_m = 0.1 * std::min(cells.cell_x_m, cells.cell_y_m);
  const Tin tin = mesh_samples(place_samples(dem), meshing, {}).tin;
  const TinIndex index(tin);
  GroundGrid grid(dem.columns, dem.rows, ground_placement(dem));
  stand_on(index, grid);
  const auto columns = static_cast<std::size_t>(grid.columns());
  const std::size_t cells_of_all = columns * static_cast<std::size_t>(grid.rows());
  std::vector<Seen> judged(cells_of_all), fast(cells_of_all);
  for (const Eye& at : eyes_of(grid)) {
    for (const auto& [eye_m, target_m] : {Heights{2, 0}, Heights{0, 1.5}, Heights{300, 0}}) {
      const Position eye = grid.raised(at.column, at.row, eye_m);
      judge_tin_viewshed(index, grid, eye, target_m, whole_window(grid), judged);
      tin_viewshed(index, grid, eye, target_m, whole_window(grid), fast);
      for (std::size_t i = 0; i < cells_of_all; ++i)
        EXPECT_EQ(judged[i], fast[i])
            << "eye over " << at.column << "," << at.row << " at " << eye_m << " m, target "
            << target_m << " m: column " << i % columns << " row " << i / columns;
    }
  }
}

/// All rasters of ground in the collection: those of kListedDems, and copies, crops and large ones.
std::vector<test::ListedDem> proved_dems() {
  std::vector<test::ListedDem> dems(test::kListedDems.begin(), test::kListedDems.end());
  dems.push_back({"vancouver-west", "geographic/N49W124_vancouver_srtm3.tif"});
  dems.push_back({"nice", "geographic/N43E007.hgt.zip"});
  dems.push_back({"xueshan", "projected/taiwan_xueshan_z13_webmercator.tif"});
  dems.push_back({"taiwan", "scale/taiwan_north_20m_twd97.tif"});
  dems.push_back({"north-carolina", "reference/grass_nc_elevation_10m.ascii", true});
  return dems;
}

class RealDems : public testing::TestWithParam<test::ListedDem> {};

TEST_P(RealDems, SweepEqualsJudge) {
  const test::ListedDem& listed = GetParam();
  SCARP_SHARED_OR_SKIP(dem, listed.file);
  const test::TempFolder folder;
  const std::string window = window_of(dem, folder);
  DemOptions options;
  options.nodata = listed.nodata;
  if (!listed.flat) expect_equal(window, options);
  const bool degrees = std::string(listed.file).starts_with("geographic/");
  if (!degrees || listed.flat) {
    options.earth = Earth::kFlat;
    expect_equal(window, options);
  }
}

TEST_P(RealDems, ViewshedOfAMeshEqualsItsJudge) {
  const test::ListedDem& listed = GetParam();
  SCARP_SHARED_OR_SKIP(dem, listed.file);
  const test::TempFolder folder;
  DemOptions options;
  options.nodata = listed.nodata;
  if (listed.flat) options.earth = Earth::kFlat;
  expect_equal_on_mesh(window_of(dem, folder), options);
}

INSTANTIATE_TEST_SUITE_P(All, RealDems, testing::ValuesIn(proved_dems()),
                         [](const testing::TestParamInfo<test::ListedDem>& param) {
                           std::string name = param.param.name;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

/// Obstacles in a frame whose normals lean: a target under them stands beside their sample by what
/// the normal leans over their height.
TEST(ObstaclesOnTheEllipsoid, SweepEqualsJudge) {
  SCARP_SHARED_OR_SKIP(dem, "projected/new_zealand_1km_nztm.tif");
  const test::TempFolder folder;
  const GroundGrid ground = read_ground({window_of(dem, folder)}, {}, {}).grid;
  GroundGrid obstacles(ground.columns(), ground.rows(), ground.placement());
  for (std::int32_t r = 0; r < ground.rows(); ++r)
    for (std::int32_t c = 0; c < ground.columns(); ++c)
      if (ground.is_known(c, r))
        obstacles.set_z(c, r, ground.at(c, r).z_m + ((c * 7 + r * 3) % 11 < 3 ? 24 : 0));
  const auto columns = static_cast<std::size_t>(ground.columns());
  std::vector<Seen> seen(columns * static_cast<std::size_t>(ground.rows()));
  std::vector<float> least_m(seen.size());
  std::size_t aside = 0;
  for (const Eye& at : eyes_of(ground)) {
    for (const double eye_m : {30.0, 400.0}) {
      const Position eye = ground.raised(at.column, at.row, eye_m);
      const GridSight judge(obstacles, eye);
      for (const double target_m : {0.0, 1.5}) {
        sweep_viewshed({obstacles, ground}, eye, target_m, whole_window(ground), seen);
        sweep_heights({obstacles, ground}, eye, whole_window(ground), least_m);
        for (std::size_t i = 0; i < seen.size(); ++i) {
          const auto c = static_cast<std::int32_t>(i % columns),
                     r = static_cast<std::int32_t>(i / columns);
          if (!ground.is_known(c, r)) continue;
          EXPECT_EQ(seen[i], judge.judge(ground.raised(c, r, target_m), c, r))
              << "column " << c << " row " << r << " target " << target_m;
          aside += ground.at(c, r).x_m != obstacles.at(c, r).x_m;
          if (target_m > 0) continue;
          EXPECT_EQ(seen[i] == Seen::kVisible, least_m[i] == 0)
              << "column " << c << " row " << r << " least height " << least_m[i] << " eye over "
              << at.column << "," << at.row << " at " << eye_m;
          if (std::isfinite(least_m[i])) {
            Position over = ground.at(c, r);
            over.z_m = ground.raised(c, r, least_m[i]).z_m;
            EXPECT_EQ(judge.judge(over, c, r), Seen::kVisible)
                << "column " << c << " row " << r << " height " << least_m[i];
          }
        }
      }
    }
  }
  EXPECT_GT(aside, 0U);
}

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
