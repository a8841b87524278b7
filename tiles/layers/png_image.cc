#include "tiles/layers/png_image.h"

#include <fmt/format.h>
#include <png.h>

#include <cassert>
#include <memory>

#include "core/error/error.h"

namespace scarp {

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
