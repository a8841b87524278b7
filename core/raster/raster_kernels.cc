#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/raster/raster_kernels.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once more for each instruction set.
#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <cmath>
#include <cstdlib>

#include "core/raster/raster_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace scarp {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// No more than 16 pixels at once: triangles are small, and tiles whole multiples of it.
using Floats = hn::CappedTag<float, 16>;
using Numbers = hn::RebindToSigned<Floats>;
using Objects = hn::RebindToUnsigned<Floats>;
using Doubles = hn::ScalableTag<double>;
constexpr Floats kFloats;
constexpr Numbers kNumbers;
constexpr Objects kObjects;
constexpr Doubles kDoubles;

void place_now(const ScreenMap& map, const ClipPosition* corners, std::size_t begin,
               std::size_t end, ScreenCorners& placed) {
  const hn::Rebind<std::int32_t, Doubles> ints;
  using V = hn::Vec<Doubles>;
  const auto value = [](double v) HWY_ATTR { return hn::Set(kDoubles, v); };
  const V zero = hn::Zero(kDoubles), one = value(1), subpixels = value(kSubpixels);
  const V half_width = value(map.half_width_px), half_height = value(map.half_height_px);
  const V guard_x = value(map.guard_x), guard_y = value(map.guard_y);
  const auto bit_where = [&](hn::Mask<Doubles> mask, Outside bit)
                             HWY_ATTR { return hn::IfThenElseZero(mask, hn::Set(kDoubles, bit)); };
  const std::size_t lanes = hn::Lanes(kDoubles);
  for (std::size_t i = begin; i < end; i += lanes) {
    // The last vector begins earlier, so that it does not read beyond the end.
    if (i + lanes > end) i = end - lanes;
    V x, y, z, w;
    hn::LoadInterleaved4(kDoubles, &corners[i].x, x, y, z, w);
    const V minus_w = hn::Neg(w);
    const auto beyond =
        hn::Or(hn::Gt(hn::Abs(x), hn::Mul(guard_x, w)), hn::Gt(hn::Abs(y), hn::Mul(guard_y, w)));
    const auto near = hn::Gt(z, w);
    auto bits = bit_where(hn::Lt(x, minus_w), kLeft);
    bits = hn::Add(bits, bit_where(hn::Gt(x, w), kRight));
    bits = hn::Add(bits, bit_where(hn::Lt(y, minus_w), kBelow));
    bits = hn::Add(bits, bit_where(hn::Gt(y, w), kAbove));
    bits = hn::Add(bits, bit_where(near, kTooNear));
    bits = hn::Add(bits, bit_where(hn::Lt(z, zero), kTooFar));
    bits = hn::Add(bits, bit_where(beyond, kBeyondGuard));
    const auto has_place = hn::Not(hn::Or(near, beyond));
    const V x_px = hn::Mul(hn::Add(hn::Div(x, w), one), half_width);
    const V y_px = hn::Mul(hn::Sub(one, hn::Div(y, w)), half_height);
    const auto whole = [&](V px) HWY_ATTR {
      return hn::DemoteTo(ints, hn::IfThenElseZero(has_place, hn::Round(hn::Mul(px, subpixels))));
    };
    hn::StoreU(whole(x_px), ints, placed.x.data() + i);
    hn::StoreU(whole(y_px), ints, placed.y.data() + i);
    hn::StoreU(hn::IfThenElseZero(has_place, hn::Div(z, w)), kDoubles, placed.depth.data() + i);
    hn::StoreU(hn::DemoteTo(ints, bits), ints,
               reinterpret_cast<std::int32_t*>(placed.outside.data()) + i);
  }
}

/// Lanes of a float vector.
std::size_t lanes_now() {
  return hn::Lanes(kFloats);
}

/// Writes the lanes of a mask that are nearer than what is there.
template <bool kObject>
HWY_INLINE void write(hn::Mask<Floats> covered, hn::Vec<Floats> z, std::uint32_t object,
                      float* depth, std::uint32_t* owner) {
  const auto there = hn::LoadU(kFloats, depth);
  auto nearer = hn::Gt(z, there);
  if constexpr (kObject) {
    const auto owns = hn::LoadU(kObjects, owner), mine = hn::Set(kObjects, object);
    const auto lower = hn::RebindMask(kFloats, hn::Lt(mine, owns));
    nearer = hn::And(covered, hn::Or(nearer, hn::And(hn::Eq(z, there), lower)));
    hn::StoreU(hn::IfThenElse(hn::RebindMask(kObjects, nearer), mine, owns), kObjects, owner);
  } else {
    nearer = hn::And(covered, nearer);
  }
  hn::StoreU(hn::IfThenElse(nearer, z, there), kFloats, depth);
}

/// Any triangle, run by run.
template <bool kObject>
HWY_INLINE void fill_runs(const PixelTile& tile, const ScreenTriangle& t) {
  const auto lanes = static_cast<int>(hn::Lanes(kFloats));
  const auto step = hn::Set(kFloats, t.depth_step());
  RowWalk walk(t, tile);
  for (int row, begin, end; walk.next(row, begin, end);) {
    const auto first = hn::Set(kFloats, t.depth_at(begin, row));
    const std::size_t start = tile.index(0, row);
    const auto write_from = [&](int from, hn::Mask<Floats> covered) HWY_ATTR {
      const auto along = hn::Iota(kFloats, static_cast<float>(from - begin));
      const std::size_t at = start + static_cast<std::size_t>(from);
      write<kObject>(covered, hn::Add(first, hn::Mul(step, along)), t.object, tile.depth + at,
                     kObject ? tile.object + at : nullptr);
    };
    int x = begin;
    for (; x + lanes <= end; x += lanes) write_from(x, hn::FirstN(kFloats, hn::Lanes(kFloats)));
    if (x == end) continue;
    // A vector never leaves its tile: other threads write there.
    const int from = HWY_MIN(x, tile.right - lanes);
    const auto before = hn::FirstN(kFloats, static_cast<std::size_t>(x - from));
    const auto within = hn::FirstN(kFloats, static_cast<std::size_t>(end - from));
    write_from(from, hn::AndNot(before, within));
  }
}

/// An edge of a small triangle: twice the area that it spans with a pixel's centre, less one where
/// the edge itself is not covered. 32 bits hold it for boxes of kSmallSubpixels and a vector more.
struct SmallEdge {
  hn::Vec<Numbers> at, per_row;
  std::int32_t per_column;

  HWY_INLINE void set(const ScreenTriangle& t, std::size_t a, std::size_t b, int column, int row,
                      hn::Vec<Numbers> iota) {
    const std::int32_t dx = t.x[b] - t.x[a], dy = t.y[b] - t.y[a];
    const auto half = static_cast<std::int32_t>(kHalfPixel);
    const std::int32_t x = column * kSubpixels + half - t.x[a];
    const std::int32_t y = row * kSubpixels + half - t.y[a];
    const bool is_top_or_left = (dy < 0) | ((dy == 0) & (dx > 0));
    per_column = -dy * kSubpixels;
    at = hn::Add(hn::Set(kNumbers, dx * y - dy * x - (is_top_or_left ? 0 : 1)),
                 hn::Mul(hn::Set(kNumbers, per_column), iota));
    per_row = hn::Set(kNumbers, dx * kSubpixels);
  }
};

constexpr std::int32_t kSmallSubpixels = 1 << 14;
constexpr int kSmallVectors = 4;

struct Box {
  int left, top, right, bottom;  // pixels, in the tile
};

/// A triangle whose box is few vectors wide: all pixels of the box are asked which edges they are
/// within.
template <bool kObject>
HWY_INLINE void fill_small(const PixelTile& tile, const ScreenTriangle& t, const Box& box,
                           int vectors) {
  const auto lanes = static_cast<int>(hn::Lanes(kFloats));
  const int start = HWY_MIN(box.left, tile.right - vectors * lanes);
  const auto iota = hn::Iota(kNumbers, 0);
  const auto step = hn::Set(kFloats, t.depth_step());
  SmallEdge a, b, c;
  a.set(t, 0, 1, start, box.top, iota);
  b.set(t, 1, 2, start, box.top, iota);
  c.set(t, 2, 0, start, box.top, iota);
  std::size_t at = tile.index(start, box.top);
  for (int row = box.top; row < box.bottom; ++row, at += tile.stride_px) {
    int begin = -1;
    auto first = hn::Zero(kFloats);
    auto at_a = a.at, at_b = b.at, at_c = c.at;
    for (int v = 0; v < vectors; ++v) {
      const auto covered =
          hn::RebindMask(kFloats, hn::Gt(hn::Or(hn::Or(at_a, at_b), at_c), hn::Set(kNumbers, -1)));
      const auto lane = static_cast<int>(hn::FindFirstTrue(kFloats, covered));
      if (lane >= 0) {
        if (begin < 0) {
          begin = v * lanes + lane;
          first = hn::Set(kFloats, t.depth_at(start + begin, row));
        }
        const auto along = hn::Iota(kFloats, static_cast<float>(v * lanes - begin));
        const std::size_t to = at + static_cast<std::size_t>(v * lanes);
        write<kObject>(covered, hn::Add(first, hn::Mul(step, along)), t.object, tile.depth + to,
                       kObject ? tile.object + to : nullptr);
      }
      if (v + 1 == vectors) break;
      at_a = hn::Add(at_a, hn::Set(kNumbers, a.per_column * lanes));
      at_b = hn::Add(at_b, hn::Set(kNumbers, b.per_column * lanes));
      at_c = hn::Add(at_c, hn::Set(kNumbers, c.per_column * lanes));
    }
    a.at = hn::Add(a.at, a.per_row);
    b.at = hn::Add(b.at, b.per_row);
    c.at = hn::Add(c.at, c.per_row);
  }
}

template <bool kObject>
HWY_INLINE void fill_all(const PixelTile& tile, const ScreenTriangle* triangles,
                         const std::uint32_t* which, std::size_t count) {
  constexpr std::size_t kAhead = 6;
  const auto lanes = static_cast<int>(hn::Lanes(kFloats));
  const int room = (tile.right - tile.left) / lanes;
  for (std::size_t i = 0; i < count; ++i) {
    if (i + kAhead < count) hwy::Prefetch(triangles + which[i + kAhead]);
    const ScreenTriangle& t = triangles[which[i]];
    const std::int32_t left = HWY_MIN(HWY_MIN(t.x[0], t.x[1]), t.x[2]);
    const std::int32_t right = HWY_MAX(HWY_MAX(t.x[0], t.x[1]), t.x[2]);
    const std::int32_t top = HWY_MIN(HWY_MIN(t.y[0], t.y[1]), t.y[2]);
    const std::int32_t bottom = HWY_MAX(HWY_MAX(t.y[0], t.y[1]), t.y[2]);
    const Box box{HWY_MAX(first_centre(left), tile.left), HWY_MAX(first_centre(top), tile.top),
                  HWY_MIN(first_centre(right), tile.right),
                  HWY_MIN(first_centre(bottom), tile.bottom)};
    if (box.left >= box.right) continue;
    const int vectors = (box.right - box.left + lanes - 1) / lanes;
    if (vectors <= HWY_MIN(room, kSmallVectors) && right - left <= kSmallSubpixels &&
        bottom - top <= kSmallSubpixels) {
      // A constant number of vectors unrolls.
      if (vectors == 1)
        fill_small<kObject>(tile, t, box, 1);
      else
        fill_small<kObject>(tile, t, box, vectors);
    } else {
      fill_runs<kObject>(tile, t);
    }
  }
}

void fill_depth_now(const PixelTile& tile, const ScreenTriangle* triangles,
                    const std::uint32_t* which, std::size_t count) {
  fill_all<false>(tile, triangles, which, count);
}
void fill_objects_now(const PixelTile& tile, const ScreenTriangle* triangles,
                      const std::uint32_t* which, std::size_t count) {
  fill_all<true>(tile, triangles, which, count);
}

}  // namespace HWY_NAMESPACE
}  // namespace scarp
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace scarp {

HWY_EXPORT(place_now);
HWY_EXPORT(lanes_now);
HWY_EXPORT(fill_depth_now);
HWY_EXPORT(fill_objects_now);

namespace {

KernelPath& path_in_use() {
  static KernelPath path = kernel_path_for(std::getenv("SCARP_SCALAR"));
  return path;
}

/// More corners than any vector of doubles has lanes.
constexpr std::size_t kMostLanes = 64;

void place_plainly(const ScreenMap& map, const ClipPosition& p, std::size_t i,
                   ScreenCorners& placed) {
  const bool is_near = p.z > p.w;
  const bool is_beyond = std::abs(p.x) > map.guard_x * p.w || std::abs(p.y) > map.guard_y * p.w;
  std::uint32_t bits = 0;
  if (p.x < -p.w) bits |= kLeft;
  if (p.x > p.w) bits |= kRight;
  if (p.y < -p.w) bits |= kBelow;
  if (p.y > p.w) bits |= kAbove;
  if (is_near) bits |= kTooNear;
  if (p.z < 0) bits |= kTooFar;
  if (is_beyond) bits |= kBeyondGuard;
  placed.outside[i] = bits;
  const bool has_place = !is_near && !is_beyond;
  const ScreenCorner at = has_place ? place_corner(map, p) : ScreenCorner{0, 0, 0};
  placed.x[i] = at.x;
  placed.y[i] = at.y;
  placed.depth[i] = at.depth;
}

void fill_plainly(const PixelTile& tile, const ScreenTriangle& t) {
  const float step = t.depth_step();
  RowWalk walk(t, tile);
  for (int row, begin, end; walk.next(row, begin, end);) {
    const float first = t.depth_at(begin, row);
    const std::size_t at = tile.index(begin, row);
    for (int i = 0; i < end - begin; ++i) {
      const float z = first + step * static_cast<float>(i);
      float& there = tile.depth[at + static_cast<std::size_t>(i)];
      if (tile.object == nullptr) {
        there = z > there ? z : there;
        continue;
      }
      std::uint32_t& owner = tile.object[at + static_cast<std::size_t>(i)];
      if (!(z > there || (z == there && t.object < owner))) continue;
      there = z;
      owner = t.object;
    }
  }
}

}  // namespace

ScreenCorner place_corner(const ScreenMap& map, const ClipPosition& p) {
  const double x_px = (p.x / p.w + 1) * map.half_width_px;
  const double y_px = (1 - p.y / p.w) * map.half_height_px;
  return {static_cast<std::int32_t>(std::nearbyint(x_px * kSubpixels)),
          static_cast<std::int32_t>(std::nearbyint(y_px * kSubpixels)), p.z / p.w};
}

void ScreenCorners::resize(std::size_t count) {
  x.resize(count);
  y.resize(count);
  depth.resize(count);
  outside.resize(count);
}

KernelPath kernel_path_for(const char* scarp_scalar) {
  return scarp_scalar != nullptr && *scarp_scalar != '\0' ? KernelPath::kPlain
                                                          : KernelPath::kVectors;
}
KernelPath kernel_path() {
  return path_in_use();
}
void set_kernel_path(KernelPath path) {
  path_in_use() = path;
}

void place_corners(const ScreenMap& map, std::span<const ClipPosition> corners, std::size_t begin,
                   std::size_t end, ScreenCorners& placed) {
  if (kernel_path() == KernelPath::kVectors && end - begin >= kMostLanes) {
    HWY_DYNAMIC_DISPATCH(place_now)(map, corners.data(), begin, end, placed);
    return;
  }
  for (std::size_t i = begin; i < end; ++i) place_plainly(map, corners[i], i, placed);
}

KernelPath fill_triangles(const PixelTile& tile, const ScreenTriangle* triangles,
                          std::span<const std::uint32_t> which) {
  if (kernel_path() == KernelPath::kVectors &&
      static_cast<std::size_t>(tile.right - tile.left) >= HWY_DYNAMIC_DISPATCH(lanes_now)()) {
    if (tile.object == nullptr)
      HWY_DYNAMIC_DISPATCH(fill_depth_now)(tile, triangles, which.data(), which.size());
    else
      HWY_DYNAMIC_DISPATCH(fill_objects_now)(tile, triangles, which.data(), which.size());
    return KernelPath::kVectors;
  }
  for (const std::uint32_t t : which) fill_plainly(tile, triangles[t]);
  return KernelPath::kPlain;
}

}  // namespace scarp
#endif
