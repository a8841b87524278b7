#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "core/error/error.h"
#include "tiles/store/groups_file.h"
#include "tiles/store/horizon_file.h"
#include "tiles/store/scene.h"
#include "tiles/store/tin_file.h"
#include "tiles/store/tree_file.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;

/// Goes through a scene and collects what it finds.
class SceneCheck {
 public:
  SceneCheck(const Scene& scene, const GroupsCheck& check_groups, const Progress& progress)
      : scene_(scene), check_groups_(check_groups), progress_(progress) {
    for (const SceneTile& tile : scene.description().tiles) file_count_ += tile.files.size();
    file_count_ += scene.description().layers.size();
  }

  std::vector<SceneFinding> run() {
    for (const SceneTile& tile : scene_.description().tiles) {
      for (const StoredFile& file : tile.files) check_bytes(file);
      check_tile(tile);
    }
    for (const StoredFile& file : scene_.description().layers) check_bytes(file);
    note_strays();
    return std::move(findings_);
  }

 private:
  void fault(std::string message) { findings_.push_back({true, std::move(message)}); }

  /// Runs a step; an Error of it is a finding. Returns whether there was none.
  template <class Step>
  bool attempt(Step step) {
    try {
      step();
      return true;
    } catch (const Error& error) {
      fault(error.what());
      return false;
    }
  }

  void check_bytes(const StoredFile& file) {
    const std::string path = scene_.path_of(file);
    attempt([&] {
      const FileDigest digest = digest_of_file(path);
      if (digest.size != file.size)
        fault(
            fmt::format("'{}': {} bytes where scene.json promises {}; restore it from a copy or "
                        "build the scene again",
                        path, digest.size, file.size));
      else if (digest.checksum != file.checksum)
        fault(
            fmt::format("'{}': checksum {} where scene.json promises {}; restore it from a copy "
                        "or build the scene again",
                        path, to_hex(digest.checksum), to_hex(file.checksum)));
    });
    ++files_done_;
    if (progress_) progress_(static_cast<double>(files_done_) / static_cast<double>(file_count_));
  }

  void check_tile(const SceneTile& tile) {
    const StoredFile* tin_file = scene_.find(tile.id, "tin");
    Tin tin;
    const bool has_tin = tin_file != nullptr && attempt([&] {
                           SampledTin mesh = read_sampled_tin(checked(*tin_file));
                           tin = std::move(mesh.tin);
                           if (const auto broken = check_tin(tin))
                             fault(fmt::format("'{}': {}; build the scene again",
                                               scene_.path_of(*tin_file), *broken));
                           check_samples(*tin_file, mesh.sample_of_vertex);
                         });
    for (const StoredFile& file : tile.files) {
      if (file.kind == "horizon") attempt([&] { check_horizon(file, has_tin ? &tin : nullptr); });
      if (file.kind == "groups") attempt([&] { check_groups(file, has_tin ? &tin : nullptr); });
      if (file.kind == "tree") attempt([&] { check_tree(file); });
    }
  }

  SectionFile checked(const StoredFile& file) const {
    return scene_.open(file, Verify::kEverything);
  }

  void check_samples(const StoredFile& file, const std::vector<std::int64_t>& samples) {
    const RasterGeometry& raster = scene_.description().raster;
    const std::int64_t count = std::int64_t{raster.columns} * raster.rows;
    for (const std::int64_t sample : samples) {
      if (sample >= count) {
        fault(fmt::format("'{}': sample {} in a raster of {}; build the scene again",
                          scene_.path_of(file), sample, count));
        return;
      }
    }
  }

  void check_horizon(const StoredFile& file, const Tin* tin) {
    const HorizonTable table = read_horizon(checked(file));
    const std::size_t rows =
        table.horizon_vertex.size() / static_cast<std::size_t>(table.layout.count);
    if (tin != nullptr && rows != tin->vertices.size())
      fault(fmt::format("'{}': horizons of {} vertices for a TIN of {}; build the scene again",
                        scene_.path_of(file), rows, tin->vertices.size()));
  }

  void check_groups(const StoredFile& file, const Tin* tin) {
    const Groups groups = read_groups(checked(file));
    if (tin == nullptr) return;
    std::optional<std::string> broken;
    if (groups.group_of_triangle.size() != tin->triangles.size())
      broken = fmt::format("groups of {} triangles for a TIN of {}",
                           groups.group_of_triangle.size(), tin->triangles.size());
    else if (check_groups_)
      broken = check_groups_(*tin, groups);
    if (broken)
      fault(fmt::format("'{}': {}; build the scene again", scene_.path_of(file), *broken));
  }

  /// Every tile that has groups is in the tree, with its ground in its circle.
  void check_tree(const StoredFile& file) {
    const TileTree tree = read_tree(checked(file));
    std::optional<std::string> broken = check_tile_tree_bounds(tree);
    for (const SceneTile& tile : scene_.description().tiles) {
      if (broken || scene_.find(tile.id, "groups") == nullptr || !tile.contents) continue;
      const auto node = std::ranges::find(tree.nodes, tile_id(tile), &TileNode::tile);
      if (node == tree.nodes.end())
        broken = fmt::format("tile {} is not in the tree", tile.id);
      else if (std::hypot(tile.contents->high[0] - node->horizon.centre_x_m,
                          tile.contents->high[1] - node->horizon.centre_y_m) >
               node->horizon.radius_m)
        broken = fmt::format("the circle of tile {} does not hold it", tile.id);
    }
    if (broken)
      fault(fmt::format("'{}': {}; build the scene again", scene_.path_of(file), *broken));
  }

  void note_strays() {
    std::set<std::string> listed = {kSceneJson};
    for (const SceneTile& tile : scene_.description().tiles) {
      for (const StoredFile& file : tile.files) listed.insert(file.name);
    }
    for (const StoredFile& file : scene_.description().layers) listed.insert(file.name);
    std::set<std::string> strays;  // sorted: the order of a folder is not
    std::error_code failure;
    for (fs::recursive_directory_iterator i(scene_.path(), failure), end; !failure && i != end;
         i.increment(failure)) {
      std::error_code ignored;
      if (i->is_directory(ignored)) continue;
      const std::string name = i->path().lexically_relative(scene_.path()).generic_string();
      if (!listed.contains(name)) strays.insert(i->path().string());
    }
    for (const std::string& stray : strays)
      findings_.push_back({false, fmt::format("'{}': is not listed in scene.json", stray)});
  }

  const Scene& scene_;
  const GroupsCheck& check_groups_;
  const Progress& progress_;
  std::size_t file_count_ = 0;
  std::size_t files_done_ = 0;
  std::vector<SceneFinding> findings_;
};

}  // namespace

std::vector<SceneFinding> check_scene(const std::string& path, const GroupsCheck& check_groups,
                                      const Progress& progress) {
  try {
    const Scene scene = open_scene(path);
    return SceneCheck(scene, check_groups, progress).run();
  } catch (const Error& error) {
    return {{true, error.what()}};
  }
}

}  // namespace scarp
