// How much certified regions cull on real DEMs, against the judge.
//   certified_bench [--vertices N] [--eyes N] [--dem NAME] [--fans N] [--sectors N] [--spacing X]
//                   [--piece X] [--group-triangles N] [--seed N] [--thesis] [--threads N]

#include <fmt/core.h>
#include <gdal_priv.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "core/culling/certified_culling.h"
#include "core/culling/visible_groups.h"
#include "core/horizon/stewart.h"
#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/group_tree.h"
#include "core/occlusion/splitmix64.h"
#include "core/occlusion/squares.h"
#include "core/sight/triangle_sight.h"
#include "core/threads/parallel_for.h"
#include "ingest/dem/dem.h"
#include "ingest/mesh/mesh.h"
#include "tests/judge/dem_window.h"
#include "tests/support/shared_data.h"

namespace scarp {
namespace {

/// Windows of the shared DEMs, read as flat grids: the culling does not care for coordinates.
struct NamedDem {
  const char* name;
  const char* file;
  std::int32_t column, row, columns, rows;
  double cell_m;
};
constexpr NamedDem kDems[] = {
    {"bigtujunga", "projected/bigtujunga_srtm30m_utm11.tif", 0, 0, 643, 643, 30},
    {"st_helens", "projected/mt_st_helens_usgs30m.dem", 0, 0, 327, 468, 30},
    {"jacksboro", "geographic/jacksboro_fault_srtm3.tif", 0, 0, 403, 344, 80},
    {"zion", "geographic/zion_srtm3_uint16.tif", 0, 0, 465, 457, 80},
    {"fuji", "geographic/N35E138_fuji_srtm3.tif", 600, 500, 500, 500, 80},
    {"ashby", "literature/ashby_gap_va_i16.tif", 0, 0, 346, 452, 30},
    {"fort_irwin", "literature/ntc_fort_irwin_i16.tif", 0, 0, 512, 512, 30},
    {"west_us", "literature/west_us_i16.tif", 0, 0, 512, 512, 90},
    {"crater_lake", "literature/crater_lake_west_i16.tif", 0, 0, 336, 459, 30},
    {"vinschgau", "projected/vinschgau_alps_250m_utm32.tif", 0, 0, 252, 194, 250},
    {"front_range", "geographic/front_range_srtmgl3.asc", 0, 0, 240, 144, 80},
    {"swiss_alps", "geographic/N46E008_swiss_alps_srtm3.tif", 200, 200, 500, 500, 80},
    {"taiwan", "projected/taiwan_xueshan_z13_webmercator.tif", 1000, 1000, 600, 600, 17.4},
    {"gabilan", "projected/gabilan_lidar1m.bil", 0, 0, 600, 600, 1},
};

double user_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec);
}

struct Settings {
  std::uint32_t vertices = 10'000;
  int eyes = 8;
  std::string dem;
  HidingOptions hiding;
  std::uint32_t group_triangles = 128;
  std::uint64_t seed = 1;
  bool thesis = false;
  double bytes = 16;
};

struct Counts {
  double triangles = 0, hidden = 0, in_hidden = 0, culled = 0, falsely = 0;
};

/// What the bounds hide before they are compressed.
bool fine_culls(const HidingBounds& bounds, GroupIndex g, const Position& eye) {
  const Circle& c = bounds.circle[g];
  const double dx = eye.x_m - c.x_m, dy = eye.y_m - c.y_m;
  const double distance_m = std::hypot(dx, dy);
  const double ratio = distance_m / (c.radius_m * kFirstRing);
  if (!(ratio >= 1)) return false;
  const std::int32_t ring = ring_of(bounds.layout, static_cast<float>(ratio * ratio));
  const double slope = static_cast<double>(
      bounds.at(g, sector_of(bounds.layout, dx, dy))[static_cast<std::size_t>(ring)]);
  return eye.z_m < bounds.height_m[g] + slope * distance_m;
}

std::vector<std::uint8_t> fine_culled(const HidingBounds& bounds,
                                      std::span<const GroupIndex> group_of, const Position& eye) {
  std::vector<std::uint8_t> group_culled(bounds.circle.size());
  for (GroupIndex g = 0; g < group_culled.size(); ++g) group_culled[g] = fine_culls(bounds, g, eye);
  std::vector<std::uint8_t> culled(group_of.size());
  for (std::size_t t = 0; t < culled.size(); ++t)
    culled[t] = group_of[t] != kNone && group_culled[group_of[t]];
  return culled;
}

void count(Counts& counts, std::span<const GroupIndex> group_of, std::uint32_t groups,
           const std::vector<TriangleSight>& sight, const std::vector<std::uint8_t>& culled) {
  std::vector<std::uint8_t> seen(groups, 0);
  for (std::size_t t = 0; t < sight.size(); ++t)
    if (sight[t] == TriangleSight::kVisible && group_of[t] != kNone) seen[group_of[t]] = 1;
  for (std::size_t t = 0; t < sight.size(); ++t) {
    const bool hidden = sight[t] == TriangleSight::kHidden;
    ++counts.triangles;
    counts.hidden += hidden;
    counts.in_hidden += group_of[t] != kNone && !seen[group_of[t]];
    counts.culled += culled[t];
    counts.falsely += culled[t] && !hidden;
  }
}

constexpr double kHeights[] = {2, 50, 300, 1000};
std::map<std::string, std::array<std::vector<double>, 4>> all_shares;

void print_rows(const std::string& method, const std::array<Counts, 4>& rows) {
  for (std::size_t h = 0; h < 4; ++h) {
    const Counts& c = rows[h];
    fmt::print(
        "  {:<10} {:>5.0f} m  hidden {:5.1f} %  in hidden groups {:5.1f} %  culled {:5.1f} %  "
        "share {:.3f}  of hidden {:.3f}  false {}\n",
        method, kHeights[h], 100 * c.hidden / c.triangles, 100 * c.in_hidden / c.triangles,
        100 * c.culled / c.triangles, c.culled / std::max(1.0, c.in_hidden),
        c.culled / std::max(1.0, c.hidden), c.falsely);
    if (c.in_hidden > 0.005 * c.triangles) all_shares[method][h].push_back(c.culled / c.in_hidden);
  }
  std::fflush(stdout);
}

void run_dem(const NamedDem& dem, const Settings& settings) {
  const auto path = test::shared_data(dem.file);
  if (!path) return;
  const SampleGrid grid =
      test::dem_window(*path, dem.column, dem.row, dem.columns, dem.rows, dem.cell_m);
  MeshOptions mesh_options;
  mesh_options.vertex_budget = settings.vertices;
  const Tin tin = mesh_samples(grid, mesh_options, {}).tin;
  const LeafGroups leaves = group_by_squares(tin, settings.group_triangles);
  double start = user_seconds();
  HidingOptions hiding = settings.hiding;
  if (settings.bytes > 0)
    hiding.sectors = sectors_within(settings.bytes, tin.triangles.size(), leaves.count);
  const HidingBounds bounds = bound_hiding(tin, leaves.group_of_triangle, leaves.count, hiding);
  const double bound_s = user_seconds() - start;
  start = user_seconds();
  const CertifiedRegions regions = compress_bounds(bounds, LeastGround(tin));
  const double compress_s = user_seconds() - start;
  if (const auto broken = check_certified(regions)) fmt::print("BROKEN: {}\n", *broken);
  CertifiedCulling certified(regions);
  fmt::print(
      "{}: {} triangles, {} groups; bounds {:.1f} s = {:.0f} us a triangle, compression {:.0f} us; "
      "{} sectors, {:.1f} bytes a triangle\n",
      dem.name, tin.triangles.size(), leaves.count, bound_s,
      1e6 * bound_s / static_cast<double>(tin.triangles.size()),
      1e6 * compress_s / static_cast<double>(tin.triangles.size()), regions.layout.sectors,
      static_cast<double>(regions.groups.size() * sizeof(CertifiedGroup) +
                          regions.steps.size() * sizeof(SectorSteps)) /
          static_cast<double>(tin.triangles.size()));
  std::optional<Groups> thesis;
  if (settings.thesis)
    thesis = build_group_tree(tin, stewart_horizons(tin.vertices, {}, {}), leaves);
  const TinIndex index(tin);
  std::array<Counts, 4> fine, certified_counts, thesis_counts;
  for (std::size_t h = 0; h < 4; ++h) {
    SplitMix64 random(settings.seed);
    for (int i = 0; i < settings.eyes; ++i) {
      Position eye = tin.vertices[random.below(tin.vertices.size())];
      eye.z_m += kHeights[h];
      const std::vector<TriangleSight> sight = judge_all(index, eye);
      count(fine[h], leaves.group_of_triangle, leaves.count, sight,
            fine_culled(bounds, leaves.group_of_triangle, eye));
      Groups grouped;
      grouped.group_of_triangle = leaves.group_of_triangle;
      grouped.leaf_count = leaves.count;
      count(certified_counts[h], leaves.group_of_triangle, leaves.count, sight,
            culled_triangles(grouped, certified.visible({eye, {}})));
      if (thesis)
        count(thesis_counts[h], leaves.group_of_triangle, leaves.count, sight,
              culled_triangles(*thesis, visible_groups(*thesis, {eye, {}})));
    }
  }
  print_rows("fine", fine);
  print_rows("certified", certified_counts);
  if (thesis) print_rows("thesis", thesis_counts);
}

int run(const Settings& settings) {
  GDALAllRegister();
  for (const NamedDem& dem : kDems)
    if (settings.dem.empty() ||
        ("," + settings.dem + ",").find("," + std::string(dem.name) + ",") != std::string::npos)
      run_dem(dem, settings);
  for (const auto& [method, shares] : all_shares) {
    fmt::print("mean {:<10}", method);
    for (const auto& share : shares) {
      double sum = 0;
      for (const double s : share) sum += s;
      fmt::print(" {:.3f} ({})", sum / static_cast<double>(std::max<std::size_t>(1, share.size())),
                 share.size());
    }
    fmt::print("\n");
  }
  return 0;
}

}  // namespace
}  // namespace scarp

int main(int argc, char** argv) {
  scarp::Settings settings;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--thesis") {
      settings.thesis = true;
      continue;
    }
    const std::string value = i + 1 < argc ? argv[++i] : "";
    if (name == "--vertices")
      settings.vertices = static_cast<std::uint32_t>(std::stoul(value));
    else if (name == "--eyes")
      settings.eyes = std::stoi(value);
    else if (name == "--dem")
      settings.dem = value;
    else if (name == "--bytes")
      settings.bytes = std::stod(value);
    else if (name == "--fans")
      settings.hiding.fans = std::stoi(value);
    else if (name == "--sectors")
      settings.hiding.sectors = std::stoi(value);
    else if (name == "--spacing")
      settings.hiding.spacing = std::stod(value);
    else if (name == "--width")
      settings.hiding.width = std::stod(value);
    else if (name == "--piece")
      settings.hiding.piece = std::stod(value);
    else if (name == "--group-triangles")
      settings.group_triangles = static_cast<std::uint32_t>(std::stoul(value));
    else if (name == "--seed")
      settings.seed = std::stoull(value);
    else if (name == "--threads")
      scarp::set_thread_count(std::stoi(value));
    else
      return 2;
  }
  return scarp::run(settings);
}
