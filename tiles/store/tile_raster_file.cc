#include "tiles/store/tile_raster_file.h"

#include <fmt/format.h>

namespace scarp {
namespace {

constexpr std::uint32_t kTileRasterVersion = 1;

}  // namespace

void write_tile_raster(const std::string& path, const TileRaster& raster, Existing existing) {
  SectionFileWriter writer(kTileRasterKind, kTileRasterVersion);
  writer.add_owned<std::int32_t>("layout", std::vector<std::int32_t>{raster.columns, raster.rows});
  writer.add<std::int32_t>("value", std::span(raster.values));
  writer.write(path, existing);
}

TileRaster read_tile_raster(const SectionFile& file) {
  file.require(kTileRasterKind, kTileRasterVersion);
  const std::span<const std::int32_t> layout = file.section<std::int32_t>("layout");
  if (layout.size() != 2 || layout[0] < 1 || layout[1] < 1) file.fail("a raster of no size");
  TileRaster raster{layout[0], layout[1], file.copy<std::int32_t, std::int32_t>("value")};
  if (raster.values.size() !=
      static_cast<std::size_t>(raster.columns) * static_cast<std::size_t>(raster.rows))
    file.fail(fmt::format("{} values where {} x {} were expected", raster.values.size(),
                          raster.columns, raster.rows));
  return raster;
}

}  // namespace scarp
