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

/// Whether a DEM is among names separated by commas; all are where there are none.
bool is_asked_for(const ListedDem& listed, const std::string& names);

}  // namespace scarp::test
