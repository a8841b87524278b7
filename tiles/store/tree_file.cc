#include "tiles/store/tree_file.h"

#include <fmt/format.h>

#include <cassert>

namespace scarp {
namespace {

constexpr std::uint32_t kTreeVersion = 1;

struct TilePlace {
  std::int32_t level, column, row;
};
struct TileCircle {
  double centre_x_m, centre_y_m, height_m, radius_m;
};

}  // namespace

SectionFileWriter tree_writer(const TileTree& tree) {
  assert(!check_tile_tree(tree));
  const HorizonLayout layout =
      tree.nodes.empty() ? kTreeHorizon : tree.nodes.front().horizon.layout;
  std::vector<TilePlace> places;
  std::vector<TileCircle> circles;
  std::vector<float> slopes;
  for (const auto& [tile, horizon] : tree.nodes) {
    places.push_back({tile.level, tile.column, tile.row});
    circles.push_back({horizon.centre_x_m, horizon.centre_y_m, horizon.height_m, horizon.radius_m});
    slopes.insert(slopes.end(), horizon.slopes.begin(), horizon.slopes.end());
  }
  SectionFileWriter writer(kTreeKind, kTreeVersion);
  writer.add_owned<std::int32_t>(
      "layout", std::vector<std::int32_t>{layout.sectors, layout.rings, layout.rings_per_octave});
  writer.add_owned<std::int32_t>("tile", places);
  writer.add_owned<double>("circle", circles);
  writer.add_owned<float>("slope", slopes);
  return writer;
}

void write_tree(const std::string& path, const TileTree& tree, Existing existing) {
  tree_writer(tree).write(path, existing);
}

TileTree read_tree(const SectionFile& file) {
  file.require(kTreeKind, kTreeVersion);
  const std::span<const std::int32_t> layout = file.section<std::int32_t>("layout");
  constexpr std::int32_t kMost = 4096;
  if (layout.size() != 3) file.fail(fmt::format("{} numbers of a layout of three", layout.size()));
  for (const std::int32_t number : layout)
    if (number < 1 || number > kMost)
      file.fail(fmt::format("{} in a layout where 1 to {} was expected", number, kMost));
  const HorizonLayout cells = {layout[0], layout[1], layout[2]};
  const auto places = file.copy<std::int32_t, TilePlace>("tile");
  const auto circles = file.copy<double, TileCircle>("circle");
  const std::span<const float> slopes = file.section<float>("slope");
  if (circles.size() != places.size() || slopes.size() / cells.cells() != places.size() ||
      slopes.size() % cells.cells() != 0)
    file.fail(fmt::format("{} circles and {} slopes of {} tiles of {} cells", circles.size(),
                          slopes.size(), places.size(), cells.cells()));
  TileTree tree;
  for (std::size_t n = 0; n < places.size(); ++n) {
    const auto own = slopes.subspan(n * cells.cells(), cells.cells());
    tree.nodes.push_back({{places[n].level, places[n].column, places[n].row},
                          {cells,
                           circles[n].centre_x_m,
                           circles[n].centre_y_m,
                           circles[n].height_m,
                           circles[n].radius_m,
                           {own.begin(), own.end()}}});
  }
  if (const auto broken = check_tile_tree(tree)) file.fail(fmt::format("of its tree, {}", *broken));
  return tree;
}

}  // namespace scarp
