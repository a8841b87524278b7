// Makes a city of a wanted size from the buildings of a real one, as GeoJSON, and says the
// rectangle that it takes: repeat_footprints FOOTPRINTS.geojson POLYGONS SEED OUT.geojson Polygons
// are counted as models of cities are: a roof and its walls. The densest square kilometre is
// repeated side by side, each time mirrored as the seed says; the last copy keeps the buildings
// nearest to its middle.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <vector>

#include "core/occlusion/splitmix64.h"

namespace {

constexpr double kSideM = 1000, kMetresPerDegree = 111'195;

/// A building in metres from the middle of the densest square.
struct Building {
  std::vector<std::array<double, 2>> outline;  // closed
  double height_m;

  std::size_t polygons() const { return outline.size(); }  // its walls and a roof
  double reach_m() const {
    double reach = 0;
    for (const auto& [x, y] : outline) reach = std::max({reach, std::abs(x), std::abs(y)});
    return reach;
  }
};

struct City {
  double longitude = 0, latitude = 0;  // of (0, 0)
  std::vector<Building> buildings;

  double metres_per_longitude() const {
    return kMetresPerDegree * std::cos(latitude * std::numbers::pi / 180);
  }
};

City densest_square(const nlohmann::json& footprints) {
  City city;
  const auto& features = footprints.at("features");
  std::size_t most = 0;
  const auto first = [](const nlohmann::json& f) { return f["geometry"]["coordinates"][0][0]; };
  const double scale = std::cos(double{first(features[0])[1]} * std::numbers::pi / 180);
  for (const auto& middle : features) {
    const double longitude = first(middle)[0], latitude = first(middle)[1];
    std::size_t around = 0;
    for (const auto& other : features)
      around +=
          std::abs(double{first(other)[0]} - longitude) * scale < kSideM / 2 / kMetresPerDegree &&
          std::abs(double{first(other)[1]} - latitude) < kSideM / 2 / kMetresPerDegree;
    if (around > most) most = around, city.longitude = longitude, city.latitude = latitude;
  }
  for (const auto& feature : features) {
    Building building{{}, feature["properties"]["height"]};
    for (const auto& p : feature["geometry"]["coordinates"][0])
      building.outline.push_back({(double{p[0]} - city.longitude) * city.metres_per_longitude(),
                                  (double{p[1]} - city.latitude) * kMetresPerDegree});
    if (building.reach_m() < kSideM / 2) city.buildings.push_back(building);
  }
  std::sort(city.buildings.begin(), city.buildings.end(),
            [](const Building& a, const Building& b) { return a.reach_m() < b.reach_m(); });
  return city;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 5) {
    fmt::print(stderr, "usage: repeat_footprints FOOTPRINTS.geojson POLYGONS SEED OUT.geojson\n");
    return 2;
  }
  std::ifstream in(arguments[1]);
  const City city = densest_square(nlohmann::json::parse(in));
  const auto wanted = static_cast<std::size_t>(std::atoll(arguments[2]));
  scarp::SplitMix64 random(static_cast<std::uint64_t>(std::atoll(arguments[3])));
  std::size_t in_square = 0;
  for (const Building& b : city.buildings) in_square += b.polygons();
  const std::size_t squares = (wanted + in_square - 1) / in_square;
  const auto across = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(squares))));
  nlohmann::json out = {{"type", "FeatureCollection"}, {"features", nlohmann::json::array()}};
  std::size_t made = 0;
  for (std::size_t s = 0; s < squares; ++s) {
    const double dx = kSideM * static_cast<double>(s % across);
    const double dy = kSideM * static_cast<double>(s / across);
    const double turn_x = random.unit() < 0.5 ? -1 : 1, turn_y = random.unit() < 0.5 ? -1 : 1;
    for (const Building& b : city.buildings) {
      if (made >= wanted) break;
      nlohmann::json ring = nlohmann::json::array();
      for (const auto& [x, y] : b.outline)
        ring.push_back({city.longitude + (turn_x * x + dx) / city.metres_per_longitude(),
                        city.latitude + (turn_y * y + dy) / kMetresPerDegree});
      out["features"].push_back({{"type", "Feature"},
                                 {"properties", {{"height", b.height_m}}},
                                 {"geometry", {{"type", "Polygon"}, {"coordinates", {ring}}}}});
      made += b.polygons();
    }
  }
  std::ofstream(arguments[4]) << out;
  // Half a side of ground around it.
  const double west = city.longitude - kSideM / city.metres_per_longitude();
  const double south = city.latitude - kSideM / kMetresPerDegree;
  const double size = kSideM * static_cast<double>(across + 1);
  fmt::print("{} {} {} {}\n", west, south + size / kMetresPerDegree,
             west + size / city.metres_per_longitude(), south);
  fmt::print(stderr, "{} polygons of {} buildings, {} squares\n", made, out["features"].size(),
             squares);
}
