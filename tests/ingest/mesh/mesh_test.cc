#include "ingest/mesh/mesh.h"

#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <memory>
#include <random>

#include "core/error/error.h"
#include "tests/ingest/mesh/grids.h"
#include "tests/support/shared_data.h"

namespace scarp {
namespace {

using test::bent_grid;
using test::cut_out;
using test::flat_grid;

MeshOptions within(double max_error_m, MeshBound bound = MeshBound::kSurface) {
  MeshOptions options;
  options.max_error_m = max_error_m;
  options.bound = bound;
  return options;
}

MeshOptions vertices(std::uint32_t budget) {
  MeshOptions options;
  options.vertex_budget = budget;
  return options;
}

double plain(std::int32_t, std::int32_t) {
  return 7;
}

std::size_t triangles_of(const SampleGrid& grid) {
  const Mesh mesh = mesh_samples(grid, within(0), {});
  EXPECT_EQ(check_mesh(grid, mesh), std::nullopt);
  return mesh.tin.triangles.size();
}

TEST(Mesh, APlaneNeedsTwoTriangles) {
  // Slopes and cells are lattice numbers, so that the samples lie on the plane exactly.
  const SampleGrid grid =
      flat_grid(40, 30, 10, 8, [](std::int32_t c, std::int32_t r) { return 2.5 * c - 0.5 * r; });
  EXPECT_EQ(triangles_of(grid), 2U);
}

TEST(Mesh, APeakIsFoundAndKept) {
  const SampleGrid grid = flat_grid(
      9, 9, 10, 10, [](std::int32_t c, std::int32_t r) { return c == 3 && r == 5 ? 90.0 : 0.0; });
  const Mesh mesh = mesh_samples(grid, within(1), {});
  EXPECT_NE(std::find(mesh.sample_of_vertex.begin(), mesh.sample_of_vertex.end(), 5 * 9 + 3),
            mesh.sample_of_vertex.end());
  EXPECT_LE(measure_error(grid, mesh).over_surface_m, 1);
}

TEST(Mesh, ASurfaceBoundSeesWhatSamplesDoNot) {
  // A saddle: the samples lie on both readings of a cell, the ground between them does not.
  const auto saddle = [](std::int32_t c, std::int32_t r) { return 16.0 * (c % 2 == r % 2); };
  const SampleGrid grid = flat_grid(2, 2, 10, 10, saddle);
  const Mesh mesh = mesh_samples(grid, within(1), {});
  EXPECT_EQ(mesh.cell_ambiguity_m, 16);
  EXPECT_EQ(mesh.error_over_surface_m, 0);
  EXPECT_EQ(measure_error(grid, mesh).cell_ambiguity_m, 16);

  // A ridge that runs between two edges: every sample within 5 m, the ground 20 m away.
  const SampleGrid wavy = flat_grid(
      12, 12, 10, 10, [](std::int32_t c, std::int32_t r) { return 5.0 * ((c * 7 + r * 5) % 4); });
  const Mesh loose = mesh_samples(wavy, within(4, MeshBound::kSamples), {});
  EXPECT_LE(loose.error_at_samples_m, 4);
  EXPECT_GT(measure_error(wavy, loose).over_surface_m, 4);
}

TEST(Mesh, VoidsAreCutOutAlongSampleEdges) {
  SampleGrid ring = flat_grid(4, 4, 10, 10, plain);
  EXPECT_EQ(triangles_of(ring), 2U);

  SampleGrid hole = flat_grid(7, 6, 10, 10, plain);
  cut_out(hole, {"ooooooo", "ooooooo", "ooo ooo", "ooooooo", "ooooooo", "ooooooo"});
  EXPECT_EQ(triangles_of(hole), 8U);

  SampleGrid islands = flat_grid(7, 3, 10, 10, plain);
  cut_out(islands, {"oo oooo", "oo oooo", "   oooo"});
  EXPECT_EQ(triangles_of(islands), 4U);

  // Two cells that touch in one corner; a known sample without a cell is lost.
  SampleGrid pinch = flat_grid(4, 3, 10, 10, plain);
  cut_out(pinch, {"oo  ", "ooo ", " ooo"});
  cut_out(pinch, {"oo o", "ooo ", " oo "});
  const Mesh mesh = mesh_samples(pinch, within(0), {});
  EXPECT_EQ(check_mesh(pinch, mesh), std::nullopt);
  EXPECT_EQ(mesh.tin.triangles.size(), 4U);
  EXPECT_EQ(mesh.tin.vertices.size(), 7U);
  EXPECT_EQ(mesh.lost_samples, 0U);
  SampleGrid lost = pinch;
  lost.known[lost.index(3, 0)] = 1;
  EXPECT_EQ(mesh_samples(lost, within(0), {}).lost_samples, 1U);
}

TEST(Mesh, WithoutAGroundCellTheErrorSaysSo) {
  SampleGrid grid = flat_grid(3, 3, 10, 10, plain);
  cut_out(grid, {"o o", "   ", "o o"});
  try {
    mesh_samples(grid, within(1), {});
    FAIL() << "an error was expected";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInput);
    EXPECT_NE(std::string(error.what()).find("3 x 3"), std::string::npos);
  }
}

TEST(Mesh, AVertexBudgetIsUsedUpAndErrorsFall) {
  std::mt19937 random(5);
  const SampleGrid grid = flat_grid(30, 30, 10, 10, [&](std::int32_t c, std::int32_t r) {
    return 40 * std::sin(0.3 * c) * std::cos(0.2 * r) + double(random() % 8);
  });
  double before_m = 1e9;
  for (const std::uint32_t budget : {4U, 40U, 400U}) {
    const Mesh mesh = mesh_samples(grid, vertices(budget), {});
    EXPECT_EQ(mesh.tin.vertices.size(), budget);
    EXPECT_EQ(check_mesh(grid, mesh), std::nullopt);
    EXPECT_LT(mesh.error_at_samples_m, before_m);
    EXPECT_NEAR(mesh.error_over_surface_m, measure_error(grid, mesh).over_surface_m,
                kErrorRoundingM);
    before_m = mesh.error_at_samples_m;
  }
  const Mesh all = mesh_samples(grid, vertices(5000), {});
  EXPECT_LE(all.tin.vertices.size(), 900U);
  EXPECT_LE(all.error_at_samples_m, kErrorRoundingM);
}

TEST(Mesh, ProgressRisesToOne) {
  double last = 0;
  std::mt19937 random(6);
  const SampleGrid grid = flat_grid(
      250, 250, 10, 10, [&](std::int32_t, std::int32_t) { return double(random() % 64); });
  int calls = 0;
  mesh_samples(grid, within(1), [&](double done) {
    EXPECT_GE(done, last);
    last = done;
    ++calls;
  });
  EXPECT_EQ(last, 1);
  EXPECT_GT(calls, 3);
}

/// Random heights in lattice numbers, voids in clumps.
SampleGrid random_grid(bool bent) {
  const auto columns = *rc::gen::inRange(2, 24), rows = *rc::gen::inRange(2, 24);
  const auto relief = *rc::gen::element(1, 8, 200);
  const auto seed = *rc::gen::arbitrary<std::uint32_t>();
  const auto voids_percent = *rc::gen::element(0, 0, 3, 30);
  std::mt19937 random(seed);
  const auto height = [&](std::int32_t c, std::int32_t) {
    return relief * (0.25 * static_cast<double>(random() % 64) + c % 5);
  };
  SampleGrid grid = bent ? bent_grid(columns, rows, *rc::gen::element(0.01, 0.1, 0.4),
                                     *rc::gen::element(-60.0, 0.0, 46.0, 75.0), height)
                         : flat_grid(columns, rows, *rc::gen::element(10.0, 3.7, 30.0),
                                     *rc::gen::element(10.0, 7.5, 30.9), height);
  for (std::uint8_t& known : grid.known) known = static_cast<int>(random() % 100) >= voids_percent;
  grid.known[0] = grid.known[1] = 1;
  grid.known[grid.index(0, 1)] = grid.known[grid.index(1, 1)] = 1;
  return grid;
}

void expect_sound(const SampleGrid& grid, const MeshOptions& options) {
  const Mesh mesh = mesh_samples(grid, options, {});
  const auto broken = check_mesh(grid, mesh);
  RC_ASSERT(broken.value_or("") == "");
  const MeasuredError judged = measure_error(grid, mesh);
  RC_ASSERT(judged.uncovered_samples == 0U);
  RC_ASSERT(judged.border_gap_cells <= kBorderDeviationCells);
  RC_ASSERT(judged.at_samples_m <= *options.max_error_m + kErrorRoundingM);
  RC_ASSERT(judged.at_samples_m <= mesh.error_at_samples_m + kErrorRoundingM);
  RC_ASSERT(judged.over_surface_m <= mesh.error_over_surface_m + kErrorRoundingM);
  RC_ASSERT(std::abs(judged.cell_ambiguity_m - mesh.cell_ambiguity_m) <= kErrorRoundingM);
  if (options.bound == MeshBound::kSurface) {
    RC_ASSERT(judged.over_surface_m <= *options.max_error_m + kErrorRoundingM);
  }
  if (grid.bend_cells == 0) {
    RC_ASSERT(std::abs(judged.at_samples_m - mesh.error_at_samples_m) <= kErrorRoundingM);
    RC_ASSERT(std::abs(judged.over_surface_m - mesh.error_over_surface_m) <= kErrorRoundingM);
  }
}

RC_GTEST_PROP(MeshProperty, FlatGridsKeepTheBound, ()) {
  expect_sound(random_grid(false),
               within(*rc::gen::element(0.0, 0.5, 4.0, 50.0, 1e6),
                      *rc::gen::element(MeshBound::kSurface, MeshBound::kSamples)));
}

RC_GTEST_PROP(MeshProperty, BentGridsKeepTheBound, ()) {
  expect_sound(random_grid(true),
               within(*rc::gen::element(0.0, 0.5, 4.0, 50.0, 1e6),
                      *rc::gen::element(MeshBound::kSurface, MeshBound::kSamples)));
}

TEST(Mesh, AStronglyBentGridIsMeshedWithoutTurnedTriangles) {
  for (const double height_m : {0.0, 300.0}) {
    SampleGrid grid = bent_grid(160, 120, 0.1, 60, [&](std::int32_t c, std::int32_t r) {
      return height_m * std::sin(0.1 * c) * std::sin(0.07 * r);
    });
    for (std::int32_t c = 40; c < 90; ++c) grid.known[grid.index(c, 60)] = 0;
    const Mesh mesh = mesh_samples(grid, within(height_m == 0 ? 1e5 : 20), {});
    EXPECT_EQ(check_mesh(grid, mesh), std::nullopt);
    const MeasuredError judged = measure_error(grid, mesh);
    EXPECT_LE(judged.border_gap_cells, kBorderDeviationCells);
    EXPECT_EQ(judged.uncovered_samples, 0U);
    EXPECT_LE(judged.over_surface_m, (height_m == 0 ? 1e5 : 20) + kErrorRoundingM);
    EXPECT_LT(mesh.tin.triangles.size(), 12000U) << grid.bend_cells;
  }
}

TEST(Mesh, NoTriangleIsThinnerThanItsEdgesBend) {
  const SampleGrid grid = bent_grid(160, 120, 0.1, 60, plain);
  const Mesh mesh = mesh_samples(grid, within(1e5), {});
  const double cell_m = std::min(grid.cell_x_m, grid.cell_y_m);
  for (const auto& corners : mesh.tin.triangles) {
    double longest_m = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const Position &a = mesh.tin.vertices[corners[i]],
                     &b = mesh.tin.vertices[corners[(i + 1) % 3]];
      longest_m = std::max(longest_m, std::hypot(b.x_m - a.x_m, b.y_m - a.y_m));
    }
    const Position &a = mesh.tin.vertices[corners[0]], &b = mesh.tin.vertices[corners[1]],
                   &c = mesh.tin.vertices[corners[2]];
    const double area_m2 = (b.x_m - a.x_m) * (c.y_m - a.y_m) - (b.y_m - a.y_m) * (c.x_m - a.x_m);
    // A chord strays by a quarter of bend times length squared, in cells.
    const double cells = longest_m / std::max(grid.cell_x_m, grid.cell_y_m);
    ASSERT_GT(area_m2 / longest_m, 0.25 * grid.bend_cells * cells * cells * cell_m);
  }
}

TEST(Mesh, SmoothBentGroundIsMeasuredWhereItsTrianglesReallyLie) {
  // Long edges, far from the samples' lines: a sample may lie in another triangle than its column
  // and row say.
  for (unsigned seed = 1; seed <= 60; ++seed) {
    std::mt19937 random(seed);
    const auto part = [&] { return 1e-3 * static_cast<double>(random() % 1000); };
    const double a = 0.05 + 0.2 * part(), b = 0.05 + 0.2 * part(), d = 6 * part(), e = 6 * part();
    const SampleGrid grid = bent_grid(
        40, 36, seed % 2 ? 0.1 : 0.4, 10 + 60 * part(), [&](std::int32_t c, std::int32_t r) {
          return 2000 * std::sin(a * c + 0.5 * b * r + d) * std::cos(b * r - 0.3 * a * c + e);
        });
    for (const MeshBound bound : {MeshBound::kSurface, MeshBound::kSamples}) {
      const Mesh mesh = mesh_samples(grid, within(60 + 300 * part(), bound), {});
      const MeasuredError judged = measure_error(grid, mesh);
      EXPECT_NEAR(judged.at_samples_m, mesh.error_at_samples_m, kErrorRoundingM) << seed;
      EXPECT_LE(judged.over_surface_m, mesh.error_over_surface_m + kErrorRoundingM) << seed;
    }
  }
}

TEST(Mesh, RoughBentGroundIsMeasuredWhereItsTrianglesReallyLie) {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    std::mt19937 random(seed);
    SampleGrid grid = bent_grid(40, 36, 0.4, 50, [&](std::int32_t, std::int32_t) {
      return 16.0 * static_cast<double>(random() % 256);
    });
    for (std::int32_t c = 12; c < 30; ++c) grid.known[grid.index(c, 17)] = seed % 2;
    const Mesh mesh = mesh_samples(grid, vertices(20 + seed), {});
    const MeasuredError judged = measure_error(grid, mesh);
    EXPECT_NEAR(judged.at_samples_m, mesh.error_at_samples_m, kErrorRoundingM) << seed;
    EXPECT_NEAR(judged.over_surface_m, mesh.error_over_surface_m, kErrorRoundingM) << seed;
  }
}

TEST(Mesh, IsTheSameOnEveryRun) {
  std::mt19937 random(9);
  const SampleGrid grid =
      flat_grid(60, 50, 10, 10, [&](std::int32_t, std::int32_t) { return double(random() % 16); });
  const Mesh one = mesh_samples(grid, within(3), {}), other = mesh_samples(grid, within(3), {});
  EXPECT_EQ(one.tin.vertices, other.tin.vertices);
  EXPECT_EQ(one.tin.triangles, other.tin.triangles);
  EXPECT_EQ(one.tin.neighbours, other.tin.neighbours);
}

TEST(MeasureError, FindsKnownDistances) {
  // Two triangles over 3 x 3 samples with a peak of 4 m at one place.
  SampleGrid grid = flat_grid(3, 3, 10, 10, [](std::int32_t, std::int32_t) { return 0.0; });
  Mesh mesh = mesh_samples(grid, within(0), {});
  ASSERT_EQ(mesh.tin.triangles.size(), 2U);
  EXPECT_EQ(measure_error(grid, mesh).over_surface_m, 0);
  grid.positions[grid.index(1, 0)].z_m = 4;
  EXPECT_EQ(measure_error(grid, mesh).at_samples_m, 4);
  // A corner pulled down: the mesh falls over two cells, the ground over one. Where the corner's
  // cell is read with its other diagonal, its middle is level; the mesh is a quarter up the edge.
  grid.positions[grid.index(1, 0)].z_m = 0;
  mesh.tin.vertices[0].z_m = grid.positions[0].z_m = -8;
  mesh.tin.triangles = {{0, 2, 3}, {0, 3, 1}};
  connect_neighbours(mesh.tin);
  EXPECT_EQ(measure_error(grid, mesh).at_samples_m, 4);
  EXPECT_EQ(measure_error(grid, mesh).over_surface_m, 6);
}

TEST(CheckMesh, NamesWhatIsBroken) {
  std::mt19937 random(4);
  const SampleGrid grid =
      flat_grid(4, 4, 10, 10, [&](std::int32_t, std::int32_t) { return double(random() % 64); });
  const Mesh sound = mesh_samples(grid, within(0), {});
  ASSERT_EQ(check_mesh(grid, sound), std::nullopt);
  Mesh mesh = sound;
  mesh.sample_of_vertex[1] = 2;
  mesh.sample_of_vertex[2] = 2;
  EXPECT_EQ(check_mesh(grid, mesh), "vertex 1 is not where its sample is");

  // One triangle short: its edges are no border of the ground.
  int border = 0;
  for (std::size_t t = 0; t < sound.tin.triangles.size(); ++t) {
    mesh = sound;
    mesh.tin.triangles.erase(mesh.tin.triangles.begin() + static_cast<std::ptrdiff_t>(t));
    connect_neighbours(mesh.tin);
    const std::string broken = check_mesh(grid, mesh).value_or("");
    EXPECT_NE(broken, "");
    border += broken.find("does not run along the border") != std::string::npos;
  }
  EXPECT_GT(border, 10);

  // The long diagonal of a rhomb.
  const SampleGrid wide = flat_grid(5, 3, 10, 10, plain);
  Mesh rhomb;
  for (const std::int64_t sample : {0, 4, 7, 10, 14}) {
    rhomb.sample_of_vertex.push_back(sample);
    rhomb.tin.vertices.push_back(wide.positions[static_cast<std::size_t>(sample)]);
  }
  rhomb.tin.triangles = {{0, 2, 1}, {0, 3, 2}, {3, 4, 2}, {2, 4, 1}};
  connect_neighbours(rhomb.tin);
  EXPECT_EQ(check_mesh(wide, rhomb), std::nullopt);
  rhomb.sample_of_vertex = {0, 4, 6, 10, 14};
  rhomb.tin.vertices[2] = wide.positions[6];
  rhomb.tin.triangles = {{0, 3, 2}, {0, 2, 4}, {3, 4, 2}, {0, 4, 1}};
  connect_neighbours(rhomb.tin);
  EXPECT_NE(check_mesh(wide, rhomb).value_or("").find("inside its circle"), std::string::npos);
}

struct CloseDataset {
  void operator()(GDALDataset* dataset) const { GDALClose(dataset); }
};

/// Heights of a real DEM, cut to at most 600 x 600 samples, and what is known of them.
struct Heights {
  std::int32_t columns = 0, rows = 0;
  std::vector<double> z_m;
  std::vector<std::uint8_t> known;
};

Heights read_heights(const std::string& path) {
  GDALAllRegister();
  const std::unique_ptr<GDALDataset, CloseDataset> dataset(
      GDALDataset::Open(path.c_str(), GDAL_OF_RASTER));
  Heights heights;
  if (!dataset) return heights;
  heights.columns = std::min(600, dataset->GetRasterXSize());
  heights.rows = std::min(600, dataset->GetRasterYSize());
  heights.z_m.resize(static_cast<std::size_t>(heights.columns) *
                     static_cast<std::size_t>(heights.rows));
  GDALRasterBand* band = dataset->GetRasterBand(1);
  EXPECT_EQ(band->RasterIO(GF_Read, 0, 0, heights.columns, heights.rows, heights.z_m.data(),
                           heights.columns, heights.rows, GDT_Float64, 0, 0),
            CE_None);
  int has_nodata = 0;
  const double nodata = band->GetNoDataValue(&has_nodata);
  for (double& z : heights.z_m) {
    heights.known.push_back(!(has_nodata && z == nodata) && z > -1000);
    if (!heights.known.back()) z = 0;
  }
  return heights;
}

void judge_dem(const SampleGrid& grid, double max_error_m) {
  for (const MeshBound bound : {MeshBound::kSurface, MeshBound::kSamples}) {
    const Mesh mesh = mesh_samples(grid, within(max_error_m, bound), {});
    EXPECT_EQ(check_mesh(grid, mesh), std::nullopt);
    const MeasuredError judged = measure_error(grid, mesh);
    EXPECT_EQ(judged.uncovered_samples, 0U);
    EXPECT_LE(judged.border_gap_cells, kBorderDeviationCells);
    EXPECT_LE(judged.at_samples_m, max_error_m + kErrorRoundingM);
    EXPECT_NEAR(judged.at_samples_m, mesh.error_at_samples_m, kErrorRoundingM);
    EXPECT_NEAR(judged.over_surface_m, mesh.error_over_surface_m, kErrorRoundingM);
    EXPECT_NEAR(judged.cell_ambiguity_m, mesh.cell_ambiguity_m, kErrorRoundingM);
    if (bound == MeshBound::kSurface) {
      EXPECT_LE(judged.over_surface_m, max_error_m + kErrorRoundingM);
    }
  }
}

TEST(MeshDem, MountainsLaidOutFlat) {
  SCARP_SHARED_OR_SKIP(path, "projected/bigtujunga_srtm30m_utm11.tif");
  const Heights dem = read_heights(path);
  const auto height = [&](std::int32_t c, std::int32_t r) {
    return dem.z_m[static_cast<std::size_t>(r * dem.columns + c)];
  };
  // 28.7 m is no lattice number: grid lines are straight but for rounding.
  for (const double cell_m : {30.0, 28.7}) {
    SampleGrid grid = flat_grid(dem.columns, dem.rows, cell_m, 30, height);
    grid.known = dem.known;
    judge_dem(grid, 5);
  }
}

TEST(MeshDem, MountainsWithVoidsOnTheGlobe) {
  SCARP_SHARED_OR_SKIP(path, "geographic/N27E086_everest_srtm3_voids.tif");
  const Heights dem = read_heights(path);
  SampleGrid grid =
      bent_grid(dem.columns, dem.rows, 3.0 / 3600, 27.5, [&](std::int32_t c, std::int32_t r) {
        return dem.z_m[static_cast<std::size_t>(r * dem.columns + c)];
      });
  grid.known = dem.known;
  judge_dem(grid, 25);
}

}  // namespace
}  // namespace scarp
