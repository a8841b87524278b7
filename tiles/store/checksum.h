#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace scarp {

/// XXH3, 128 bits, in its canonical (big-endian) byte order. Finds damage, not forgery.
struct Checksum {
  std::array<std::uint8_t, 16> bytes{};

  friend bool operator==(const Checksum&, const Checksum&) = default;
};

Checksum checksum_of(std::span<const std::byte> bytes);

/// 32 lower-case hexadecimal digits, and back: nothing where the text is anything else.
std::string to_hex(const Checksum& checksum);
std::optional<Checksum> checksum_from_hex(std::string_view text);

/// The checksum of bytes that come in pieces; the same as of all of them at once.
class ChecksumStream {
 public:
  ChecksumStream();
  ~ChecksumStream();
  ChecksumStream(const ChecksumStream&) = delete;
  ChecksumStream& operator=(const ChecksumStream&) = delete;

  void add(std::span<const std::byte> bytes);
  Checksum checksum() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

struct FileDigest {
  std::uint64_t size = 0;  ///< bytes
  Checksum checksum;
};

/// Size and checksum of a whole file. Errors: kInput where it cannot be read.
/// Cost: one pass over the file, 1 MiB of memory.
FileDigest digest_of_file(const std::string& path);

}  // namespace scarp
