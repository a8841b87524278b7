#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "tiles/store/checksum.h"

namespace scarp::test {

/// Makes all checksums and the size of a damaged section file fit again, as far as its table can be
/// followed: damage that only the checks behind the checksums can find. Offsets: docs/formats.md.
inline void reseal(std::vector<std::byte>& bytes) {
  constexpr std::size_t kHeader = 64, kEntry = 64;
  if (bytes.size() < kHeader) return;
  const auto read = [&](std::size_t at, auto value) {
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
  };
  const auto store = [&](std::size_t at, const auto& value) {
    std::memcpy(bytes.data() + at, &value, sizeof value);
  };
  store(16, std::uint64_t{bytes.size()});
  const auto sections = read(24, std::uint32_t{});
  if (sections > (bytes.size() - kHeader) / kEntry) return;
  const std::span<const std::byte> all(bytes);
  constexpr std::uint64_t kSizes[] = {0, 1, 4, 4, 8, 8, 4, 8};
  for (std::size_t i = 0; i < sections; ++i) {
    const std::size_t entry = kHeader + i * kEntry;
    const auto type = read(entry + 16, std::uint32_t{});
    const auto width = read(entry + 20, std::uint32_t{});
    const auto count = read(entry + 24, std::uint64_t{});
    const auto offset = read(entry + 32, std::uint64_t{});
    const std::uint64_t element = type < 8 ? kSizes[type] * width : 0;
    if (offset > bytes.size() || element == 0 || count > (bytes.size() - offset) / element)
      continue;
    store(entry + 40, checksum_of(all.subspan(offset, count * element)));
  }
  store(32, Checksum{});
  store(32, checksum_of(all.first(kHeader + sections * kEntry)));
}

}  // namespace scarp::test
