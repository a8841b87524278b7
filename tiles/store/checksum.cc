#include "tiles/store/checksum.h"

#include <fcntl.h>
#include <unistd.h>
#include <xxhash.h>

#include <cerrno>
#include <cstring>
#include <new>
#include <vector>

#include "tiles/store/file_error.h"
#include "tiles/store/open_file.h"

namespace scarp {
namespace {

Checksum canonical(XXH128_hash_t hash) {
  XXH128_canonical_t ordered;
  XXH128_canonicalFromHash(&ordered, hash);
  Checksum result;
  static_assert(sizeof ordered.digest == sizeof result.bytes);
  std::memcpy(result.bytes.data(), ordered.digest, result.bytes.size());
  return result;
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

}  // namespace

Checksum checksum_of(std::span<const std::byte> bytes) {
  return canonical(XXH3_128bits(bytes.data(), bytes.size()));
}

std::string to_hex(const Checksum& checksum) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : checksum.bytes) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

std::optional<Checksum> checksum_from_hex(std::string_view text) {
  Checksum checksum;
  if (text.size() != 2 * checksum.bytes.size()) return {};
  for (std::size_t i = 0; i < checksum.bytes.size(); ++i) {
    const int high = hex_digit(text[2 * i]);
    const int low = hex_digit(text[2 * i + 1]);
    if (high < 0 || low < 0) return {};
    checksum.bytes[i] = static_cast<std::uint8_t>(16 * high + low);
  }
  return checksum;
}

struct ChecksumStream::State {
  XXH3_state_t* hash = XXH3_createState();
  ~State() { XXH3_freeState(hash); }
};

ChecksumStream::ChecksumStream() : state_(std::make_unique<State>()) {
  if (state_->hash == nullptr) throw std::bad_alloc();
  XXH3_128bits_reset(state_->hash);
}

ChecksumStream::~ChecksumStream() = default;

void ChecksumStream::add(std::span<const std::byte> bytes) {
  if (!bytes.empty()) XXH3_128bits_update(state_->hash, bytes.data(), bytes.size());
}

Checksum ChecksumStream::checksum() const {
  return canonical(XXH3_128bits_digest(state_->hash));
}

FileDigest digest_of_file(const std::string& path) {
  const OpenFile file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file) throw_read_error(path, errno);
  std::vector<std::byte> piece(std::size_t{1} << 20);
  ChecksumStream stream;
  FileDigest digest;
  for (;;) {
    const ssize_t got = ::read(file.descriptor(), piece.data(), piece.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw_read_error(path, errno);
    if (got == 0) break;
    stream.add({piece.data(), static_cast<std::size_t>(got)});
    digest.size += static_cast<std::uint64_t>(got);
  }
  digest.checksum = stream.checksum();
  return digest;
}

}  // namespace scarp
