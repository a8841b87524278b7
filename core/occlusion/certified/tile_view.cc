#include "core/occlusion/certified/tile_view.h"

#include <cassert>

#include "core/occlusion/certified/certify_groups.h"
#include "core/terrain/weld.h"

namespace scarp {
namespace {

void append(const Tin& part, Tin& tin) {
  const auto vertices = static_cast<VertexIndex>(tin.vertices.size());
  const auto triangles = static_cast<TriangleIndex>(tin.triangles.size());
  tin.vertices.insert(tin.vertices.end(), part.vertices.begin(), part.vertices.end());
  for (auto corners : part.triangles) {
    for (VertexIndex& v : corners) v += vertices;
    tin.triangles.push_back(corners);
  }
  for (auto across : part.neighbours) {
    for (TriangleIndex& other : across)
      if (other != kNone) other += triangles;
    tin.neighbours.push_back(across);
  }
}

/// What is seen of one level, welded.
Tin level_of(const TileScheme& scheme, std::span<const SeenTile> seen, std::int32_t level) {
  std::vector<Occluder> cut;
  std::vector<const Tin*> parts;
  cut.reserve(seen.size());
  for (const SeenTile& tile : seen) {
    if (tile.id.level != level) continue;
    if (level == scheme.finest_level()) {
      parts.push_back(tile.tin);
      continue;
    }
    cut.push_back(outside(tile, scheme.columns(), scheme.covered_by_finer(seen.front().id, level)));
    parts.push_back(&cut.back().tin);
  }
  return weld(parts).tin;
}

}  // namespace

TileView view_of_tile(const TileScheme& scheme, std::span<const SeenTile> seen) {
  assert(!seen.empty() && seen.front().id.level == scheme.finest_level());
  TileView view{level_of(scheme, seen, scheme.finest_level()), seen.front().tin->triangles.size()};
  for (std::int32_t level = scheme.finest_level() - 1; level >= 0; --level)
    append(level_of(scheme, seen, level), view.tin);
  return view;
}

CertifiedRegions certify_tile(const TileView& view, std::span<const GroupIndex> group_of_triangle,
                              std::uint32_t groups, const HidingOptions& options,
                              const Progress& progress) {
  assert(group_of_triangle.size() == view.own_triangles);
  if (groups == 0) return {{options.sectors, 2}, {}, {}};
  std::vector<GroupIndex> group_of(view.tin.triangles.size(), kNone);
  std::copy(group_of_triangle.begin(), group_of_triangle.end(), group_of.begin());
  return compress_bounds(
      bound_hiding(view.tin, group_of, groups, options, progress, view.own_triangles),
      LeastGround(view.tin));
}

}  // namespace scarp
