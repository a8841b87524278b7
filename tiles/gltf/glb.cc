#include "tiles/gltf/glb.h"

#include <array>
#include <bit>
#include <cassert>
#include <string>

namespace scarp {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::uint32_t kMagic = 0x46546C67;        // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;    // "JSON"
constexpr std::uint32_t kBinaryChunk = 0x004E4942;  // "BIN"

void append_words(std::vector<std::byte>& bytes, std::initializer_list<std::uint32_t> words) {
  for (const std::uint32_t word : words) {
    const auto parts = std::bit_cast<std::array<std::byte, 4>>(word);
    bytes.insert(bytes.end(), parts.begin(), parts.end());
  }
}

}  // namespace

std::size_t append_aligned(std::vector<std::byte>& buffer, std::span<const std::byte> bytes,
                           std::size_t alignment) {
  buffer.resize((buffer.size() + alignment - 1) / alignment * alignment);
  const std::size_t offset = buffer.size();
  buffer.insert(buffer.end(), bytes.begin(), bytes.end());
  return offset;
}

std::vector<std::byte> glb_bytes(GlbParts parts) {
  parts.binary.resize((parts.binary.size() + 3) / 4 * 4);
  parts.json["buffers"][0]["byteLength"] = parts.binary.size();
  std::string text = parts.json.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::size_t size = 12 + 8 + text.size() + 8 + parts.binary.size();
  assert(size < (std::size_t{1} << 32));
  std::vector<std::byte> bytes;
  bytes.reserve(size);
  append_words(bytes, {kMagic, 2, static_cast<std::uint32_t>(size),
                       static_cast<std::uint32_t>(text.size()), kJsonChunk});
  const std::span<const std::byte> json = std::as_bytes(std::span(text));
  bytes.insert(bytes.end(), json.begin(), json.end());
  append_words(bytes, {static_cast<std::uint32_t>(parts.binary.size()), kBinaryChunk});
  bytes.insert(bytes.end(), parts.binary.begin(), parts.binary.end());
  return bytes;
}

}  // namespace scarp
