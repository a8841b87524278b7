#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "tiles/store/part_file.h"

namespace scarp {

/// Writes a picture as PNG, 8 bits a channel, sRGB.
///
/// @param rgb  [height_px * width_px * 3], row by row from the top
///
/// Requires width_px, height_px >= 1 and as many values (asserted).
/// Errors: kResource from libpng or the disk, kInput where the file exists and is not to be
/// replaced. Nothing is left behind. Memory: the compressed file.
void write_png(const std::string& path, std::int32_t width_px, std::int32_t height_px,
               std::span<const std::uint8_t> rgb, Existing existing);

}  // namespace scarp
