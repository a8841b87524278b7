#include "core/raster/rasterise.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/raster/fill_span.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

constexpr std::int64_t kHalf = kSubpixels / 2;

/// No corner is farther than this from the picture: with 8 bits of subpixels, coordinates stay
/// under 2^29, their differences under 2^30 and products of two differences under 2^60.
constexpr double kGuardPx = 1 << 20;

/// Tiles are written by one thread at a time; one tile's depth and objects fit a level-2 cache.
constexpr int kTileWidthPx = 128;
constexpr int kTileHeightPx = 64;

/// Triangles are prepared and binned in chunks (one thread each) and drawn a batch at a time.
constexpr std::size_t kChunkTriangles = 4096;
constexpr std::size_t kBatchChunks = 64;

/// On which side of the planes of the view a corner lies: a triangle all outside one is not seen.
enum Outside : std::uint32_t {
  kLeft = 1,
  kRight = 2,
  kBelow = 4,
  kAbove = 8,
  kTooNear = 16,
  kTooFar = 32,
  kBeyondGuard = 64,  // of any side; such triangles are cut
};

/// A corner on the screen, in subpixels from the upper left.
struct ScreenVertex {
  std::int32_t x = 0;
  std::int32_t y = 0;
  double depth = 0;
  std::uint32_t outside = 0;
};

/// A triangle ready to be drawn: corners from top to bottom, depth as a plane from the first.
struct ScreenTriangle {
  std::array<std::int32_t, 3> x;
  std::array<std::int32_t, 3> y;
  double depth;
  double depth_per_x;  // per subpixel
  double depth_per_y;
  std::uint32_t object;
  bool middle_is_right;
};

/// The prepared triangles of a chunk, and which of them touch which tile, in index order.
struct Chunk {
  std::vector<ScreenTriangle> triangles;
  std::vector<std::uint32_t> first;    // [tiles + 1] into entries
  std::vector<std::uint32_t> entries;  // into triangles
};

std::int64_t floor_divide(std::int64_t a, std::int64_t b) {
  const std::int64_t quotient = a / b;
  return quotient - (a % b < 0 ? 1 : 0);
}

/// First row or column whose pixel centre is at or after the coordinate.
int first_centre(std::int64_t subpixels) {
  return static_cast<int>((subpixels - kHalf + kSubpixels - 1) >> 8);
}
static_assert(kSubpixels == 1 << 8);

/// How clip space lands on the target's pixels.
class Screen {
 public:
  Screen(int width_px, int height_px)
      : half_width_px_(width_px / 2.0),
        half_height_px_(height_px / 2.0),
        guard_x_(kGuardPx / half_width_px_),
        guard_y_(kGuardPx / half_height_px_) {}

  double guard_x() const { return guard_x_; }
  double guard_y() const { return guard_y_; }

  std::uint32_t outside(const ClipPosition& p) const {
    std::uint32_t bits = 0;
    if (p.x < -p.w) bits |= kLeft;
    if (p.x > p.w) bits |= kRight;
    if (p.y < -p.w) bits |= kBelow;
    if (p.y > p.w) bits |= kAbove;
    if (p.z > p.w) bits |= kTooNear;
    if (p.z < 0) bits |= kTooFar;
    if (std::abs(p.x) > guard_x_ * p.w || std::abs(p.y) > guard_y_ * p.w) bits |= kBeyondGuard;
    return bits;
  }

  /// Requires a point that is neither too near nor beyond the guard, up to rounding.
  ScreenVertex place(const ClipPosition& p) const {
    const double x_px = (p.x / p.w + 1) * half_width_px_;
    const double y_px = (1 - p.y / p.w) * half_height_px_;
    return {static_cast<std::int32_t>(std::nearbyint(x_px * kSubpixels)),
            static_cast<std::int32_t>(std::nearbyint(y_px * kSubpixels)), p.z / p.w, 0};
  }

  ScreenVertex place_if_whole(const ClipPosition& p) const {
    const std::uint32_t bits = outside(p);
    ScreenVertex vertex;
    if ((bits & (kTooNear | kBeyondGuard)) == 0) vertex = place(p);
    vertex.outside = bits;
    return vertex;
  }

 private:
  double half_width_px_;
  double half_height_px_;
  double guard_x_;
  double guard_y_;
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

Polygon cut_to_guard(const Screen& screen, Polygon polygon) {
  const double x = screen.guard_x();
  const double y = screen.guard_y();
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
  void for_each_tile(const ScreenTriangle& triangle, const Visit& visit) const {
    const auto [left, right] = std::minmax({triangle.x[0], triangle.x[1], triangle.x[2]});
    const int first_column = std::max(0, first_centre(left)) / kTileWidthPx;
    const int last_column = std::min(width_px, first_centre(right)) - 1;
    const int first_row = std::max(0, first_centre(triangle.y[0])) / kTileHeightPx;
    const int last_row = std::min(height_px, first_centre(triangle.y[2])) - 1;
    for (int row = first_row; row <= last_row / kTileHeightPx; ++row) {
      for (int column = first_column; column <= last_column / kTileWidthPx; ++column) {
        visit(static_cast<std::size_t>(row * columns + column));
      }
    }
  }
};

/// Adds the triangle unless it holds no pixel centre of the target for certain.
void prepare(const Tiling& tiling, const ScreenVertex& a, const ScreenVertex& b,
             const ScreenVertex& c, std::uint32_t object, std::vector<ScreenTriangle>& out) {
  const auto [left, right] = std::minmax({a.x, b.x, c.x});
  if (std::max(0, first_centre(left)) >= std::min(tiling.width_px, first_centre(right))) return;
  const ScreenVertex* v[3] = {&a, &b, &c};
  if (v[1]->y < v[0]->y) std::swap(v[0], v[1]);
  if (v[2]->y < v[1]->y) std::swap(v[1], v[2]);
  if (v[1]->y < v[0]->y) std::swap(v[0], v[1]);
  if (std::max(0, first_centre(v[0]->y)) >= std::min(tiling.height_px, first_centre(v[2]->y))) {
    return;
  }
  const std::int64_t x1 = v[1]->x - v[0]->x;
  const std::int64_t y1 = v[1]->y - v[0]->y;
  const std::int64_t x2 = v[2]->x - v[0]->x;
  const std::int64_t y2 = v[2]->y - v[0]->y;
  const std::int64_t twice_area = x1 * y2 - x2 * y1;
  if (twice_area == 0) return;
  const double depth1 = v[1]->depth - v[0]->depth;
  const double depth2 = v[2]->depth - v[0]->depth;
  const double scale = 1 / static_cast<double>(twice_area);
  out.push_back({{v[0]->x, v[1]->x, v[2]->x},
                 {v[0]->y, v[1]->y, v[2]->y},
                 v[0]->depth,
                 (depth1 * static_cast<double>(y2) - depth2 * static_cast<double>(y1)) * scale,
                 (depth2 * static_cast<double>(x1) - depth1 * static_cast<double>(x2)) * scale,
                 object,
                 twice_area > 0});
}

void prepare_cut(const Screen& screen, const Tiling& tiling, const Polygon& triangle,
                 std::uint32_t object, std::vector<ScreenTriangle>& out) {
  const Polygon polygon = cut_to_guard(screen, triangle);
  if (polygon.count < 3) return;
  const ScreenVertex first = screen.place(polygon.corners[0]);
  ScreenVertex before = screen.place(polygon.corners[1]);
  for (std::size_t i = 2; i < polygon.count; ++i) {
    const ScreenVertex corner = screen.place(polygon.corners[i]);
    prepare(tiling, first, before, corner, object, out);
    before = corner;
  }
}

/// Counts, then fills: the triangles of each tile, in order.
void bin(const Tiling& tiling, Chunk& chunk) {
  chunk.first.assign(tiling.count() + 1, 0);
  for (const ScreenTriangle& triangle : chunk.triangles) {
    tiling.for_each_tile(triangle, [&](std::size_t tile) { ++chunk.first[tile + 1]; });
  }
  for (std::size_t tile = 0; tile < tiling.count(); ++tile) {
    chunk.first[tile + 1] += chunk.first[tile];
  }
  chunk.entries.resize(chunk.first.back());
  std::vector<std::uint32_t> next(chunk.first.begin(), chunk.first.end() - 1);
  for (std::uint32_t t = 0; t < chunk.triangles.size(); ++t) {
    tiling.for_each_tile(chunk.triangles[t],
                         [&](std::size_t tile) { chunk.entries[next[tile]++] = t; });
  }
}

/// Walks down an edge and knows, in each row, the first column whose centre is at or right of it:
/// the exact ceiling of a fraction, kept as quotient and shortfall. Every triangle on either side
/// of the edge asks for the same number, which is what makes shared edges meet.
class EdgeWalk {
 public:
  /// Requires y_bottom > y_top, and the row's centre between them.
  EdgeWalk(std::int64_t x_top, std::int64_t y_top, std::int64_t x_bottom, std::int64_t y_bottom,
           int row) {
    const std::int64_t dx = x_bottom - x_top;
    const std::int64_t dy = y_bottom - y_top;
    const std::int64_t y = static_cast<std::int64_t>(row) * kSubpixels + kHalf;
    divisor_ = dy * kSubpixels;
    const std::int64_t numerator = (x_top - kHalf) * dy + (y - y_top) * dx;
    column_ = -floor_divide(-numerator, divisor_);
    shortfall_ = column_ * divisor_ - numerator;
    // A row further down adds kSubpixels * dx / divisor_ = dx / dy columns.
    column_step_ = floor_divide(dx, dy);
    remainder_step_ = (dx - column_step_ * dy) * kSubpixels;
  }

  std::int64_t column() const { return column_; }

  void step() {
    column_ += column_step_;
    shortfall_ -= remainder_step_;
    if (shortfall_ < 0) {
      ++column_;
      shortfall_ += divisor_;
    }
  }

 private:
  std::int64_t column_;     // ceiling of numerator / divisor
  std::int64_t shortfall_;  // column * divisor - numerator, in [0, divisor)
  std::int64_t divisor_;
  std::int64_t column_step_;
  std::int64_t remainder_step_;
};

/// A rectangle of the target, [left, right) x [top, bottom), in pixels.
struct Tile {
  int left;
  int top;
  int right;
  int bottom;
};

/// Fills the rows [row, end) between two edges.
void fill_rows(Target& target, const Tile& tile, const ScreenTriangle& triangle, EdgeWalk& left,
               EdgeWalk& right, int row, int end) {
  for (; row < end; ++row, left.step(), right.step()) {
    const int begin_x = static_cast<int>(std::max<std::int64_t>(left.column(), tile.left));
    const int end_x = static_cast<int>(std::min<std::int64_t>(right.column(), tile.right));
    if (begin_x >= end_x) continue;
    // The span starts from double, at a pixel inside the triangle: float then only carries what
    // changes within the span, and never leaves the depths of the corners by more than rounding.
    const double dx = static_cast<double>(begin_x) * kSubpixels + kHalf - triangle.x[0];
    const double dy = static_cast<double>(row) * kSubpixels + kHalf - triangle.y[0];
    const Span span = {
        static_cast<float>(triangle.depth + triangle.depth_per_x * dx + triangle.depth_per_y * dy),
        static_cast<float>(triangle.depth_per_x * kSubpixels), triangle.object};
    const std::size_t at = target.index(begin_x, row);
    const std::size_t count = static_cast<std::size_t>(end_x - begin_x);
    if (target.object.empty()) {
      fill_span_depth(span, count, target.depth.data() + at);
    } else {
      fill_span(span, count, target.depth.data() + at, target.object.data() + at);
    }
  }
}

void fill_triangle(Target& target, const Tile& tile, const ScreenTriangle& t) {
  const int top = std::max(tile.top, first_centre(t.y[0]));
  const int bottom = std::min(tile.bottom, first_centre(t.y[2]));
  if (top >= bottom) return;
  const int middle = std::clamp(first_centre(t.y[1]), top, bottom);
  EdgeWalk longest(t.x[0], t.y[0], t.x[2], t.y[2], top);
  const auto fill = [&](std::size_t from, std::size_t to, int begin, int end) {
    if (begin >= end) return;
    EdgeWalk shorter(t.x[from], t.y[from], t.x[to], t.y[to], begin);
    if (t.middle_is_right) {
      fill_rows(target, tile, t, longest, shorter, begin, end);
    } else {
      fill_rows(target, tile, t, shorter, longest, begin, end);
    }
  };
  fill(0, 1, top, middle);
  fill(1, 2, middle, bottom);
}

/// One call of rasterise: what its steps share.
struct Drawing {
  Target& target;
  std::span<const ClipPosition> vertices;
  std::span<const std::array<VertexIndex, 3>> triangles;
  std::span<const std::uint32_t> objects;
  Screen screen;
  Tiling tiling;
  std::vector<ScreenVertex> placed = {};  // [vertices]
};

void place_vertices(Drawing& drawing) {
  const std::size_t count = drawing.vertices.size();
  drawing.placed.resize(count);
  parallel_for((count + kChunkTriangles - 1) / kChunkTriangles, [&](std::size_t chunk) {
    const std::size_t end = std::min(count, (chunk + 1) * kChunkTriangles);
    for (std::size_t i = chunk * kChunkTriangles; i < end; ++i) {
      drawing.placed[i] = drawing.screen.place_if_whole(drawing.vertices[i]);
    }
  });
}

/// Prepares and bins the triangles [begin, end).
void prepare_chunk(const Drawing& drawing, std::size_t begin, std::size_t end, Chunk& chunk) {
  constexpr std::uint32_t kHidesAll = kLeft | kRight | kBelow | kAbove | kTooNear | kTooFar;
  constexpr std::uint32_t kCuts = kTooNear | kBeyondGuard;
  chunk.triangles.clear();
  for (std::size_t i = begin; i < end; ++i) {
    const auto& [a, b, c] = drawing.triangles[i];
    assert(std::max({a, b, c}) < drawing.vertices.size());
    const ScreenVertex& at_a = drawing.placed[a];
    const ScreenVertex& at_b = drawing.placed[b];
    const ScreenVertex& at_c = drawing.placed[c];
    if ((at_a.outside & at_b.outside & at_c.outside & kHidesAll) != 0) continue;
    const std::uint32_t object =
        drawing.objects.empty() ? static_cast<std::uint32_t>(i) : drawing.objects[i];
    assert(object != kNone);
    if (((at_a.outside | at_b.outside | at_c.outside) & kCuts) == 0) {
      prepare(drawing.tiling, at_a, at_b, at_c, object, chunk.triangles);
    } else {
      const Polygon whole = {{drawing.vertices[a], drawing.vertices[b], drawing.vertices[c]}, 3};
      prepare_cut(drawing.screen, drawing.tiling, whole, object, chunk.triangles);
    }
  }
  bin(drawing.tiling, chunk);
}

void draw_tile(const Drawing& drawing, std::span<const Chunk> chunks, std::size_t index) {
  const Tiling& tiling = drawing.tiling;
  const int left = static_cast<int>(index) % tiling.columns * kTileWidthPx;
  const int top = static_cast<int>(index) / tiling.columns * kTileHeightPx;
  const Tile tile = {left, top, std::min(left + kTileWidthPx, tiling.width_px),
                     std::min(top + kTileHeightPx, tiling.height_px)};
  for (const Chunk& chunk : chunks) {
    for (std::uint32_t i = chunk.first[index]; i < chunk.first[index + 1]; ++i) {
      fill_triangle(drawing.target, tile, chunk.triangles[chunk.entries[i]]);
    }
  }
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
      target,        vertices, triangles, objects, Screen(target.width_px, target.height_px),
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
