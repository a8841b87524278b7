#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/terrain/tin.h"
#include "tests/support/dem_list.h"

namespace scarp::test {

/// A listed DEM as commands would read, place and mesh it, to a number of vertices; nothing where
/// the shared data are not there.
std::optional<Tin> mesh_of(const ListedDem& listed, std::uint32_t vertices);

/// The same as `scarp build` meshes it unless told otherwise, to a tenth of a cell: of a raster of
/// more than kMostBuiltSamples a side its middle.
std::optional<Tin> built_mesh_of(const ListedDem& listed);
inline constexpr std::int32_t kMostBuiltSamples = 1500;

/// Whether a DEM is among names separated by commas; all are where there are none.
bool is_asked_for(const ListedDem& listed, const std::string& names);

}  // namespace scarp::test
