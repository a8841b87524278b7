#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace scarp {

/// What a culling file says, as the tables of a GeoPackage for tools: `frame`, `tiles`, `groups`,
/// `heights`; docs/runtime.md has their columns. Numbers are those of the file, in metres.
/// Requires a file that opens (asserted).
/// Errors: those of PartFile, and kResource where GDAL cannot write.
void write_culling_tables(const std::string& path, std::span<const std::byte> culling_file,
                          const std::string& crs_wkt);

}  // namespace scarp
