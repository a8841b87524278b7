#include "ingest/footprints/footprints.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>

#include "core/error/error.h"
#include "core/geodesy/predicates.h"
#include "core/threads/parallel_for.h"
#include "ingest/mesh/mesh_walls.h"
#include "tests/support/shared_data.h"
#include "tests/support/temp_folder.h"

namespace scarp {
namespace {

using test::TempFolder;
using Height = std::function<double(double x, double y)>;

struct Place {
  std::string crs;  // empty: flat earth without CRS
  double x = 0, y = 0, cell = 1;
  std::int32_t columns = 41, rows = 31;
};

Dem make_dem(const Place& at, const Height& height) {
  Dem dem;
  dem.columns = at.columns;
  dem.rows = at.rows;
  dem.geotransform = {at.x, at.cell, 0, at.y, 0, -at.cell};
  for (std::int32_t r = 0; r < at.rows; ++r)
    for (std::int32_t c = 0; c < at.columns; ++c)
      dem.heights_m.push_back(height(dem.x_of(c), dem.y_of(r)));
  dem.known.assign(dem.heights_m.size(), 1);
  FrameDescription frame;
  frame.crs_wkt = at.crs;
  frame.earth = at.crs.empty() ? Earth::kFlat : Earth::kEllipsoid;
  frame.centre_x = dem.x_of((at.columns - 1) / 2.0);
  frame.centre_y = dem.y_of((at.rows - 1) / 2.0);
  dem.frame = std::make_shared<const GeoFrame>(frame);
  return dem;
}

const Height kLevel = [](double, double) { return 100.0; };

std::vector<std::array<double, 2>> box(double x0, double y0, double x1, double y1) {
  return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
}

/// A DEM with buildings on it and all that is made of them.
struct Town {
  Dem dem;
  SampleGrid grid;
  WallsAndRoofs walls;
  Mesh mesh;
  std::vector<std::string> warnings;

  explicit Town(Dem made) : dem(std::move(made)), grid(place_samples(dem)) {}

  void build(const std::vector<Footprint>& footprints, double max_error_m = 0.1) {
    finish(build_walls(footprints, dem, grid, max_error_m, warnings), max_error_m);
  }
  void finish(WallsAndRoofs built, double max_error_m) {
    walls = std::move(built);
    EXPECT_EQ(check_walls(grid, walls), std::nullopt);
    MeshOptions options;
    options.max_error_m = max_error_m;
    mesh = mesh_with_walls(grid, options, walls, {});
    EXPECT_EQ(check_tin(mesh.tin), std::nullopt);
    EXPECT_LE(mesh.error_at_samples_m, max_error_m);
    EXPECT_LE(mesh.error_over_surface_m, max_error_m);
    // Chords along the border of a bent grid leave it by a little.
    EXPECT_NEAR(area_m2([](const auto&) { return true; }), grid_area_m2(), 1e-6 * grid_area_m2());
    if (grid.positions.size() < 4000) judge_ground(max_error_m);
  }

  /// Brute force: the surface against the ground at every sample that is not covered, and in every
  /// cell that no wall comes near against both readings of the cell.
  void judge_ground(double max_error_m) const {
    std::vector<std::uint8_t> near_wall(grid.positions.size(), 0), vertex(near_wall);
    for (const auto& [a, b] : walls.edges) {
      const WallVertex &p = walls.vertices[a], &q = walls.vertices[b];
      for (double c = std::floor(std::min(p.column, q.column)); c <= std::max(p.column, q.column);
           ++c)
        for (double r = std::floor(std::min(p.row, q.row)); r <= std::max(p.row, q.row); ++r)
          near_wall[grid.index(static_cast<std::int32_t>(c), static_cast<std::int32_t>(r))] = 1;
    }
    for (const std::int64_t sample : mesh.sample_of_vertex)
      if (sample >= 0) vertex[static_cast<std::size_t>(sample)] = 1;
    for (std::int32_t r = 0; r + 1 < grid.rows; ++r) {
      for (std::int32_t c = 0; c + 1 < grid.columns; ++c) {
        const std::size_t i = grid.index(c, r), j = grid.index(c, r + 1);
        if (!walls.covered[i] && r > 0 && c > 0) {
          ASSERT_LE(std::abs(height_over(grid.positions[i]) - grid.positions[i].z_m),
                    max_error_m + 1e-6);
        }
        if (near_wall[i] || walls.covered[i] || walls.covered[i + 1] || walls.covered[j] ||
            walls.covered[j + 1] || (vertex[i] && vertex[i + 1] && vertex[j] && vertex[j + 1]))
          continue;
        for (const auto& [u, v] : {std::array{0.5, 0.5}, {0.25, 0.625}, {0.875, 0.25}}) {
          const auto mix = [&](auto value) {
            const double nw = value(i), ne = value(i + 1), sw = value(j), se = value(j + 1);
            const double one = u + v <= 1 ? nw + u * (ne - nw) + v * (sw - nw)
                                          : se + (1 - u) * (sw - se) + (1 - v) * (ne - se);
            const double other =
                v <= u ? nw + u * (ne - nw) + v * (se - ne) : nw + v * (sw - nw) + u * (se - sw);
            return std::pair(one, other);
          };
          const auto x = mix([&](std::size_t k) { return grid.positions[k].x_m; }).first;
          const auto y = mix([&](std::size_t k) { return grid.positions[k].y_m; }).first;
          const auto z = mix([&](std::size_t k) { return grid.positions[k].z_m; });
          const double surface = height_over(round_to_lattice(Position{x, y, 0}));
          ASSERT_LE(std::abs(surface - z.first), max_error_m + 0.002) << c << "," << r;
          ASSERT_LE(std::abs(surface - z.second), max_error_m + 0.002) << c << "," << r;
        }
      }
    }
  }

  double grid_area_m2() const {
    double twice = 0;
    for (std::int32_t r = 0; r + 1 < grid.rows; ++r) {
      for (std::int32_t c = 0; c + 1 < grid.columns; ++c) {
        const Position &nw = grid.at(c, r), &se = grid.at(c + 1, r + 1), &ne = grid.at(c + 1, r),
                       &sw = grid.at(c, r + 1);
        twice += (ne.x_m - sw.x_m) * (nw.y_m - se.y_m) - (ne.y_m - sw.y_m) * (nw.x_m - se.x_m);
      }
    }
    return twice / 2;
  }

  /// Area of the triangles that a test of their three corners accepts.
  template <class Accepts>
  double area_m2(const Accepts& accepts) const {
    double area = 0;
    for (const auto& [a, b, c] : mesh.tin.triangles) {
      const std::array<Position, 3> t{mesh.tin.vertices[a], mesh.tin.vertices[b],
                                      mesh.tin.vertices[c]};
      if (accepts(t))
        area += 0.5 * ((t[1].x_m - t[0].x_m) * (t[2].y_m - t[0].y_m) -
                       (t[1].y_m - t[0].y_m) * (t[2].x_m - t[0].x_m));
    }
    return area;
  }
  /// Area of the triangles that lie flat at a height.
  double roof_area_m2(double z_m) const {
    return area_m2(
        [&](const auto& t) { return t[0].z_m == z_m && t[1].z_m == z_m && t[2].z_m == z_m; });
  }
  /// Brute force: height of the surface at a place of the map; the highest of triangles that meet.
  double height_at(double x, double y) const {
    return height_over(GeoFrame::Placer(*dem.frame).place({x, y, 0}));
  }
  double height_over(const Position& p) const {
    double found = -1e9;
    for (const auto& [ia, ib, ic] : mesh.tin.triangles) {
      const Position &a = mesh.tin.vertices[ia], &b = mesh.tin.vertices[ib],
                     &c = mesh.tin.vertices[ic];
      if (orient2d(a, b, p) < 0 || orient2d(b, c, p) < 0 || orient2d(c, a, p) < 0) continue;
      const double whole = (b.x_m - a.x_m) * (c.y_m - a.y_m) - (b.y_m - a.y_m) * (c.x_m - a.x_m);
      const double at_b =
          ((p.x_m - a.x_m) * (c.y_m - a.y_m) - (p.y_m - a.y_m) * (c.x_m - a.x_m)) / whole;
      const double at_c =
          ((b.x_m - a.x_m) * (p.y_m - a.y_m) - (b.y_m - a.y_m) * (p.x_m - a.x_m)) / whole;
      found = std::max(found, a.z_m + at_b * (b.z_m - a.z_m) + at_c * (c.z_m - a.z_m));
    }
    return found;
  }
  double volume_m3(double above_m) const {
    double volume = 0;
    for (const auto& [ia, ib, ic] : mesh.tin.triangles) {
      const Position &a = mesh.tin.vertices[ia], &b = mesh.tin.vertices[ib],
                     &c = mesh.tin.vertices[ic];
      const double area =
          0.5 * ((b.x_m - a.x_m) * (c.y_m - a.y_m) - (b.y_m - a.y_m) * (c.x_m - a.x_m));
      volume += area * ((a.z_m + b.z_m + c.z_m) / 3 - above_m);
    }
    return volume;
  }
  bool warned(const std::string& part) const {
    for (const std::string& w : warnings)
      if (w.find(part) != std::string::npos) return true;
    return false;
  }
};

TEST(BuildWalls, SquareOnLevelGroundHasExactAreasAndVolume) {
  Town town(make_dem({}, kLevel));
  town.build({{{box(10, -20, 20, -10)}, 8}});
  EXPECT_EQ(town.walls.buildings, 1U);
  EXPECT_EQ(town.walls.vertices.size(), 8U);
  EXPECT_TRUE(town.warnings.empty());
  const double run = town.walls.run_m;
  EXPECT_EQ(run, kWallRunM);
  const double roof = (10 - 2 * run) * (10 - 2 * run);
  EXPECT_DOUBLE_EQ(town.roof_area_m2(108), roof);
  EXPECT_DOUBLE_EQ(town.roof_area_m2(100), town.grid_area_m2() - 100);
  // a truncated pyramid
  EXPECT_NEAR(town.volume_m3(100), 8.0 / 3 * (100 + roof + 10 * (10 - 2 * run)), 1e-9);
  EXPECT_EQ(town.height_at(15, -15), 108);
  EXPECT_EQ(town.height_at(9.9, -15), 100);
}

TEST(BuildWalls, OnASlopeTheRoofIsLevelAboveTheLowestGroundAndWallsFollowTheGround) {
  const auto slope = [](double x, double y) { return 100 + 0.25 * x + 0.125 * y; };
  Town town(make_dem({}, slope));
  town.build({{{box(10.5, -20.25, 20, -10)}, 8}}, 0.01);
  const double level = slope(10.5, -20.25) + 8;
  const double run = town.walls.run_m;
  EXPECT_NEAR(town.roof_area_m2(round_to_lattice(level)), (9.5 - 2 * run) * (10.25 - 2 * run),
              1e-6);
  for (const WallVertex& v : town.walls.vertices) {
    const double ground = slope(town.dem.x_of(v.column), town.dem.y_of(v.row));
    EXPECT_NEAR(v.position.z_m, v.on_roof ? level : ground, kLatticeStepM);
  }
  EXPECT_EQ(town.walls.vertices.size(), 8U);  // a plane needs no corner between
}

TEST(BuildWalls, FootStaysWithinItsErrorOnRoughGround) {
  const auto rough = [](double x, double y) { return 3 * std::sin(x / 3) + 2 * std::cos(y / 2); };
  for (const double error_m : {0.5, 0.05, 0.0}) {
    Town town(make_dem({}, rough));
    town.build({{{{{6.3, -22}, {31, -24.7}, {30, -6}, {8, -9}}}, 12}}, std::max(error_m, 0.02));
    WallsAndRoofs walls = build_walls({{{{{6.3, -22}, {31, -24.7}, {30, -6}, {8, -9}}}, 12}},
                                      town.dem, town.grid, error_m, town.warnings);
    double worst_m = 0;
    const auto bilinear = [&](double column, double row) {
      const auto c = static_cast<std::int32_t>(column), r = static_cast<std::int32_t>(row);
      const double u = column - c, w = row - r;
      return (1 - w) * ((1 - u) * town.grid.at(c, r).z_m + u * town.grid.at(c + 1, r).z_m) +
             w * ((1 - u) * town.grid.at(c, r + 1).z_m + u * town.grid.at(c + 1, r + 1).z_m);
    };
    for (const auto& [ia, ib] : walls.edges) {
      const WallVertex &a = walls.vertices[ia], &b = walls.vertices[ib];
      if (a.on_roof || b.on_roof) continue;
      for (double t = 0; t <= 1; t += 1.0 / 256) {
        const double z = a.position.z_m + t * (b.position.z_m - a.position.z_m);
        worst_m = std::max(worst_m, std::abs(z - bilinear(a.column + t * (b.column - a.column),
                                                          a.row + t * (b.row - a.row))));
      }
    }
    // between its probes, half a piece of a cell, the bilinear ground bends by a few centimetres
    EXPECT_LT(worst_m, error_m + 0.03);
    EXPECT_GT(worst_m, error_m / 4);
  }
}

TEST(BuildWalls, RoofNeverLiesUnderTheGroundAtItsOutline) {
  Town town(make_dem({}, [](double x, double) { return x; }));
  town.build({{{box(10, -20, 30, -10)}, 3}});
  EXPECT_TRUE(town.warned("1 roofs raised"));
  EXPECT_EQ(town.height_at(20, -15), 30);
}

TEST(BuildWalls, CourtyardIsGround) {
  Town town(make_dem({}, kLevel));
  town.build({{{box(5, -25, 35, -5), box(15, -18, 25, -12)}, 10}});
  EXPECT_EQ(town.walls.buildings, 1U);
  EXPECT_EQ(town.height_at(20, -15), 100);
  EXPECT_EQ(town.height_at(10, -15), 110);
  const double run = town.walls.run_m;
  EXPECT_DOUBLE_EQ(town.roof_area_m2(110),
                   (30 - 2 * run) * (20 - 2 * run) - (10 + 2 * run) * (6 + 2 * run));
  EXPECT_DOUBLE_EQ(town.roof_area_m2(100), town.grid_area_m2() - 30 * 20 + 10 * 6);
  // samples of the courtyard are ground, but for those a wall stands on
  EXPECT_EQ(town.walls.covered[town.grid.index(19, 15)], 0);
  EXPECT_EQ(town.walls.covered[town.grid.index(9, 15)], 1);
}

TEST(BuildWalls, TouchingBuildingsOfOneLevelBecomeOne) {
  Town town(make_dem({}, kLevel));
  town.build({{{box(10, -20, 20, -10)}, 8}, {{box(20, -25, 30, -12)}, 8}});
  EXPECT_EQ(town.walls.buildings, 1U);
  EXPECT_EQ(town.height_at(20, -15), 108);
  const double run = town.walls.run_m;
  EXPECT_DOUBLE_EQ(town.roof_area_m2(108),
                   100 + 130 - run * (40 + 46 - 2 * 8) + run * run * (6 - 2));
}

TEST(BuildWalls, SmallGapsAndOverlapsBetweenNeighboursClose) {
  Town town(make_dem({}, kLevel));
  town.build({{{box(10, -20, 20.004, -10)}, 8},
              {{box(20, -20, 25, -10)}, 8},
              {{box(25.007, -20, 30, -10)}, 8}});
  EXPECT_EQ(town.walls.buildings, 1U);
  EXPECT_EQ(town.roof_area_m2(100), town.grid_area_m2() - 200);
}

TEST(BuildWalls, WhereTwoOverlapTheHigherWins) {
  Town town(make_dem({}, kLevel));
  town.build({{{box(10, -20, 22, -8)}, 5}, {{box(18, -16, 30, -4)}, 20}});
  EXPECT_EQ(town.walls.buildings, 2U);
  EXPECT_EQ(town.height_at(20, -14), 120);
  EXPECT_EQ(town.height_at(12, -14), 105);
  EXPECT_EQ(town.height_at(12, -7), 100);
  const double run = town.walls.run_m;
  EXPECT_DOUBLE_EQ(town.roof_area_m2(120), (12 - 2 * run) * (12 - 2 * run));
  // The lower roof runs up to the higher wall: only its own outer walls take from it.
  EXPECT_NEAR(town.roof_area_m2(105), (12 - 2 * run) * (12 - 2 * run) - (4 - run) * (8 - run),
              0.01);
  EXPECT_DOUBLE_EQ(town.roof_area_m2(100), town.grid_area_m2() - 144 - 144 + 32);
}

TEST(BuildWalls, ATowerInsideAPodium) {
  Town town(make_dem({}, kLevel));
  town.build({{{box(5, -25, 35, -5)}, 10}, {{box(15, -18, 25, -12)}, 60}});
  EXPECT_EQ(town.walls.buildings, 2U);
  const double run = town.walls.run_m;
  EXPECT_DOUBLE_EQ(town.roof_area_m2(160), (10 - 2 * run) * (6 - 2 * run));
  EXPECT_DOUBLE_EQ(town.roof_area_m2(110), (30 - 2 * run) * (20 - 2 * run) - 60);
}

TEST(BuildWalls, SliversAndBuildingsWithoutRoomForARoofAreDropped) {
  Town town(make_dem({}, kLevel));
  town.build({{{box(10, -20, 20, -10)}, 8},
              {{box(30, -20, 30.5, -19.5)}, 8},     // a quarter of a square metre
              {{box(25, -20, 25.1, -8)}, 8},        // ten centimetres wide
              {{box(10, -20.25, 20, -10)}, 7.5}});  // a ledge, wide enough
  EXPECT_TRUE(town.warned("2 slivers"));
  EXPECT_EQ(town.walls.buildings, 2U);
  EXPECT_EQ(town.height_at(30.25, -19.75), 100);
}

TEST(BuildWalls, BowTieIsRepaired) {
  Town town(make_dem({}, kLevel));
  town.build({{{{{10, -20}, {20, -10}, {20, -20}, {10, -10}}}, 8}});
  EXPECT_EQ(town.height_at(11, -15), 108);
  EXPECT_EQ(town.height_at(19, -15), 108);
  EXPECT_EQ(town.height_at(15, -11), 100);
}

TEST(BuildWalls, OutlineWithASpikeIsCutAtTheBorder) {
  Town town(make_dem({}, kLevel));
  town.build(
      {{{{{-4, -20}, {20, -20}, {20, -12}, {30, -12}, {20, -12}, {20, -10}, {-4, -10}}}, 8}});
  EXPECT_EQ(town.walls.buildings, 1U);
  EXPECT_EQ(town.height_at(5, -15), 108);
  EXPECT_EQ(town.height_at(25, -12), 100);
}

TEST(BuildWalls, CutWhereTheGroundEnds) {
  Dem dem = make_dem({}, kLevel);
  for (std::int32_t r = 10; r < 20; ++r)
    for (std::int32_t c = 20; c < 25; ++c)
      dem.known[static_cast<std::size_t>(r * dem.columns + c)] = 0;
  Town town(std::move(dem));
  std::vector<std::string> warnings;
  town.walls = build_walls({{{box(-5, -28, 10, -15)}, 8},     // over the western border
                            {{box(15, -18, 30, -14)}, 9},     // across a hole
                            {{box(21, -16, 23, -14)}, 9},     // in the hole
                            {{box(500, -28, 510, -15)}, 8}},  // elsewhere
                           town.dem, town.grid, 0.1, town.warnings);
  EXPECT_EQ(check_walls(town.grid, town.walls), std::nullopt);
  EXPECT_TRUE(town.warned("2 footprints left out, not on the ground"));
  EXPECT_EQ(town.walls.buildings, 3U);  // the hole divides one
  MeshOptions options;
  options.max_error_m = 0.1;
  town.mesh = mesh_with_walls(town.grid, options, town.walls, {});
  EXPECT_EQ(check_tin(town.mesh.tin), std::nullopt);
  EXPECT_EQ(town.height_at(2, -20), 108);
  EXPECT_EQ(town.height_at(17, -16), 109);
  EXPECT_EQ(town.height_at(28, -16), 109);
  EXPECT_EQ(town.height_at(22, -16), -1e9);
}

/// Greatest height of the footprints that hold a place, 0 for none, and how far the nearest outline
/// is.
std::pair<double, double> highest_over(const std::vector<Footprint>& footprints, double x,
                                       double y) {
  double highest = 0, nearest = 1e9;
  for (const Footprint& f : footprints) {
    bool inside = false;
    for (const auto& ring : f.rings) {
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const auto& [ax, ay] = ring[i];
        const auto& [bx, by] = ring[(i + 1) % ring.size()];
        const double length2 = (bx - ax) * (bx - ax) + (by - ay) * (by - ay);
        const double along = (x - ax) * (bx - ax) + (y - ay) * (by - ay);
        const double t = length2 == 0 ? 0 : std::clamp(along / length2, 0.0, 1.0);
        nearest = std::min(nearest, std::hypot(x - ax - t * (bx - ax), y - ay - t * (by - ay)));
        if ((ay > y) != (by > y) && x < ax + (y - ay) / (by - ay) * (bx - ax)) inside = !inside;
      }
    }
    if (inside) highest = std::max(highest, f.height_m);
  }
  return {highest, nearest};
}

/// Random towns: whatever is thrown at it, walls and mesh are sound, and far from walls the surface
/// is the highest roof over a place or the ground.
TEST(BuildWalls, RandomTownsAreSoundAndTheHighestRoofWins) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(0, 1);
  for (int round = 0; round < 30; ++round) {
    const bool snapped = round % 3 == 0;  // corners on metres: shared edges and corners
    const auto at = [&](double low, double high) {
      const double v = low + (high - low) * any(random);
      return snapped ? std::round(v) : v;
    };
    std::vector<Footprint> footprints;
    for (int i = 0; i < 14; ++i) {
      const double x = at(3, 36), y = at(-28, -5), r = at(2, 9);
      std::vector<std::array<double, 2>> ring;
      const int corners = 3 + static_cast<int>(any(random) * 6);
      const double turn = any(random) * 6;
      for (int k = 0; k < corners; ++k) {
        const double angle = turn + 2 * M_PI * k / corners;
        double px = x + r * std::cos(angle), py = y + r * std::sin(angle);
        if (snapped) px = std::round(px), py = std::round(py);
        ring.push_back({px, py});
      }
      footprints.push_back({{ring}, 3.0 + std::floor(any(random) * 5)});
    }
    Town town(make_dem({}, [](double x, double y) { return 0.1 * std::sin(x) * std::cos(y); }));
    town.build(footprints, 0.05);
    EXPECT_FALSE(town.warned("too near")) << "round " << round;
    for (int probe = 0; probe < 60; ++probe) {
      const double x = 1 + 38 * any(random), y = -29 + 28 * any(random);
      const auto [expected, nearest] = highest_over(footprints, x, y);
      if (nearest < 0.8) continue;  // walls, their feet, and slivers
      EXPECT_NEAR(town.height_at(x, y), expected, 0.35) << x << "," << y << " round " << round;
    }
  }
}

/// Rings of random points cross themselves and each other everywhere, at any scale of the cells.
TEST(BuildWalls, TangledOutlinesAreSoundAtAnyCellSize) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(0, 1);
  std::uint32_t pieces = 0, dropped = 0;
  for (const double cell : {0.2, 1.0, 30.0, 1000.0}) {
    for (int round = 0; round < 4; ++round) {
      const Place at{round % 2 ? "EPSG:32633" : "", 400'000, 5'000'000, cell, 21, 31};
      Town town(make_dem(at, [&](double x, double y) {
        return cell * (std::sin(x / cell / 2) + std::cos(y / cell));
      }));
      std::vector<Footprint> footprints;
      for (int i = 0; i < 12; ++i) {
        const double x = at.x + cell * 20 * any(random), y = at.y - cell * 30 * any(random);
        const double reach = std::min(20 * cell, 60.0) * any(random);
        Footprint f;
        f.height_m = 1 + std::floor(4 * any(random));
        f.rings.resize(1);
        for (int k = 0; k < 3 + i; ++k)
          f.rings[0].push_back({x + reach * any(random), y + reach * any(random)});
        footprints.push_back(f);
      }
      town.build(footprints, 0.05 * cell);
      pieces += town.walls.buildings;
      dropped += town.warned("too near");
    }
  }
  EXPECT_GT(pieces, 200U);
  EXPECT_EQ(dropped, 0U);
}

TEST(BuildWalls, SameBitsForAnyThreadCount) {
  Town town(make_dem({}, kLevel));
  std::vector<Footprint> footprints;
  for (int i = 0; i < 12; ++i)
    footprints.push_back({{box(2.3 + 3 * i, -20, 4.1 + 3 * i, -10.0 + 0.3 * i)}, 8.0 + i % 3});
  set_thread_count(1);
  town.build(footprints);
  const WallsAndRoofs one = town.walls;
  set_thread_count(5);
  town.build(footprints);
  set_thread_count(0);
  ASSERT_EQ(one.vertices.size(), town.walls.vertices.size());
  for (std::size_t i = 0; i < one.vertices.size(); ++i)
    EXPECT_EQ(one.vertices[i].position, town.walls.vertices[i].position);
  EXPECT_EQ(one.edges, town.walls.edges);
  EXPECT_EQ(one.covered, town.walls.covered);
}

TEST(MeshWithWalls, WithAVertexBudgetTheErrorBesideBuildingsIsNotWorse) {
  Town town(make_dem({}, [](double x, double y) { return 3 * std::sin(x / 4) + std::cos(y / 2); }));
  town.build({{{box(10, -20, 20, -10)}, 8}, {{box(14, -14, 30, -4)}, 20}});
  MeshOptions options;
  options.vertex_budget = 200;
  const Mesh ground = mesh_samples(town.grid, options, {});
  town.mesh = mesh_with_walls(town.grid, options, town.walls, {});
  EXPECT_EQ(check_tin(town.mesh.tin), std::nullopt);
  EXPECT_GT(town.mesh.error_at_samples_m, 0);
  EXPECT_LE(town.mesh.error_at_samples_m, ground.error_at_samples_m);
  EXPECT_GE(town.mesh.error_over_surface_m, town.mesh.error_at_samples_m);
  const auto corners =
      std::count(town.mesh.sample_of_vertex.begin(), town.mesh.sample_of_vertex.end(), -1);
  EXPECT_EQ(static_cast<std::size_t>(corners), town.walls.vertices.size());
  EXPECT_EQ(town.mesh.sample_of_vertex.back(), -1);
}

TEST(MeshWithWalls, WithoutBuildingsIsTheMeshOfTheGround) {
  Town town(make_dem({}, [](double x, double y) { return std::sin(x) + std::cos(y); }));
  MeshOptions options;
  options.max_error_m = 0.2;
  EXPECT_EQ(mesh_with_walls(town.grid, options, {}, {}).tin.triangles,
            mesh_samples(town.grid, options, {}).tin.triangles);
}

TEST(CheckWalls, NamesTheFirstBrokenInvariant) {
  Town town(make_dem({}, kLevel));
  town.build({{{box(10.5, -20.5, 20.5, -10.5)}, 8}});
  const auto broken = [&](const std::function<void(WallsAndRoofs&)>& harm) {
    WallsAndRoofs walls = town.walls;
    harm(walls);
    return check_walls(town.grid, walls).value_or("nothing");
  };
  EXPECT_EQ(broken([](auto& w) { w.vertices[3].position.z_m += 1e-5; }),
            "corner 3 is not on the lattice");
  EXPECT_EQ(broken([](auto& w) { w.vertices[3].row += 1e-6; }), "corner 3 is not on a tick");
  EXPECT_EQ(broken([](auto& w) { w.vertices[3].row = -4; }), "corner 3 is not on the ground");
  EXPECT_EQ(broken([](auto& w) { w.covered.pop_back(); }), "marks of samples are missing");
  EXPECT_EQ(broken([](auto& w) { w.edges.push_back(w.edges[0]); }),
            "edges 0 and 8 meet in the plane of the samples");
  const std::string swapped =
      broken([](auto& w) { std::swap(w.vertices[0].position, w.vertices[1].position); });
  EXPECT_NE(swapped.find("meet in the plane of the lattice"), std::string::npos) << swapped;
}

// Reading.

std::string write_text(const std::string& path, const std::string& text) {
  FILE* file = fopen(path.c_str(), "w");
  fputs(text.c_str(), file);
  fclose(file);
  return path;
}

std::string geojson(const std::string& features, const std::string& crs = "") {
  return "{\"type\":\"FeatureCollection\"," +
         (crs.empty() ? ""
                      : "\"crs\":{\"type\":\"name\",\"properties\":{\"name\":\"" + crs + "\"}},") +
         "\"features\":[" + features + "]}";
}

std::string feature(const std::string& coordinates, const std::string& properties,
                    const std::string& type = "Polygon") {
  return "{\"type\":\"Feature\",\"properties\":{" + properties + "},\"geometry\":{\"type\":\"" +
         type + "\",\"coordinates\":" + coordinates + "}}";
}

const Place kUtm{"EPSG:32611", 500'000, 4'000'000, 10, 41, 31};
const char* const kSquare =
    "[[[500100,3999800],[500200,3999800],[500200,3999900],[500100,3999900],[500100,3999800]]]";

TEST(ReadFootprints, HeightsAsNumberOrTextOthersCounted) {
  const TempFolder folder;
  const Dem dem = make_dem(kUtm, kLevel);
  std::string features;
  for (const char* h : {"12.5", "\"7\"", "\" 8.25 m\"", "null", "\"tall\"", "-3", "0", "\"nan\""})
    features += feature(kSquare, std::string("\"h\":") + h) + ",";
  features += feature("[500100,3999800]", "\"h\":5", "Point") + ",";
  features += feature("[" + std::string(kSquare) + "," + kSquare + "]", "\"h\":4", "MultiPolygon");
  const std::string path =
      write_text(folder.path("b.geojson"), geojson(features, "urn:ogc:def:crs:EPSG::32611"));
  std::vector<std::string> warnings;
  const auto found = read_footprints(path, "h", dem, warnings);
  std::vector<double> heights;
  for (const Footprint& f : found) heights.push_back(f.height_m);
  // a multipolygon of one square twice is invalid, and repaired it is one square
  EXPECT_EQ(heights, (std::vector<double>{12.5, 7, 8.25, 4}));
  EXPECT_EQ(found[0].rings.at(0).size(), 4U);
  ASSERT_EQ(warnings.size(), 3U);
  EXPECT_NE(warnings[0].find("5 features left out, no height above 0 in \"h\""), std::string::npos);
  EXPECT_NE(warnings[1].find("1 features left out, no polygon"), std::string::npos);
  EXPECT_NE(warnings[2].find("1 invalid features repaired"), std::string::npos);
}

TEST(ReadFootprints, RefusesWithOneLineThatSaysWhy) {
  const TempFolder folder;
  const Dem dem = make_dem(kUtm, kLevel);
  const auto refusal = [&](const std::string& text, const std::string& field) -> std::string {
    std::vector<std::string> warnings;
    try {
      const std::string path = write_text(folder.path("b.geojson"), text);
      add_footprints(dem, place_samples(dem), path, field, 0.1, warnings);
    } catch (const Error& e) {
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
      EXPECT_NE(std::string(e.what()).find("b.geojson'"), std::string::npos);
      return e.what();
    }
    return "accepted";
  };
  const auto says = [](const std::string& message, const std::string& part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  const std::string utm = "urn:ogc:def:crs:EPSG::32611";
  says(refusal("hello", "h"), "a vector file that OGR reads was expected");
  says(refusal(geojson(feature(kSquare, "\"levels\":3,\"name\":\"x\""), utm), "h"),
       "no attribute \"h\"; a height in metres was expected; give --height-field with one of: "
       "levels, name");
  says(refusal(geojson(feature("[1,2]", "\"h\":3", "Point"), utm), "h"), "holds no polygon");
  says(refusal(geojson(feature(kSquare, "\"h\":-3"), utm), "h"), "no polygon has a height above 0");
  says(refusal(geojson(feature("[[[10,10],[10.1,10],[10.1,10.1],[10,10]]]", "\"h\":3")), "h"),
       "all 1 buildings lie outside the DEM");
  says(refusal(geojson(feature("[[[499900,3999800],[500006,3999800],[500006,3999900],[499900,"
                               "3999900],[499900,3999800]]]",
                               "\"h\":3"),
                       utm),
               "h"),
       "none of 1 buildings stands on the ground");
  EXPECT_EQ(refusal(geojson(feature(kSquare, "\"h\":3"), utm), "H"), "accepted");
}

TEST(AddFootprints, LongitudesAndLatitudesOnAUtmDem) {
  const TempFolder folder;
  const Dem dem =
      make_dem(kUtm, [](double x, double y) { return (x - 5e5) / 50 + (4e6 - y) / 90; });
  std::string ring;
  const double corners[5][2] = {{500100, 3999800},
                                {500200, 3999800},
                                {500200, 3999900},
                                {500100, 3999900},
                                {500100, 3999800}};
  for (const auto& [x, y] : corners) {
    const MapPoint p = convert_coordinates("EPSG:32611", "OGC:CRS84", {x, y, 0});
    char text[80];
    snprintf(text, sizeof text, "%s[%.10f,%.10f]", ring.empty() ? "" : ",", p.x, p.y);
    ring += text;
  }
  Town town(dem);
  town.finish(add_footprints(town.dem, town.grid,
                             write_text(folder.path("b.geojson"),
                                        geojson(feature("[[" + ring + "]]", "\"h\":30"))),
                             "h", 0.05, town.warnings),
              0.05);
  EXPECT_TRUE(town.warnings.empty());
  EXPECT_EQ(town.walls.buildings, 1U);
  // the lowest ground is at the upper left corner, and the frame is plumb at the centre of the DEM
  EXPECT_NEAR(town.height_at(500150, 3999850), 100 / 50.0 + 100 / 90.0 + 30, 0.01);
  EXPECT_NEAR(town.height_at(500099, 3999850), 99 / 50.0 + 150 / 90.0, 0.06);
}

TEST(AddFootprints, DemInDegrees) {
  Town town(make_dem({"EPSG:4326", 10, 46, 0.001, 61, 51}, [](double x, double y) {
    return 500 + 40 * std::sin(x * 600) + 30 * std::cos(y * 500);
  }));
  std::vector<Footprint> footprints;
  for (int i = 0; i < 20; ++i)
    footprints.push_back({{box(10.005 + 0.0025 * i, 45.955 + 0.0017 * i, 10.0058 + 0.0025 * i,
                               45.9554 + 0.0017 * i)},
                          10.0 + i});
  town.build(footprints, 1);
  EXPECT_EQ(town.walls.buildings, 20U);
}

/// All of lower Manhattan on level ground: sound, every roof at its height where no other building
/// covers it, and what was left out is said.
TEST(AddFootprints, Manhattan) {
  SCARP_SHARED_OR_SKIP(path, "urban/manhattan_lower_buildings.geojson");
  const auto start = std::chrono::steady_clock::now();
  Town town(make_dem({"EPSG:32618", 582'400, 4'510'000, 5, 900, 780},
                     [](double, double) { return 0.0; }));
  std::vector<Footprint> footprints = read_footprints(path, "height", town.dem, town.warnings);
  town.finish(add_footprints(town.dem, town.grid, path, "height", 0.5, town.warnings), 0.5);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  std::printf("%zu footprints, %u pieces, %zu corners, %zu triangles, %.1f s\n", footprints.size(),
              town.walls.buildings, town.walls.vertices.size(), town.mesh.tin.triangles.size(),
              seconds.count());
  for (const std::string& w : town.warnings) std::printf("  %s\n", w.c_str());
  EXPECT_TRUE(town.warned("25 invalid features repaired"));
  EXPECT_TRUE(town.warned("2 polygons left out, outside the DEM"));
  EXPECT_FALSE(town.warned("too near"));

  std::mt19937 random(11);
  const GeoFrame::Placer placer(*town.dem.frame);
  int on_roofs = 0;
  for (int probe = 0; probe < 800; ++probe) {
    const Footprint& f = footprints[random() % footprints.size()];
    double x = 0, y = 0;  // a random mean of three corners
    for (int k = 0; k < 3; ++k) {
      const auto& corner = f.rings[0][random() % f.rings[0].size()];
      x += corner[0] / 3;
      y += corner[1] / 3;
    }
    const auto [highest_m, nearest_m] = highest_over(footprints, x, y);
    if (nearest_m < 1) continue;
    on_roofs += highest_m > 0;
    EXPECT_NEAR(town.height_at(x, y), placer.place({x, y, highest_m}).z_m, 0.01) << x << "," << y;
  }
  EXPECT_GT(on_roofs, 300);
}

}  // namespace
}  // namespace scarp
