#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace scarp::test {

/// What a binary glTF of a tile holds, read by the words of the glTF 2.0 specification and of its
/// extensions, with none of the program's own code.
struct ReadGlb {
  std::array<double, 3> translation{};          ///< z up, as 3D Tiles turns it
  std::vector<std::array<float, 3>> positions;  ///< z up
  std::vector<std::array<float, 3>> normals;    ///< z up
  std::vector<float> features;                  ///< empty where there are none
  std::vector<std::uint32_t> corners;
  std::uint32_t null_feature = 0;
  bool is_compressed = false;
  // The property table; empty where there is none.
  std::vector<std::uint32_t> group, triangles, first_triangle;
  std::vector<double> minimum_height_m, maximum_height_m;
  std::vector<std::array<double, 4>> region_rad;

  /// Translation and position together, exact.
  std::array<double, 3> vertex(std::size_t i) const {
    return {translation[0] + static_cast<double>(positions[i][0]),
            translation[1] + static_cast<double>(positions[i][1]),
            translation[2] + static_cast<double>(positions[i][2])};
  }
};

/// Throws std::runtime_error, naming what is wrong.
ReadGlb read_glb(const std::string& bytes);
ReadGlb read_glb_file(const std::string& path);

}  // namespace scarp::test
