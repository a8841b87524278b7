// How long grouping takes on a mesh of a real DEM, and how much the groups cull.
//   groups_bench [--vertices N] [--threads N] [--layout COUNT/SUBSECTORS]
// Prints a row for each layout with the settings of table 3 of Edmondson 2004 (100 seeds and at
// most 200 groups; 500 and 1,000 above 50,000 vertices), then crystals against squares of equal
// mean size: triangles culled by 60 seeded eyes that look all around, as a share of all. Needs the
// shared data.

#include <fmt/core.h>
#include <gdal_priv.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "core/culling/visible_groups.h"
#include "core/horizon/stewart.h"
#include "core/occlusion/build_groups.h"
#include "core/occlusion/group_tree.h"
#include "core/occlusion/splitmix64.h"
#include "core/occlusion/squares.h"
#include "core/threads/parallel_for.h"
#include "ingest/dem/dem.h"
#include "ingest/mesh/mesh.h"
#include "tests/support/shared_data.h"

namespace scarp {
namespace {

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

std::optional<Tin> mesh_of(const std::string& name, std::uint32_t vertices) {
  const auto path = test::shared_data(name);
  if (!path) return {};
  MeshOptions options;
  options.vertex_budget = vertices;
  return mesh_samples(place_samples(read_dem({*path}, {}, {})), options, {}).tin;
}

std::size_t orphans_of(const Groups& groups) {
  return static_cast<std::size_t>(std::count(groups.group_of_triangle.begin(),
                                             groups.group_of_triangle.end(), GroupIndex{kNone}));
}

/// Eyes above random vertices: share of triangles culled, nodes tested and time per eye.
void print_culling(const std::string& name, const Tin& tin, const Groups& groups) {
  for (const double height_m : {2.0, 50.0, 300.0, 1000.0}) {
    constexpr int kEyes = 60;
    SplitMix64 random(7);
    std::uint64_t culled = 0, tested = 0;
    double seconds = 0;
    for (int i = 0; i < kEyes; ++i) {
      Position eye = tin.vertices[random.below(tin.vertices.size())];
      eye.z_m += height_m;
      const Stopwatch watch;
      const CullingAnswer answer = visible_groups(groups, {eye, {}});
      seconds += watch.seconds();
      tested += answer.nodes_tested;
      for (const std::uint8_t c : culled_triangles(groups, answer)) culled += c;
    }
    fmt::print(
        "{:<9} {:>5} groups {:>6} orphans  {:>5.0f} m up: {:5.1f} % culled, {:>6.1f} nodes, "
        "{:>6.1f} us an eye\n",
        name, groups.leaf_count, orphans_of(groups), height_m,
        100.0 * static_cast<double>(culled) /
            (static_cast<double>(kEyes) * static_cast<double>(tin.triangles.size())),
        static_cast<double>(tested) / kEyes, 1e6 * seconds / kEyes);
  }
}

void print_table_3(const Tin& tin, const std::vector<SectorLayout>& layouts) {
  fmt::print("layout  passes  orphans  groups  nodes  crystals s  all s  points/region\n");
  for (const SectorLayout& layout : layouts) {
    const HorizonTable horizon = stewart_horizons(tin.vertices, layout, {});
    CrystalOptions options;
    options.seeds = tin.vertices.size() > 50'000 ? 500 : 100;
    options.max_groups = 2 * options.seeds;
    options.merge_small = false;
    const Stopwatch watch;
    LeafGroups leaves = grow_crystals(tin, horizon, options);
    const double crystals_s = watch.seconds();
    const std::uint32_t passes = leaves.passes;
    const Groups groups = build_group_tree(tin, horizon, std::move(leaves));
    fmt::print("{:>3}/{:<2}  {:>6}  {:>7}  {:>6}  {:>5}  {:>10.3f}  {:>5.3f}  {:>13.2f}\n",
               layout.count, layout.subsectors, passes, orphans_of(groups), groups.leaf_count,
               groups.nodes.size(), crystals_s, watch.seconds(),
               static_cast<double>(groups.regions.points.size()) /
                   static_cast<double>(groups.regions.end_slope.size()));
    std::fflush(stdout);
  }
}

int run(std::uint32_t vertices, std::optional<SectorLayout> layout) {
  GDALAllRegister();
  const auto tin = mesh_of("projected/bigtujunga_srtm30m_utm11.tif", vertices);
  if (!tin) {
    fmt::print(stderr, "groups_bench: the shared data are not there\n");
    return 1;
  }
  fmt::print("{} vertices, {} triangles, {} threads\n", tin->vertices.size(), tin->triangles.size(),
             thread_count());
  std::vector<SectorLayout> layouts = {{8, 1}, {8, 2}, {8, 4}, {8, 8}, {16, 4}, {32, 2}, {64, 1}};
  if (layout) layouts = {*layout};
  print_table_3(*tin, layouts);
  const SectorLayout compared = layout.value_or(SectorLayout{});
  const HorizonTable horizon = stewart_horizons(tin->vertices, compared, {});
  Stopwatch watch;
  const Groups crystals = build_groups(*tin, horizon, {});
  fmt::print("build_groups {}/{}: {:.3f} s\n", compared.count, compared.subsectors,
             watch.seconds());
  print_culling("crystals", *tin, crystals);
  const CrystalOptions options;
  print_culling("squares", *tin,
                build_group_tree(*tin, horizon, group_by_squares(*tin, options.group_triangles)));
  return 0;
}

}  // namespace
}  // namespace scarp

int main(int argc, char** argv) {
  std::uint32_t vertices = 100'000;
  std::optional<scarp::SectorLayout> layout;
  for (int i = 1; i < argc; i += 2) {
    const std::string name = argv[i], value = i + 1 < argc ? argv[i + 1] : "";
    scarp::SectorLayout asked;
    if (name == "--vertices" && std::atol(value.c_str()) > 3) {
      vertices = static_cast<std::uint32_t>(std::atol(value.c_str()));
    } else if (name == "--threads" && std::atoi(value.c_str()) > 0) {
      scarp::set_thread_count(std::atoi(value.c_str()));
    } else if (name == "--layout" &&
               std::sscanf(value.c_str(), "%d/%d", &asked.count, &asked.subsectors) == 2 &&
               asked.count >= 4 && asked.subsectors >= 1) {
      layout = asked;
    } else {
      fmt::print(stderr, "usage: groups_bench [--vertices N] [--threads N] [--layout 16/4]\n");
      return 2;
    }
  }
  return scarp::run(vertices, layout);
}
