#include "tiles/store/section_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cassert>

#include "core/error/error.h"
#include "tiles/store/mapped_file.h"

namespace scarp {
namespace {

static_assert(std::endian::native == std::endian::little,
              "section files are little-endian and are read in place");

constexpr FileKind kMagic = {'S', 'C', 'R', 'P'};
constexpr std::uint32_t kContainerVersion = 1;
constexpr std::uint64_t kAlignment = 64;  // a cache line, and enough for any vector load
constexpr std::size_t kNameSize = 16;

// The two records as they lie in the file; docs/formats.md repeats them as tables.
struct FileHeader {
  FileKind magic;
  std::uint32_t container_version;
  FileKind kind;
  std::uint32_t kind_version;
  std::uint64_t file_size;
  std::uint32_t section_count;
  std::uint32_t zero;
  Checksum checksum;  // of header and table, with these 16 bytes zero
  std::array<std::uint8_t, 16> zeros;
};
static_assert(sizeof(FileHeader) == 64 && std::is_trivially_copyable_v<FileHeader>);

struct TableEntry {
  std::array<char, kNameSize> name;  // padded with zeros, at least one
  std::uint32_t type;
  std::uint32_t width;
  std::uint64_t count;
  std::uint64_t offset;
  Checksum checksum;
  std::uint64_t zero;
};
static_assert(sizeof(TableEntry) == 64 && std::is_trivially_copyable_v<TableEntry>);

std::uint64_t aligned(std::uint64_t offset) {
  return (offset + kAlignment - 1) / kAlignment * kAlignment;
}

std::size_t scalar_size(ElementType type) {
  switch (type) {
    case ElementType::kUint8:
      return 1;
    case ElementType::kInt32:
    case ElementType::kUint32:
    case ElementType::kFloat32:
      return 4;
    case ElementType::kInt64:
    case ElementType::kUint64:
    case ElementType::kFloat64:
      return 8;
  }
  return 0;
}

std::string_view type_name(ElementType type) {
  switch (type) {
    case ElementType::kUint8:
      return "uint8";
    case ElementType::kInt32:
      return "int32";
    case ElementType::kUint32:
      return "uint32";
    case ElementType::kInt64:
      return "int64";
    case ElementType::kUint64:
      return "uint64";
    case ElementType::kFloat32:
      return "float32";
    case ElementType::kFloat64:
      return "float64";
  }
  return "unknown";
}

bool printable(char c) {
  return c >= 0x21 && c <= 0x7e;
}

std::string quoted(FileKind kind) {
  std::string text = "\"";
  for (const char c : kind) text += c == ' ' || printable(c) ? c : '?';
  return text + "\"";
}

template <class Record>
std::span<const std::byte> bytes_of(const Record& record) {
  return std::as_bytes(std::span(&record, 1));
}

/// Requires at least sizeof(Record) bytes.
template <class Record>
Record record_from(std::span<const std::byte> bytes) {
  Record record;
  std::memcpy(&record, bytes.data(), sizeof record);
  return record;
}

Checksum head_checksum(FileHeader header, std::span<const std::byte> table) {
  header.checksum = {};
  ChecksumStream stream;
  stream.add(bytes_of(header));
  stream.add(table);
  return stream.checksum();
}

std::span<const std::byte> padding_before(std::uint64_t offset) {
  static constexpr std::array<std::byte, kAlignment> kZeros{};
  return std::span(kZeros).first(static_cast<std::size_t>(aligned(offset) - offset));
}

}  // namespace

SectionFileWriter::SectionFileWriter(FileKind kind, std::uint32_t kind_version)
    : kind_(kind), kind_version_(kind_version) {}

void SectionFileWriter::add_bytes(std::string_view name, ElementType type, std::size_t scalar,
                                  std::size_t width, std::span<const std::byte> bytes) {
  assert(!name.empty() && name.size() < kNameSize && std::ranges::all_of(name, printable));
  assert(std::ranges::none_of(sections_, [&](const Section& s) { return s.name == name; }));
  assert(width >= 1 && bytes.size() % (scalar * width) == 0);
  sections_.push_back({std::string(name), type, static_cast<std::uint32_t>(width),
                       bytes.size() / (scalar * width), bytes});
}

std::vector<std::byte> SectionFileWriter::head() const {
  FileHeader header{kMagic, kContainerVersion, kind_, kind_version_, 0, 0, 0, {}, {}};
  header.section_count = static_cast<std::uint32_t>(sections_.size());
  std::vector<TableEntry> table;
  std::uint64_t end = sizeof(FileHeader) + sections_.size() * sizeof(TableEntry);
  for (const Section& section : sections_) {
    TableEntry entry{};
    section.name.copy(entry.name.data(), kNameSize - 1);
    entry.type = static_cast<std::uint32_t>(section.type);
    entry.width = section.width;
    entry.count = section.count;
    entry.offset = aligned(end);
    entry.checksum = checksum_of(section.bytes);
    end = entry.offset + section.bytes.size();
    table.push_back(entry);
  }
  header.file_size = end;
  const std::span<const std::byte> table_bytes = std::as_bytes(std::span(table));
  header.checksum = head_checksum(header, table_bytes);
  std::vector<std::byte> bytes;
  bytes.insert(bytes.end(), bytes_of(header).begin(), bytes_of(header).end());
  bytes.insert(bytes.end(), table_bytes.begin(), table_bytes.end());
  return bytes;
}

void SectionFileWriter::write(const std::string& path, Existing existing) const {
  PartFile file(path, existing);
  const std::vector<std::byte> start = head();
  file.append(start);
  std::uint64_t end = start.size();
  for (const Section& section : sections_) {
    file.append(padding_before(end));
    file.append(section.bytes);
    end = aligned(end) + section.bytes.size();
  }
  file.commit();
}

std::vector<std::byte> SectionFileWriter::to_bytes() const {
  std::vector<std::byte> bytes = head();
  for (const Section& section : sections_) {
    bytes.resize(static_cast<std::size_t>(aligned(bytes.size())));
    bytes.insert(bytes.end(), section.bytes.begin(), section.bytes.end());
  }
  return bytes;
}

SectionFile SectionFile::open(const std::string& path, Verify verify) {
  auto mapped = std::make_shared<const MappedFile>(MappedFile::open(path));
  SectionFile file = from_memory(mapped->bytes(), path, verify);
  file.owner_ = std::move(mapped);
  return file;
}

SectionFile SectionFile::open_in(int folder, const std::string& name, const std::string& path,
                                 Verify verify) {
  auto mapped = std::make_shared<const MappedFile>(MappedFile::open_in(folder, name, path));
  SectionFile file = from_memory(mapped->bytes(), path, verify);
  file.owner_ = std::move(mapped);
  return file;
}

SectionFile SectionFile::from_memory(std::span<const std::byte> bytes, const std::string& name,
                                     Verify verify) {
  assert(reinterpret_cast<std::uintptr_t>(bytes.data()) % alignof(double) == 0);
  SectionFile file;
  file.name_ = name;
  file.bytes_ = bytes;
  file.read_head();
  if (verify == Verify::kEverything) file.check();
  return file;
}

void SectionFile::read_head() {
  if (bytes_.size() < sizeof(FileHeader))
    fail(fmt::format("{} bytes where a header of {} was expected", bytes_.size(),
                     sizeof(FileHeader)));
  const auto header = record_from<FileHeader>(bytes_);
  if (header.magic != kMagic)
    fail(fmt::format("it begins with {} where {} was expected", quoted(header.magic),
                     quoted(kMagic)));
  if (header.container_version != kContainerVersion)
    fail(fmt::format("format version {} where {} was expected", header.container_version,
                     kContainerVersion));
  if (header.file_size != bytes_.size())
    fail(fmt::format("{} bytes where its header promises {}", bytes_.size(), header.file_size));
  const std::size_t room = (bytes_.size() - sizeof(FileHeader)) / sizeof(TableEntry);
  if (header.section_count > room)
    fail(fmt::format("a table of {} sections in a file with room for {}", header.section_count,
                     room));
  const std::span<const std::byte> table =
      bytes_.subspan(sizeof(FileHeader), header.section_count * sizeof(TableEntry));
  if (head_checksum(header, table) != header.checksum) fail("the header's checksum does not fit");
  kind_ = header.kind;
  kind_version_ = header.kind_version;
  std::uint64_t end = sizeof(FileHeader) + table.size();
  for (std::size_t i = 0; i < header.section_count; ++i)
    read_entry(table.subspan(i * sizeof(TableEntry), sizeof(TableEntry)), end);
  if (end != bytes_.size())
    fail(fmt::format("{} bytes of sections in a file of {}", end, bytes_.size()));
}

void SectionFile::read_entry(std::span<const std::byte> bytes, std::uint64_t& end) {
  const auto raw = record_from<TableEntry>(bytes);
  const auto name_end = std::find(raw.name.begin(), raw.name.end(), '\0');
  const std::string name(raw.name.begin(), name_end);
  if (name.empty() || name_end == raw.name.end() || !std::ranges::all_of(name, printable) ||
      std::any_of(name_end, raw.name.end(), [](char c) { return c != '\0'; }))
    fail(fmt::format("section {} has no proper name", entries_.size()));
  if (has(name)) fail(fmt::format("section \"{}\" is there twice", name));
  const auto type = static_cast<ElementType>(raw.type);
  const std::uint64_t scalar = scalar_size(type);
  if (scalar == 0) fail(fmt::format("section \"{}\" has the unknown type {}", name, raw.type));
  const std::uint64_t element = scalar * raw.width;  // at most 2^35
  if (element == 0) fail(fmt::format("section \"{}\" has elements without numbers", name));
  const std::uint64_t start = aligned(end);
  if (raw.offset != start || start > bytes_.size() || raw.count > (bytes_.size() - start) / element)
    fail(
        fmt::format("section \"{}\" (offset {}, {} elements of {} bytes) does not lie at offset {} "
                    "in a file of {} bytes",
                    name, raw.offset, raw.count, element, start, bytes_.size()));
  end = start + raw.count * element;
  entries_.push_back({name, type, raw.width,
                      bytes_.subspan(static_cast<std::size_t>(start),
                                     static_cast<std::size_t>(raw.count * element)),
                      raw.checksum});
}

void SectionFile::check() const {
  const std::byte* end = bytes_.data() + sizeof(FileHeader) + entries_.size() * sizeof(TableEntry);
  for (const Entry& entry : entries_) {
    if (std::any_of(end, entry.bytes.data(), [](std::byte b) { return b != std::byte{0}; }))
      fail(fmt::format("the bytes before section \"{}\" are not zero", entry.name));
    if (checksum_of(entry.bytes) != entry.checksum)
      fail(fmt::format("the checksum of section \"{}\" does not fit", entry.name));
    end = entry.bytes.data() + entry.bytes.size();
  }
}

void SectionFile::require(FileKind kind, std::uint32_t kind_version) const {
  if (kind_ != kind)
    fail(fmt::format("a file of kind {} where {} was expected", quoted(kind_), quoted(kind)));
  if (kind_version_ != kind_version)
    fail(fmt::format("version {} of kind {} where {} was expected", kind_version_, quoted(kind),
                     kind_version));
}

bool SectionFile::has(std::string_view section) const {
  return std::ranges::any_of(entries_, [&](const Entry& e) { return e.name == section; });
}

const SectionFile::Entry& SectionFile::entry(std::string_view section) const {
  const auto found =
      std::ranges::find_if(entries_, [&](const Entry& e) { return e.name == section; });
  if (found == entries_.end()) fail(fmt::format("section \"{}\" is missing", section));
  return *found;
}

std::uint32_t SectionFile::width(std::string_view section) const {
  return entry(section).width;
}

std::span<const std::byte> SectionFile::find(std::string_view section, ElementType type,
                                             std::uint32_t width) const {
  const Entry& found = entry(section);
  if (found.type != type || found.width != width)
    fail(fmt::format("section \"{}\" holds {} x {} where {} x {} was expected", section,
                     type_name(found.type), found.width, type_name(type), width));
  return found.bytes;
}

std::vector<std::byte> SectionFile::unpacked(std::string_view section) const {
  auto bytes = scarp::unpacked(find(section, ElementType::kUint8, 1));
  if (!bytes) fail_packed(section);
  return std::move(*bytes);
}

void SectionFile::fail_packed(std::string_view section) const {
  fail(fmt::format("section \"{}\" holds nothing that can be unpacked", section));
}

void SectionFile::fail(const std::string& found) const {
  throw Error(ErrorCode::kCorrupt,
              fmt::format("'{}': {}; the file is damaged or not what it is taken for; restore it "
                          "from a copy or build the scene again",
                          name_, found));
}

}  // namespace scarp
