#include "tests/support/run_scarp.h"

#include <stdlib.h>
#include <sys/wait.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/support/temp_folder.h"

namespace scarp::test {
namespace {

std::string read_text(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

}  // namespace

RunResult run_scarp(const std::string& command_line) {
  const TempFolder folder;
  const std::string script = "SCARP='" SCARP_PROGRAM "'; { " + command_line + "; } >'" +
                             folder.path("out") + "' 2>'" + folder.path("err") + "'";
  const int status = system(script.c_str());
  RunResult result;
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  result.output = read_text(folder.path("out"));
  result.errors = read_text(folder.path("err"));
  return result;
}

std::string jacksboro_vrt(const std::string& folder) {
  const std::string path = folder + "/jacksboro.vrt";
  const std::string command = SCARP_SOURCE_DIR "/scripts/jacksboro '" + path + "' 2>/dev/null";
  return system(command.c_str()) == 0 ? path : "";
}

}  // namespace scarp::test
