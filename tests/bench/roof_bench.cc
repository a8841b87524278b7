// What each stage takes a sample, vertex, triangle or pixel, against what the machine's memory and
// arithmetic would allow: seconds measured in one run with the machine's own limits; bytes and
// operations counted by hand, with the count beside each stage below.
//   roof_bench [--side 2048] [--json FILE]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "cli/stopwatch.h"
#include "core/horizon/stewart.h"
#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/hidden_together.h"
#include "core/sight/triangle_sight.h"
#include "core/skyline/skyline.h"
#include "core/threads/for_each_target.h"
#include "core/threads/parallel_for.h"
#include "core/viewshed/viewshed.h"
#include "ingest/dem/dem.h"
#include "ingest/mesh/mesh.h"
#include "tests/support/refined_dem.h"
#include "tests/support/shared_data.h"
#include "tests/support/temp_folder.h"

namespace scarp {
namespace {

constexpr int kRuns = 3;

double median_seconds(const std::function<void()>& run) {
  std::vector<double> seconds;
  for (int i = 0; i < kRuns; ++i) {
    const Stopwatch watch;
    run();
    seconds.push_back(watch.seconds());
  }
  std::sort(seconds.begin(), seconds.end());
  return seconds[kRuns / 2];
}

/// Bytes a second that all threads read and write together, of arrays far larger than caches.
double measure_bandwidth() {
  constexpr std::size_t kBytes = std::size_t{256} << 20, kPieces = 64;
  std::vector<char> from(kBytes, 1), to(kBytes);
  const double seconds = median_seconds([&] {
    parallel_for(kPieces, [&](std::size_t i) {
      std::memcpy(&to[i * (kBytes / kPieces)], &from[i * (kBytes / kPieces)], kBytes / kPieces);
    });
  });
  return 2 * static_cast<double>(kBytes) / seconds;
}

constexpr std::size_t kLanes = 128;

/// Multiplications and additions of floats that wait for nothing.
SCARP_FOR_EACH_TARGET
void multiply_and_add(float* values, std::int32_t times) {
  float held[kLanes];
  for (std::size_t i = 0; i < kLanes; ++i) held[i] = values[i];
  for (std::int32_t k = 0; k < times; ++k)
    for (std::size_t i = 0; i < kLanes; ++i) held[i] = held[i] * 0.999F + 0.001F;
  for (std::size_t i = 0; i < kLanes; ++i) values[i] = held[i];
}

/// Operations a second of all threads together.
double measure_arithmetic() {
  constexpr std::int32_t kTimes = 4'000'000;
  const auto threads = static_cast<std::size_t>(thread_count());
  std::vector<std::vector<float>> values(threads, std::vector<float>(kLanes, 0.5F));
  const double seconds = median_seconds([&] {
    parallel_for(threads, [&](std::size_t i) { multiply_and_add(values[i].data(), kTimes); });
  });
  return 2.0 * kLanes * kTimes * static_cast<double>(threads) / seconds;
}

struct Roof {
  double bytes_per_s, operations_per_s;
};

/// A row of the table.
struct Stage {
  std::string name, unit;
  double units = 0, seconds = 0;
  double bytes = 0;       ///< a unit, that must pass between memory and processor at least
  double operations = 0;  ///< a unit; 0: not counted, because they depend on the ground
};

class Table {
 public:
  explicit Table(const Roof& roof) : roof_(roof) {
    fmt::print("memory {:.1f} GB/s, arithmetic {:.0f} Gop/s, {} threads\n", 1e-9 * roof.bytes_per_s,
               1e-9 * roof.operations_per_s, thread_count());
    fmt::print("{:<34} {:<20} {:>10} {:>7} {:>9} {:>7} {:>9} {:>9}\n", "stage", "unit", "ns a unit",
               "bytes", "ns, mem.", "ops", "ns, arith.", "of roof");
    rows_ = {{"bytes_per_s", roof.bytes_per_s},
             {"operations_per_s", roof.operations_per_s},
             {"stages", nlohmann::json::array()}};
  }

  void add(const Stage& stage) {
    const double ns = 1e9 * stage.seconds / stage.units;
    const double memory_ns = 1e9 * stage.bytes / roof_.bytes_per_s;
    const double arithmetic_ns = 1e9 * stage.operations / roof_.operations_per_s;
    const double share = std::max(memory_ns, arithmetic_ns) / ns;
    fmt::print("{:<34} {:<20} {:>10.3g} {:>7.3g} {:>9.3g} {:>7} {:>9} {:>8.2g}%\n", stage.name,
               stage.unit, ns, stage.bytes, memory_ns,
               stage.operations > 0 ? fmt::format("{:.3g}", stage.operations) : "-",
               stage.operations > 0 ? fmt::format("{:.3g}", arithmetic_ns) : "-", 100 * share);
    rows_["stages"].push_back({{"stage", stage.name},
                               {"unit", stage.unit},
                               {"ns", ns},
                               {"bytes", stage.bytes},
                               {"operations", stage.operations},
                               {"share_of_roof", share}});
  }

  const nlohmann::json& json() const { return rows_; }

 private:
  Roof roof_;
  nlohmann::json rows_;
};

void measure_grid(const std::string& file, Table& table) {
  Ground ground;
  // 4 of the file's floats, 4 of the grid's steps.
  const double read_s = median_seconds([&] { ground = read_ground({file}, {}, {}); });
  const GroundGrid& grid = ground.grid;
  const double samples = static_cast<double>(grid.columns()) * grid.rows();
  table.add({"read and place a DEM", "sample", samples, read_s, 8, 0});
  const auto earth = ground.dem.frame->earth_frame();
  std::vector<Seen> seen(static_cast<std::size_t>(samples));
  const ViewshedEye eye{grid.raised(grid.columns() / 2, grid.rows() / 2, 2), 0, {}};
  SweepCounts counts;
  const double view_s = median_seconds([&] { view_from(grid, earth, eye, seen, &counts); });
  // 4 to measure the tops of tiles, 4 to sweep where they are not passed over, 1 of the answer.
  const double swept = static_cast<double>(counts.targets) / samples;
  table.add({"viewshed, exact", "sample", samples, view_s, 4 + 4 * swept + 1, 0});
  // Of a sample that is swept and its 1.5 bins, by the loops of line_kernels.cc: place 60 (two
  // biquadratics and their tilts on the ellipsoid), picture 7, rises 4, edges 1.5 x 9, bins
  // 1.5 x 12, class 6.
  table.add({"viewshed, of what is swept", "swept sample", static_cast<double>(counts.targets),
             view_s, 4 / std::max(swept, 1e-9) + 5, 109});
  std::vector<float> least_m(seen.size());
  const double heights_s = median_seconds([&] { heights_from(grid, earth, eye, least_m); });
  table.add({"least heights", "sample", samples, heights_s, 4 + 4, 0});
}

void measure_horizons(const std::string& file, Table& table) {
  const Ground ground = read_ground({file}, {}, {});
  const GroundGrid& grid = ground.grid;
  const auto samples =
      static_cast<std::size_t>(grid.columns()) * static_cast<std::size_t>(grid.rows());
  std::vector<std::int16_t> estimate(samples), lower(samples), upper(samples);
  Skyline skyline(grid, ground.dem.frame->earth_frame(), {});
  constexpr int kDirections = 8;
  const double seconds = median_seconds([&] {
    for (int i = 0; i < kDirections; ++i)
      skyline.look(fixed_azimuth(2 * std::numbers::pi * i / kDirections),
                   {estimate, lower, upper, {}});
  });
  // 4 of the height, 3 x 2 of the answer.
  table.add({"horizons with bounds", "sample, direction",
             static_cast<double>(samples) * kDirections, seconds, 10, 0});
}

void measure_meshes(const std::string& file, Table& table) {
  const Dem dem = read_dem({file}, {}, {});
  SampleGrid samples;
  const double place_s = median_seconds([&] { samples = place_samples(dem); });
  const auto count = static_cast<double>(samples.positions.size());
  // 8 + 1 read, 24 + 1 written.
  table.add({"place samples by PROJ", "sample", count, place_s, 34, 0});
  Mesh mesh;
  const double mesh_s =
      median_seconds([&] { mesh = mesh_samples(samples, {.max_error_m = 5}, {}); });
  // A position and a mark, once.
  table.add({"mesh to 5 m", "sample", count, mesh_s, 25, 0});
  table.add({"mesh to 5 m", "triangle", static_cast<double>(mesh.tin.triangles.size()), mesh_s,
             25 * count / static_cast<double>(mesh.tin.triangles.size()), 0});

  Mesh small;
  small = mesh_samples(samples, {.vertex_budget = 20'000}, {});
  const auto vertices = static_cast<double>(small.tin.vertices.size());
  const auto triangles = static_cast<double>(small.tin.triangles.size());
  const double stewart_s = median_seconds([&] {
    stewart_horizons(small.tin.vertices, {16, 4}, {});
  });
  // Three keys of 8 bytes, of which one is sorted by four passes that read and write 12.
  table.add({"horizons of vertices (thesis)", "vertex, subsector", 64 * vertices, stewart_s,
             3 * 8 + 4 * 24, 0});
  LeafGroups leaves;
  const double grow_s = median_seconds([&] { leaves = grow_hidden_together(small.tin, {}, {}); });
  table.add({"grow groups", "triangle", triangles, grow_s, 12 + 12 + 512 / 8, 0});
  const Stopwatch watch;
  const CertifiedRegions regions =
      certify_groups(small.tin, leaves.group_of_triangle, leaves.count, {});
  // Corners, neighbours and a third of six positions, and the 16 bytes that are kept.
  table.add({"certify groups", "triangle", triangles, watch.seconds(), 24 + 12 + 16, 0});
  const TinIndex index(small.tin);
  const Position eye = small.tin.vertices[small.tin.vertices.size() / 2];
  const double judge_s = median_seconds([&] { judge_all(index, {eye.x_m, eye.y_m, eye.z_m + 2}); });
  table.add({"judge", "eye, triangle", triangles, judge_s, 24 + 12 + 1, 0});
}

}  // namespace
}  // namespace scarp

int main(int argc, char** argv) {
  int side = 2048;
  std::string json_file;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string name = argv[i];
    if (name == "--side") side = std::atoi(argv[i + 1]);
    if (name == "--json") json_file = argv[i + 1];
  }
  const auto dem = scarp::test::shared_data("projected/bigtujunga_srtm30m_utm11.tif");
  if (!dem) {
    fmt::print(stderr, "roof_bench: the shared data are not there\n");
    return 1;
  }
  const scarp::test::TempFolder folder, small_folder;
  scarp::Table table({scarp::measure_bandwidth(), scarp::measure_arithmetic()});
  const std::string file = scarp::test::refined_dem(*dem, side, folder);
  const std::string small = scarp::test::refined_dem(*dem, std::min(side, 1024), small_folder);
  scarp::measure_grid(file, table);
  scarp::measure_horizons(small, table);
  scarp::measure_meshes(small, table);
  if (!json_file.empty()) std::ofstream(json_file) << table.json().dump(1) << '\n';
}
