#pragma once

#include <string>

#include "tiles/cells/vdb_file.h"

namespace scarp {

/// What vdb_file.cc asks of OpenVDB, in a library of its own that is loaded when it is needed.
/// Both give the empty text, or what went wrong, and throw nothing: exceptions stay on their side.
struct VdbModule {
  const char* version;  ///< of the program that it goes with
  std::string (*write)(const std::string& path, const VdbFile& file, VdbSummary& summary);
  std::string (*read)(const std::string& path, const VdbFile& shapes, VdbFile& file);
};

}  // namespace scarp

/// The one name that the library gives.
extern "C" const scarp::VdbModule scarp_vdb_module;
