#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "tiles/store/part_file.h"

namespace scarp {

using LayerSamples = std::variant<std::span<const std::uint8_t>, std::span<const std::int32_t>,
                                  std::span<const std::uint32_t>, std::span<const float>,
                                  std::span<const std::int16_t>>;

/// A further band of a layer.
struct RasterBand {
  std::string name;
  LayerSamples samples;  ///< of the same type as the layer's
};

/// Numbers over a raster, in one band or more. Borrows the samples.
struct RasterLayer {
  std::int32_t columns = 0;
  std::int32_t rows = 0;
  LayerSamples samples;  ///< [rows * columns], row by row from the north
  /// As GDAL has it: x = g[0] + column g[1] + row g[2], y = g[3] + column g[4] + row g[5], of pixel
  /// corners, in units of the CRS.
  std::array<double, 6> geotransform = {0, 1, 0, 0, 0, -1};
  std::string crs_wkt;                 ///< empty: none
  std::string band_name;               ///< such as "visible"
  std::vector<RasterBand> more_bands;  ///< after the first, with its unit, nodata and scale
  double scale = 1;                    ///< what a step of the numbers is worth, in the unit
  /// Built on the disk, overviews as well, so that memory holds only blocks; slower.
  bool saves_memory = false;
  std::string unit;              ///< such as "m"; empty: none
  std::optional<double> nodata;  ///< NaN is allowed for float
  /// Red, green, blue, alpha of the values from 0 on; for uint8 only, at most 256. Empty: none.
  std::vector<std::array<std::uint8_t, 4>> colours;
  std::map<std::string, std::string> metadata;
};

/// Writes a cloud-optimised GeoTIFF: tiles of 512 x 512, DEFLATE with a predictor where the numbers
/// vary smoothly, overviews (nearest sample; averages for float). Bands lie pixel by pixel. Any GIS
/// reads it. The same layer gives the same bytes.
///
/// Requires columns, rows >= 1, as many samples, colours only for uint8 (asserted).
/// Errors: kResource with GDAL's own words or from the disk, kInput where the file exists and is
/// not to be replaced, or the CRS is not WKT. Nothing is left behind. Memory: overviews (a third of
/// the samples) and the compressed file; blocks only where it saves memory.
void write_geotiff_cog(const std::string& path, const RasterLayer& layer, Existing existing);

/// Takes a rectangle of a layer's samples, [rows * columns], row by row from the north.
using TakePiece = std::function<void(std::int32_t column, std::int32_t row, std::int32_t columns,
                                     std::int32_t rows, std::span<const std::int32_t> samples)>;

/// The same for a layer of int32 or uint8 that is never held whole: `give` hands over its pieces.
/// Later ones lie on top, except where they are nodata; what none covers is nodata. The layer's own
/// samples are left empty, and it has one band and nodata (asserted).
/// @param work_path  a file for the pieces, which is removed again
/// Memory: GDAL's cache. Errors: as above, and what `give` throws.
void write_geotiff_cog_in_pieces(const std::string& path, const std::string& work_path,
                                 const RasterLayer& layer,
                                 const std::function<void(const TakePiece&)>& give,
                                 Existing existing);

}  // namespace scarp
