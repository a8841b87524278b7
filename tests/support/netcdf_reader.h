#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <variant>
#include <vector>

namespace scarp::test {

/// A netCDF file of the classic formats (CDF-1 and CDF-2), read by the format's description and
/// strictly: every count, padding and offset is checked.
struct ReadNetcdf {
  using Numbers = std::vector<double>;
  using Attribute = std::variant<std::string, Numbers>;
  struct Variable {
    std::vector<std::string> dimensions;
    std::map<std::string, Attribute> attributes;
    std::uint32_t type = 0;  ///< 4 int, 6 double
    Numbers values;

    std::string text(const std::string& name) const {
      return std::get<std::string>(attributes.at(name));
    }
    double number(const std::string& name) const {
      return std::get<Numbers>(attributes.at(name)).at(0);
    }
  };
  std::map<std::string, std::uint32_t> dimensions;
  std::map<std::string, Attribute> attributes;
  std::map<std::string, Variable> variables;
};

/// Throws std::runtime_error, naming what is wrong.
ReadNetcdf read_netcdf(const std::string& path);

}  // namespace scarp::test
