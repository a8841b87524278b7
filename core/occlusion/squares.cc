#include "core/occlusion/squares.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <queue>
#include <utility>

namespace scarp {
namespace {

/// Centroids are multiples of a third of the lattice step: no square below that is divided.
constexpr double kSmallestHalfM = kLatticeStepM / 16;

/// A square and its triangles, which are a part of one array.
struct Square {
  double x_m, y_m;  // middle
  double half_m;
  std::size_t first, end;
};

/// Where a triangle is: three times its centroid, exact on the lattice.
struct Place {
  double x3_m, y3_m;
  TriangleIndex triangle;
};

std::vector<Place> centroids_of(const Tin& tin) {
  std::vector<Place> places;
  places.reserve(tin.triangles.size());
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
    Place place{0, 0, t};
    for (const VertexIndex v : tin.triangles[t]) {
      place.x3_m += tin.vertices[v].x_m;
      place.y3_m += tin.vertices[v].y_m;
    }
    places.push_back(place);
  }
  return places;
}

/// Sorts the square's places by quarter: south before north, west before east in each.
std::array<Square, 4> quarters_of(const Square& square, std::vector<Place>& places) {
  const auto at = [&](std::size_t i) { return places.begin() + static_cast<std::ptrdiff_t>(i); };
  const auto index = [&](auto it) { return static_cast<std::size_t>(it - places.begin()); };
  const auto south = [&](const Place& p) { return p.y3_m < 3 * square.y_m; };
  const auto west = [&](const Place& p) { return p.x3_m < 3 * square.x_m; };
  const auto north_first = std::stable_partition(at(square.first), at(square.end), south);
  const auto south_east = std::stable_partition(at(square.first), north_first, west);
  const auto north_east = std::stable_partition(north_first, at(square.end), west);
  const double half_m = square.half_m / 2;
  const auto quarter = [&](int x, int y, auto first, auto end) {
    return Square{square.x_m + x * half_m, square.y_m + y * half_m, half_m, index(first),
                  index(end)};
  };
  return {quarter(-1, -1, at(square.first), south_east), quarter(1, -1, south_east, north_first),
          quarter(-1, 1, north_first, north_east), quarter(1, 1, north_east, at(square.end))};
}

std::vector<Square> divide(const Tin& tin, std::vector<Place>& places, std::size_t wanted) {
  const Bounds bounds = bounds_of(tin.vertices);
  const double half_m =
      std::max(bounds.high.x_m - bounds.low.x_m, bounds.high.y_m - bounds.low.y_m) / 2;
  std::vector<Square> squares = {
      {bounds.low.x_m + half_m, bounds.low.y_m + half_m, half_m, 0, places.size()}};
  using Entry = std::pair<std::size_t, std::size_t>;  // triangles, and the lower index first
  std::priority_queue<Entry> largest;
  largest.push({places.size(), ~std::size_t{0}});
  std::size_t filled = 1;
  while (filled < wanted && !largest.empty() && largest.top().first > 1) {
    const std::size_t divided = ~largest.top().second;
    largest.pop();
    if (squares[divided].half_m < kSmallestHalfM) continue;
    --filled;
    bool in_place = true;
    for (const Square& quarter : quarters_of(squares[divided], places)) {
      if (quarter.first == quarter.end) continue;
      const std::size_t slot = in_place ? divided : squares.size();
      if (in_place)
        squares[divided] = quarter;
      else
        squares.push_back(quarter);
      in_place = false;
      largest.push({quarter.end - quarter.first, ~slot});
      ++filled;
    }
  }
  return squares;
}

}  // namespace

LeafGroups group_by_squares(const Tin& tin, std::uint32_t group_triangles) {
  assert(group_triangles > 0 && tin.neighbours.size() == tin.triangles.size());
  LeafGroups groups;
  groups.group_of_triangle.assign(tin.triangles.size(), kNone);
  if (tin.triangles.empty()) return groups;
  std::vector<Place> places = centroids_of(tin);
  const std::size_t wanted = std::max<std::size_t>(1, places.size() / group_triangles);
  const std::vector<Square> squares = divide(tin, places, wanted);
  groups.count = static_cast<std::uint32_t>(squares.size());
  groups.collisions.resize(groups.count);
  for (GroupIndex g = 0; g < groups.count; ++g)
    for (std::size_t i = squares[g].first; i < squares[g].end; ++i)
      groups.group_of_triangle[places[i].triangle] = g;
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
    const GroupIndex own = groups.group_of_triangle[t];
    for (const TriangleIndex n : tin.neighbours[t])
      if (n != kNone && n > t && groups.group_of_triangle[n] != own)
        count_collision(groups.collisions, own, groups.group_of_triangle[n]);
  }
  return groups;
}

}  // namespace scarp
