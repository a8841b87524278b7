#include "core/occlusion/certified/tile_tree.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <numbers>
#include <span>

namespace scarp {
namespace {

/// Circles are so much larger than needed, relatively: rounding counts for nothing.
constexpr double kCircleRounding = 1e-9;

TileId parent_of(const TileId& tile) {
  return {tile.level - 1, tile.column / 2, tile.row / 2};
}

/// Number of a tile's node, or none.
std::optional<std::size_t> find(const TileTree& tree, const TileId& tile) {
  const auto at = std::ranges::lower_bound(tree.nodes, tile, {}, &TileNode::tile);
  if (at == tree.nodes.end() || at->tile != tile) return {};
  return static_cast<std::size_t>(at - tree.nodes.begin());
}

/// Calls body(number) for the nodes below a node.
template <class Body>
void for_children(const TileTree& tree, const TileId& tile, const Body& body) {
  for (std::int32_t i = 0; i < 4; ++i)
    if (const auto child =
            find(tree, {tile.level + 1, 2 * tile.column + i % 2, 2 * tile.row + i / 2}))
      body(*child);
}

/// A horizon around the circles of others, that holds for them.
TileHorizon horizon_over(std::span<const TileNode* const> children) {
  double low_x = HUGE_VAL, low_y = HUGE_VAL, high_x = -HUGE_VAL, high_y = -HUGE_VAL;
  double height_m = -HUGE_VAL;
  for (const TileNode* child : children) {
    const TileHorizon& h = child->horizon;
    low_x = std::min(low_x, h.centre_x_m - h.radius_m);
    high_x = std::max(high_x, h.centre_x_m + h.radius_m);
    low_y = std::min(low_y, h.centre_y_m - h.radius_m);
    high_y = std::max(high_y, h.centre_y_m + h.radius_m);
    height_m = std::max(height_m, h.height_m);
  }
  const double x_m = (low_x + high_x) / 2, y_m = (low_y + high_y) / 2;
  double radius_m = 0;
  for (const TileNode* child : children)
    radius_m = std::max(
        radius_m, std::hypot(child->horizon.centre_x_m - x_m, child->horizon.centre_y_m - y_m) +
                      child->horizon.radius_m);
  TileHorizon horizon = horizon_of_nothing(children.front()->horizon.layout, x_m, y_m, height_m,
                                           radius_m * (1 + kCircleRounding));
  for (const TileNode* child : children) cover_tile(child->horizon, horizon);
  return horizon;
}

void collect_below(const TileTree& tree, std::size_t node, std::vector<TileId>& tiles) {
  bool is_leaf = true;
  for_children(tree, tree.nodes[node].tile, [&](std::size_t child) {
    is_leaf = false;
    collect_below(tree, child, tiles);
  });
  if (is_leaf) tiles.push_back(tree.nodes[node].tile);
}

void descend(const TileTree& tree, std::size_t node, const Position& eye, HiddenTiles& hidden) {
  ++hidden.nodes_tested;
  if (hides_tile(tree.nodes[node].horizon, eye))
    collect_below(tree, node, hidden.tiles);
  else
    for_children(tree, tree.nodes[node].tile,
                 [&](std::size_t child) { descend(tree, child, eye, hidden); });
}

std::optional<std::string> check_horizon(const TileHorizon& horizon) {
  const HorizonLayout& layout = horizon.layout;
  constexpr std::int32_t kMost = 4096;
  for (const std::int32_t n : {layout.sectors, layout.rings, layout.rings_per_octave})
    if (n < 1 || n > kMost) return "has a layout of " + std::to_string(n);
  if (horizon.slopes.size() != layout.cells()) return "has not a slope for each cell";
  for (const double number : {horizon.centre_x_m, horizon.centre_y_m, horizon.height_m})
    if (!std::isfinite(number)) return "is centred nowhere";
  if (!(horizon.radius_m > 0) || !std::isfinite(horizon.radius_m)) return "has no proper circle";
  for (const float slope : horizon.slopes)
    if (std::isnan(slope)) return "has a slope that is no number";
  return {};
}

}  // namespace

TileNode tile_node(const TileId& tile, const Bounds& bounds, const Groups& groups) {
  const double x_m = (bounds.low.x_m + bounds.high.x_m) / 2;
  const double y_m = (bounds.low.y_m + bounds.high.y_m) / 2;
  const double radius_m =
      std::hypot(bounds.high.x_m - x_m, bounds.high.y_m - y_m) * (1 + kCircleRounding);
  TileNode node{tile, horizon_of_nothing(kTreeHorizon, x_m, y_m, bounds.high.z_m, radius_m)};
  const bool all_grouped = std::ranges::find(groups.group_of_triangle, GroupIndex{kNone}) ==
                           groups.group_of_triangle.end();
  if (all_grouped && groups.has_certified())
    cover_groups(groups.certified, node.horizon);
  else
    cover_uncertified(node.horizon);
  return node;
}

TileTree tree_over(std::vector<TileNode> tiles) {
  TileTree tree;
  while (!tiles.empty()) {
    const std::int32_t level = tiles.front().tile.level;
    std::map<TileId, std::vector<const TileNode*>> children;
    std::ranges::sort(tiles, {}, &TileNode::tile);
    for (const TileNode& tile : tiles) {
      assert(tile.tile.level == level);
      children[parent_of(tile.tile)].push_back(&tile);
    }
    std::vector<TileNode> above;
    if (level > 0)
      for (const auto& [id, below] : children) above.push_back({id, horizon_over(below)});
    tree.nodes.insert(tree.nodes.begin(), std::make_move_iterator(tiles.begin()),
                      std::make_move_iterator(tiles.end()));
    tiles = std::move(above);
  }
  return tree;
}

HiddenTiles hidden_tiles(const TileTree& tree, const Position& eye) {
  HiddenTiles hidden;
  if (!tree.nodes.empty()) descend(tree, 0, eye, hidden);
  std::ranges::sort(hidden.tiles);
  return hidden;
}

std::optional<std::string> check_tile_tree(const TileTree& tree) {
  std::int32_t finest = 0;
  for (const TileNode& node : tree.nodes) finest = std::max(finest, node.tile.level);
  for (std::size_t n = 0; n < tree.nodes.size(); ++n) {
    const TileNode& node = tree.nodes[n];
    const std::string name = "node " + std::to_string(n) + " ";
    if (node.tile.level < 0 || node.tile.level > 30 || node.tile.column < 0 || node.tile.row < 0)
      return name + "is no tile";
    if (node.horizon.layout != tree.nodes.front().horizon.layout)
      return name + "has another layout than the first";
    if (const auto broken = check_horizon(node.horizon)) return name + *broken;
    if (n == 0) continue;
    if (!(tree.nodes[n - 1].tile < node.tile)) return name + "is not in its order";
    if (node.tile.level == tree.nodes.front().tile.level || !find(tree, parent_of(node.tile)))
      return name + "has no node above it";
  }
  for (std::size_t n = 0; n < tree.nodes.size(); ++n) {
    bool has_children = false;
    for_children(tree, tree.nodes[n].tile, [&](std::size_t) { has_children = true; });
    if (!has_children && tree.nodes[n].tile.level != finest)
      return "node " + std::to_string(n) + " has none below it";
  }
  return {};
}

std::optional<std::string> check_tile_tree_bounds(const TileTree& tree) {
  std::optional<std::string> broken;
  for (std::size_t n = 0; n < tree.nodes.size() && !broken; ++n) {
    const TileHorizon& own = tree.nodes[n].horizon;
    for_children(tree, tree.nodes[n].tile, [&](std::size_t child) {
      for (std::size_t cell = 0; cell < own.slopes.size() && !broken; ++cell) {
        if (!(std::abs(own.slopes[cell]) < 1e30F)) continue;
        const auto rings = static_cast<std::size_t>(own.layout.rings);
        const double azimuth =
            2 * std::numbers::pi * (static_cast<double>(cell / rings) + 0.5) / own.layout.sectors;
        const double away_m = own.radius_m * std::exp2((static_cast<double>(cell % rings) + 0.5) /
                                                       own.layout.rings_per_octave);
        const double top_m = own.height_m + static_cast<double>(own.slopes[cell]) * away_m;
        // Just under the top: by more than both comparisons round.
        const Position eye{own.centre_x_m + away_m * std::cos(azimuth),
                           own.centre_y_m + away_m * std::sin(azimuth),
                           top_m - (std::abs(top_m) + std::abs(own.height_m) + away_m) * 1e-12};
        if (hides_tile(own, eye) && !hides_tile(tree.nodes[child].horizon, eye))
          broken = "node " + std::to_string(n) + " hides what node " + std::to_string(child) +
                   " below it shows";
      }
    });
  }
  return broken;
}

}  // namespace scarp
