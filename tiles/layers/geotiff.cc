#include "tiles/layers/geotiff.h"

#include <cpl_string.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <cassert>
#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <vector>

#include "core/error/error.h"
#include "core/memory/large_array.h"
#include "core/threads/parallel_for.h"
#include "tiles/layers/describe_dataset.h"
#include "tiles/layers/gdal_session.h"
#include "tiles/layers/spatial_reference.h"

namespace scarp {
namespace {

struct LayerData {
  GDALDataType type;
  void* start;
  std::size_t count;
  bool is_float;
  const char* predictor;
};

LayerData data_of(const LayerSamples& samples) {
  // GDAL's in-memory raster takes a pointer that it could write through; nothing here does.
  const auto start = [](const auto& span) {
    return const_cast<void*>(static_cast<const void*>(span.data()));
  };
  if (const auto* bytes = std::get_if<std::span<const std::uint8_t>>(&samples))
    return {GDT_Byte, start(*bytes), bytes->size(), false, "NO"};  // classes: differences only cost
  if (const auto* ints = std::get_if<std::span<const std::int32_t>>(&samples))
    return {GDT_Int32, start(*ints), ints->size(), false, "YES"};
  if (const auto* counts = std::get_if<std::span<const std::uint32_t>>(&samples))
    return {GDT_UInt32, start(*counts), counts->size(), false, "YES"};
  if (const auto* halves = std::get_if<std::span<const std::int16_t>>(&samples))
    return {GDT_Int16, start(*halves), halves->size(), false, "YES"};
  const auto& floats = std::get<std::span<const float>>(samples);
  return {GDT_Float32, start(floats), floats.size(), true, "YES"};
}

/// The samples as a GDAL dataset, without a copy.
GDALDatasetUniquePtr memory_dataset(const RasterLayer& layer, const LayerData& data,
                                    const GdalSession& session, const std::string& path) {
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("MEM");
  if (driver == nullptr) session.fail(path);
  GDALDatasetUniquePtr dataset(
      driver->Create("", layer.columns, layer.rows, 0, data.type, nullptr));
  if (!dataset) session.fail(path);
  const auto add_band = [&](void* start) {
    CPLStringList options;
    options.SetNameValue("DATAPOINTER", fmt::format("{}", fmt::ptr(start)).c_str());
    if (dataset->AddBand(data.type, options.List()) != CE_None) session.fail(path);
  };
  add_band(data.start);
  for (const RasterBand& band : layer.more_bands) {
    const LayerData more = data_of(band.samples);
    assert(more.type == data.type && more.count == data.count);
    add_band(more.start);
  }
  return dataset;
}

/// Halved pictures until one fits into a tile. In memory: the driver would make them by itself, but
/// as a compressed file of its own, which takes longer than all the rest.
void build_overviews(GDALDataset& source, const LayerData& data) {
  constexpr int kTile = 512;
  std::vector<int> factors;
  for (int factor = 2;
       std::max(source.GetRasterXSize(), source.GetRasterYSize()) > kTile * factor / 2; factor *= 2)
    factors.push_back(factor);
  if (!factors.empty())
    source.BuildOverviews(data.is_float ? "AVERAGE" : "NEAREST", static_cast<int>(factors.size()),
                          factors.data(), 0, nullptr, nullptr, nullptr);
}

/// GDAL 3.6 does not report what fails while it closes a file, but then blocks are missing: does
/// the file hold all of them?
void check_blocks(const std::string& built, const std::string& path) {
  const GDALDatasetUniquePtr file(GDALDataset::Open(built.c_str(), GDAL_OF_RASTER));
  std::error_code unknown;
  const auto size = std::filesystem::file_size(built, unknown);
  const auto number = [](GDALRasterBand& band, const char* what, int x, int y) {
    const char* text =
        band.GetMetadataItem(fmt::format("BLOCK_{}_{}_{}", what, x, y).c_str(), "TIFF");
    return text == nullptr ? 0 : std::strtoull(text, nullptr, 10);
  };
  const auto is_whole = [&](GDALRasterBand& band) {
    int width = 1, height = 1;
    band.GetBlockSize(&width, &height);
    for (int y = 0; y < (band.GetYSize() + height - 1) / height; ++y)
      for (int x = 0; x < (band.GetXSize() + width - 1) / width; ++x) {
        const auto bytes = number(band, "SIZE", x, y);
        if (bytes == 0 || number(band, "OFFSET", x, y) + bytes > size) return false;
      }
    return true;
  };
  bool whole = file && !unknown;
  for (int b = 1; whole && b <= file->GetRasterCount(); ++b) {
    GDALRasterBand& band = *file->GetRasterBand(b);
    whole = is_whole(band);
    for (int i = 0; whole && i < band.GetOverviewCount(); ++i)
      whole = is_whole(*band.GetOverview(i));
  }
  if (!whole)
    throw Error(ErrorCode::kResource,
                fmt::format("'{}': not all of it could be written; free space on the disk or write "
                            "elsewhere",
                            path));
}

int CPL_STDCALL relieve(double, const char*, void*) {
  relieve_large_memory();
  return TRUE;
}

}  // namespace

void describe(GDALDataset& dataset, const RasterLayer& layer, const std::string& path) {
  if (!layer.crs_wkt.empty()) {
    const OGRSpatialReference crs = spatial_reference(layer.crs_wkt, path);
    dataset.SetSpatialRef(&crs);
  }
  std::array<double, 6> geotransform = layer.geotransform;
  dataset.SetGeoTransform(geotransform.data());
  for (const auto& [key, value] : layer.metadata)
    dataset.SetMetadataItem(key.c_str(), value.c_str());
  for (int i = 1; i <= dataset.GetRasterCount(); ++i) {
    GDALRasterBand& band = *dataset.GetRasterBand(i);
    const std::string& name =
        i == 1 ? layer.band_name : layer.more_bands[static_cast<std::size_t>(i) - 2].name;
    if (!name.empty()) band.SetDescription(name.c_str());
    if (!layer.unit.empty()) band.SetUnitType(layer.unit.c_str());
    if (layer.nodata) band.SetNoDataValue(*layer.nodata);
    if (layer.scale != 1) band.SetScale(layer.scale);
  }
  GDALRasterBand& band = *dataset.GetRasterBand(1);
  if (layer.colours.empty()) return;
  GDALColorTable table;
  for (std::size_t i = 0; i < layer.colours.size(); ++i) {
    const auto& [red, green, blue, alpha] = layer.colours[i];
    const GDALColorEntry entry = {red, green, blue, alpha};
    table.SetColorEntry(static_cast<int>(i), &entry);
  }
  band.SetColorInterpretation(GCI_PaletteIndex);
  band.SetColorTable(&table);
}

namespace {

/// The options of the COG driver that all layers share.
CPLStringList cog_options(const char* predictor, const char* resampling) {
  CPLStringList options;
  options.SetNameValue("COMPRESS", "DEFLATE");
  options.SetNameValue("PREDICTOR", predictor);
  options.SetNameValue("LEVEL", "1");  // the most of what can be had, at a third of the time
  options.SetNameValue("BIGTIFF", "IF_SAFER");
  options.SetNameValue("NUM_THREADS", std::to_string(thread_count()).c_str());
  options.SetNameValue("OVERVIEW_RESAMPLING", resampling);
  return options;
}

/// Removes a file at the end, whatever happens.
struct WorkFile {
  std::string path;
  ~WorkFile() {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  }
};

/// A file of pieces on the disk: quickly packed, in the tiles of the final one.
GDALDatasetUniquePtr piece_dataset(const std::string& work_path, const RasterLayer& layer,
                                   const GdalSession& session, const std::string& path) {
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  if (driver == nullptr) session.fail(path);
  CPLStringList options;
  options.SetNameValue("TILED", "YES");
  options.SetNameValue("BLOCKXSIZE", "512");
  options.SetNameValue("BLOCKYSIZE", "512");
  options.SetNameValue("COMPRESS", "DEFLATE");
  options.SetNameValue("ZLEVEL", "1");
  options.SetNameValue("BIGTIFF", "IF_SAFER");
  options.SetNameValue("SPARSE_OK", "TRUE");
  GDALDatasetUniquePtr dataset(driver->Create(work_path.c_str(), layer.columns, layer.rows, 1,
                                              data_of(layer.samples).type, options.List()));
  if (!dataset) session.fail(path);
  describe(*dataset, layer, path);
  return dataset;
}

/// GDAL 3.6 does not report what fails while it closes a file: reads it all again.
void check_readable(const std::string& built, const GdalSession& session, const std::string& path) {
  const GDALDatasetUniquePtr dataset(GDALDataset::Open(built.c_str(), GDAL_OF_RASTER));
  if (!dataset) session.fail(path);
  const auto read = [&](GDALRasterBand& band) {
    int columns = 0, rows = 0;
    band.GetBlockSize(&columns, &rows);
    std::vector<std::int32_t> block(static_cast<std::size_t>(columns) *
                                    static_cast<std::size_t>(rows));
    for (int row = 0; row * rows < band.GetYSize(); ++row)
      for (int column = 0; column * columns < band.GetXSize(); ++column)
        if (band.ReadBlock(column, row, block.data()) != CE_None) session.fail(path);
  };
  GDALRasterBand& band = *dataset->GetRasterBand(1);
  read(band);
  for (int i = 0; i < band.GetOverviewCount(); ++i) read(*band.GetOverview(i));
  session.check(path);
}

}  // namespace

void write_geotiff_cog(const std::string& path, const RasterLayer& layer, Existing existing) {
  const LayerData data = data_of(layer.samples);
  assert(layer.columns >= 1 && layer.rows >= 1);
  assert(data.count ==
         static_cast<std::size_t>(layer.columns) * static_cast<std::size_t>(layer.rows));
  assert(layer.colours.empty() || (data.type == GDT_Byte && layer.colours.size() <= 256));
  PartFile file(path, existing);
  const GdalSession session;
  const GDALDatasetUniquePtr source = memory_dataset(layer, data, session, path);
  describe(*source, layer, path);
  if (!layer.saves_memory) build_overviews(*source, data);
  session.check(path);
  CPLStringList options = cog_options(data.predictor, data.is_float ? "AVERAGE" : "NEAREST");
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("COG");
  if (driver == nullptr) session.fail(path);
  const std::string built = layer.saves_memory ? file.part_path() : session.folder() + "/layer.tif";
  GDALDatasetUniquePtr cog(
      driver->CreateCopy(built.c_str(), source.get(), TRUE, options.List(), relieve, nullptr));
  if (!cog) session.fail(path);
  cog.reset();  // closing writes the rest
  session.check(path);
  if (layer.saves_memory) {
    check_blocks(built, path);
    file.take_over();
  } else {
    file.append(session.bytes_of(built, path));
  }
  file.commit();
}

void write_geotiff_cog_in_pieces(const std::string& path, const std::string& work_path,
                                 const RasterLayer& layer,
                                 const std::function<void(const TakePiece&)>& give,
                                 Existing existing) {
  assert(layer.columns >= 1 && layer.rows >= 1 && layer.nodata && layer.more_bands.empty());
  PartFile file(path, existing);
  const GdalSession session;
  const WorkFile work{work_path};
  GDALDatasetUniquePtr pieces = piece_dataset(work_path, layer, session, path);
  give([&](std::int32_t column, std::int32_t row, std::int32_t columns, std::int32_t rows,
           std::span<const std::int32_t> samples) {
    assert(samples.size() == static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
    GDALRasterBand& band = *pieces->GetRasterBand(1);
    std::vector<std::int32_t> merged(samples.size());
    if (band.RasterIO(GF_Read, column, row, columns, rows, merged.data(), columns, rows, GDT_Int32,
                      0, 0) != CE_None)
      session.fail(path);
    const auto nodata = static_cast<std::int32_t>(*layer.nodata);
    for (std::size_t i = 0; i < samples.size(); ++i)
      if (samples[i] != nodata) merged[i] = samples[i];
    if (band.RasterIO(GF_Write, column, row, columns, rows, merged.data(), columns, rows, GDT_Int32,
                      0, 0) != CE_None)
      session.fail(path);
  });
  pieces.reset();
  session.check(path);
  pieces.reset(GDALDataset::Open(work_path.c_str(), GDAL_OF_RASTER));
  if (!pieces) session.fail(path);
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("COG");
  if (driver == nullptr) session.fail(path);
  CPLStringList options = cog_options(data_of(layer.samples).predictor, "NEAREST");
  GDALDatasetUniquePtr cog(driver->CreateCopy(file.part_path().c_str(), pieces.get(), TRUE,
                                              options.List(), nullptr, nullptr));
  if (!cog) session.fail(path);
  cog.reset();  // closing writes the rest
  session.check(path);
  check_readable(file.part_path(), session, path);
  file.take_over();
  file.commit();
}

}  // namespace scarp
