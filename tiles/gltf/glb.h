#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

namespace scarp {

/// A glTF 2.0 asset as it grows: JSON, and the one buffer of its binary form.
struct GlbParts {
  nlohmann::ordered_json json;
  std::vector<std::byte> binary;
};

/// Appends bytes to the buffer, after zeros up to a multiple of `alignment`. Returns their offset.
std::size_t append_aligned(std::vector<std::byte>& buffer, std::span<const std::byte> bytes,
                           std::size_t alignment);

/// The binary form (.glb): a header of 12 bytes, a chunk of JSON padded with spaces, a chunk of the
/// buffer padded with zeros. Little-endian. Sets the length of json.buffers[0].
/// Requires fewer than 2^32 bytes in all (asserted).
std::vector<std::byte> glb_bytes(GlbParts parts);

}  // namespace scarp
