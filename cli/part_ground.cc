#include "cli/part_ground.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>

namespace scarp {
namespace {

/// Vertices are samples: one that is nearer than this to the raster's border lies on it, and one
/// that is not is a cell away.
constexpr double kOnBorderCells = 0.25;

/// Places as the samples of a scene's raster count them.
class RasterPlaces {
 public:
  explicit RasterPlaces(const SceneTiles& tiles)
      : raster_(tiles.scene().description().raster), placer_(tiles.frame()) {}

  /// How far a place lies inside the raster's left, upper, right and lower border, in cells.
  std::array<double, 4> inside_cells(const Position& p) const {
    const MapPoint map = placer_.unplace(p);
    const auto& g = raster_.geotransform;
    const double column = (map.x - g[0]) / g[1] - 0.5, row = (map.y - g[3]) / g[5] - 0.5;
    return {column, row, raster_.columns - 1 - column, raster_.rows - 1 - row};
  }
  bool is_outside(const Position& p) const {
    return std::ranges::min(inside_cells(p)) < -kOnBorderCells;
  }
  /// Whether an edge between samples runs along one side of the raster.
  bool is_border(const Position& from, const Position& to) const {
    const auto a = inside_cells(from), b = inside_cells(to);
    for (std::size_t side = 0; side < a.size(); ++side)
      if (std::abs(a[side]) < kOnBorderCells && std::abs(b[side]) < kOnBorderCells) return true;
    return false;
  }

 private:
  const RasterGeometry& raster_;
  GeoFrame::Placer placer_;
};

/// Whether a part tells of every place in the discs whether it is ground, enclosed void, or outside
/// the data. It does so of their centres, and wherever another void begins within them, it begins
/// at an edge that tells: of a hole, which is one in the whole scene as well, or of the raster.
bool tells_void(const SceneTiles& tiles, const TinIndex& part, std::span<const ViewPlan> discs) {
  const RasterPlaces places(tiles);
  for (const ViewPlan& disc : discs) {
    const Position& centre = disc.eye;
    if (part.triangle_at(centre.x_m, centre.y_m) == kNone &&
        !part.is_in_hole(centre.x_m, centre.y_m) && !places.is_outside(centre))
      return false;
  }
  std::vector<bool> of_hole(part.edges().size());
  for (const std::uint32_t e : part.hole_edges()) of_hole[e] = true;
  for (std::size_t e = 0; e < of_hole.size(); ++e) {
    const MeshEdge& edge = part.edges()[e];
    if (!edge.is_border() || of_hole[e]) continue;
    const Position& a = part.tin().vertices[edge.from];
    const Position& b = part.tin().vertices[edge.to];
    TileContents box;
    box.low = {std::min(a.x_m, b.x_m), std::min(a.y_m, b.y_m), 0};
    box.high = {std::max(a.x_m, b.x_m), std::max(a.y_m, b.y_m), 0};
    const auto meets = [&](const ViewPlan& disc) { return may_meet(box, disc); };
    if (std::ranges::any_of(discs, meets) && !places.is_border(a, b)) return false;
  }
  return true;
}

}  // namespace

PartGround::PartGround(SceneTiles& tiles, const AskedLines& lines, std::uint64_t memory_bytes,
                       const std::string& remedy)
    : used_(lines.tiles), tin_(tiles.read_within(used_, memory_bytes, remedy)), index_(tin_) {
  if (used_.size() == tiles.size() || (!used_.empty() && tells_void(tiles, *index_, lines.ends)))
    return;
  used_.resize(tiles.size());
  std::iota(used_.begin(), used_.end(), std::size_t{0});
  index_.reset();
  tin_ = tiles.read_within(used_, memory_bytes, remedy);
  index_.emplace(tin_);
}

}  // namespace scarp
