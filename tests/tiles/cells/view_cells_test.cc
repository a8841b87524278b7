#include "core/culling/view_cells.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <random>
#include <set>
#include <string>

#include "core/sight/triangle_sight.h"
#include "core/threads/parallel_for.h"
#include "tests/support/temp_folder.h"
#include "tests/tiles/culling_scene.h"
#include "tiles/cells/sets_file.h"
#include "tiles/cells/vdb_file.h"

namespace scarp {
namespace {

constexpr double kAltitudesM[] = {-20, 5, 60, 5000};

ViewCells cells_over(const test::CullingScene& scene) {
  const Bounds bounds = bounds_of(scene.tin.vertices);
  ViewCells cells;
  cells.cell_m = (bounds.high.x_m - bounds.low.x_m) / 19;
  cells.low_x_m = bounds.low.x_m, cells.low_y_m = bounds.low.y_m;
  cells.columns = cells.rows = 20;
  cells.bands = 4;
  for (std::int32_t row = 0; row < cells.rows; ++row)
    for (std::int32_t column = 0; column < cells.columns; ++column) {
      const auto ground_m = scene.index->ground_height_m(
          round_to_lattice(cells.low_x_m + (column + 0.5) * cells.cell_m),
          round_to_lattice(cells.low_y_m + (row + 0.5) * cells.cell_m));
      for (const double altitude_m : kAltitudesM)
        cells.top_m.push_back(ground_m ? static_cast<float>(*ground_m + altitude_m)
                                       : std::nanf(""));
    }
  return cells;
}

const test::CullingScene& hills() {
  static const auto scene = test::hills_scene(9);
  return *scene;
}

const ViewCells& filled() {
  static const ViewCells cells = [] {
    ViewCells made = cells_over(hills());
    find_hidden_sets(hills().groups.certified, 1, made);
    return made;
  }();
  return cells;
}

TEST(ViewCells, HideNothingThatAnyOfTheirCamerasSees) {
  const ViewCells& cells = filled();
  std::mt19937_64 random(3);
  const auto part = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::size_t judged = 0;
  for (int i = 0; i < 300; ++i) {
    const auto column = static_cast<std::int32_t>(random() % 20);
    const auto row = static_cast<std::int32_t>(random() % 20);
    const auto band = static_cast<std::int32_t>(random() % 4);
    const std::size_t cell = cells.at(column, row, band);
    const auto hidden = groups_of(cells.sets, cells.set[cell]);
    if (std::isnan(cells.top_m[cell]) || hidden.empty()) continue;
    const auto top_m = static_cast<double>(cells.top_m[cell]);
    const Position eye = round_to_lattice({cells.low_x_m + (column + part()) * cells.cell_m,
                                           cells.low_y_m + (row + part()) * cells.cell_m,
                                           top_m - 30 * part() - 0.01});
    const std::set<GroupIndex> is_hidden(hidden.begin(), hidden.end());
    const auto sight = judge_all(*hills().index, eye);
    for (std::size_t t = 0; t < sight.size(); ++t) {
      if (is_hidden.count(hills().groups.group_of_triangle[t]) == 0) continue;
      ++judged;
      ASSERT_EQ(sight[t], TriangleSight::kHidden);
    }
  }
  EXPECT_GT(judged, 3'000U);
}

TEST(ViewCells, SetsGrowDownwardsAndAreAllDifferent) {
  const ViewCells& cells = filled();
  std::set<std::vector<GroupIndex>> seen;
  for (std::uint32_t set = 0; set < cells.sets.size(); ++set) {
    const auto groups = groups_of(cells.sets, set);
    EXPECT_TRUE(std::adjacent_find(groups.begin(), groups.end()) == groups.end());
    EXPECT_TRUE(seen.insert(groups).second) << set;
  }
  for (std::int32_t row = 0; row < cells.rows; ++row)
    for (std::int32_t column = 0; column < cells.columns; ++column)
      for (std::int32_t band = 0; band + 1 < cells.bands; ++band) {
        const auto lower = groups_of(cells.sets, cells.set[cells.at(column, row, band)]);
        const auto upper = groups_of(cells.sets, cells.set[cells.at(column, row, band + 1)]);
        ASSERT_TRUE(std::includes(lower.begin(), lower.end(), upper.begin(), upper.end()));
      }
  // Sharing pays: the table is smaller than all sets written out.
  std::size_t written_out = 0;
  for (std::uint32_t set = 0; set < cells.sets.size(); ++set)
    written_out += groups_of(cells.sets, set).size();
  EXPECT_LT(cells.sets.added.size(), written_out / 2);
}

TEST(ViewCells, AreTheSameForAnyNumberOfThreads) {
  ViewCells one = cells_over(hills());
  set_thread_count(1);
  find_hidden_sets(hills().groups.certified, 1, one);
  set_thread_count(0);
  EXPECT_EQ(one.set, filled().set);
  EXPECT_EQ(one.sets.parent, filled().sets.parent);
  EXPECT_EQ(one.sets.added, filled().sets.added);
}

/// Cells share sets of larger ones, and each keeps the share that was asked for on average.
TEST(ViewCells, ShareSetsThatHoldNearlyAll) {
  ViewCells shared = cells_over(hills());
  find_hidden_sets(hills().groups.certified, 0.8, shared);
  std::size_t kept = 0, all = 0;
  for (std::size_t cell = 0; cell < shared.set.size(); ++cell) {
    if (std::isnan(shared.top_m[cell])) continue;
    const auto fewer = groups_of(shared.sets, shared.set[cell]);
    const auto more = groups_of(filled().sets, filled().set[cell]);
    ASSERT_TRUE(std::includes(more.begin(), more.end(), fewer.begin(), fewer.end()));
    kept += fewer.size(), all += more.size();
  }
  EXPECT_GT(static_cast<double>(kept), 0.8 * static_cast<double>(all));
  EXPECT_LT(shared.sets.size(), filled().sets.size() * 9 / 10);
}

TEST(SetsFile, ReadsBackWhatWasWritten) {
  const auto bytes = sets_writer(filled().sets).to_bytes();
  const HiddenSets read = read_sets(SectionFile::from_memory(bytes, "sets", Verify::kEverything));
  EXPECT_EQ(read.parent, filled().sets.parent);
  EXPECT_EQ(read.first, filled().sets.first);
  EXPECT_EQ(read.added, filled().sets.added);
}

VdbFile small_file() {
  VdbShape shape{32, 24, 8, {1000, -500, 2}, {25, 30, 1}};
  const std::size_t count = 32 * 24 * 8;
  VdbGrid<std::int32_t> sets{"hidden_set", shape, -1, std::vector<std::int32_t>(count, -1),
                             std::vector<std::uint8_t>(count, 0)};
  VdbGrid<float> tops{"band_top_m", shape, -1e9F, std::vector<float>(count, -1e9F),
                      std::vector<std::uint8_t>(count, 0)};
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t column = i % 32;
    if (column < 8) continue;  // nothing there
    sets.is_active[i] = tops.is_active[i] = 1;
    sets.values[i] = column < 24 ? 7 : static_cast<std::int32_t>(i % 5);
    tops.values[i] = static_cast<float>(i) * 0.5F;
  }
  VdbFile file;
  file.integers = {sets};
  file.floats = {tops};
  file.metadata = {{"CRS", "LOCAL_CS[\"map\"]"}, {"EARTH", "flat"}};
  return file;
}

bool is_openvdb_loaded() {
  std::ifstream maps("/proc/self/maps");
  const std::string text{std::istreambuf_iterator<char>(maps), {}};
  return text.find("openvdb") != std::string::npos;
}
/// Before any test of this program asked for it.
const bool kIsLoadedFromTheStart = is_openvdb_loaded();

TEST(VdbFile, TakesOpenVdbIntoMemoryOnlyWhenItIsWanted) {
  EXPECT_FALSE(kIsLoadedFromTheStart);
  const test::TempFolder folder;
  write_vdb(folder.path("cells.vdb"), small_file(), Existing::kRefuse);
  EXPECT_TRUE(is_openvdb_loaded());
}

TEST(VdbFile, ReadsBackWhatWasWrittenAndCollapsesEqualBlocks) {
  const test::TempFolder folder;
  const VdbFile file = small_file();
  const VdbSummary summary = write_vdb(folder.path("cells.vdb"), file, Existing::kRefuse);
  EXPECT_EQ(summary.active_cells, 2U * 24 * 24 * 8);
  // Columns 8 to 23 are two blocks by three of one value; the rest are leaves.
  EXPECT_EQ(summary.tiles, 6U);
  EXPECT_EQ(summary.leaves, 3U + 9);
  const VdbFile read = read_vdb(folder.path("cells.vdb"), file);
  EXPECT_EQ(read.integers[0].values, file.integers[0].values);
  EXPECT_EQ(read.integers[0].is_active, file.integers[0].is_active);
  EXPECT_EQ(read.floats[0].values, file.floats[0].values);
  EXPECT_EQ(read.metadata.at("CRS"), file.metadata.at("CRS"));
  EXPECT_ANY_THROW(write_vdb(folder.path("cells.vdb"), file, Existing::kRefuse));
}

TEST(VdbFile, OpensInVdbPrint) {
  if (std::system("vdb_print -version >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "left out, vdb_print is not installed";
  const test::TempFolder folder;
  write_vdb(folder.path("cells.vdb"), small_file(), Existing::kRefuse);
  const std::string print = "vdb_print -m '" + folder.path("cells.vdb") + "' | grep -q ";
  EXPECT_EQ(std::system((print + "'hidden_set'").c_str()), 0);
  EXPECT_EQ(std::system((print + "'LOCAL_CS'").c_str()), 0);
}

}  // namespace
}  // namespace scarp
