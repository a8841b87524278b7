#include "tiles/layers/block_raster.h"

#include <gdal_priv.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <vector>

#include "core/error/error.h"
#include "core/threads/parallel_for.h"
#include "tests/tiles/limits.h"
#include "tests/tiles/temporary_folder.h"

namespace scarp {
namespace {

using test::TemporaryFolder;

constexpr std::int32_t kColumns = 700, kRows = 290, kSide = BlockRaster::kSide;

std::int16_t sample(std::size_t band, std::int32_t column, std::int32_t row) {
  return static_cast<std::int16_t>(static_cast<std::uint32_t>(column + 1000 * row) * 2654435761U +
                                   7919U * static_cast<std::uint32_t>(band));
}

RasterLayer layer_of_three() {
  const std::span<const std::int16_t> none;
  RasterLayer layer;
  layer.columns = kColumns;
  layer.rows = kRows;
  layer.samples = none;
  layer.geotransform = {500'000, 10, 0, 4'000'000, 0, -10};
  layer.band_name = "first";
  layer.more_bands = {{"second", none}, {"third", none}};
  layer.unit = "degree";
  layer.scale = 0.01;
  layer.nodata = -32768;
  layer.metadata["WHAT"] = "angles, < and & too";
  return layer;
}

void write_square(BlockRaster& raster, std::size_t band, std::int32_t column, std::int32_t row) {
  const std::int32_t columns = std::min(kSide, kColumns - column);
  const std::int32_t rows = std::min(kSide, kRows - row);
  std::vector<std::int16_t> square;
  for (std::int32_t r = 0; r < rows; ++r)
    for (std::int32_t c = 0; c < columns; ++c) square.push_back(sample(band, column + c, row + r));
  raster.write(band, column, row, columns, rows, std::as_bytes(std::span(square)));
}

void write_all(const std::string& path, Existing existing) {
  BlockRaster raster(path, layer_of_three(), existing);
  // The last band first, and its squares from the end.
  for (std::size_t band = raster.bands(); band-- > 0;) {
    raster.begin(band);
    parallel_for(6, [&](std::size_t i) {
      const auto n = static_cast<std::int32_t>(5 - i);
      write_square(raster, band, n % 3 * kSide, n / 3 * kSide);
    });
    raster.finish(band, 1);
  }
  raster.commit();
}

GDALDatasetUniquePtr open(const std::string& path) {
  GDALAllRegister();
  return GDALDatasetUniquePtr(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER));
}

std::vector<std::int16_t> read(GDALRasterBand& band) {
  std::vector<std::int16_t> samples(static_cast<std::size_t>(band.GetXSize()) *
                                    static_cast<std::size_t>(band.GetYSize()));
  EXPECT_EQ(band.RasterIO(GF_Read, 0, 0, band.GetXSize(), band.GetYSize(), samples.data(),
                          band.GetXSize(), band.GetYSize(), GDT_Int16, 0, 0),
            CE_None);
  return samples;
}

TEST(BlockRaster, GdalReadsBackWhatWasWritten) {
  const TemporaryFolder folder;
  const std::string path = folder / "bands.tif";
  write_all(path, Existing::kRefuse);
  const GDALDatasetUniquePtr written = open(path);
  ASSERT_NE(written, nullptr);
  ASSERT_EQ(written->GetRasterCount(), 3);
  EXPECT_STREQ(written->GetMetadataItem("WHAT"), "angles, < and & too");
  double transform[6];
  ASSERT_EQ(written->GetGeoTransform(transform), CE_None);
  EXPECT_EQ(transform[0], 500'000);
  EXPECT_EQ(transform[5], -10);
  for (std::size_t b = 0; b < 3; ++b) {
    GDALRasterBand& band = *written->GetRasterBand(static_cast<int>(b) + 1);
    EXPECT_EQ(band.GetScale(), 0.01);
    EXPECT_EQ(band.GetNoDataValue(), -32768);
    EXPECT_STREQ(band.GetUnitType(), "degree");
    const std::vector<std::int16_t> samples = read(band);
    std::size_t wrong = 0;
    for (std::int32_t r = 0; r < kRows; ++r)
      for (std::int32_t c = 0; c < kColumns; ++c)
        wrong += samples[static_cast<std::size_t>(r * kColumns + c)] != sample(b, c, r) ? 1 : 0;
    EXPECT_EQ(wrong, 0U) << b;
    ASSERT_EQ(band.GetOverviewCount(), 2);
    for (int o = 0; o < 2; ++o) {
      GDALRasterBand& overview = *band.GetOverview(o);
      const std::int32_t step = 2 << o;
      EXPECT_EQ(overview.GetXSize(), (kColumns + step - 1) / step);
      EXPECT_EQ(overview.GetYSize(), (kRows + step - 1) / step);
      const std::vector<std::int16_t> halved = read(overview);
      for (std::size_t i = 0; i < halved.size(); i += 17) {
        const auto c = static_cast<std::int32_t>(i) % overview.GetXSize();
        const auto r = static_cast<std::int32_t>(i) / overview.GetXSize();
        EXPECT_EQ(halved[i], sample(b, c * step, r * step)) << c << ' ' << r;
      }
    }
  }
  EXPECT_STREQ(written->GetRasterBand(2)->GetDescription(), "second");
}

TEST(BlockRaster, OverviewsLieBeforeTheWholeAndEveryTileHasItsPlace) {
  const TemporaryFolder folder;
  const std::string path = folder / "bands.tif";
  write_all(path, Existing::kRefuse);
  const GDALDatasetUniquePtr written = open(path);
  std::uintmax_t last = 0;
  const auto offset = [](GDALRasterBand& band, int x, int y) {
    const std::string name = "BLOCK_OFFSET_" + std::to_string(x) + "_" + std::to_string(y);
    return std::stoull(band.GetMetadataItem(name.c_str(), "TIFF"));
  };
  GDALRasterBand& first = *written->GetRasterBand(1);
  for (int o = 1; o >= 0; --o) {
    EXPECT_GT(offset(*first.GetOverview(o), 0, 0), last);
    last = offset(*first.GetOverview(o), 0, 0);
  }
  EXPECT_GT(offset(first, 0, 0), last);
  EXPECT_EQ(offset(first, 1, 0) - offset(first, 0, 0), 2U * kSide * kSide);
  EXPECT_EQ(std::filesystem::file_size(path),
            offset(*written->GetRasterBand(3), 2, 1) + 2U * kSide * kSide);
}

TEST(BlockRaster, OfFloats) {
  const TemporaryFolder folder;
  RasterLayer layer;
  layer.columns = 300;
  layer.rows = 2;
  layer.samples = std::span<const float>();
  layer.nodata = std::numeric_limits<double>::quiet_NaN();
  const std::string path = folder / "floats.tif";
  BlockRaster raster(path, layer, Existing::kRefuse);
  raster.begin(0);
  const std::vector<float> left(256 * 2, 1.5F), right(44 * 2, -3);
  raster.write(0, 256, 0, 44, 2, std::as_bytes(std::span(right)));
  raster.write(0, 0, 0, 256, 2, std::as_bytes(std::span(left)));
  raster.finish(0, 1);
  raster.commit();
  const GDALDatasetUniquePtr written = open(path);
  ASSERT_NE(written, nullptr);
  float read[2] = {};
  ASSERT_EQ(
      written->GetRasterBand(1)->RasterIO(GF_Read, 255, 1, 2, 1, read, 2, 1, GDT_Float32, 0, 0),
      CE_None);
  EXPECT_EQ(read[0], 1.5F);
  EXPECT_EQ(read[1], -3.0F);
}

TEST(BlockRaster, LeavesNothingBehindWhereItFails) {
  const TemporaryFolder folder;
  const auto message_of = [](const auto& body) -> std::string {
    try {
      body();
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  const std::string path = folder / "bands.tif";
  { BlockRaster raster(path, layer_of_three(), Existing::kRefuse); }  // not committed
  EXPECT_TRUE(folder.names().empty());
  EXPECT_NE(message_of([&] { write_all(folder / "nowhere/x.tif", Existing::kRefuse); }), "");
  {
    const test::FullDisk full(10'000);
    EXPECT_NE(message_of([&] { write_all(path, Existing::kRefuse); }), "");
  }
  EXPECT_TRUE(folder.names().empty());
  write_all(path, Existing::kRefuse);
  EXPECT_NE(message_of([&] { write_all(path, Existing::kRefuse); }).find("exists"),
            std::string::npos);
  EXPECT_EQ(message_of([&] { write_all(path, Existing::kReplace); }), "");
  EXPECT_EQ(folder.names(), std::set<std::string>{"bands.tif"});
}

}  // namespace
}  // namespace scarp
