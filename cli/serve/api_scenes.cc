#include <fmt/format.h>

#include <charconv>

#include "cli/serve/api.h"
#include "cli/serve/map_tiles.h"
#include "cli/serve/problem.h"
#include "tiles/store/checksum.h"

namespace scarp {
namespace {

using nlohmann::json;

json parameter(const char* description, json schema, bool is_required = false) {
  return {{"description", description}, {"schema", std::move(schema)}, {"required", is_required}};
}

std::int64_t whole_number(const std::string& text) {
  std::int64_t value = -1;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  return failure == std::errc() && end == text.data() + text.size() ? value : -1;
}

/// Throws Refusal{400, 404}.
MapTile tile_of(const Call& call) {
  const std::int64_t zoom = whole_number(call.path.at("z"));
  if (zoom < 0 || zoom > kDeepestZoom)
    throw Refusal(404, fmt::format("zoom {} is not there; 0 to {} was expected", call.path.at("z"),
                                   kDeepestZoom));
  const MapTile tile{static_cast<int>(zoom), whole_number(call.path.at("x")),
                     whole_number(call.path.at("y"))};
  const std::int64_t count = std::int64_t{1} << zoom;
  if (tile.x < 0 || tile.y < 0 || tile.x >= count || tile.y >= count)
    throw Refusal(
        404, fmt::format("tile {}/{}/{} is not there", zoom, call.path.at("x"), call.path.at("y")));
  return tile;
}

bool is_layer(const ServedScene& scene, const std::string& layer) {
  return layer == "hillshade" || layer == "terrain-rgb" || layer == "viewshed" ||
         ((layer == "groups" || layer == "group-ids") && scene.is_scene());
}

/// The deepest zoom that shows more than the one before.
int deepest_of(const ServedScene& scene) {
  const double world_m = tile_box(0, 0, 0).east_m * 2;
  const double zoom = std::ceil(std::log2(world_m / kTilePx / scene.map().pixel_m()));
  return static_cast<int>(std::clamp(zoom, 1.0, double{kDeepestZoom} - 2));
}

}  // namespace

json Api::scene_json(const Call& call, const ServedScene& scene) const {
  json description = scene.description();
  const std::string own = "/scenes/" + encode_segment(scene.name());
  json links = json::array();
  links.push_back(link(call, "self", own));
  for (const char* layer : {"hillshade", "terrain-rgb", "groups", "group-ids"})
    if (is_layer(scene, layer))
      links.push_back(link(call, layer, own + "/tiles/" + layer + ".json"));
  links.push_back(link(call, "height", own + "/height"));
  if (scene.is_scene()) links.push_back(link(call, "files", own + "/files"));
  if (tilesets_.contains(scene.name()))
    links.push_back(link(call, "3dtiles", own + "/3dtiles/tileset.json"));
  description["links"] = std::move(links);
  return description;
}

json Api::collection_json(const Call& call, const ServedScene& scene) const {
  const std::string own = "/collections/" + encode_segment(scene.name());
  const auto& b = scene.bounds();
  return {
      {"id", scene.name()},
      {"title", scene.name()},
      {"extent",
       {{"spatial",
         {{"bbox", json::array({json::array({b[0], b[1], b[2], b[3]})})},
          {"crs", "http://www.opengis.net/def/crs/OGC/1.3/CRS84"}}}}},
      {"links",
       {link(call, "self", own),
        link(call, "http://www.opengis.net/def/rel/ogc/1.0/tilesets-map", own + "/map/tiles")}}};
}

void Api::add_scene_routes() {
  const json none = json::object();
  add({"GET", "/scenes", "scenes", "All scenes", none, false, [this](Call& call) {
         json all = json::array();
         for (const auto& scene : scenes_->all()) all.push_back(scene_json(call, *scene));
         return json_response({{"scenes", all}, {"links", {link(call, "self", "/scenes")}}});
       }});
  add({"GET", "/scenes/{name}", "scene", "One scene", none, false, [this](Call& call) {
         return json_response(scene_json(call, scenes_->require(call.path["name"])));
       }});
  json at;
  at["at"] = parameter("LON,LAT in degrees", {{"type", "string"}, {"maxLength", 100}}, true);
  add({"GET", "/scenes/{name}/height", "height", "Height of the ground at a place", at, false,
       [this](Call& call) {
         const ServedScene& scene = scenes_->require(call.path["name"]);
         const TypedPosition place = position_of(call.query["at"]);
         const auto ground_m = scene.ground_m({place.x, place.y});
         return json_response({{"ground_m", ground_m ? json(*ground_m) : json()}});
       }});
  add({"GET", "/scenes/{name}/files", "files", "What can be downloaded of a scene", none, false,
       [this](Call& call) {
         const ServedScene& scene = scenes_->require(call.path["name"]);
         json files = json::array();
         if (const SceneTiles* tiles = scene.source().scene_tiles()) {
           const SceneDescription& description = tiles->scene().description();
           const auto list = [&](const std::string& name, const std::string& kind, json bytes) {
             files.push_back({{"name", name},
                              {"kind", kind},
                              {"bytes", std::move(bytes)},
                              {"href", call.origin + "/scenes/" + encode_segment(scene.name()) +
                                           "/files/" + name}});
           };
           list("scene.json", "json", nullptr);
           list("report.json", "json", nullptr);
           for (const StoredFile& file : description.layers) list(file.name, file.kind, file.size);
           for (const SceneTile& tile : description.tiles)
             for (const StoredFile& file : tile.files) list(file.name, file.kind, file.size);
         }
         return json_response({{"files", files}});
       }});
  const auto from_folder = [this](const auto& folders, Call& call, const char* what) {
    const ServedScene& scene = scenes_->require(call.path["name"]);
    const auto folder = folders.find(scene.name());
    if (folder == folders.end())
      return problem(404, fmt::format("scene '{}': has no {}", scene.name(), what));
    return folder->second->respond(*call.request, call.rest);
  };
  add({"GET", "/scenes/{name}/files/{+rest}", "file", "A file of a scene; a part of it by Range",
       none, false, [this, from_folder](Call& call) { return from_folder(files_, call, "files"); },
       "application/octet-stream"});
  add({"GET", "/scenes/{name}/3dtiles/{+rest}", "tileset",
       "3D Tiles of a scene, where they are served", none, false,
       [this, from_folder](Call& call) { return from_folder(tilesets_, call, "3D tiles"); },
       "application/octet-stream"});
}

void Api::add_tile_routes() {
  // A viewshed's inputs, as a query.
  json view = json::object();
  for (const auto& [name, input] : require_process("viewshed").inputs.items()) {
    if (name == "scene") continue;
    const bool is_list = name == "observers";
    view[is_list ? "observer" : name] = {
        {"description", input["description"]}, {"schema", input["schema"]}, {"required", is_list}};
    if (is_list) view["observer"]["explode"] = true;
  }
  json optional_view = view;
  optional_view["observer"]["required"] = false;
  optional_view["v"] = parameter("Version of the tiles; a known one may be kept for long",
                                 {{"type", "string"}, {"maxLength", 64}});
  for (const char* ending : {"png", "tif", "geojson", "json"})
    add({"GET", fmt::format("/scenes/{{name}}/viewshed.{}", ending),
         fmt::format("viewshed-{}", ending), "What eyes see, as process viewshed has it", view,
         true, [this](Call& call) { return viewshed_of_query(call); },
         std::string(ending) == "png"   ? "image/png"
         : std::string(ending) == "tif" ? "image/tiff"
                                        : "application/json"});
  add({"GET", "/scenes/{name}/tiles/{layer}.json", "tilejson",
       "TileJSON of a layer: hillshade, terrain-rgb, groups, group-ids, or viewshed with its query",
       optional_view, false, [this](Call& call) { return tile_json(call); }});
  add({"GET", "/scenes/{name}/tiles/{layer}/{z}/{x}/{y}.png", "tile",
       "A tile of 256 x 256 pixels in web mercator", optional_view, true,
       [this](Call& call) { return tile(call, call.path["layer"], tile_of(call)); }, "image/png"});
  add({"GET", "/collections", "collections", "The scenes, as OGC API - Common names them",
       json::object(), false, [this](Call& call) {
         json all = json::array();
         for (const auto& scene : scenes_->all()) all.push_back(collection_json(call, *scene));
         return json_response(
             {{"collections", all}, {"links", {link(call, "self", "/collections")}}});
       }});
  add({"GET", "/collections/{name}", "collection", "One of them", json::object(), false,
       [this](Call& call) {
         return json_response(collection_json(call, scenes_->require(call.path["name"])));
       }});
  add({"GET", "/collections/{name}/map/tiles", "tilesets", "Its tilesets: one", json::object(),
       false, [this](Call& call) {
         const std::string& name = scenes_->require(call.path["name"]).name();
         json tileset = {{"title", name},
                         {"dataType", "map"},
                         {"crs", "http://www.opengis.net/def/crs/EPSG/0/3857"},
                         {"tileMatrixSetURI",
                          "http://www.opengis.net/def/tilematrixset/OGC/1.0/WebMercatorQuad"}};
         json item = link(call, "item",
                          "/collections/" + encode_segment(name) +
                              "/map/tiles/WebMercatorQuad/{tileMatrix}/{tileRow}/{tileCol}",
                          "image/png");
         item["templated"] = true;
         tileset["links"] = json::array({std::move(item)});
         return json_response({{"tilesets", json::array({std::move(tileset)})}});
       }});
  for (const char* pattern : {"/collections/{name}/map/tiles/WebMercatorQuad/{z}/{y}/{x}",
                              "/collections/{name}/map/tiles/WebMercatorQuad/{z}/{y}/{x}.png"})
    add({"GET", pattern, std::string(pattern).ends_with("png") ? "map-tile-png" : "map-tile",
         "The same tile of layer hillshade, as OGC API - Tiles names it", json::object(), true,
         [this](Call& call) { return tile(call, "hillshade", tile_of(call)); }, "image/png"});
}

/// The query of a viewshed as inputs of the process.
HttpResponse Api::viewshed_of_query(Call& call) {
  static const std::map<std::string, std::size_t> kFormats = {
      {"viewshed.json", 0}, {"viewshed.png", 1}, {"viewshed.tif", 2}, {"viewshed.geojson", 3}};
  json inputs = call.query;
  inputs["observers"] = inputs["observer"];
  inputs.erase("observer");
  inputs["scene"] = scenes_->require(call.path["name"]).name();
  const Process& process = require_process("viewshed");
  const std::size_t format = kFormats.at(call.target.segments.back());
  return run(process, inputs, process.formats[format], false, {}, call.origin);
}

HttpResponse Api::tile_json(Call& call) const {
  const ServedScene& scene = scenes_->require(call.path["name"]);
  const std::string& layer = call.path["layer"];
  if (!is_layer(scene, layer))
    throw Refusal(
        404, fmt::format("layer '{}': is not there; hillshade, terrain-rgb{} was expected", layer,
                         scene.is_scene() ? ", groups, group-ids" : ""));
  std::string query = "?v=" + version_;
  if (layer == "viewshed") {
    if (!call.query.contains("observer"))
      throw Refusal(400, "query: 'observer' is missing: LON,LAT[,H] of an eye was expected");
    for (const auto& [name, value] : call.target.query)
      if (name != "v") query += "&" + encode_segment(name) + "=" + encode_segment(value);
  }
  const auto& b = scene.bounds();
  const int deepest = deepest_of(scene);
  json description = {{"tilejson", "3.0.0"},
                      {"name", scene.name() + " " + layer},
                      {"scheme", "xyz"},
                      {"tiles",
                       {call.origin + "/scenes/" + encode_segment(scene.name()) + "/tiles/" +
                        layer + "/{z}/{x}/{y}.png" + query}},
                      {"minzoom", 0},
                      {"maxzoom", deepest},
                      {"bounds", b},
                      {"center", {(b[0] + b[2]) / 2, (b[1] + b[3]) / 2, std::max(0, deepest - 3)}},
                      {"tileSize", kTilePx},
                      {"vector_layers", json::array()}};
  if (layer == "terrain-rgb") {
    description["encoding"] = "mapbox";
    description["description"] = "height_m = -10000 + (65536 R + 256 G + B) 0.1";
  } else if (layer == "group-ids") {
    description["description"] =
        "group = 65536 R + 256 G + B; 16777215: in no group, and always drawn";
  }
  return json_response(description);
}

HttpResponse Api::tile(Call& call, const std::string& layer, const MapTile& at) {
  const ServedScene& scene = scenes_->require(call.path["name"]);
  if (!is_layer(scene, layer)) throw Refusal(404, fmt::format("layer '{}': is not there", layer));
  json query = call.query;
  const bool is_known_version = query.value("v", std::string()) == version_;
  query.erase("v");
  const std::string name = fmt::format("{}/{}/{}/{}/{}?{}", scene.name(), layer, at.zoom, at.x,
                                       at.y, layer == "viewshed" ? query.dump() : "");
  std::shared_ptr<const StoredTile> stored = tiles_.find(name);
  if (!stored) {
    auto made = std::make_shared<StoredTile>();
    if (layer == "hillshade") {
      made->png = hillshade_tile(scene, at);
    } else if (layer == "terrain-rgb") {
      made->png = terrain_rgb_tile(scene, at);
    } else if (layer == "groups") {
      made->png = groups_tile(scene, at);
    } else if (layer == "group-ids") {
      made->png = group_numbers_tile(scene, at);
    } else {
      if (!query.contains("observer"))
        throw Refusal(400, "query: 'observer' is missing: LON,LAT[,H] of an eye was expected");
      query["observers"] = query["observer"];
      query.erase("observer");
      query["scene"] = scene.name();
      const auto view = views_.look(*scenes_, query, {});
      made->png = seen_tile(scene, *view->raster, at);
    }
    require_not_stopped();
    made->etag =
        "\"" + to_hex(checksum_of(std::as_bytes(std::span(made->png)))).substr(0, 20) + "\"";
    tiles_.put(name, made, made->png.size());
    stored = made;
  }
  HttpResponse response;
  response.set("Content-Type", "image/png");
  response.set("ETag", stored->etag);
  response.set("Cache-Control", is_known_version ? "public, max-age=86400, immutable" : "no-cache");
  // The cache and the answer share the bytes.
  response.body = std::shared_ptr<const std::string>(stored, &stored->png);
  return response;
}

}  // namespace scarp
