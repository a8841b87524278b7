#include "tiles/cells/vdb_file.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include "core/error/error.h"
#include "tiles/cells/vdb_module.h"

namespace scarp {
namespace {

/// Stays loaded. Throws Error{kResource} where it is not there, or of another version.
const VdbModule& vdb_module() {
  static const VdbModule& module = []() -> const VdbModule& {
    // Found beside the program, or where installing puts it, by the program's own search path.
    void* library = ::dlopen(SCARP_VDB_MODULE, RTLD_NOW | RTLD_LOCAL);
    void* found = library ? ::dlsym(library, "scarp_vdb_module") : nullptr;
    if (!found)
      throw Error(ErrorCode::kResource,
                  fmt::format("'{}', which writes OpenVDB files, cannot be loaded: {}; install "
                              "Scarp whole",
                              SCARP_VDB_MODULE, ::dlerror()));
    const auto& loaded = *static_cast<const VdbModule*>(found);
    if (std::string(loaded.version) != SCARP_VERSION)
      throw Error(ErrorCode::kResource,
                  fmt::format("'{}' is of version {}; {} was expected; install Scarp whole",
                              SCARP_VDB_MODULE, loaded.version, SCARP_VERSION));
    return loaded;
  }();
  return module;
}

}  // namespace

VdbSummary write_vdb(const std::string& path, const VdbFile& file, Existing existing) {
  PartFile part(path, existing);
  VdbSummary summary;
  const std::string failure = vdb_module().write(part.part_path(), file, summary);
  if (!failure.empty())
    throw Error(ErrorCode::kResource,
                fmt::format("'{}': {}; check the space that is left on the disk", path, failure));
  part.take_over();
  part.commit();
  return summary;
}

VdbFile read_vdb(const std::string& path, const VdbFile& shapes) {
  VdbFile file;
  const std::string failure = vdb_module().read(path, shapes, file);
  if (!failure.empty())
    throw Error(ErrorCode::kInput, fmt::format("'{}': {}; an OpenVDB file with the grids that were "
                                               "asked for was expected",
                                               path, failure));
  return file;
}

}  // namespace scarp
