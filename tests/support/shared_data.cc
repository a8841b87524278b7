#include "tests/support/shared_data.h"

#include <cstdlib>
#include <filesystem>

namespace scarp::test {

std::optional<std::string> shared_data(const std::string& name) {
  namespace fs = std::filesystem;
  const char* named = std::getenv("SCARP_SHARED_DATA");
  const fs::path root = named ? fs::path(named) : fs::path(SCARP_SOURCE_DIR) / "../shared/data";
  const fs::path path = root / name;
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return {};
  return fs::canonical(path, ignored).string();
}

}  // namespace scarp::test
