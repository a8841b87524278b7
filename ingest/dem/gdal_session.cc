#include "ingest/dem/gdal_session.h"

#include <cpl_conv.h>
#include <cpl_error.h>
#include <fmt/format.h>

#include <mutex>

#include "core/error/error.h"

namespace scarp {

DatasetPtr open_dataset(const std::string& file, unsigned int open_flags, const std::string& what) {
  static std::once_flag registered;
  std::call_once(registered, [] {
    // Reading must leave no .aux.xml beside the user's data.
    CPLSetConfigOption("GDAL_PAM_ENABLED", "NO");
    // Rasters that are not packed go straight to their reader, without GDAL's cache of blocks.
    CPLSetConfigOption("GTIFF_DIRECT_IO", "YES");
    GDALAllRegister();
  });
  // GDAL reports on stderr by itself unless the thread's handler is quiet; its words go into ours.
  CPLPushErrorHandler(CPLQuietErrorHandler);
  CPLErrorReset();
  DatasetPtr dataset(GDALDataset::Open(file.c_str(), open_flags));
  const std::string reason = CPLGetLastErrorMsg();
  CPLPopErrorHandler();
  if (!dataset) {
    VSIStatBufL status;
    const bool exists = VSIStatL(file.c_str(), &status) == 0;
    throw Error(
        ErrorCode::kInput,
        fmt::format("'{}': {}; {} was expected; check the path and try gdalinfo on it", file,
                    !exists          ? "no such file"
                    : reason.empty() ? "not recognised"
                                     : reason,
                    what));
  }
  return dataset;
}

}  // namespace scarp
