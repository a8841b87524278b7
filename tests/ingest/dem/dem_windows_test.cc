#include "ingest/dem/dem_windows.h"

#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>

#include "core/error/error.h"
#include "tests/support/shared_data.h"
#include "tests/support/temp_folder.h"

namespace scarp {
namespace {

using test::TempFolder;

constexpr int kColumns = 61, kRows = 47;
constexpr double kVoid = -999;

double height_m(int column, int row) {
  return (column * 7 + row * 13) % 11 == 0 ? kVoid : 300 * std::sin(column * 0.3) + row * 2.5;
}

/// Heights of a rectangle of the pattern in a file, stored in tiles of 16 x 16, with void.
std::string write_piece(const std::string& path, const SampleRect& rect, bool south_up) {
  GDALAllRegister();
  const char* const options[] = {"TILED=YES", "BLOCKXSIZE=16", "BLOCKYSIZE=16", nullptr};
  GDALDataset* dataset = GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      path.c_str(), rect.columns, rect.rows, 1, GDT_Float32, const_cast<char**>(options));
  double transform[6] = {500'000 + 30.0 * rect.first_column, 30, 0,
                         4'000'000 - 30.0 * rect.first_row,  0,  -30};
  if (south_up) {
    transform[3] -= 30.0 * rect.rows;
    transform[5] = 30;
  }
  dataset->SetGeoTransform(transform);
  OGRSpatialReference crs;
  crs.SetFromUserInput("EPSG:32611");
  dataset->SetSpatialRef(&crs);
  dataset->GetRasterBand(1)->SetNoDataValue(kVoid);
  dataset->GetRasterBand(1)->SetScale(0.5);
  for (int r = 0; r < rect.rows; ++r) {
    std::vector<double> row;
    for (int c = 0; c < rect.columns; ++c)
      row.push_back(height_m(rect.first_column + c, rect.first_row + r));
    const int to = south_up ? rect.rows - 1 - r : r;
    EXPECT_EQ(dataset->GetRasterBand(1)->RasterIO(GF_Write, 0, to, rect.columns, 1, row.data(),
                                                  rect.columns, 1, GDT_Float64, 0, 0),
              CE_None);
  }
  GDALClose(dataset);
  return path;
}

/// Every window of a raster cut into squares of `side` is what read_dem and place_samples give.
void expect_windows_like_whole(const std::vector<std::string>& files, const DemOptions& options,
                               std::int32_t side) {
  const Dem whole = read_dem(files, options, {});
  const SampleGrid placed = place_samples(whole);
  const DemWindows windows(files, options);
  ASSERT_EQ(windows.dem().columns, whole.columns);
  ASSERT_EQ(windows.dem().rows, whole.rows);
  for (std::int32_t row = 0; row < whole.rows; row += side) {
    for (std::int32_t column = 0; column < whole.columns; column += side) {
      const SampleRect rect{column, row, std::min(side, whole.columns - column),
                            std::min(side, whole.rows - row)};
      const HeightWindow window = windows.read(rect);
      const SampleGrid grid = place_window(windows.dem(), window);
      EXPECT_EQ(grid.cell_x_m, placed.cell_x_m);
      EXPECT_EQ(grid.bend_cells, placed.bend_cells);
      for (std::int32_t r = 0; r < rect.rows; ++r) {
        for (std::int32_t c = 0; c < rect.columns; ++c) {
          const std::size_t from = placed.index(column + c, row + r), at = grid.index(c, r);
          ASSERT_EQ(window.known[at], whole.known[from]);
          ASSERT_EQ(window.heights_m[at], whole.heights_m[from]);
          ASSERT_EQ(grid.positions[at], placed.positions[from]);
        }
      }
    }
  }
}

TEST(DemWindows, EqualTheWholeInAMosaicWithVoidAndRowsFromTheSouth) {
  const TempFolder folder;
  const std::vector<std::string> files = {
      write_piece(folder.path("a.tif"), {0, 0, kColumns, 30}, false),
      write_piece(folder.path("b.tif"), {0, 25, 40, kRows - 25}, true),
      write_piece(folder.path("c.tif"), {45, 31, kColumns - 45, 10}, true)};
  for (const std::int32_t side : {9, 16, 100}) expect_windows_like_whole(files, {}, side);
}

TEST(DemWindows, CheckTellsWhatReadingTells) {
  const TempFolder folder;
  const std::vector<std::string> files = {
      write_piece(folder.path("a.tif"), {0, 0, kColumns, 30}, false),
      write_piece(folder.path("b.tif"), {0, 30, kColumns, kRows - 30}, true)};
  const Dem whole = read_dem(files, {}, {});
  const std::vector<DemSource> sources = DemWindows(files, {}).check({});
  ASSERT_EQ(sources.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(sources[i].samples, whole.sources[i].samples);
    EXPECT_EQ(sources[i].checksum, whole.sources[i].checksum);
    EXPECT_EQ(sources[i].size_bytes, whole.sources[i].size_bytes);
  }
}

TEST(DemWindows, AFileThatShrankMeanwhileIsNamed) {
  const TempFolder folder;
  const std::string path = write_piece(folder.path("a.tif"), {0, 0, kColumns, kRows}, false);
  const DemWindows source({path}, {});
  ASSERT_EQ(truncate(path.c_str(), 3000), 0);
  try {
    source.read({40, 40, 16, 7});
    FAIL() << "read what is not there";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(path), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("is the file complete?"), std::string::npos);
  }
}

TEST(DemWindows, EqualTheWholeOnARealDemInDegrees) {
  SCARP_SHARED_OR_SKIP(path, "geographic/crater_lake_30m_wgs84.tif");
  DemOptions options;
  options.nodata = -32767;  // which its header does not tell
  expect_windows_like_whole({path}, options, 200);
}

}  // namespace
}  // namespace scarp
