#include "tiles/culling/culling_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <span>

#include "tiles/culling/least_heights.h"
#include "tiles/runtime/scarp_runtime.h"

namespace scarp {
namespace {

static_assert(std::endian::native == std::endian::little,
              "files are written as they are in memory");

/// Cameras are in reach at least so far from the frame's origin, metres, and at least so many
/// times as far as the scene goes.
constexpr double kLeastReachM = 250'000;
constexpr double kReachOfScene = 4;
constexpr int kMostUnitBits = 16;

/// Slopes beyond this are not kept: products stay below 2^53.
constexpr double kMostSlope = 0x1p26;

/// A square of ground for about this many triangles.
constexpr double kTrianglesACell = 2;
constexpr double kMostCellsAcross = 8192;

/// A group's numbers, in units.
struct Place {
  std::int32_t x, y, height;
  float inverse;
  std::int32_t low;
  std::uint32_t step;
};

using BoxOfSix = std::array<std::int32_t, 6>;
constexpr BoxOfSix kEmptyBox = {INT32_MAX, INT32_MAX, INT32_MAX, INT32_MIN, INT32_MIN, INT32_MIN};

void widen(BoxOfSix& box, const BoxOfSix& by) {
  for (std::size_t i = 0; i < 3; ++i) {
    box[i] = std::min(box[i], by[i]);
    box[i + 3] = std::max(box[i + 3], by[i + 3]);
  }
}

/// What the certified slope of a code is at run time (core/occlusion/certified): a float.
double certified_slope(const CertifiedGroup& group, std::int32_t code) {
  return static_cast<double>(slope_of(group, code)) * 0x1p20;
}

class Writer {
 public:
  explicit Writer(const CullingSource& source)
      : source_(source), regions_(source.groups->certified), tin_(source.ground->tin()) {
    choose_unit();
    order_tiles();
    place_groups();
    box_groups();
    take_heights();
  }

  std::vector<std::byte> bytes() const;

 private:
  double units(double metres) const { return metres * units_per_m_; }
  std::int32_t down(double metres) const {
    return static_cast<std::int32_t>(std::floor(units(metres)));
  }
  std::int32_t up(double metres) const {
    return static_cast<std::int32_t>(std::ceil(units(metres)));
  }

  void choose_unit();
  void order_tiles();
  void place_groups();
  void place_group(std::uint32_t group, std::size_t at);
  void box_groups();
  void take_heights();
  std::array<std::int32_t, 4> inner_of(const CullingTile& tile, std::size_t first_triangle) const;
  double straight_m(const Position& p) const;

  const CullingSource& source_;
  const CertifiedRegions& regions_;
  const Tin& tin_;
  int unit_bits_ = 0;
  double units_per_m_ = 1;
  std::vector<runtime::Tile> tiles_;
  std::vector<std::uint32_t> order_;  // groups of the scene in the order of the file
  std::vector<Place> places_;
  std::vector<BoxOfSix> boxes_, blocks_;
  std::vector<SectorSteps> steps_;
  // heights
  std::int32_t first_column_ = 0, first_row_ = 0, columns_ = 0, rows_ = 0;
  int cell_bits_ = 0, height_bits_ = 0;
  std::int32_t base_ = 0, highest_ = 0;
  std::vector<std::int16_t> heights_;
};

void Writer::choose_unit() {
  double reach_m = 1;
  for (const CullingTile& tile : source_.tiles)
    for (const Position& p : {tile.bounds.low, tile.bounds.high})
      reach_m = std::max({reach_m, std::abs(p.x_m), std::abs(p.y_m), std::abs(p.z_m)});
  reach_m = std::max(reach_m * kReachOfScene, kLeastReachM);
  unit_bits_ =
      std::clamp(static_cast<int>(std::floor(std::log2(0x1p31 / reach_m))), 0, kMostUnitBits);
  units_per_m_ = std::ldexp(1, unit_bits_);
}

/// Places in the order in which a quadtree is walked through.
std::uint64_t walked(std::uint32_t column, std::uint32_t row) {
  std::uint64_t place = 0;
  for (int bit = 0; bit < 32; ++bit) {
    place |= std::uint64_t{(column >> bit) & 1} << (2 * bit);
    place |= std::uint64_t{(row >> bit) & 1} << (2 * bit + 1);
  }
  return place;
}

/// Finest tiles in the order of the quadtree, so that the groups of any tile follow each other,
/// and in each its groups in the same way.
void Writer::order_tiles() {
  struct Finest {
    const CullingTile* tile;
    std::uint32_t first_group;
    std::size_t first_triangle;
  };
  std::vector<Finest> finest;
  std::uint32_t next_group = 0;
  std::size_t next_triangle = 0;
  int finest_level = 0;
  for (const CullingTile& tile : source_.tiles) {
    if (!tile.is_finest) continue;
    finest.push_back({&tile, next_group, next_triangle});
    next_group += tile.groups;
    next_triangle += tile.triangles;
    finest_level = std::max(finest_level, tile.id.level);
  }
  assert(next_group == regions_.groups.size() && next_triangle == tin_.triangles.size());
  const auto place_of = [](const TileId& id) {
    return walked(static_cast<std::uint32_t>(id.column), static_cast<std::uint32_t>(id.row));
  };
  std::sort(finest.begin(), finest.end(), [&](const Finest& a, const Finest& b) {
    return place_of(a.tile->id) < place_of(b.tile->id);
  });
  std::vector<std::uint64_t> places;
  std::vector<std::uint32_t> firsts;
  const auto add = [&](const CullingTile& tile, std::uint32_t flags, std::uint32_t first,
                       std::uint32_t count, const std::array<std::int32_t, 4>& inner) {
    const Position &low = tile.bounds.low, &high = tile.bounds.high;
    tiles_.push_back({static_cast<std::uint32_t>(tile.id.level),
                      static_cast<std::uint32_t>(tile.id.column),
                      static_cast<std::uint32_t>(tile.id.row),
                      flags,
                      first,
                      count,
                      {down(low.x_m), down(low.y_m), down(low.z_m)},
                      {up(high.x_m), up(high.y_m), up(high.z_m)},
                      {inner[0], inner[1], inner[2], inner[3]}});
  };
  for (const Finest& f : finest) {
    const auto begin = static_cast<std::uint32_t>(order_.size());
    for (std::uint32_t g = 0; g < f.tile->groups; ++g) order_.push_back(f.first_group + g);
    const auto place_in_tile = [&](std::uint32_t g) {
      const CertifiedGroup& group = regions_.groups[g];
      const Position &low = f.tile->bounds.low, &high = f.tile->bounds.high;
      const auto part = [](double at, double from, double to) {
        return static_cast<std::uint32_t>(
            std::clamp((at - from) / std::max(to - from, 1e-3), 0.0, 1.0) * 65535);
      };
      return walked(part(group.centre_x_m, low.x_m, high.x_m),
                    part(group.centre_y_m, low.y_m, high.y_m));
    };
    std::stable_sort(order_.begin() + begin, order_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return place_in_tile(a) < place_in_tile(b);
    });
    const std::span<const GroupIndex> group_of(
        source_.groups->group_of_triangle.data() + f.first_triangle, f.tile->triangles);
    const bool has_orphans = std::find(group_of.begin(), group_of.end(), kNone) != group_of.end();
    add(*f.tile, runtime::kIsFinest | (has_orphans ? runtime::kHasOrphans : 0), begin,
        f.tile->groups, inner_of(*f.tile, f.first_triangle));
    places.push_back(place_of(f.tile->id));
    firsts.push_back(begin);
  }
  firsts.push_back(static_cast<std::uint32_t>(order_.size()));
  constexpr std::array<std::int32_t, 4> kNowhere = {1, 1, 0, 0};
  for (const CullingTile& tile : source_.tiles) {
    if (tile.is_finest) continue;
    const int finer = 2 * (finest_level - tile.id.level);
    const std::uint64_t from = place_of(tile.id) << finer;
    const auto begin = std::lower_bound(places.begin(), places.end(), from) - places.begin();
    const auto end =
        std::lower_bound(places.begin(), places.end(), from + (std::uint64_t{1} << finer)) -
        places.begin();
    const std::uint32_t first = firsts[static_cast<std::size_t>(begin)];
    add(tile, 0, first, firsts[static_cast<std::size_t>(end)] - first, kNowhere);
  }
}

/// A rectangle that no border of a tile's ground runs through, with a place on its ground: from the
/// tile's bounds, each border cuts off the side where least is lost.
std::array<std::int32_t, 4> Writer::inner_of(const CullingTile& tile,
                                             std::size_t first_triangle) const {
  double low_x_m = tile.bounds.low.x_m, low_y_m = tile.bounds.low.y_m;
  double high_x_m = tile.bounds.high.x_m, high_y_m = tile.bounds.high.y_m;
  const auto is_own = [&](TriangleIndex t) {
    return t != kNone && t >= first_triangle && t < first_triangle + tile.triangles;
  };
  for (std::size_t t = first_triangle; t < first_triangle + tile.triangles; ++t)
    for (std::size_t i = 0; i < 3; ++i) {
      if (is_own(tin_.neighbours[t][i])) continue;
      const Position& a = tin_.vertices[tin_.triangles[t][(i + 1) % 3]];
      const Position& b = tin_.vertices[tin_.triangles[t][(i + 2) % 3]];
      const double left_m = std::min(a.x_m, b.x_m), right_m = std::max(a.x_m, b.x_m);
      const double below_m = std::min(a.y_m, b.y_m), above_m = std::max(a.y_m, b.y_m);
      if (right_m < low_x_m || left_m > high_x_m || above_m < low_y_m || below_m > high_y_m)
        continue;
      const double wide_m = high_x_m - low_x_m, deep_m = high_y_m - low_y_m;
      const std::array<double, 4> lost = {
          (right_m - low_x_m) * deep_m, (high_x_m - left_m) * deep_m, (above_m - low_y_m) * wide_m,
          (high_y_m - below_m) * wide_m};
      constexpr double kBesideM = 0x1p-10;
      switch (std::min_element(lost.begin(), lost.end()) - lost.begin()) {
        case 0:
          low_x_m = right_m + kBesideM;
          break;
        case 1:
          high_x_m = left_m - kBesideM;
          break;
        case 2:
          low_y_m = above_m + kBesideM;
          break;
        default:
          high_y_m = below_m - kBesideM;
      }
    }
  constexpr std::array<std::int32_t, 4> kNone4 = {1, 1, 0, 0};
  if (!(low_x_m < high_x_m && low_y_m < high_y_m)) return kNone4;
  const TriangleIndex middle = source_.ground->triangle_at(
      round_to_lattice((low_x_m + high_x_m) / 2), round_to_lattice((low_y_m + high_y_m) / 2));
  if (!is_own(middle)) return kNone4;
  const std::array<std::int32_t, 4> inner = {up(low_x_m) + 1, up(low_y_m) + 1, down(high_x_m) - 1,
                                             down(high_y_m) - 1};
  return inner[0] < inner[2] && inner[1] < inner[3] ? inner : kNone4;
}

void Writer::place_groups() {
  const std::size_t sectors = static_cast<std::size_t>(regions_.layout.sectors);
  places_.resize(order_.size());
  steps_.resize(order_.size() * sectors);
  for (std::size_t i = 0; i < order_.size(); ++i) place_group(order_[i], i);
}

/// Slopes rounded down so that the file's slope of each code is none above the certified one; what
/// is too steep is replaced by the steepest that is not, or by nothing.
void Writer::place_group(std::uint32_t g, std::size_t at) {
  const CertifiedGroup& group = regions_.groups[g];
  Place& place = places_[at];
  place.x = static_cast<std::int32_t>(std::floor(units(group.centre_x_m) + 0.5));
  place.y = static_cast<std::int32_t>(std::floor(units(group.centre_y_m) + 0.5));
  place.height = down(group.height_m);
  place.inverse = static_cast<float>(65536 / (static_cast<double>(group.radius_m) * units_per_m_));
  const double step = std::floor(static_cast<double>(group.slope_step) * 0x1p30);
  double low = std::floor(static_cast<double>(group.low_slope) * 0x1p20);
  const bool is_in_range = step < 0x1p31 && std::abs(low) < 0x1p30;
  place.step = is_in_range ? static_cast<std::uint32_t>(step) : 0;
  const auto file_slope = [&](std::int32_t code) {
    return low + std::floor((code - 1) * static_cast<double>(place.step) / 1024);
  };
  std::int32_t steepest = 0;
  if (is_in_range) {
    for (std::int32_t code = 1; code < kSlopeCodes; ++code)
      while (file_slope(code) > certified_slope(group, code)) --low;
    for (std::int32_t code = 1; code < kSlopeCodes; ++code)
      if (file_slope(code) <= kMostSlope) steepest = code;
  }
  place.low = is_in_range ? static_cast<std::int32_t>(low) : 0;
  const std::size_t sectors = static_cast<std::size_t>(regions_.layout.sectors);
  for (std::size_t s = 0; s < sectors; ++s) {
    const SectorSteps& from = regions_.steps[g * sectors + s];
    for (std::size_t i = 0; i < from.size(); ++i) {
      const std::int32_t code = std::min<std::int32_t>(from[i] & (kSlopeCodes - 1), steepest);
      const bool is_kept = code > 0 && file_slope(code) >= -kMostSlope;
      steps_[at * sectors + s][i] =
          static_cast<std::uint16_t>((from[i] & ~(kSlopeCodes - 1)) | (is_kept ? code : 0));
    }
  }
}

/// Height without refraction.
double Writer::straight_m(const Position& p) const {
  if (!source_.frame) return p.z_m;
  const double u = p.x_m / source_.frame->scale_m(), v = p.y_m / source_.frame->scale_m();
  const double square = u * u + v * v;
  return p.z_m - source_.frame->bend_m() * square / (std::sqrt(1 + square) + 1);
}

void Writer::box_groups() {
  std::vector<std::uint32_t> place_of(order_.size());
  for (std::uint32_t i = 0; i < order_.size(); ++i) place_of[order_[i]] = i;
  boxes_.assign(order_.size(), kEmptyBox);
  for (std::size_t t = 0; t < tin_.triangles.size(); ++t) {
    const GroupIndex group = source_.groups->group_of_triangle[t];
    if (group == kNone) continue;
    for (const VertexIndex v : tin_.triangles[t]) {
      const Position& p = tin_.vertices[v];
      // A unit more for what the height without refraction errs.
      const double z_m = straight_m(p);
      widen(boxes_[place_of[group]],
            {down(p.x_m), down(p.y_m), down(z_m) - 1, up(p.x_m), up(p.y_m), up(z_m) + 1});
    }
  }
  blocks_.assign(
      (order_.size() + runtime::detail::kBlockGroups - 1) / runtime::detail::kBlockGroups,
      kEmptyBox);
  for (std::size_t i = 0; i < boxes_.size(); ++i)
    widen(blocks_[i / runtime::detail::kBlockGroups], boxes_[i]);
}

/// The pyramid of least heights as whole numbers.
void Writer::take_heights() {
  if (tin_.triangles.empty()) return;
  const Bounds bounds = bounds_of(tin_.vertices);
  const double wide_m = bounds.high.x_m - bounds.low.x_m, deep_m = bounds.high.y_m - bounds.low.y_m;
  const double fine_m =
      std::sqrt(wide_m * deep_m * kTrianglesACell / static_cast<double>(tin_.triangles.size()));
  const double least_m = std::max({fine_m, std::max(wide_m, deep_m) / kMostCellsAcross, 1e-3});
  cell_bits_ = std::clamp(static_cast<int>(std::ceil(std::log2(units(least_m)))), 0, 30);
  const LeastHeights ground = least_heights(tin_, std::ldexp(1, cell_bits_ - unit_bits_));
  first_column_ = ground.first_column, first_row_ = ground.first_row;
  columns_ = ground.columns, rows_ = ground.rows;

  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const float h_m : ground.height_m)
    if (std::isfinite(h_m)) {
      low = std::min(low, units(static_cast<double>(h_m)));
      high = std::max(high, units(static_cast<double>(h_m)));
    }
  if (low > high) low = high = 0;
  while (std::ldexp(1, height_bits_) * 65'000 < high - low) ++height_bits_;
  const double step = std::ldexp(1, height_bits_);
  base_ = static_cast<std::int32_t>(std::floor((low + high) / 2));
  highest_ = -32767;
  for (const float h_m : ground.height_m) {
    std::int16_t code = runtime::detail::kNoHeight;
    if (std::isfinite(h_m))
      code =
          static_cast<std::int16_t>(std::floor((units(static_cast<double>(h_m)) - base_) / step));
    heights_.push_back(code);
    highest_ = std::max<std::int32_t>(highest_, code);
  }
  std::size_t finer = 0;
  for (std::int32_t columns = columns_, rows = rows_; columns > 1 || rows > 1;) {
    const std::int32_t across = (columns + 1) / 2, down_rows = (rows + 1) / 2;
    for (std::int32_t row = 0; row < down_rows; ++row)
      for (std::int32_t column = 0; column < across; ++column) {
        std::int16_t least = INT16_MAX;
        for (std::int32_t r = 2 * row; r < std::min(2 * row + 2, rows); ++r)
          for (std::int32_t c = 2 * column; c < std::min(2 * column + 2, columns); ++c)
            least = std::min(
                least,
                heights_[finer + static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) +
                         static_cast<std::size_t>(c)]);
        heights_.push_back(least);
      }
    finer += static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
    columns = across, rows = down_rows;
  }
}

/// Bytes that grow, little-endian.
class Bytes {
 public:
  template <class T>
  void put(std::size_t at, const T& value) {
    std::memcpy(bytes_.data() + at, &value, sizeof value);
  }
  void put(std::size_t at, const EcefPoint& p) {
    put(at, p.x_m), put(at + 8, p.y_m), put(at + 16, p.z_m);
  }
  void resize(std::size_t size) { bytes_.resize(size); }
  std::size_t size() const { return bytes_.size(); }
  const unsigned char* data() const {
    return reinterpret_cast<const unsigned char*>(bytes_.data());
  }
  std::vector<std::byte> take() { return std::move(bytes_); }

  /// At the next multiple of 64.
  void append(std::span<const std::byte> more) {
    resize((size() + 63) / 64 * 64);
    bytes_.insert(bytes_.end(), more.begin(), more.end());
  }

 private:
  std::vector<std::byte> bytes_;
};

std::vector<std::byte> Writer::bytes() const {
  Bytes bytes;
  bytes.resize(runtime::detail::kHeaderBytes);
  std::size_t sections = 0;
  const auto append = [&](const auto& values) {
    const std::span<const std::byte> section = std::as_bytes(std::span(values));
    bytes.append(section);
    bytes.put(192 + 4 * sections,
              runtime::detail::crc_of(reinterpret_cast<const unsigned char*>(section.data()),
                                      section.size()));
    ++sections;
  };
  const auto append_each = [&](auto member) {
    std::vector<std::remove_cvref_t<decltype(places_[0].*member)>> values;
    for (const Place& place : places_) values.push_back(place.*member);
    append(values);
  };
  append(tiles_);
  append_each(&Place::x);
  append_each(&Place::y);
  append_each(&Place::height);
  append_each(&Place::inverse);
  append_each(&Place::low);
  append_each(&Place::step);
  append(order_);
  std::vector<std::uint32_t> triangles(order_.size(), 0);
  {
    std::vector<std::uint32_t> of_group(order_.size(), 0);
    for (const GroupIndex g : source_.groups->group_of_triangle)
      if (g != kNone) ++of_group[g];
    for (std::size_t i = 0; i < order_.size(); ++i) triangles[i] = of_group[order_[i]];
  }
  append(triangles);
  append(boxes_);
  append(blocks_);
  append(steps_);
  append(heights_);
  assert(sections == runtime::detail::kSections);

  std::memcpy(const_cast<unsigned char*>(bytes.data()), "SCARPGRP", 8);
  bytes.put(8, runtime::detail::kVersionOfFile);
  bytes.put(12, runtime::detail::kHeaderBytes);
  bytes.put(16, std::uint64_t{bytes.size()});
  bytes.put(24, static_cast<std::uint32_t>(order_.size()));
  bytes.put(28, static_cast<std::uint32_t>(tiles_.size()));
  bytes.put(32, regions_.layout.sectors);
  bytes.put(36, regions_.layout.ring_bits);
  bytes.put(40, unit_bits_);
  bytes.put(44, std::uint32_t{source_.frame ? 1U : 0U});
  if (source_.frame) {
    bytes.put(48, source_.frame->origin());
    bytes.put(72, source_.frame->east());
    bytes.put(96, source_.frame->north());
    bytes.put(120, source_.frame->up());
  } else {
    bytes.put(48, source_.flat_origin);
    bytes.put(72, EcefPoint{1, 0, 0});
    bytes.put(96, EcefPoint{0, 1, 0});
    bytes.put(120, EcefPoint{0, 0, 1});
  }
  bytes.put(144, source_.frame ? source_.frame->scale_m() : 1.0);
  bytes.put(152, source_.frame ? source_.frame->bend_m() : 0.0);
  bytes.put(160, first_column_);
  bytes.put(164, first_row_);
  bytes.put(168, columns_);
  bytes.put(172, rows_);
  bytes.put(176, cell_bits_);
  bytes.put(180, base_);
  bytes.put(184, height_bits_);
  bytes.put(188, highest_);
  bytes.put(252, runtime::detail::crc_of(bytes.data(), 252));
  return bytes.take();
}

}  // namespace

std::vector<std::byte> culling_file(const CullingSource& source) {
  assert(source.groups->has_certified() || source.groups->leaf_count == 0);
  return Writer(source).bytes();
}

}  // namespace scarp
