// What tiles cost beside the whole, in seconds of one core: meshing, levels, and regions of one
// tile's groups.
//   tiles_bench [--at SAMPLES] [--side SAMPLES] [--tile SAMPLES] [--error M] [--fans N] [FILE]
// A square window of the file, --at columns and rows from its upper left, laid out flat in cells of
// 20 m; without a file, northern Taiwan of the shared data.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <map>
#include <string>
#include <vector>

#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/certified/tile_view.h"
#include "core/occlusion/hidden_together.h"
#include "core/terrain/coarse_samples.h"
#include "core/terrain/occluder.h"
#include "core/terrain/range_pyramid.h"
#include "ingest/mesh/tile_mesh.h"
#include "tests/ingest/mesh/tiled.h"
#include "tests/judge/dem_window.h"
#include "tests/support/shared_data.h"

namespace scarp {
namespace {

struct Options {
  std::int32_t at = 4000, side = 2049, tile = 512, fans = 32;
  double error_m = 5;
  std::string file;
};

/// Of all threads together, so that other work on the machine does not count.
double cpu_seconds(const auto& work) {
  const std::clock_t start = std::clock();
  work();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

class Bench {
 public:
  Bench(const SampleGrid& raster, const Options& options)
      : raster_(raster), options_(options), scheme_(raster.columns, raster.rows, options.tile) {}

  void run() {
    mesh_whole();
    for (std::int32_t level = scheme_.finest_level(); level >= 0; --level) mesh(level);
    for (std::int32_t level = scheme_.finest_level() - 1; level >= 0; --level) lower(level);
    ranges();
    certify();
  }

 private:
  double samples() const { return static_cast<double>(raster_.positions.size()); }

  MeshOptions within(std::int32_t level) const {
    MeshOptions options;
    options.max_error_m = options_.error_m * scheme_.stride(level);
    return options;
  }

  void mesh_whole() {
    Mesh whole;
    const double took =
        cpu_seconds([&] { whole = mesh_samples(raster_, within(scheme_.finest_level()), {}); });
    whole_triangles_ = whole.tin.triangles.size();
    fmt::print("whole    {:9} triangles {:7.3f} s {:6.3f} us a sample\n", whole_triangles_, took,
               1e6 * took / samples());
  }

  void mesh(std::int32_t level) {
    const SampleGrid grid = coarsened(raster_, scheme_.stride(level));
    std::size_t triangles = 0;
    double took = 0;
    for (const TileId& id : scheme_.tiles(level)) {
      const SampleGrid window = test::part_of(grid, scheme_.window_with_halo(id));
      took += cpu_seconds([&] { meshes_[id] = mesh_tile(scheme_, id, window, within(level), {}); });
      triangles += meshes_[id].tin.triangles.size();
    }
    const std::size_t tiles = scheme_.tiles(level).size();
    fmt::print("level {:2} {:9} triangles {:7.3f} s {:6.3f} us a sample of its own, {} tiles",
               level, triangles, took, 1e6 * took / static_cast<double>(grid.positions.size()),
               tiles);
    if (level == scheme_.finest_level())
      fmt::print("; {:.3f} times the whole's triangles",
                 double(triangles) / double(whole_triangles_));
    fmt::print("\n");
  }

  SeenTile seen(const TileId& id) const {
    if (const auto at = occluders_.find(id); at != occluders_.end())
      return {id, &at->second.tin, at->second.sample_of_vertex};
    const Mesh& mesh = meshes_.at(id);
    return {id, &mesh.tin, mesh.sample_of_vertex};
  }

  std::vector<SeenTile> seen(const std::vector<TileId>& ids) const {
    std::vector<SeenTile> tiles;
    for (const TileId& id : ids)
      if (!seen(id).tin->triangles.empty()) tiles.push_back(seen(id));
    return tiles;
  }

  void lower(std::int32_t level) {
    double took = 0, above_m = 0, lowered_m = 0;
    std::size_t triangles = 0, kept = 0, vertices = 0;
    for (const TileId& id : scheme_.tiles(level)) {
      const Mesh& mesh = meshes_.at(id);
      if (mesh.tin.triangles.empty()) continue;
      const SeenTile coarse{id, &mesh.tin, mesh.sample_of_vertex};
      const std::vector<SeenTile> finer = seen(scheme_.finer_around(id));
      Occluder occluder;
      took += cpu_seconds([&] { occluder = occluder_of(scheme_, coarse, finer); });
      above_m = std::max(above_m, gap_of(scheme_, coarse, finer).above_m);
      triangles += mesh.tin.triangles.size();
      kept += occluder.tin.triangles.size();
      std::size_t at = 0;
      for (std::size_t v = 0; v < occluder.tin.vertices.size(); ++v, ++vertices) {
        while (mesh.sample_of_vertex[at] != occluder.sample_of_vertex[v]) ++at;
        lowered_m += mesh.tin.vertices[at].z_m - occluder.tin.vertices[v].z_m;
      }
      occluders_[id] = std::move(occluder);
    }
    fmt::print(
        "lower {:2} {:9} triangles of {} kept {:7.3f} s; vertices lowered by {:.1f} m on average, "
        "{:.1f} m at most\n",
        level, kept, triangles, took, lowered_m / double(vertices), above_m);
  }

  void ranges() {
    const TileId id = scheme_.tiles(scheme_.finest_level()).front();
    const SampleGrid window = test::part_of(raster_, scheme_.window_with_halo(id));
    const double took = cpu_seconds([&] { ranges_of(scheme_, id, window); });
    fmt::print("ranges   {:.4f} us a sample\n",
               1e6 * took / static_cast<double>(window.positions.size()));
  }

  void certify() {
    const std::vector<TileId> finest = scheme_.tiles(scheme_.finest_level());
    const std::int32_t level = scheme_.finest_level();
    const TileId id{level, scheme_.tiles_across(level) / 2, scheme_.tiles_down(level) / 2};
    const Tin& tin = meshes_.at(id).tin;
    HiddenTogetherOptions together;
    const LeafGroups groups = grow_hidden_together(tin, together);
    HidingOptions hiding;
    hiding.fans = options_.fans;
    const double alone =
        cpu_seconds([&] { certify_groups(tin, groups.group_of_triangle, groups.count, hiding); });
    TileView view;
    const double assembled =
        cpu_seconds([&] { view = view_of_tile(scheme_, seen(scheme_.seen_from(id))); });
    const double took =
        cpu_seconds([&] { certify_tile(view, groups.group_of_triangle, groups.count, hiding); });
    fmt::print(
        "certify  tile {}, {} fans: {} triangles alone {:.2f} s; with a view of {} triangles, "
        "assembled in {:.2f} s, {:.2f} s: {:.2f} times\n",
        name_of(id), hiding.fans, tin.triangles.size(), alone, view.tin.triangles.size(), assembled,
        took, took / alone);
  }

  const SampleGrid& raster_;
  const Options& options_;
  TileScheme scheme_;
  std::map<TileId, Mesh> meshes_;
  std::map<TileId, Occluder> occluders_;
  std::size_t whole_triangles_ = 0;
};

}  // namespace
}  // namespace scarp

int main(int count, char** words) {
  scarp::Options options;
  for (int i = 1; i < count; ++i) {
    const auto is = [&](const char* name) {
      return std::strcmp(words[i], name) == 0 && i + 1 < count;
    };
    if (is("--at"))
      options.at = std::atoi(words[++i]);
    else if (is("--side"))
      options.side = std::atoi(words[++i]);
    else if (is("--tile"))
      options.tile = std::atoi(words[++i]);
    else if (is("--error"))
      options.error_m = std::atof(words[++i]);
    else if (is("--fans"))
      options.fans = std::atoi(words[++i]);
    else
      options.file = words[i];
  }
  if (options.file.empty())
    options.file = scarp::test::shared_data("scale/taiwan_north_20m_twd97.tif").value_or("");
  const scarp::SampleGrid raster =
      scarp::test::dem_window(options.file, options.at, options.at, options.side, options.side, 20);
  if (raster.positions.empty()) {
    fmt::print(stderr, "'{}': a raster was expected; give a DEM file\n", options.file);
    return 1;
  }
  scarp::Bench(raster, options).run();
  return 0;
}
