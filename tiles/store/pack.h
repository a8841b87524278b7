#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

/// Bytes packed by zstd, one frame each.
namespace scarp {

/// What a frame may unpack to: more than any section of a tile, less than what harms a machine.
inline constexpr std::size_t kMostUnpackedBytes = std::size_t{1} << 31;

/// The same bytes give the same frame with the same version of zstd. Cost: about 1 us a byte.
std::vector<std::uint8_t> packed(std::span<const std::byte> bytes);

/// The inverse; nothing where the bytes are not one whole frame, or unpack to more than `most`.
/// Memory: grows with what is really unpacked, whatever the frame promises. Cost: 2 ns a byte.
std::optional<std::vector<std::byte>> unpacked(std::span<const std::byte> frame,
                                               std::size_t most = kMostUnpackedBytes);

}  // namespace scarp
