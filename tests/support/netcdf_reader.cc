#include "tests/support/netcdf_reader.h"

#include <bit>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace scarp::test {
namespace {

constexpr std::uint32_t kChar = 2, kInt = 4, kFloat = 5, kDouble = 6;
constexpr std::uint32_t kDimensionTag = 10, kVariableTag = 11, kAttributeTag = 12;

class Reader {
 public:
  explicit Reader(std::string bytes) : bytes_(std::move(bytes)) {}

  ReadNetcdf read() {
    if (bytes_.substr(0, 3) != "CDF" || (bytes_[3] != 1 && bytes_[3] != 2)) fail("no classic file");
    is_wide_ = bytes_[3] == 2;
    at_ = 4;
    if (word() != 0) fail("records, which are not expected");
    ReadNetcdf file;
    for (std::uint32_t i = list(kDimensionTag); i > 0; --i) {
      names_.push_back(name());
      sizes_.push_back(word());
      file.dimensions[names_.back()] = sizes_.back();
    }
    file.attributes = attributes();
    for (std::uint32_t i = list(kVariableTag); i > 0; --i) read_variable(file);
    return file;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error("netCDF, at byte " + std::to_string(at_) + ": " + what);
  }

  std::uint64_t big_endian(std::size_t from, std::size_t count) const {
    if (from + count > bytes_.size()) fail("ends early");
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < count; ++i)
      value = value << 8 | static_cast<unsigned char>(bytes_[from + i]);
    return value;
  }
  std::uint32_t word() {
    at_ += 4;
    return static_cast<std::uint32_t>(big_endian(at_ - 4, 4));
  }
  /// Elements of a list: its tag and count, or two zeros.
  std::uint32_t list(std::uint32_t tag) {
    const std::uint32_t found = word(), count = word();
    if (found != tag && (found != 0 || count != 0)) fail("another list");
    return count;
  }
  void pad(std::size_t size) {
    for (; size % 4 != 0; ++size, ++at_)
      if (big_endian(at_, 1) != 0) fail("padding that is not zero");
  }
  std::string name() {
    const std::uint32_t size = word();
    if (at_ + size > bytes_.size()) fail("ends early");
    const std::string text = bytes_.substr(at_, size);
    at_ += size;
    pad(size);
    return text;
  }
  static std::size_t size_of(std::uint32_t type) {
    return type == kChar ? 1 : type == kDouble ? 8 : 4;
  }
  std::vector<double> numbers(std::uint32_t type, std::size_t from, std::size_t count) const {
    std::vector<double> values;
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint64_t bits = big_endian(from + i * size_of(type), size_of(type));
      if (type == kInt)
        values.push_back(static_cast<std::int32_t>(bits));
      else if (type == kDouble)
        values.push_back(std::bit_cast<double>(bits));
      else if (type == kFloat)
        values.push_back(
            static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits))));
      else
        fail("a type that is not expected");
    }
    return values;
  }
  std::map<std::string, ReadNetcdf::Attribute> attributes() {
    std::map<std::string, ReadNetcdf::Attribute> all;
    for (std::uint32_t i = list(kAttributeTag); i > 0; --i) {
      const std::string key = name();
      const std::uint32_t type = word(), count = word();
      const std::size_t size = count * size_of(type);
      if (at_ + size > bytes_.size()) fail("ends early");
      if (type == kChar)
        all[key] = bytes_.substr(at_, size);
      else
        all[key] = numbers(type, at_, count);
      at_ += size;
      pad(size);
    }
    return all;
  }
  void read_variable(ReadNetcdf& file) {
    const std::string key = name();
    ReadNetcdf::Variable& variable = file.variables[key];
    std::size_t count = 1;
    for (std::uint32_t i = word(); i > 0; --i) {
      const std::uint32_t dimension = word();
      if (dimension >= names_.size()) fail("a dimension that there is not");
      variable.dimensions.push_back(names_[dimension]);
      count *= sizes_[dimension];
    }
    variable.attributes = attributes();
    variable.type = word();
    const std::uint32_t size = word();
    const std::size_t bytes = count * size_of(variable.type);
    if (size != (bytes + 3) / 4 * 4) fail("variable " + key + " of another size");
    const std::size_t begin = big_endian(at_, is_wide_ ? 8 : 4);
    at_ += is_wide_ ? 8 : 4;
    variable.values = numbers(variable.type, begin, count);
  }

  std::string bytes_;
  std::size_t at_ = 0;
  bool is_wide_ = false;
  std::vector<std::string> names_;
  std::vector<std::uint32_t> sizes_;
};

}  // namespace

ReadNetcdf read_netcdf(const std::string& path) {
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return Reader(bytes.str()).read();
}

}  // namespace scarp::test
