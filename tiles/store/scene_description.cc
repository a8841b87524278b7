#include "tiles/store/scene_description.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "core/error/error.h"

namespace scarp {
namespace {

using Json = nlohmann::ordered_json;  // members in the order in which they are added

constexpr std::string_view kChecksumStart = ",\n  \"checksum\": \"";
constexpr std::string_view kChecksumEnd = "\"\n}\n";
constexpr std::size_t kChecksumDigits = 32;

// ---- what may be said ----

bool is_proper_name(const std::string& name) {
  if (name.empty() || name.front() == '/' || name.back() == '/' || name.size() > 1024) return false;
  for (std::size_t start = 0; start <= name.size();) {
    const std::size_t end = std::min(name.find('/', start), name.size());
    const std::string part = name.substr(start, end - start);
    if (part.empty() || part == "." || part == "..") return false;
    start = end + 1;
  }
  return std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '/' ||
           c == '.' || c == '-' || c == '_';
  });
}

template <class Numbers>
bool all_finite(const Numbers& numbers) {
  return std::ranges::all_of(numbers, [](double x) { return std::isfinite(x); });
}

std::optional<std::string> check_file(const StoredFile& file, std::set<std::string>& names) {
  if (!is_proper_name(file.name))
    return fmt::format("file name \"{}\" is not relative, of letters, digits, '/', '.', '-', '_'",
                       file.name);
  if (file.name == kSceneJson || !names.insert(file.name).second)
    return fmt::format("file \"{}\" is listed twice", file.name);
  if (file.kind.empty()) return fmt::format("file \"{}\" has no kind", file.name);
  return {};
}

std::optional<std::string> check_files(const SceneDescription& scene) {
  std::set<std::string> names, ids;
  for (const SceneTile& tile : scene.tiles) {
    if (!tile_named(tile.id)) return fmt::format("tile id \"{}\" is not level/column/row", tile.id);
    if (!ids.insert(tile.id).second) return fmt::format("tile \"{}\" is listed twice", tile.id);
    if (tile.contents && !(all_finite(tile.contents->low) && all_finite(tile.contents->high)))
      return fmt::format("the bounds of tile \"{}\" are not finite", tile.id);
    for (const StoredFile& file : tile.files) {
      if (auto wrong = check_file(file, names)) return wrong;
    }
  }
  for (const StoredFile& file : scene.layers) {
    if (auto wrong = check_file(file, names)) return wrong;
  }
  return {};
}

// ---- out ----

Json to_json(const StoredFile& file) {
  return {{"name", file.name},
          {"kind", file.kind},
          {"size", file.size},
          {"xxh128", to_hex(file.checksum)}};
}

Json to_json(const std::vector<StoredFile>& files) {
  Json list = Json::array();
  for (const StoredFile& file : files) list.push_back(to_json(file));
  return list;
}

Json to_json(const SceneTile& tile) {
  Json json = {{"id", tile.id}, {"files", to_json(tile.files)}};
  if (tile.contents)
    json["contents"] = {{"low", tile.contents->low},
                        {"high", tile.contents->high},
                        {"vertices", tile.contents->vertices},
                        {"triangles", tile.contents->triangles},
                        {"groups", tile.contents->groups}};
  return json;
}

Json to_json(const EarthModel& earth) {
  return {{"model", earth.shape == EarthShape::kEllipsoid ? "ellipsoid" : "flat"},
          {"refraction", earth.refraction},
          {"geoid", earth.geoid},
          {"centre", earth.centre}};
}

Json to_json(const std::map<std::string, ParameterValue>& parameters) {
  Json object = Json::object();
  for (const auto& [name, value] : parameters)
    std::visit([&, &key = name](const auto& v) { object[key] = v; }, value);
  return object;
}

// ---- in ----

/// Where in the text the reading is, for messages: "earth.refraction".
struct Place {
  const Json& value;
  std::string path;
  const std::string& file;

  [[noreturn]] void fail(const std::string& found) const {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("'{}': {}{}{}; restore it from a copy or build the scene again", file,
                            path, path.empty() ? "" : " ", found));
  }

  Place at(const char* key) const {
    if (!value.is_object()) fail("is not an object");
    const auto found = value.find(key);
    const std::string below = path.empty() ? key : path + "." + key;
    if (found == value.end()) Place{value, below, file}.fail("is missing");
    return {*found, below, file};
  }

  std::string text() const {
    if (!value.is_string()) fail("is not a text");
    return value.get<std::string>();
  }

  double number() const {
    if (!value.is_number()) fail("is not a number");
    return value.get<double>();
  }

  std::uint64_t size() const {
    if (!value.is_number_unsigned()) fail("is not a whole number from 0");
    return value.get<std::uint64_t>();
  }

  std::int32_t count() const {
    const std::uint64_t found = size();
    if (found > 0x7fffffffU) fail("is out of range");
    return static_cast<std::int32_t>(found);
  }

  Checksum checksum() const {
    const std::optional<Checksum> found = checksum_from_hex(text());
    if (!found) fail("is not a checksum of 32 hexadecimal digits");
    return *found;
  }

  template <std::size_t n>
  std::array<double, n> numbers() const {
    std::array<double, n> result{};
    if (!value.is_array() || value.size() != n) fail(fmt::format("is not a list of {} numbers", n));
    for (std::size_t i = 0; i < n; ++i) result[i] = Place{value[i], path, file}.number();
    return result;
  }

  template <class Read>
  auto list(Read read) const {
    if (!value.is_array()) fail("is not a list");
    std::vector<decltype(read(*this))> result;
    for (std::size_t i = 0; i < value.size(); ++i)
      result.push_back(read(Place{value[i], fmt::format("{}[{}]", path, i), file}));
    return result;
  }
};

StoredFile stored_file_from(const Place& place) {
  return {place.at("name").text(), place.at("kind").text(), place.at("size").size(),
          place.at("xxh128").checksum()};
}

SourceFile source_from(const Place& place) {
  return {place.at("name").text(), place.at("size").size(), place.at("xxh128").checksum()};
}

TileContents contents_from(const Place& place) {
  TileContents contents;
  contents.low = place.at("low").numbers<3>();
  contents.high = place.at("high").numbers<3>();
  contents.vertices = place.at("vertices").size();
  contents.triangles = place.at("triangles").size();
  contents.groups = place.at("groups").size();
  return contents;
}

SceneTile tile_from(const Place& place) {
  SceneTile tile{place.at("id").text(), place.at("files").list(stored_file_from), {}};
  if (place.value.contains("contents")) tile.contents = contents_from(place.at("contents"));
  return tile;
}

EarthModel earth_from(const Place& place) {
  EarthModel earth;
  const std::string model = place.at("model").text();
  if (model != "ellipsoid" && model != "flat")
    place.at("model").fail(fmt::format("is \"{}\" where ellipsoid or flat was expected", model));
  earth.shape = model == "flat" ? EarthShape::kFlat : EarthShape::kEllipsoid;
  earth.refraction = place.at("refraction").number();
  earth.geoid = place.at("geoid").text();
  earth.centre = place.at("centre").numbers<3>();
  return earth;
}

ParameterValue parameter_from(const Place& place) {
  const Json& value = place.value;
  if (value.is_boolean()) return value.get<bool>();
  if (value.is_number_unsigned() && value.get<std::uint64_t>() > 0x7fffffffffffffffU)
    place.fail("is out of range");
  if (value.is_number_integer()) return value.get<std::int64_t>();
  if (value.is_number_float()) return value.get<double>();
  return place.text();
}

std::map<std::string, ParameterValue> parameters_from(const Place& place) {
  if (!place.value.is_object()) place.fail("is not an object");
  std::map<std::string, ParameterValue> parameters;
  for (const auto& [name, value] : place.value.items())
    parameters[name] = parameter_from({value, place.path + "." + name, place.file});
  return parameters;
}

/// The text's checksum is over the text with the digits of the checksum itself left out.
Checksum checksum_of_text(std::string_view before, std::string_view after) {
  ChecksumStream stream;
  stream.add(std::as_bytes(std::span(before)));
  stream.add(std::as_bytes(std::span(after)));
  return stream.checksum();
}

bool checksum_fits(std::string_view text) {
  const std::size_t end_size = kChecksumEnd.size() + kChecksumDigits;
  if (text.size() < kChecksumStart.size() + end_size || !text.ends_with(kChecksumEnd)) return false;
  const std::string_view before = text.substr(0, text.size() - end_size);
  const std::string_view digits = text.substr(before.size(), kChecksumDigits);
  return before.ends_with(kChecksumStart) &&
         to_hex(checksum_of_text(before, kChecksumEnd)) == digits;
}

}  // namespace

TileId tile_id(const SceneTile& tile) {
  const std::optional<TileId> id = tile_named(tile.id);
  assert(id);
  return *id;
}

std::vector<std::size_t> finest_tiles(const SceneDescription& scene) {
  std::int32_t finest = 0;
  for (const SceneTile& tile : scene.tiles) finest = std::max(finest, tile_id(tile).level);
  std::vector<std::size_t> tiles;
  for (std::size_t i = 0; i < scene.tiles.size(); ++i)
    if (tile_id(scene.tiles[i]).level == finest) tiles.push_back(i);
  std::ranges::sort(tiles, {}, [&](std::size_t i) { return tile_id(scene.tiles[i]); });
  return tiles;
}

std::optional<std::string> check_description(const SceneDescription& scene) {
  if (!(scene.earth.refraction >= 0 && scene.earth.refraction <= 1))
    return fmt::format("refraction {} is not in 0 to 1", scene.earth.refraction);
  if (!all_finite(scene.earth.centre)) return "the frame's centre is not finite";
  if (scene.raster.columns < 1 || scene.raster.rows < 1)
    return fmt::format("a raster of {} x {} samples", scene.raster.columns, scene.raster.rows);
  if (!all_finite(scene.raster.geotransform)) return "the geotransform is not finite";
  for (const auto& [name, value] : scene.parameters) {
    const double* number = std::get_if<double>(&value);
    if (number != nullptr && !std::isfinite(*number))
      return fmt::format("parameter \"{}\" is not finite", name);
  }
  return check_files(scene);
}

std::string scene_to_json(const SceneDescription& scene) {
  assert(!check_description(scene));
  Json sources = Json::array();
  for (const SourceFile& source : scene.sources)
    sources.push_back(
        {{"name", source.name}, {"size", source.size}, {"xxh128", to_hex(source.checksum)}});
  Json tiles = Json::array();
  for (const SceneTile& tile : scene.tiles) tiles.push_back(to_json(tile));
  const Json json = {{"format", "scarp scene"},
                     {"version", kSceneVersion},
                     {"made_by", scene.made_by},
                     {"crs", scene.crs_wkt},
                     {"earth", to_json(scene.earth)},
                     {"raster",
                      {{"columns", scene.raster.columns},
                       {"rows", scene.raster.rows},
                       {"geotransform", scene.raster.geotransform}}},
                     {"parameters", to_json(scene.parameters)},
                     {"sources", std::move(sources)},
                     {"tiles", std::move(tiles)},
                     {"layers", to_json(scene.layers)}};
  std::string text = json.dump(2, ' ', false, Json::error_handler_t::replace);
  text.resize(text.size() - 2);  // the closing "\n}", which follows the checksum
  text += kChecksumStart;
  const Checksum checksum = checksum_of_text(text, kChecksumEnd);
  return text + to_hex(checksum) + std::string(kChecksumEnd);
}

SceneDescription scene_from_json(std::string_view text, const std::string& name) {
  const Json json = Json::parse(text, nullptr, false);
  const Place root{json, "", name};
  if (json.is_discarded()) root.fail("it is not JSON");
  if (root.at("format").text() != "scarp scene") root.at("format").fail("is not \"scarp scene\"");
  if (root.at("version").count() != kSceneVersion)
    root.at("version").fail(
        fmt::format("is {} where {} was expected", root.at("version").count(), kSceneVersion));
  if (!checksum_fits(text))
    root.fail("its checksum does not fit: it was damaged, or edited by hand");
  SceneDescription scene;
  scene.made_by = root.at("made_by").text();
  scene.crs_wkt = root.at("crs").text();
  scene.earth = earth_from(root.at("earth"));
  scene.raster.columns = root.at("raster").at("columns").count();
  scene.raster.rows = root.at("raster").at("rows").count();
  scene.raster.geotransform = root.at("raster").at("geotransform").numbers<6>();
  scene.parameters = parameters_from(root.at("parameters"));
  scene.sources = root.at("sources").list(source_from);
  scene.tiles = root.at("tiles").list(tile_from);
  scene.layers = root.at("layers").list(stored_file_from);
  if (const auto wrong = check_description(scene)) root.fail(*wrong);
  return scene;
}

}  // namespace scarp
