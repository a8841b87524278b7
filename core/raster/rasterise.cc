#include "core/raster/rasterise.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/raster/raster_kernels.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Tiles are written by one thread at a time; one tile's depth and objects fit a level-2 cache.
constexpr int kTileWidthPx = 128;
constexpr int kTileHeightPx = 64;

/// Triangles are prepared and binned in chunks (one thread each) and drawn a batch at a time.
constexpr std::size_t kChunkTriangles = 4096;
constexpr std::size_t kBatchChunks = 64;

/// Tiles that a triangle's box touches, all ends included.
struct TileRange {
  std::uint16_t first_column, last_column, first_row, last_row;
};

/// The prepared triangles of a chunk, and which of them touch which tile, in index order.
struct Chunk {
  std::vector<ScreenTriangle> triangles;
  std::vector<TileRange> ranges;       // [triangles]
  std::vector<std::uint32_t> first;    // [tiles + 1] into entries
  std::vector<std::uint32_t> entries;  // into triangles
};

/// A convex polygon in clip space: a triangle gains at most one corner a plane.
struct Polygon {
  std::array<ClipPosition, 8> corners;
  std::size_t count = 0;
};

/// Keeps the part where distance(corner) >= 0. A cut edge is always divided from its inner end, so
/// that two triangles that share it get the same new corner, bit for bit.
template <typename Distance>
Polygon cut(const Polygon& polygon, const Distance& distance) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.count; ++i) {
    const ClipPosition& a = polygon.corners[i];
    const ClipPosition& b = polygon.corners[i + 1 == polygon.count ? 0 : i + 1];
    const double at_a = distance(a);
    const double at_b = distance(b);
    if (at_a >= 0) kept.corners[kept.count++] = a;
    if ((at_a >= 0) == (at_b >= 0)) continue;
    const ClipPosition& in = at_a >= 0 ? a : b;
    const ClipPosition& out = at_a >= 0 ? b : a;
    const double at_in = std::max(at_a, at_b);
    const double t = at_in / (at_in - std::min(at_a, at_b));
    kept.corners[kept.count++] = {in.x + t * (out.x - in.x), in.y + t * (out.y - in.y),
                                  in.z + t * (out.z - in.z), in.w + t * (out.w - in.w)};
  }
  return kept;
}

Polygon cut_to_guard(const ScreenMap& map, Polygon polygon) {
  const double x = map.guard_x;
  const double y = map.guard_y;
  polygon = cut(polygon, [](const ClipPosition& p) { return p.w - p.z; });
  polygon = cut(polygon, [x](const ClipPosition& p) { return x * p.w + p.x; });
  polygon = cut(polygon, [x](const ClipPosition& p) { return x * p.w - p.x; });
  polygon = cut(polygon, [y](const ClipPosition& p) { return y * p.w + p.y; });
  return cut(polygon, [y](const ClipPosition& p) { return y * p.w - p.y; });
}

/// Divides the target into tiles and finds those that a rectangle touches.
struct Tiling {
  int width_px;
  int height_px;
  int columns;
  int rows;

  explicit Tiling(const Target& target)
      : width_px(target.width_px),
        height_px(target.height_px),
        columns((target.width_px + kTileWidthPx - 1) / kTileWidthPx),
        rows((target.height_px + kTileHeightPx - 1) / kTileHeightPx) {}

  std::size_t count() const { return static_cast<std::size_t>(columns * rows); }

  template <typename Visit>
  void for_each_tile(const TileRange& range, const Visit& visit) const {
    for (int row = range.first_row; row <= range.last_row; ++row)
      for (int column = range.first_column; column <= range.last_column; ++column)
        visit(static_cast<std::size_t>(row * columns + column));
  }
};

/// Adds the triangle unless it holds no pixel centre of the target for certain.
inline void prepare(const Tiling& tiling, const ScreenCorner& a, const ScreenCorner& b,
                    const ScreenCorner& c, std::uint32_t object, Chunk& out) {
  const int left = std::max(0, first_centre(std::min({a.x, b.x, c.x})));
  const int right = std::min(tiling.width_px, first_centre(std::max({a.x, b.x, c.x}))) - 1;
  const int top = std::max(0, first_centre(std::min({a.y, b.y, c.y})));
  const int bottom = std::min(tiling.height_px, first_centre(std::max({a.y, b.y, c.y}))) - 1;
  if ((left > right) | (top > bottom)) return;
  ScreenTriangle triangle;
  if (!set_up(a, b, c, object, triangle)) return;
  out.triangles.push_back(triangle);
  out.ranges.push_back({static_cast<std::uint16_t>(left / kTileWidthPx),
                        static_cast<std::uint16_t>(right / kTileWidthPx),
                        static_cast<std::uint16_t>(top / kTileHeightPx),
                        static_cast<std::uint16_t>(bottom / kTileHeightPx)});
}

void prepare_cut(const ScreenMap& map, const Tiling& tiling, const Polygon& triangle,
                 std::uint32_t object, Chunk& out) {
  const Polygon polygon = cut_to_guard(map, triangle);
  if (polygon.count < 3) return;
  const auto corner = [&](std::size_t i) { return place_corner(map, polygon.corners[i]); };
  for (std::size_t i = 2; i < polygon.count; ++i)
    prepare(tiling, corner(0), corner(i - 1), corner(i), object, out);
}

/// Counts, then fills: the triangles of each tile, in order.
void bin(const Tiling& tiling, Chunk& chunk) {
  chunk.first.assign(tiling.count() + 1, 0);
  for (const TileRange& range : chunk.ranges)
    tiling.for_each_tile(range, [&](std::size_t tile) { ++chunk.first[tile + 1]; });
  for (std::size_t tile = 0; tile < tiling.count(); ++tile)
    chunk.first[tile + 1] += chunk.first[tile];
  chunk.entries.resize(chunk.first.back());
  std::vector<std::uint32_t> next(chunk.first.begin(), chunk.first.end() - 1);
  for (std::uint32_t t = 0; t < chunk.ranges.size(); ++t)
    tiling.for_each_tile(chunk.ranges[t],
                         [&](std::size_t tile) { chunk.entries[next[tile]++] = t; });
}

/// One call of rasterise: what its steps share.
struct Drawing {
  Target& target;
  std::span<const ClipPosition> vertices;
  std::span<const std::array<VertexIndex, 3>> triangles;
  std::span<const std::uint32_t> objects;
  ScreenMap map;
  Tiling tiling;
  ScreenCorners placed = {};  // [vertices]
};

void place_vertices(Drawing& drawing) {
  const std::size_t count = drawing.vertices.size();
  drawing.placed.resize(count);
  parallel_for((count + kChunkTriangles - 1) / kChunkTriangles, [&](std::size_t chunk) {
    const std::size_t begin = chunk * kChunkTriangles;
    place_corners(drawing.map, drawing.vertices, begin, std::min(count, begin + kChunkTriangles),
                  drawing.placed);
  });
}

/// Prepares and bins the triangles [begin, end).
void prepare_chunk(const Drawing& drawing, std::size_t begin, std::size_t end, Chunk& chunk) {
  constexpr std::uint32_t kHidesAll = kLeft | kRight | kBelow | kAbove | kTooNear | kTooFar;
  constexpr std::uint32_t kCuts = kTooNear | kBeyondGuard;
  const ScreenCorners& placed = drawing.placed;
  chunk.triangles.clear();
  chunk.ranges.clear();
  for (std::size_t i = begin; i < end; ++i) {
    const auto& [a, b, c] = drawing.triangles[i];
    assert(std::max({a, b, c}) < drawing.vertices.size());
    const std::uint32_t at_a = placed.outside[a], at_b = placed.outside[b],
                        at_c = placed.outside[c];
    if ((at_a & at_b & at_c & kHidesAll) != 0) continue;
    const std::uint32_t object =
        drawing.objects.empty() ? static_cast<std::uint32_t>(i) : drawing.objects[i];
    assert(object != kNone);
    if (((at_a | at_b | at_c) & kCuts) == 0) {
      const auto corner = [&](VertexIndex v) {
        return ScreenCorner{placed.x[v], placed.y[v], placed.depth[v]};
      };
      prepare(drawing.tiling, corner(a), corner(b), corner(c), object, chunk);
    } else {
      const Polygon whole = {{drawing.vertices[a], drawing.vertices[b], drawing.vertices[c]}, 3};
      prepare_cut(drawing.map, drawing.tiling, whole, object, chunk);
    }
  }
  bin(drawing.tiling, chunk);
}

void draw_tile(const Drawing& drawing, std::span<const Chunk> chunks, std::size_t index) {
  const Tiling& tiling = drawing.tiling;
  Target& target = drawing.target;
  const int left = static_cast<int>(index) % tiling.columns * kTileWidthPx;
  const int top = static_cast<int>(index) / tiling.columns * kTileHeightPx;
  const PixelTile tile = {left,
                          top,
                          std::min(left + kTileWidthPx, tiling.width_px),
                          std::min(top + kTileHeightPx, tiling.height_px),
                          static_cast<std::size_t>(target.width_px),
                          target.depth.data(),
                          target.object.empty() ? nullptr : target.object.data()};
  for (const Chunk& chunk : chunks)
    fill_triangles(tile, chunk.triangles.data(),
                   std::span(chunk.entries)
                       .subspan(chunk.first[index], chunk.first[index + 1] - chunk.first[index]));
}

Target target_of(int width_px, int height_px) {
  assert(width_px >= 1 && width_px <= kGreatestSizePx);
  assert(height_px >= 1 && height_px <= kGreatestSizePx);
  Target target;
  target.width_px = width_px;
  target.height_px = height_px;
  target.depth.assign(target.index(0, height_px), 0.0F);
  return target;
}

}  // namespace

Target empty_depth_target(int width_px, int height_px) {
  return target_of(width_px, height_px);
}

Target empty_target(int width_px, int height_px) {
  Target target = target_of(width_px, height_px);
  target.object.assign(target.depth.size(), kNone);
  return target;
}

void rasterise(Target& target, std::span<const ClipPosition> vertices,
               std::span<const std::array<VertexIndex, 3>> triangles,
               std::span<const std::uint32_t> objects) {
  assert(objects.empty() || objects.size() == triangles.size());
  assert(target.object.empty() || target.object.size() == target.depth.size());
  Drawing drawing = {
      target,        vertices, triangles, objects, ScreenMap(target.width_px, target.height_px),
      Tiling(target)};
  place_vertices(drawing);

  constexpr std::size_t kBatch = kChunkTriangles * kBatchChunks;
  std::vector<Chunk> chunks(kBatchChunks);
  for (std::size_t begin = 0; begin < triangles.size(); begin += kBatch) {
    const std::size_t end = std::min(triangles.size(), begin + kBatch);
    const std::size_t used = (end - begin + kChunkTriangles - 1) / kChunkTriangles;
    parallel_for(used, [&](std::size_t c) {
      const std::size_t first = begin + c * kChunkTriangles;
      prepare_chunk(drawing, first, std::min(end, first + kChunkTriangles), chunks[c]);
    });
    parallel_for(drawing.tiling.count(), [&](std::size_t tile) {
      draw_tile(drawing, std::span(chunks).first(used), tile);
    });
  }
}

}  // namespace scarp
