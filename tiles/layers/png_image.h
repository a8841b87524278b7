#pragma once

#include <array>
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

/// A picture as the bytes of a PNG file, quickly: little effort is spent on making it small.
/// @param pixels    [height_px * width_px * channels], row by row from the top
/// @param channels  3: RGB, 4: RGBA, alpha not multiplied in
/// Requires (asserted) sizes >= 1 and as many values. Errors: kResource from libpng.
std::string encode_png(std::int32_t width_px, std::int32_t height_px, int channels,
                       std::span<const std::uint8_t> pixels);

/// The same of a picture in few colours, in 1, 2, 4 or 8 bits a pixel.
/// @param indices  [height_px * width_px] into the palette
/// @param palette  red, green, blue, alpha; 1 to 256
/// Requires indices below palette.size().
std::string encode_palette_png(std::int32_t width_px, std::int32_t height_px,
                               std::span<const std::uint8_t> indices,
                               std::span<const std::array<std::uint8_t, 4>> palette);

}  // namespace scarp
