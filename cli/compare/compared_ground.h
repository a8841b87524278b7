#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/terrain/ground_grid.h"
#include "core/terrain/sample_grid.h"
#include "core/viewshed/view_limits.h"
#include "ingest/dem/dem.h"

namespace scarp {

/// The square of a DEM that methods are compared on: small enough to be judged sample by sample.
struct ComparedGround {
  std::vector<std::string>
      files;                ///< that commands get: the ones read, or the square cut from them
  std::string cut_command;  ///< that cuts the square; empty where it is all of the DEM
  Dem dem;                  ///< of the square, with heights
  SampleGrid samples;
  GroundGrid grid;
  std::optional<EarthFrame> earth;
  std::string surface_flags;  ///< that a command needs to read the files alike

  struct Eye {
    std::int32_t column = 0, row = 0;
  };
  /// Over the highest sample, then over others drawn at random.
  std::vector<Eye> eyes;

  double cell_m() const;
  /// Every ground cell as two triangles: samples, three a triangle.
  std::vector<std::uint32_t> cell_corners() const;
  /// An eye as commands take it.
  std::string typed(const Eye& eye, double height_m) const;
  /// Known samples that are drawn at random, with repetition.
  std::vector<Eye> draw(std::size_t count, std::uint64_t seed) const;
};

/// Reads the square around the DEM's middle, or all of a smaller DEM.
/// @param side  samples at most, in both directions
/// Throws Error as reading a DEM does, and kInput where the square is void.
ComparedGround read_compared_ground(const std::vector<std::string>& files,
                                    const DemOptions& options, std::int32_t side, int eyes,
                                    std::uint64_t seed);

}  // namespace scarp
