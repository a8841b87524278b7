#include "cli/scene_tiles.h"

#include <algorithm>
#include <cmath>

#include "core/terrain/weld.h"
#include "tiles/store/groups_file.h"
#include "tiles/store/tin_file.h"
#include "tiles/store/tree_file.h"

namespace scarp {
namespace {

/// Allowance for rounding, and for how far a normal leans over kilometres of height: metres.
constexpr double kBesideM = 10;

/// Whether a rectangle lies wholly in the half-plane to the right of a direction from the eye.
bool is_right_of(const TileContents& contents, const Position& eye, double direction_rad) {
  const double dx = std::cos(direction_rad), dy = std::sin(direction_rad);
  for (const double x : {contents.low[0] - kBesideM, contents.high[0] + kBesideM})
    for (const double y : {contents.low[1] - kBesideM, contents.high[1] + kBesideM})
      if (dx * (y - eye.y_m) - dy * (x - eye.x_m) >= 0) return false;
  return true;
}

/// Whether no place of a rectangle is in a view of less than half a turn: then it lies to the right
/// of its first direction, or to the left of its last.
bool is_beside(const TileContents& contents, const Position& eye, const ViewRange& view) {
  if (view.to_rad - view.from_rad >= M_PI) return false;
  return is_right_of(contents, eye, view.from_rad) ||
         is_right_of(contents, eye, view.to_rad + M_PI) ||
         // or behind the eye: to the right of the direction square to the left of the middle one
         is_right_of(contents, eye, (view.from_rad + view.to_rad) / 2 - M_PI / 2);
}

/// The triangles of a surface that may come nearer to a place than a distance, in their order.
Tin part_near(const Tin& tin, const Position& place, double distance_m) {
  Tin part;
  std::vector<VertexIndex> new_vertex(tin.vertices.size(), kNone);
  for (auto triangle : tin.triangles) {
    const Position corners[] = {tin.vertices[triangle[0]], tin.vertices[triangle[1]],
                                tin.vertices[triangle[2]]};
    const Bounds bounds = bounds_of(corners);
    if (bounds.low.x_m > place.x_m + distance_m || bounds.high.x_m < place.x_m - distance_m ||
        bounds.low.y_m > place.y_m + distance_m || bounds.high.y_m < place.y_m - distance_m)
      continue;
    for (VertexIndex& v : triangle) {
      if (new_vertex[v] == kNone) {
        new_vertex[v] = static_cast<VertexIndex>(part.vertices.size());
        part.vertices.push_back(tin.vertices[v]);
      }
      v = new_vertex[v];
    }
    part.triangles.push_back(triangle);
  }
  connect_neighbours(part);
  return part;
}

}  // namespace

bool may_meet(const TileContents& contents, const ViewPlan& plan) {
  const double dx =
      std::max({contents.low[0] - plan.eye.x_m, plan.eye.x_m - contents.high[0], 0.0});
  const double dy =
      std::max({contents.low[1] - plan.eye.y_m, plan.eye.y_m - contents.high[1], 0.0});
  if (std::hypot(dx, dy) > plan.radius_m + kBesideM) return false;
  return !plan.view || !is_beside(contents, plan.eye, *plan.view);
}

bool may_meet_line(const TileContents& contents, const Position& from, const Position& to,
                   double beside_m) {
  const double beside = beside_m + kBesideM;
  if (std::max(from.x_m, to.x_m) < contents.low[0] - beside ||
      std::min(from.x_m, to.x_m) > contents.high[0] + beside ||
      std::max(from.y_m, to.y_m) < contents.low[1] - beside ||
      std::min(from.y_m, to.y_m) > contents.high[1] + beside)
    return false;
  // How far the rectangle's corners lie to the left of the line, times its length.
  const double dx = to.x_m - from.x_m, dy = to.y_m - from.y_m;
  double least = HUGE_VAL, most = -HUGE_VAL;
  for (const double x : {contents.low[0], contents.high[0]}) {
    for (const double y : {contents.low[1], contents.high[1]}) {
      const double left = dx * (y - from.y_m) - dy * (x - from.x_m);
      least = std::min(least, left);
      most = std::max(most, left);
    }
  }
  const double reach = beside * std::hypot(dx, dy);
  return least <= reach && most >= -reach;
}

ViewPlan view_towards(const Position& eye, const TileContents& contents) {
  ViewPlan plan{eye, 0, {}};
  const double middle_x_m = (contents.low[0] + contents.high[0]) / 2;
  const double middle_y_m = (contents.low[1] + contents.high[1]) / 2;
  const double middle_rad = std::atan2(middle_y_m - eye.y_m, middle_x_m - eye.x_m);
  double right_rad = 0, left_rad = 0;  // of the middle
  for (const double x : {contents.low[0] - kBesideM, contents.high[0] + kBesideM}) {
    for (const double y : {contents.low[1] - kBesideM, contents.high[1] + kBesideM}) {
      plan.radius_m = std::max(plan.radius_m, std::hypot(x - eye.x_m, y - eye.y_m));
      const double turn_rad =
          std::remainder(std::atan2(y - eye.y_m, x - eye.x_m) - middle_rad, 2 * M_PI);
      right_rad = std::min(right_rad, turn_rad);
      left_rad = std::max(left_rad, turn_rad);
    }
  }
  const bool is_inside =
      eye.x_m >= contents.low[0] - 2 * kBesideM && eye.x_m <= contents.high[0] + 2 * kBesideM &&
      eye.y_m >= contents.low[1] - 2 * kBesideM && eye.y_m <= contents.high[1] + 2 * kBesideM;
  if (!is_inside) plan.view = ViewRange{middle_rad + right_rad, middle_rad + left_rad};
  return plan;
}

SceneTiles::SceneTiles(const std::string& path)
    : scene_(open_scene(path)), frame_(frame_of(scene_.description())) {
  GroupIndex groups = 0;
  for (const std::size_t i : finest_tiles(scene_.description())) {
    const SceneTile& tile = scene_.description().tiles[i];
    if (scene_.find(tile.id, "tin") == nullptr) continue;  // void
    tiles_.push_back(i);
    first_group_.push_back(groups);
    if (tile.contents) groups += static_cast<GroupIndex>(tile.contents->groups);
  }
}

bool SceneTiles::meets(std::size_t i, const ViewPlan& plan) const {
  return !tile(i).contents || may_meet(*tile(i).contents, plan);
}

SceneTiles::HiddenFrom SceneTiles::hidden_from(const Position& eye) {
  HiddenFrom hidden{std::vector<bool>(size(), false), 0};
  const StoredFile* file = scene_.find(name_of(TileId{}), "tree");
  if (file == nullptr) return hidden;
  ++files_read_;
  const HiddenTiles answer = hidden_tiles(read_tree(scene_.open(*file)), eye);
  hidden.nodes_tested = answer.nodes_tested;
  for (std::size_t i = 0; i < size(); ++i)
    hidden.tiles[i] = std::ranges::binary_search(answer.tiles, tile_id(tile(i)));
  return hidden;
}

Tin SceneTiles::read_tin(std::size_t i) {
  read_.insert(i);
  ++files_read_;
  return scarp::read_tin(scene_.open(scene_.require(tile(i).id, "tin")));
}

Groups SceneTiles::read_groups(std::size_t i) {
  read_.insert(i);
  ++files_read_;
  return scarp::read_groups(scene_.open(scene_.require(tile(i).id, "groups")));
}

std::vector<std::size_t> SceneTiles::tiles_in(const ViewPlan& plan) const {
  std::vector<std::size_t> tiles;
  for (std::size_t i = 0; i < size(); ++i)
    if (meets(i, plan)) tiles.push_back(i);
  return tiles;
}

std::vector<std::size_t> SceneTiles::tiles_along(const Position& from, const Position& to,
                                                 double beside_m) const {
  std::vector<std::size_t> tiles;
  for (std::size_t i = 0; i < size(); ++i)
    if (!tile(i).contents || may_meet_line(*tile(i).contents, from, to, beside_m))
      tiles.push_back(i);
  return tiles;
}

Tin SceneTiles::read_ground(const std::vector<std::size_t>& tiles) {
  std::vector<Tin> tins;
  for (const std::size_t i : tiles) tins.push_back(read_tin(i));
  if (tins.size() == 1) return std::move(tins.front());
  std::vector<const Tin*> parts;
  for (const Tin& tin : tins) parts.push_back(&tin);
  return weld(parts).tin;
}

Tin SceneTiles::read_within(const std::vector<std::size_t>& tiles, std::uint64_t memory_bytes,
                            const std::string& remedy) {
  std::uint64_t triangles = 0;
  for (const std::size_t i : tiles)
    if (tile(i).contents) triangles += tile(i).contents->triangles;
  check_room(scene_.path(), triangles, kBytesPerGroundTriangle, memory_bytes, remedy);
  return read_ground(tiles);
}

std::optional<TileScheme> SceneTiles::tile_scheme() const {
  const RasterGeometry& raster = scene_.description().raster;
  const auto& parameters = scene_.description().parameters;
  const auto side = parameters.find("tile_samples");
  if (side == parameters.end()) return {};
  return TileScheme(raster.columns, raster.rows,
                    static_cast<std::int32_t>(std::get<std::int64_t>(side->second)));
}

TileWindow SceneTiles::window_of(const std::vector<std::size_t>& tiles) const {
  const RasterGeometry& raster = scene_.description().raster;
  const std::optional<TileScheme> scheme = tile_scheme();
  if (!scheme || tiles.size() == size() || tiles.empty())
    return {0, 0, raster.columns, raster.rows, 1};
  std::int32_t left = raster.columns, above = raster.rows, right = 0, below = 0;
  for (const std::size_t i : tiles) {
    const TileWindow window = scheme->window(tile_id(tile(i)));
    left = std::min(left, window.first_column);
    above = std::min(above, window.first_row);
    right = std::max(right, window.last_column());
    below = std::max(below, window.last_row());
  }
  return {left, above, right - left + 1, below - above + 1, 1};
}

std::vector<std::size_t> SceneTiles::tiles_over(const TileWindow& rectangle) const {
  const std::optional<TileScheme> scheme = tile_scheme();
  std::vector<std::size_t> tiles;
  for (std::size_t i = 0; i < size(); ++i) {
    if (scheme) {
      const TileWindow window = scheme->window(tile_id(tile(i)));
      if (window.first_column >= rectangle.last_column() ||
          window.last_column() <= rectangle.first_column ||
          window.first_row >= rectangle.last_row() || window.last_row() <= rectangle.first_row)
        continue;
    }
    tiles.push_back(i);
  }
  return tiles;
}

MapPoint SceneTiles::resolve(const TypedPosition& typed, const std::string& crs) {
  if (typed.above_datum) return to_map_point(typed, crs, frame_);
  const GeoFrame::Placer placer(frame_);
  MapPoint point = to_map_point(typed, crs, frame_);
  point.height_m = 0;
  // The place in the plane depends a little on the height: see ground_height_m.
  constexpr double kLeanM = 100;
  const Position place = placer.place(point);
  const Tin ground = part_near(read_ground(tiles_in({place, kLeanM, {}})), place, kLeanM);
  return scarp::resolve(typed, crs, frame_, TinIndex(ground));
}

}  // namespace scarp
