#pragma once

#include <string>
#include <vector>

namespace scarp::test {

struct RunResult {
  int exit_code = -1;
  std::string output;  ///< standard output
  std::string errors;  ///< standard error
};

/// Runs a shell command line in which SCARP stands for the program that was built.
RunResult run_scarp(const std::string& command_line);

/// A VRT of the Jacksboro fault in `folder`, or nothing where its Debian package is not installed.
std::string jacksboro_vrt(const std::string& folder);

}  // namespace scarp::test
