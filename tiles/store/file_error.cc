#include "tiles/store/file_error.h"

#include <fmt/format.h>

#include <cerrno>
#include <system_error>

#include "core/error/error.h"

namespace scarp {
namespace {

std::string reason_text(int reason) {
  return std::generic_category().message(reason);
}

const char* advice_for_writing(int reason) {
  switch (reason) {
    case ENOSPC:
    case EDQUOT:
      return "free some space or name an output on another disk";
    case EFBIG:
      return "raise the limit on file sizes (ulimit -f) or name an output on another disk";
    case EACCES:
    case EPERM:
    case EROFS:
      return "name an output in a folder that can be written to, or change its permissions";
    case ENOENT:
      return "the folder does not exist: create it first";
    case ENOTDIR:
      return "a part of the path is a file: name a folder";
    case ENAMETOOLONG:
      return "choose a shorter name";
    case EMFILE:
    case ENFILE:
      return "raise the limit on open files (ulimit -n)";
    default:
      return "check the disk, or name an output elsewhere";
  }
}

}  // namespace

void throw_write_error(const std::string& path, int reason) {
  throw Error(ErrorCode::kResource, fmt::format("'{}': could not be written: {}; {}", path,
                                                reason_text(reason), advice_for_writing(reason)));
}

void throw_read_error(const std::string& path, int reason) {
  switch (reason) {
    case ENOENT:
    case ENOTDIR:
      throw Error(
          ErrorCode::kInput,
          fmt::format("'{}': does not exist; a file or scene was expected; check the name", path));
    case EACCES:
    case EPERM:
      throw Error(ErrorCode::kInput,
                  fmt::format("'{}': may not be read; change its permissions", path));
    case EISDIR:
      throw Error(ErrorCode::kInput,
                  fmt::format("'{}': is a folder; a file was expected; name a file", path));
    default:
      throw Error(ErrorCode::kResource, fmt::format("'{}': could not be read: {}; check the disk",
                                                    path, reason_text(reason)));
  }
}

void throw_exists(const std::string& path) {
  throw Error(ErrorCode::kInput, fmt::format("'{}': exists already; a new name was expected; "
                                             "choose another or give --overwrite",
                                             path));
}

}  // namespace scarp
