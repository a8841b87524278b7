#include "tiles/layers/gdal_session.h"

#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_vsi.h>
#include <fmt/format.h>
#include <gdal.h>

#include <mutex>

#include "core/error/error.h"
#include "tiles/store/part_file.h"

namespace scarp {
namespace {

constexpr char kSideFiles[] = "GDAL_PAM_ENABLED";
constexpr char kCurrentDate[] = "OGR_CURRENT_DATE";

/// GDAL calls it with the user data of the innermost handler. Warnings are not errors.
void keep_first_error(CPLErr level, CPLErrorNum, const char* message) {
  auto* first_error = static_cast<std::string*>(CPLGetErrorHandlerUserData());
  if (level >= CE_Failure && first_error->empty()) *first_error = message;
}

}  // namespace

GdalSession::GdalSession() : folder_("/vsimem/scarp-" + unique_suffix()) {
  static std::once_flag registered;
  std::call_once(registered, [] { GDALAllRegister(); });
  CPLSetThreadLocalConfigOption(kSideFiles, "NO");
  // GeoPackage stamps its tables with the time: the same layer is to give the same bytes.
  CPLSetThreadLocalConfigOption(kCurrentDate, "2000-01-01T00:00:00.000Z");
  CPLPushErrorHandlerEx(keep_first_error, &first_error_);
}

GdalSession::~GdalSession() {
  VSIRmdirRecursive(folder_.c_str());
  CPLPopErrorHandler();
  CPLSetThreadLocalConfigOption(kSideFiles, nullptr);
  CPLSetThreadLocalConfigOption(kCurrentDate, nullptr);
}

std::span<const std::byte> GdalSession::bytes_of(const std::string& memory_path,
                                                 const std::string& path) const {
  vsi_l_offset size = 0;
  const GByte* bytes = VSIGetMemFileBuffer(memory_path.c_str(), &size, FALSE);
  if (bytes == nullptr) fail(path);
  return std::as_bytes(std::span(bytes, static_cast<std::size_t>(size)));
}

void GdalSession::check(const std::string& path) const {
  if (!first_error_.empty()) fail(path);
}

void GdalSession::fail(const std::string& path) const {
  throw Error(ErrorCode::kResource,
              fmt::format("'{}': GDAL could not make it: {}; check the layer's size and the memory",
                          path, first_error_.empty() ? "it gave no reason" : first_error_));
}

}  // namespace scarp
