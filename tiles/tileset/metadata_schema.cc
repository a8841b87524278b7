#include "tiles/tileset/metadata_schema.h"

#include "core/occlusion/certified/tile_horizon.h"

namespace scarp {
namespace {

using json = nlohmann::ordered_json;

json scalar(const char* component, const char* description) {
  return {{"type", "SCALAR"},
          {"componentType", component},
          {"required", true},
          {"description", description}};
}

json array_of(const char* component, std::size_t count, const char* description) {
  json property = scalar(component, description);
  property["array"] = true;
  property["count"] = count;
  return property;
}

json with_semantic(json property, const char* semantic) {
  property["semantic"] = semantic;
  return property;
}

json vector_of(const char* description) {
  json property = scalar("FLOAT64", description);
  property["type"] = "VEC3";
  return property;
}

}  // namespace

json group_class() {
  json group = {{"name", "Group"}, {"description", "Triangles that are hidden together"}};
  json& p = group["properties"];
  p["group"] = scalar("UINT32", "Number of the group in the scene");
  p["triangles"] = scalar("UINT32", "How many triangles it has");
  p["firstTriangle"] =
      scalar("UINT32", "Its first triangle in the mesh; the others follow without a gap");
  p["minimumHeight"] = scalar("FLOAT64", "Least height above the ellipsoid, metres");
  p["maximumHeight"] = scalar("FLOAT64", "Greatest height above the ellipsoid, metres");
  p["region"] = array_of("FLOAT64", 4, "West, south, east, north, radians on WGS 84");
  return group;
}

json tile_class() {
  json tile = {{"name", "Tile"}};
  json& p = tile["properties"];
  p["boundingBox"] = with_semantic(array_of("FLOAT64", 12, "Holds the tile and all below it"),
                                   "TILE_BOUNDING_BOX");
  p["minimumHeight"] = with_semantic(scalar("FLOAT64", "Least height above the ellipsoid, metres"),
                                     "TILE_MINIMUM_HEIGHT");
  p["maximumHeight"] = with_semantic(
      scalar("FLOAT64", "Greatest height above the ellipsoid, metres"), "TILE_MAXIMUM_HEIGHT");
  p["geometricError"] =
      with_semantic(scalar("FLOAT64", "Greatest distance from the ground as measured, metres"),
                    "TILE_GEOMETRIC_ERROR");
  json point = vector_of(
      "Where the ellipsoid hides this point, it hides the tile and all below it; of the scaled "
      "space in which the ellipsoid is the unit sphere");
  point["required"] = false;
  // Far away, so that a reader that does not know of noData culls next to nothing by it.
  point["noData"] = {0, 0, 1e12};
  p["horizonOcclusionPoint"] = with_semantic(std::move(point), "TILE_HORIZON_OCCLUSION_POINT");
  return tile;
}

json horizon_class() {
  json horizon = {
      {"name", "Certified horizon"},
      {"description",
       "Where cameras see nothing of a tile for certain, in the scene's flattened frame: with "
       "(x, y, z) the camera, d its distance from `centre` in x and y and 12 rings of d from "
       "radius * sqrt(2)^ring on, its azimuth counter-clockwise from +x in 16 equal sectors, the "
       "camera is hidden where z < height + slopes[sector * 12 + ring] * d"}};
  json& p = horizon["properties"];
  json centre = scalar("FLOAT64", "Metres in the plane of the frame");
  centre["type"] = "VEC2";
  p["centre"] = std::move(centre);
  p["height"] = scalar("FLOAT64", "What slopes start from, metres in the frame");
  p["radius"] = scalar("FLOAT64", "Of a circle that holds the tile, metres in the frame");
  p["slopes"] = array_of("FLOAT32", kTilesetHorizon.cells(),
                         "Rings within sectors; -3e38 where nothing is known to be hidden");
  return horizon;
}

json tileset_class() {
  json set = {{"name", "Scarp scene"}};
  json& p = set["properties"];
  json heights = {{"type", "STRING"},
                  {"required", true},
                  {"description", "How heights of the source became heights above the ellipsoid"}};
  p["heights"] = heights;
  json shift = heights;
  shift["description"] = "Transformation from the source's datum to WGS 84, or none";
  p["datumShift"] = shift;
  p["positionError"] = scalar(
      "FLOAT64", "Greatest rounding of a coordinate of the finest level, metres; doubles a level");
  p["refraction"] = scalar("FLOAT64", "Coefficient that the frame bends rays by");
  p["frameOrigin"] = vector_of("Where the frame's verticals meet, EPSG:4978, metres");
  p["frameCentre"] = vector_of("The scene's centre, where the frame's z is 0, EPSG:4978, metres");
  return set;
}

}  // namespace scarp
