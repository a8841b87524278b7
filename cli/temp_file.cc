#include "cli/temp_file.h"

#include <fmt/format.h>
#include <stdlib.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/error/error.h"

namespace scarp {

TempFile::TempFile(const std::string& ending) {
  std::error_code failure;
  const std::filesystem::path system = std::filesystem::temp_directory_path(failure);
  folder_ = (system / "scarp-XXXXXX").string();
  if (failure || ::mkdtemp(folder_.data()) == nullptr)
    throw Error(ErrorCode::kResource,
                fmt::format("'{}': no folder can be made there: {}; set TMPDIR to another one",
                            system.string(), std::strerror(errno)));
  path_ = folder_ + "/result" + ending;
}

TempFile::~TempFile() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::string TempFile::read() const {
  std::ostringstream text;
  text << std::ifstream(path_, std::ios::binary).rdbuf();
  if (!text) throw Error(ErrorCode::kResource, fmt::format("'{}': cannot be read again", path_));
  return std::move(text).str();
}

}  // namespace scarp
