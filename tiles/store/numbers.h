#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tiles/store/section_file.h"

/// Whole numbers as bytes: the sign in the lowest bit (0, -1, 1, -2 are 0, 1, 2, 3), then seven
/// bits a byte, lowest first, the highest bit set in all but the last byte.
namespace scarp {

inline std::uint64_t code_of(std::int64_t value) {
  return (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63);
}
inline std::int64_t value_of(std::uint64_t code) {
  return static_cast<std::int64_t>(code >> 1) ^ -static_cast<std::int64_t>(code & 1);
}

inline void append_number(std::int64_t value, std::vector<std::uint8_t>& bytes) {
  std::uint64_t code = code_of(value);
  for (; code >= 0x80; code >>= 7) bytes.push_back(static_cast<std::uint8_t>(code | 0x80));
  bytes.push_back(static_cast<std::uint8_t>(code));
}

/// Takes numbers from bytes, which it keeps. Errors are those of the file that they come from.
class Numbers {
 public:
  Numbers(const SectionFile& file, std::vector<std::uint8_t> bytes)
      : file_(file), bytes_(std::move(bytes)) {}

  std::int64_t take() {
    std::uint64_t code = 0;
    for (unsigned shift = 0;; shift += 7) {
      if (at_ == bytes_.size() || shift > 63) file_.fail("numbers that end too early");
      const std::uint8_t byte = bytes_[at_++];
      code |= static_cast<std::uint64_t>(byte & 0x7f) << shift;
      if (byte < 0x80) break;
    }
    return value_of(code);
  }
  std::size_t size() const { return bytes_.size(); }
  bool at_end() const { return at_ == bytes_.size(); }

 private:
  const SectionFile& file_;
  std::vector<std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

}  // namespace scarp
