#include "tiles/layers/png_image.h"

#include <fmt/format.h>
#include <png.h>

#include <cassert>
#include <csetjmp>
#include <memory>
#include <utility>

#include "core/error/error.h"

namespace scarp {
namespace {

/// Where libpng leaves its last words before it jumps.
struct Encoding {
  std::string bytes;
  std::string reason;
};

void take_bytes(png_structp png, png_bytep data, png_size_t size) {
  auto* encoding = static_cast<Encoding*>(png_get_io_ptr(png));
  encoding->bytes.append(reinterpret_cast<const char*>(data), size);
}

void take_reason(png_structp png, png_const_charp text) {
  static_cast<Encoding*>(png_get_error_ptr(png))->reason = text;
  png_longjmp(png, 1);
}

void pass_over(png_structp, png_const_charp) {}

struct Image {
  std::int32_t width_px, height_px;
  int depth, colour_type;
  std::size_t row_bytes;  // of what is handed over
  const std::uint8_t* pixels;
  std::span<const std::array<std::uint8_t, 4>> palette;
};

void set_palette(png_structp png, png_infop info,
                 std::span<const std::array<std::uint8_t, 4>> palette) {
  png_color colours[256];
  png_byte alphas[256];
  for (std::size_t i = 0; i < palette.size(); ++i) {
    colours[i] = {palette[i][0], palette[i][1], palette[i][2]};
    alphas[i] = palette[i][3];
  }
  png_set_PLTE(png, info, colours, static_cast<int>(palette.size()));
  png_set_tRNS(png, info, alphas, static_cast<int>(palette.size()), nullptr);
}

/// No object with a destructor may be made between setjmp and a jump. Returns whether it is done.
bool encode(const Image& image, Encoding& encoding) {
  png_structp png =
      png_create_write_struct(PNG_LIBPNG_VER_STRING, &encoding, take_reason, pass_over);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  if (!info || setjmp(png_jmpbuf(png))) {
    png_destroy_write_struct(&png, &info);
    return false;
  }
  png_set_write_fn(png, &encoding, take_bytes, nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(image.width_px),
               static_cast<png_uint_32>(image.height_px), image.depth, image.colour_type,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(png, 1);
  // Neighbours differ little in photographs, not in palettes.
  png_set_filter(png, PNG_FILTER_TYPE_BASE,
                 image.palette.empty() ? PNG_FILTER_SUB : PNG_FILTER_NONE);
  if (!image.palette.empty()) set_palette(png, info, image.palette);
  png_write_info(png, info);
  png_set_packing(png);
  for (std::int32_t row = 0; row < image.height_px; ++row)
    png_write_row(png, image.pixels + static_cast<std::size_t>(row) * image.row_bytes);
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return true;
}

std::string encoded(const Image& image) {
  Encoding encoding;
  if (!encode(image, encoding))
    throw Error(ErrorCode::kResource,
                fmt::format("libpng could not make a picture of {} x {}: {}; ask for a smaller one",
                            image.width_px, image.height_px, encoding.reason));
  return std::move(encoding.bytes);
}

}  // namespace

std::string encode_png(std::int32_t width_px, std::int32_t height_px, int channels,
                       std::span<const std::uint8_t> pixels) {
  assert(width_px >= 1 && height_px >= 1 && (channels == 3 || channels == 4));
  const std::size_t row_bytes =
      static_cast<std::size_t>(width_px) * static_cast<std::size_t>(channels);
  assert(pixels.size() == row_bytes * static_cast<std::size_t>(height_px));
  return encoded({width_px,
                  height_px,
                  8,
                  channels == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_RGB_ALPHA,
                  row_bytes,
                  pixels.data(),
                  {}});
}

std::string encode_palette_png(std::int32_t width_px, std::int32_t height_px,
                               std::span<const std::uint8_t> indices,
                               std::span<const std::array<std::uint8_t, 4>> palette) {
  assert(width_px >= 1 && height_px >= 1 && !palette.empty() && palette.size() <= 256);
  const auto row_bytes = static_cast<std::size_t>(width_px);
  assert(indices.size() == row_bytes * static_cast<std::size_t>(height_px));
  const int depth = palette.size() <= 2    ? 1
                    : palette.size() <= 4  ? 2
                    : palette.size() <= 16 ? 4
                                           : 8;
  return encoded(
      {width_px, height_px, depth, PNG_COLOR_TYPE_PALETTE, row_bytes, indices.data(), palette});
}

void write_png(const std::string& path, std::int32_t width_px, std::int32_t height_px,
               std::span<const std::uint8_t> rgb, Existing existing) {
  assert(width_px >= 1 && height_px >= 1);
  assert(rgb.size() ==
         3 * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px));
  PartFile file(path, existing);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width_px);
  image.height = static_cast<png_uint_32>(height_px);
  image.format = PNG_FORMAT_RGB;
  // Room for the worst case, so that it is compressed once; pages that are not reached cost
  // nothing.
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  const auto bytes = std::make_unique_for_overwrite<std::byte[]>(size);
  const bool done =
      png_image_write_to_memory(&image, bytes.get(), &size, 0, rgb.data(), 0, nullptr) != 0;
  const std::string reason = image.message;
  png_image_free(&image);
  if (!done)
    throw Error(ErrorCode::kResource,
                fmt::format("'{}': libpng could not make a picture of {} x {}: {}; ask for a "
                            "smaller one",
                            path, width_px, height_px, reason));
  file.append({bytes.get(), size});
  file.commit();
}

}  // namespace scarp
