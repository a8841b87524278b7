#include "tiles/tileset/tileset_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <nlohmann/json.hpp>
#include <span>

#include "tiles/gltf/glb.h"
#include "tiles/tileset/metadata_schema.h"

namespace scarp {
namespace {

using json = nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little);

/// A subtree of so many levels has 5461 tiles: a file of about 2 MB where all are there.
constexpr std::int32_t kMostSubtreeLevels = 7;

std::int32_t levels_of(const TilesetTiles& tiles) {
  return tiles.empty() ? 0 : tiles.rbegin()->first.level + 1;
}

/// x in the even bits, y in the odd ones.
std::size_t morton(std::int32_t x, std::int32_t y) {
  std::size_t code = 0;
  for (unsigned bit = 0; bit < 24; ++bit)
    code |= (static_cast<std::size_t>(x) >> bit & 1) << (2 * bit) |
            (static_cast<std::size_t>(y) >> bit & 1) << (2 * bit + 1);
  return code;
}

/// Tiles of a subtree above its level `level`: 1 + 4 + ... = (4^level - 1) / 3.
std::size_t tiles_above(std::int32_t level) {
  return ((std::size_t{1} << (2 * level)) - 1) / 3;
}

/// One bit for each of so many things, the first in the lowest bit of the first byte.
class Bits {
 public:
  explicit Bits(std::size_t count) : count_(count), bytes_((count + 7) / 8) {}
  void set(std::size_t i) {
    bytes_[i / 8] |= std::byte{1} << (i % 8);
    ++set_;
  }
  std::size_t set() const { return set_; }
  bool is_constant() const { return set_ == 0 || set_ == count_; }
  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  std::size_t count_, set_ = 0;
  std::vector<std::byte> bytes_;
};

struct SubtreeTile {
  std::size_t bit;
  const TilesetTile* tile;
};

/// One subtree file: JSON, then a buffer of bits and of property tables.
class Subtree {
 public:
  Subtree(const TilesetTiles& tiles, const ImplicitPlace& root, std::int32_t levels)
      : tile_bits_(tiles_above(levels)),
        content_bits_(tiles_above(levels)),
        child_bits_(std::size_t{1} << (2 * levels)) {
    for (std::int32_t level = 0; level <= levels; ++level) {
      const std::int32_t side = 1 << level;
      const ImplicitPlace first{root.level + level, root.x * side, root.y * side};
      for (auto at = tiles.lower_bound(first);
           at != tiles.end() && at->first.level == first.level && at->first.x < first.x + side;
           ++at) {
        const ImplicitPlace& place = at->first;
        if (place.y < first.y || place.y >= first.y + side) continue;
        const std::size_t code = morton(place.x - first.x, place.y - first.y);
        if (level == levels)
          child_bits_.set(code);
        else
          tiles_.push_back({tiles_above(level) + code, &at->second});
      }
    }
    std::sort(tiles_.begin(), tiles_.end(),
              [](const SubtreeTile& a, const SubtreeTile& b) { return a.bit < b.bit; });
    for (const SubtreeTile& tile : tiles_) {
      tile_bits_.set(tile.bit);
      if (tile.tile->has_content) content_bits_.set(tile.bit);
    }
  }

  std::vector<std::byte> bytes(bool has_horizons) {
    add_tile_table();
    if (has_horizons && content_bits_.set() > 0) add_horizon_table();
    json out;
    out["propertyTables"] = tables_;
    out["tileAvailability"] = availability(tile_bits_);
    out["contentAvailability"] = json::array({availability(content_bits_)});
    out["childSubtreeAvailability"] = availability(child_bits_);
    out["tileMetadata"] = 0;
    if (tables_.size() > 1) out["contentMetadata"] = {1};
    buffer_.resize((buffer_.size() + 7) / 8 * 8);
    out["buffers"] = {{{"byteLength", buffer_.size()}}};
    out["bufferViews"] = views_;
    return file_bytes(out.dump());
  }

 private:
  std::size_t add_view(std::span<const std::byte> bytes) {
    const std::size_t offset = append_aligned(buffer_, bytes, 8);
    views_.push_back({{"buffer", 0}, {"byteOffset", offset}, {"byteLength", bytes.size()}});
    return views_.size() - 1;
  }

  json availability(const Bits& bits) {
    if (bits.is_constant()) return {{"constant", bits.set() > 0 ? 1 : 0}};
    return {{"bitstream", add_view(bits.bytes())}, {"availableCount", bits.set()}};
  }

  /// A column of a table: what `get` gives for each tile, or for each that has content.
  template <class T, class Get>
  void add_column(json& table, const char* name, bool of_content, Get get) {
    std::vector<T> values;
    for (const SubtreeTile& tile : tiles_)
      if (!of_content || tile.tile->has_content) values.push_back(get(*tile.tile));
    table["properties"][name] = {{"values", add_view(std::as_bytes(std::span(values)))}};
  }

  void add_tile_table() {
    json table = {{"class", "tile"}, {"count", tiles_.size()}};
    using Tile = TilesetTile;
    add_column<std::array<double, 12>>(table, "boundingBox", false,
                                       [](const Tile& t) { return t.facts.box.numbers(); });
    add_column<double>(table, "minimumHeight", false,
                       [](const Tile& t) { return t.facts.least_height_m; });
    add_column<double>(table, "maximumHeight", false,
                       [](const Tile& t) { return t.facts.greatest_height_m; });
    add_column<double>(table, "geometricError", false,
                       [](const Tile& t) { return t.geometric_error_m; });
    add_column<std::array<double, 3>>(
        table, "horizonOcclusionPoint", false, [](const Tile& t) -> std::array<double, 3> {
          const EcefPoint p = t.horizon_point.value_or(kNoHorizonPoint);
          return {p.x_m, p.y_m, p.z_m};
        });
    tables_.push_back(std::move(table));
  }

  void add_horizon_table() {
    json table = {{"class", "horizon"}, {"count", content_bits_.set()}};
    using Tile = TilesetTile;
    add_column<std::array<double, 2>>(table, "centre", true,
                                      [](const Tile& t) -> std::array<double, 2> {
                                        return {t.horizon->centre_x_m, t.horizon->centre_y_m};
                                      });
    add_column<double>(table, "height", true, [](const Tile& t) { return t.horizon->height_m; });
    add_column<double>(table, "radius", true, [](const Tile& t) { return t.horizon->radius_m; });
    add_column<std::array<float, kTilesetHorizon.cells()>>(
        table, "slopes", true, [](const Tile& t) {
          std::array<float, kTilesetHorizon.cells()> slopes;
          std::copy(t.horizon->slopes.begin(), t.horizon->slopes.end(), slopes.begin());
          return slopes;
        });
    tables_.push_back(std::move(table));
  }

  /// A header of 24 bytes, JSON padded with spaces, the buffer; both in multiples of 8.
  std::vector<std::byte> file_bytes(std::string text) const {
    text.resize((text.size() + 7) / 8 * 8, ' ');
    std::vector<std::byte> bytes;
    const auto append = [&](const auto& value) {
      const std::span<const std::byte> own = std::as_bytes(std::span(&value, 1));
      bytes.insert(bytes.end(), own.begin(), own.end());
    };
    append(std::uint32_t{0x74627573});  // "subt"
    append(std::uint32_t{1});
    append(std::uint64_t{text.size()});
    append(std::uint64_t{buffer_.size()});
    const std::span<const std::byte> json_bytes = std::as_bytes(std::span(text));
    bytes.insert(bytes.end(), json_bytes.begin(), json_bytes.end());
    bytes.insert(bytes.end(), buffer_.begin(), buffer_.end());
    return bytes;
  }

  /// What the schema says stands for no point (tile_class).
  static constexpr EcefPoint kNoHorizonPoint = {0, 0, 1e12};

  std::vector<SubtreeTile> tiles_;
  Bits tile_bits_, content_bits_, child_bits_;
  json tables_ = json::array(), views_ = json::array();
  std::vector<std::byte> buffer_;
};

json vector_of(const EcefPoint& p) {
  return {p.x_m, p.y_m, p.z_m};
}

}  // namespace

ImplicitPlace implicit_place(const TileId& tile, bool rows_fall) {
  const std::int32_t side = 1 << tile.level;
  return {tile.level, tile.column, rows_fall ? side - 1 - tile.row : tile.row};
}

std::string content_name(const ImplicitPlace& place) {
  return fmt::format("tiles/{}/{}/{}.glb", place.level, place.x, place.y);
}

std::int32_t subtree_levels(std::int32_t levels) {
  return std::clamp(levels, 1, kMostSubtreeLevels);
}

std::string tileset_json(const TilesetDescription& tileset, const TilesetTiles& tiles) {
  assert(tiles.contains(ImplicitPlace{}));
  const std::int32_t levels = levels_of(tiles);
  json out;
  out["asset"] = {{"version", "1.1"},
                  {"extras",
                   {{"generator", "scarp " SCARP_VERSION},
                    {"heights", tileset.heights},
                    {"datumShift", tileset.datum_shift}}}};
  json classes = {{"tileset", tileset_class()}, {"tile", tile_class()}};
  if (tileset.has_horizons) classes["horizon"] = horizon_class();
  out["schema"] = {{"id", "scarp_tileset"}, {"classes", std::move(classes)}};
  out["metadata"] = {{"class", "tileset"},
                     {"properties",
                      {{"heights", tileset.heights},
                       {"datumShift", tileset.datum_shift},
                       {"positionError", tileset.position_error_m},
                       {"refraction", tileset.refraction},
                       {"frameOrigin", vector_of(tileset.frame_origin)},
                       {"frameCentre", vector_of(tileset.frame_centre)}}}};
  out["geometricError"] = tileset.geometric_error_m;
  out["root"] = {{"transform", tileset.transform},
                 {"boundingVolume", {{"box", tileset.root_box.numbers()}}},
                 {"geometricError", tiles.at(ImplicitPlace{}).geometric_error_m},
                 {"refine", "REPLACE"},
                 {"content", {{"uri", "tiles/{level}/{x}/{y}.glb"}}},
                 {"implicitTiling",
                  {{"subdivisionScheme", "QUADTREE"},
                   {"availableLevels", levels},
                   {"subtreeLevels", subtree_levels(levels)},
                   {"subtrees", {{"uri", "subtrees/{level}/{x}/{y}.subtree"}}}}}};
  return out.dump(2) + "\n";
}

std::map<std::string, std::vector<std::byte>> subtree_files(const TilesetTiles& tiles,
                                                            bool has_horizons) {
  std::map<std::string, std::vector<std::byte>> files;
  const std::int32_t levels = subtree_levels(levels_of(tiles));
  for (const auto& [place, tile] : tiles)
    if (place.level % levels == 0)
      files[fmt::format("subtrees/{}/{}/{}.subtree", place.level, place.x, place.y)] =
          Subtree(tiles, place, levels).bytes(has_horizons);
  return files;
}

}  // namespace scarp
