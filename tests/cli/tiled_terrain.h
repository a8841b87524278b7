#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>

#include "tests/support/run_scarp.h"
#include "tests/support/temp_folder.h"

namespace scarp::test {

/// Samples of the DEM of TiledTerrain, of a size that no tile divides.
inline constexpr int kTiledColumns = 141, kTiledRows = 118;

/// Size and checksum of every file of a scene, but those that hold times.
std::map<std::string, std::string> files_of(const std::string& scene);

/// Records of finished steps of an unfinished scene, and when each was written.
std::map<std::string, std::filesystem::file_time_type> records_of(const std::string& scene);

/// One DEM, mountains with a lake of void in cells of 30 m, and one scene of 3 x 2 tiles for all
/// tests of a suite that only read it.
class TiledTerrain : public testing::Test {
 protected:
  static void SetUpTestSuite();
  static void TearDownTestSuite();
  void SetUp() override { ASSERT_EQ(built_.exit_code, 0) << built_.errors; }

  /// The command that makes the same scene under another name.
  static std::string build(const std::string& scene) { return build_of(dem_, scene); }
  static std::string build_of(const std::string& dem, const std::string& scene);

  static inline TempFolder* folder_ = nullptr;
  static inline std::string dem_, scene_;
  static inline RunResult built_;
};

}  // namespace scarp::test
