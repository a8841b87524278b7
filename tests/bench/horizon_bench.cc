// How long the all-points horizon takes on 100,000 vertices: seven layouts, one table row each.
//   horizon_bench [--vertices N] [--threads N] [--layout COUNT/SUBSECTORS] [--terrain NAME]
//   [--json]
// Terrain: `fort_irwin` (a random subset of the samples of a real DEM, where the shared data are
// there; the default), `fractal` (synthetic; what is used otherwise) or `dome` (every vertex on
// its hull: the worst case).

#include <fmt/core.h>
#include <gdal_priv.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/horizon/stewart.h"
#include "core/threads/parallel_for.h"
#include "tests/support/shared_data.h"

namespace scarp {
namespace {

struct Options {
  std::size_t vertices = 100'000;
  int threads = 0;
  std::optional<SectorLayout> layout;
  std::string terrain = "fort_irwin";
  bool json = false;
};

std::optional<std::vector<Position>> fort_irwin_samples(std::size_t count) {
  const auto path = test::shared_data("literature/ntc_fort_irwin_i16.tif");
  if (!path) return {};
  GDALAllRegister();
  const GDALDatasetUniquePtr dataset(GDALDataset::Open(path->c_str(), GDAL_OF_RASTER));
  if (!dataset) return {};
  const int columns = dataset->GetRasterXSize(), rows = dataset->GetRasterYSize();
  std::vector<float> heights(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  GDALRasterBand* band = dataset->GetRasterBand(1);
  if (band->RasterIO(GF_Read, 0, 0, columns, rows, heights.data(), columns, rows, GDT_Float32, 0,
                     0) != CE_None)
    return {};
  int has_void = 0;
  const double void_value = band->GetNoDataValue(&has_void);
  double transform[6] = {};
  dataset->GetGeoTransform(transform);
  // Degrees become metres on the spot: what matters here is the shape, not the place.
  const bool degrees = std::abs(transform[1]) < 0.1;
  const double cell_m = degrees ? std::abs(transform[5]) * 111'195 : std::abs(transform[5]);
  std::vector<Position> samples;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const auto column = static_cast<double>(i % static_cast<std::size_t>(columns));
    const auto row = static_cast<double>(i / static_cast<std::size_t>(columns));
    if (has_void && static_cast<double>(heights[i]) == void_value) continue;
    samples.push_back(round_to_lattice(
        Position{column * cell_m, -row * cell_m, static_cast<double>(heights[i])}));
  }
  std::shuffle(samples.begin(), samples.end(), std::mt19937_64(1));
  samples.resize(std::min(samples.size(), count));
  return samples;
}

/// Random places on a sum of waves, half as high for each halving of their length.
std::vector<Position> fractal_samples(std::size_t count) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> unit(0, 1);
  constexpr double kExtentM = 40'000;
  struct Wave {
    double x, y, phase, height_m;
  };
  std::vector<Wave> waves;
  double length_m = kExtentM, height_m = 600;
  for (int octave = 0; octave < 9; ++octave, length_m /= 2, height_m /= 2)
    for (int i = 0; i < 4; ++i) {
      const double direction = 6.283 * unit(random), k = 6.283 / length_m;
      waves.push_back(
          {k * std::cos(direction), k * std::sin(direction), 6.283 * unit(random), height_m / 4});
    }
  std::vector<Position> samples;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = kExtentM * unit(random), y = kExtentM * unit(random);
    double z = 0;
    for (const Wave& w : waves) z += w.height_m * std::sin(w.x * x + w.y * y + w.phase);
    samples.push_back(round_to_lattice(Position{x, y, z}));
  }
  return samples;
}

std::vector<Position> dome_samples(std::size_t count) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Position> samples;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = 20'000 * unit(random), y = 20'000 * unit(random);
    samples.push_back(round_to_lattice(Position{x, y, -1e-3 * (x * x + y * y)}));
  }
  return samples;
}

struct Timing {
  SectorLayout layout;
  double total_s;
};

Timing time_layout(const std::vector<Position>& vertices, const SectorLayout& layout) {
  const auto start = std::chrono::steady_clock::now();
  const HorizonTable table = stewart_horizons(vertices, layout, {});
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  if (table.horizon_vertex.empty()) std::abort();
  return {layout, elapsed.count()};
}

void run(Options options) {
  std::vector<Position> vertices;
  if (options.terrain == "fort_irwin") {
    if (auto samples = fort_irwin_samples(options.vertices))
      vertices = std::move(*samples);
    else
      options.terrain = "fractal";
  }
  if (options.terrain == "fractal") vertices = fractal_samples(options.vertices);
  if (options.terrain == "dome") vertices = dome_samples(options.vertices);
  set_thread_count(options.threads);
  std::vector<SectorLayout> layouts = {{8, 1}, {8, 2}, {8, 4}, {8, 8}, {16, 4}, {32, 2}, {64, 1}};
  if (options.layout) layouts = {*options.layout};
  nlohmann::json rows = nlohmann::json::array();
  if (!options.json)
    fmt::print("{} vertices of {}, {} threads\nlayout  s/subsector  s in total\n", vertices.size(),
               options.terrain, thread_count());
  for (const SectorLayout& layout : layouts) {
    const Timing timing = time_layout(vertices, layout);
    const double part_s = timing.total_s / (layout.count * layout.subsectors);
    rows.push_back({{"sectors", layout.count},
                    {"subsectors", layout.subsectors},
                    {"seconds_per_subsector", part_s},
                    {"seconds", timing.total_s}});
    if (!options.json) {
      fmt::print("{:>3}/{:<2}  {:>11.4f}  {:>10.3f}\n", layout.count, layout.subsectors, part_s,
                 timing.total_s);
      std::fflush(stdout);
    }
  }
  if (options.json)
    fmt::print("{}\n", nlohmann::json{{"terrain", options.terrain},
                                      {"vertices", vertices.size()},
                                      {"threads", thread_count()},
                                      {"layouts", rows}}
                           .dump(2));
}

}  // namespace
}  // namespace scarp

int main(int argc, char** argv) {
  scarp::Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--json") {
      options.json = true;
      continue;
    }
    const std::string value = i + 1 < argc ? argv[++i] : "";
    scarp::SectorLayout layout;
    if (name == "--vertices" && std::atol(value.c_str()) > 0) {
      options.vertices = static_cast<std::size_t>(std::atol(value.c_str()));
    } else if (name == "--threads" && std::atoi(value.c_str()) > 0) {
      options.threads = std::atoi(value.c_str());
    } else if (name == "--layout" &&
               std::sscanf(value.c_str(), "%d/%d", &layout.count, &layout.subsectors) == 2 &&
               layout.count >= 4 && layout.subsectors >= 1) {
      options.layout = layout;
    } else if (name == "--terrain" &&
               (value == "fort_irwin" || value == "fractal" || value == "dome")) {
      options.terrain = value;
    } else {
      fmt::print(stderr,
                 "usage: horizon_bench [--vertices N] [--threads N] [--layout 16/4] "
                 "[--terrain fort_irwin|fractal|dome] [--json]\n");
      return 2;
    }
  }
  scarp::run(options);
}
