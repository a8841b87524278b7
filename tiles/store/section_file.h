#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "tiles/store/checksum.h"
#include "tiles/store/pack.h"
#include "tiles/store/part_file.h"

/// The one container of every tile file: named arrays of numbers, little-endian, each starting at a
/// multiple of 64 bytes and with a checksum of its own. docs/formats.md has the byte tables.
///
/// Thread safety: reading from several threads is fine; writers belong to one thread.
namespace scarp {

/// Four letters that say what a file holds, such as "TIN ".
using FileKind = std::array<char, 4>;

enum class ElementType : std::uint32_t {
  kUint8 = 1,
  kInt32 = 2,
  kUint32 = 3,
  kInt64 = 4,
  kUint64 = 5,
  kFloat32 = 6,
  kFloat64 = 7,
};

template <class Scalar>
constexpr ElementType element_type() {
  if constexpr (std::is_same_v<Scalar, std::uint8_t>) return ElementType::kUint8;
  if constexpr (std::is_same_v<Scalar, std::int32_t>) return ElementType::kInt32;
  if constexpr (std::is_same_v<Scalar, std::uint32_t>) return ElementType::kUint32;
  if constexpr (std::is_same_v<Scalar, std::int64_t>) return ElementType::kInt64;
  if constexpr (std::is_same_v<Scalar, std::uint64_t>) return ElementType::kUint64;
  if constexpr (std::is_same_v<Scalar, float>) return ElementType::kFloat32;
  if constexpr (std::is_same_v<Scalar, double>) return ElementType::kFloat64;
}

/// Collects the arrays of a file, then writes them. Borrows the arrays of add(): they must outlive
/// the writer; add_owned() keeps its own.
class SectionFileWriter {
 public:
  SectionFileWriter(FileKind kind, std::uint32_t kind_version);

  /// @param name    1 to 15 printable ASCII characters, new in this file (asserted)
  /// @param values  elements of sizeof(T) / sizeof(Scalar) scalars each, without padding
  template <class Scalar, class T>
  void add(std::string_view name, std::span<const T> values) {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(Scalar) == 0);
    add_bytes(name, element_type<Scalar>(), sizeof(Scalar), sizeof(T) / sizeof(Scalar),
              std::as_bytes(values));
  }

  /// Elements of `width` scalars each; values.size() is a multiple of it (asserted).
  template <class Scalar>
  void add_rows(std::string_view name, std::span<const Scalar> values, std::uint32_t width) {
    add_bytes(name, element_type<Scalar>(), sizeof(Scalar), width, std::as_bytes(values));
  }

  template <class Scalar, class T>
  void add_owned(std::string_view name, const std::vector<T>& values) {
    const std::span<const std::byte> bytes = std::as_bytes(std::span(values));
    owned_.push_back(std::make_unique<std::vector<std::byte>>(bytes.begin(), bytes.end()));
    add_bytes(name, element_type<Scalar>(), sizeof(Scalar), sizeof(T) / sizeof(Scalar),
              *owned_.back());
  }

  /// The values packed by zstd, as a section of bytes: for what is unpacked when it is read.
  template <class Scalar, class T>
  void add_packed(std::string_view name, const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(Scalar) == 0);
    add_owned<std::uint8_t>(name, packed(std::as_bytes(std::span(values))));
  }

  /// Writes beside the name, flushes, renames. Errors: those of PartFile; nothing is left behind.
  void write(const std::string& path, Existing existing) const;

  /// What write() writes.
  std::vector<std::byte> to_bytes() const;

 private:
  struct Section {
    std::string name;
    ElementType type;
    std::uint32_t width;
    std::uint64_t count;
    std::span<const std::byte> bytes;
  };

  void add_bytes(std::string_view name, ElementType type, std::size_t scalar_size,
                 std::size_t width, std::span<const std::byte> bytes);
  std::vector<std::byte> head() const;

  FileKind kind_;
  std::uint32_t kind_version_;
  std::vector<Section> sections_;
  std::vector<std::unique_ptr<std::vector<std::byte>>> owned_;
};

enum class Verify {
  kStructure,   ///< header and section table: cost independent of the file's size
  kEverything,  ///< the arrays' checksums too: reads the whole file
};

/// A section file, opened. All errors are Error{kCorrupt} and name the file and the section, except
/// those of opening it (see MappedFile).
///
/// open() trusts no byte of the header and the table: size, magic, version, their checksum, and
/// that the sections fill the file exactly. The arrays' bytes are vouched for by check().
class SectionFile {
 public:
  static SectionFile open(const std::string& path, Verify verify = Verify::kStructure);

  /// The same for bytes in memory, which must outlive the result and start at a multiple of 8 bytes
  /// (asserted). `name` is what messages call it.
  static SectionFile from_memory(std::span<const std::byte> bytes, const std::string& name,
                                 Verify verify = Verify::kStructure);

  /// The file `name` below an open folder, called `path` in messages.
  static SectionFile open_in(int folder, const std::string& name, const std::string& path,
                             Verify verify = Verify::kStructure);

  /// Every section's checksum, and that the bytes between sections are zero.
  void check() const;

  /// Error where the file is of another kind or kind version.
  void require(FileKind kind, std::uint32_t kind_version) const;

  bool has(std::string_view section) const;

  /// The scalars of a section, count * width of them. Error where the section is missing or has
  /// another type or width. Cost: O(1). The span lives as long as this object or a copy of it.
  template <class Scalar>
  std::span<const Scalar> section(std::string_view section, std::uint32_t width = 1) const {
    const std::span<const std::byte> bytes = find(section, element_type<Scalar>(), width);
    // sections start at multiples of 64 bytes, and mapped or allocated memory at more than 8
    return {reinterpret_cast<const Scalar*>(bytes.data()), bytes.size() / sizeof(Scalar)};
  }

  /// The elements of a section as a vector of T, which is sizeof(T) / sizeof(Scalar) scalars.
  template <class Scalar, class T>
  std::vector<T> copy(std::string_view section) const {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(Scalar) == 0);
    const std::span<const std::byte> bytes =
        find(section, element_type<Scalar>(), sizeof(T) / sizeof(Scalar));
    std::vector<T> values(bytes.size() / sizeof(T));
    if (!bytes.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }

  /// What add_packed was given. Error where the bytes are nothing packed, or of no whole number of
  /// elements. Cost: O(n), about 2 ns a byte.
  template <class Scalar, class T>
  std::vector<T> unpack(std::string_view section) const {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(Scalar) == 0);
    const std::vector<std::byte> bytes = unpacked(section);
    if (bytes.size() % sizeof(T) != 0) fail_packed(section);
    std::vector<T> values(bytes.size() / sizeof(T));
    if (!bytes.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }

  /// Scalars an element of this section has. Error where there is no such section.
  std::uint32_t width(std::string_view section) const;

  const std::string& name() const { return name_; }
  std::uint64_t size() const { return bytes_.size(); }  ///< bytes

  /// Throws Error{kCorrupt}: this file's name, what was found, and what to do.
  [[noreturn]] void fail(const std::string& found) const;

 private:
  struct Entry {
    std::string name;
    ElementType type;
    std::uint32_t width;
    std::span<const std::byte> bytes;
    Checksum checksum;
  };

  void read_head();
  void read_entry(std::span<const std::byte> bytes, std::uint64_t& end);
  const Entry& entry(std::string_view section) const;
  std::span<const std::byte> find(std::string_view section, ElementType type,
                                  std::uint32_t width) const;
  std::vector<std::byte> unpacked(std::string_view section) const;
  [[noreturn]] void fail_packed(std::string_view section) const;

  std::string name_;
  std::shared_ptr<const void> owner_;  // the mapping, where there is one
  std::span<const std::byte> bytes_;
  FileKind kind_{};
  std::uint32_t kind_version_ = 0;
  std::vector<Entry> entries_;
};

}  // namespace scarp
