#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace scarp {

/// A file's bytes, mapped into memory: read from the disk as they are touched.
///
/// Requires that nobody shortens the file while it is mapped (the system then stops the process
/// with SIGBUS). Scarp never does: it replaces files by renaming, and a mapping keeps the old one.
class MappedFile {
 public:
  /// Errors: kInput where there is no such file or it may not be read, kResource otherwise.
  static MappedFile open(const std::string& path);

  /// The file `name` below an open folder; `path` is what messages call it.
  static MappedFile open_in(int folder, const std::string& name, const std::string& path);

  MappedFile(MappedFile&& other) noexcept;
  MappedFile& operator=(MappedFile&& other) noexcept;
  ~MappedFile();

  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  MappedFile() = default;
  std::span<const std::byte> bytes_;
};

}  // namespace scarp
