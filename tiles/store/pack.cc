#include "tiles/store/pack.h"

#include <zstd.h>

#include <algorithm>
#include <memory>
#include <new>

namespace scarp {
namespace {

/// The highest level without extra memory for the reader. Packing is next to nothing beside what
/// it takes to find out what is packed.
constexpr int kPackLevel = 19;

/// Frames may promise anything, so room is made as it is filled.
constexpr std::size_t kFirstRoomBytes = std::size_t{1} << 20;

struct FreeStream {
  void operator()(ZSTD_DStream* stream) const { ZSTD_freeDStream(stream); }
};

}  // namespace

std::vector<std::uint8_t> packed(std::span<const std::byte> bytes) {
  std::vector<std::uint8_t> frame(ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      ZSTD_compress(frame.data(), frame.size(), bytes.data(), bytes.size(), kPackLevel);
  if (ZSTD_isError(size)) throw std::bad_alloc();  // nothing else can fail with enough room
  frame.resize(size);
  return frame;
}

std::optional<std::vector<std::byte>> unpacked(std::span<const std::byte> frame, std::size_t most) {
  const unsigned long long promised = ZSTD_getFrameContentSize(frame.data(), frame.size());
  if (promised == ZSTD_CONTENTSIZE_ERROR || promised == ZSTD_CONTENTSIZE_UNKNOWN || promised > most)
    return {};
  const auto size = static_cast<std::size_t>(promised);
  const std::unique_ptr<ZSTD_DStream, FreeStream> stream(ZSTD_createDStream());
  if (!stream) throw std::bad_alloc();
  std::vector<std::byte> bytes(std::min(size, kFirstRoomBytes));
  ZSTD_inBuffer in{frame.data(), frame.size(), 0};
  ZSTD_outBuffer out{bytes.data(), bytes.size(), 0};
  for (;;) {
    const std::size_t read_before = in.pos, made_before = out.pos;
    const std::size_t left = ZSTD_decompressStream(stream.get(), &out, &in);
    if (ZSTD_isError(left)) return {};
    if (left == 0) break;  // the frame's end
    if (out.pos == out.size && out.size < size) {
      bytes.resize(std::min(size, 4 * bytes.size()));
      out.dst = bytes.data();
      out.size = bytes.size();
    } else if (in.pos == read_before && out.pos == made_before) {
      return {};  // cut short
    }
  }
  if (out.pos != size || in.pos != frame.size()) return {};
  return bytes;
}

}  // namespace scarp
