#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace scarp {

enum class ErrorCode {
  kInput,     ///< a file, raster, vector or value given by the user cannot be used
  kResource,  ///< disk, memory or permission is missing
  kCorrupt,   ///< a file of ours does not hold what it promises
  kUsage,     ///< the command line asks for something that makes no sense
};

/// The one exception of ingest, tiles and cli; caught once in main and once per request.
/// core does not throw it.
///
/// The message names the object, what was found, what was wanted and the next step, in one line:
///   'alps.tif': height unit "fm" is not known; a length unit was expected; give --height-unit m
class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}

  ErrorCode code() const { return code_; }

 private:
  ErrorCode code_;
};

}  // namespace scarp
