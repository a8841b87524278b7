#include "tests/support/temp_folder.h"

#include <stdlib.h>

#include <stdexcept>

namespace scarp::test {

TempFolder::TempFolder() {
  std::string pattern = (std::filesystem::temp_directory_path() / "scarp-test-XXXXXX").string();
  if (!mkdtemp(pattern.data())) throw std::runtime_error("no temporary folder");
  folder_ = pattern;
}

TempFolder::~TempFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

}  // namespace scarp::test
