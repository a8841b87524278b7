// Triangles and seconds of mesh_samples on projected DEMs laid out flat.
//   mesh_bench [--json] [--measure] [FILE...]
// Without files: u1024 (Big Tujunga cut and refined to 1024 x 1024 by cubic resampling), Mount St
// Helens and Slovenia from the shared data. hmm's figures for u1024 are printed beside ours: the
// bar to reach at MeshBound::kSamples. --measure lets the judge have the last word on each error.
#include <gdal_priv.h>
#include <gdal_utils.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/geodesy/position.h"
#include "ingest/mesh/mesh.h"
#include "tests/support/shared_data.h"

namespace {

struct CloseDataset {
  void operator()(void* dataset) const { GDALClose(dataset); }
};
using Dataset = std::unique_ptr<void, CloseDataset>;

Dataset open(const std::string& path) {
  return Dataset(GDALOpenEx(path.c_str(), GDAL_OF_RASTER, nullptr, nullptr, nullptr));
}

/// gdal_translate, then gdalwarp, in memory.
Dataset refined_big_tujunga(const std::string& path) {
  const std::array translate{"-of", "MEM", "-a_nodata", "none", "-ot", "Float32"};
  const std::array warp{"-of",         "MEM",
                        "-te",         "384653.655454263",
                        "3788687.828", "403853.655454263",
                        "3807887.828", "-ts",
                        "1024",        "1024",
                        "-r",          "cubic",
                        "-ot",         "Float32"};
  const auto list = [](const auto& words) {
    char** strings = nullptr;
    for (const char* word : words) strings = CSLAddString(strings, word);
    return strings;
  };
  const Dataset source = open(path);
  char** words = list(translate);
  GDALTranslateOptions* translating = GDALTranslateOptionsNew(words, nullptr);
  const Dataset floats(GDALTranslate("", source.get(), translating, nullptr));
  GDALTranslateOptionsFree(translating);
  CSLDestroy(words);
  words = list(warp);
  GDALWarpAppOptions* warping = GDALWarpAppOptionsNew(words, nullptr);
  GDALDatasetH input = floats.get();
  Dataset refined(GDALWarp("", nullptr, 1, &input, warping, nullptr));
  GDALWarpAppOptionsFree(warping);
  CSLDestroy(words);
  return refined;
}

/// Pixel centres in the plane of the geotransform, seen from the upper left one.
scarp::SampleGrid flat_grid(GDALDatasetH dataset) {
  std::array<double, 6> to_map{};
  GDALGetGeoTransform(dataset, to_map.data());
  scarp::SampleGrid grid;
  grid.columns = GDALGetRasterXSize(dataset);
  grid.rows = GDALGetRasterYSize(dataset);
  grid.cell_x_m = std::abs(to_map[1]);
  grid.cell_y_m = std::abs(to_map[5]);
  const auto samples = static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(grid.rows);
  std::vector<double> heights(samples);
  GDALRasterBandH band = GDALGetRasterBand(dataset, 1);
  if (GDALRasterIO(band, GF_Read, 0, 0, grid.columns, grid.rows, heights.data(), grid.columns,
                   grid.rows, GDT_Float64, 0, 0) != CE_None)
    throw std::runtime_error("a raster cannot be read");
  int has_nodata = 0;
  const double nodata = GDALGetRasterNoDataValue(band, &has_nodata);
  grid.positions.resize(samples);
  grid.known.resize(samples);
  for (std::int32_t r = 0; r < grid.rows; ++r) {
    for (std::int32_t c = 0; c < grid.columns; ++c) {
      const std::size_t i = grid.index(c, r);
      grid.known[i] = std::isfinite(heights[i]) && !(has_nodata && heights[i] == nodata);
      grid.positions[i] = scarp::round_to_lattice(
          scarp::Position{c * grid.cell_x_m, -r * grid.cell_y_m, grid.known[i] ? heights[i] : 0});
    }
  }
  return grid;
}

struct Peer {
  double max_error_m;
  unsigned triangles;
  double seconds;
};
constexpr std::array<Peer, 3> kHmm{{{5, 145'285, 0.37}, {2, 410'775, 0.9}, {1, 808'704, 1.7}}};

struct Options {
  bool json = false;
  bool measure = false;
};

void bench(const std::string& name, GDALDatasetH dataset, const Options& options,
           nlohmann::json& rows) {
  const scarp::SampleGrid grid = flat_grid(dataset);
  for (const Peer& peer : kHmm) {
    for (const auto bound : {scarp::MeshBound::kSamples, scarp::MeshBound::kSurface}) {
      const auto start = std::chrono::steady_clock::now();
      const std::clock_t start_cpu = std::clock();
      const scarp::Mesh mesh =
          scarp::mesh_samples(grid, {.max_error_m = peer.max_error_m, .bound = bound}, {});
      const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
      const double cpu_s = double(std::clock() - start_cpu) / CLOCKS_PER_SEC;
      nlohmann::json row{{"dem", name},
                         {"samples", grid.positions.size()},
                         {"max_error_m", peer.max_error_m},
                         {"bound", bound == scarp::MeshBound::kSamples ? "samples" : "surface"},
                         {"triangles", mesh.tin.triangles.size()},
                         {"seconds", taken.count()},
                         {"cpu_seconds", cpu_s},
                         {"error_at_samples_m", mesh.error_at_samples_m},
                         {"error_over_surface_m", mesh.error_over_surface_m},
                         {"cell_ambiguity_m", mesh.cell_ambiguity_m}};
      if (name == "u1024" && bound == scarp::MeshBound::kSamples) {
        row["hmm_triangles"] = peer.triangles;
        row["hmm_seconds"] = peer.seconds;
      }
      if (options.measure) {
        const scarp::MeasuredError judged = scarp::measure_error(grid, mesh);
        row["judged_at_samples_m"] = judged.at_samples_m;
        row["judged_over_surface_m"] = judged.over_surface_m;
        row["judged_cell_ambiguity_m"] = judged.cell_ambiguity_m;
      }
      if (!options.json) {
        std::printf("%-16s %9zu %5.1f  %-8s %9zu %7.3f %7.3f %9.4f %9.4f %9.4f", name.c_str(),
                    grid.positions.size(), peer.max_error_m,
                    row["bound"].get<std::string>().c_str(), mesh.tin.triangles.size(),
                    taken.count(), cpu_s, mesh.error_at_samples_m, mesh.error_over_surface_m,
                    mesh.cell_ambiguity_m);
        if (row.contains("hmm_triangles"))
          std::printf("   hmm %u, %.2f s: %.4f, %.2f", peer.triangles, peer.seconds,
                      double(mesh.tin.triangles.size()) / peer.triangles, cpu_s / peer.seconds);
        if (options.measure)
          std::printf("   judged %.4f %.4f %.4f", row["judged_at_samples_m"].get<double>(),
                      row["judged_over_surface_m"].get<double>(),
                      row["judged_cell_ambiguity_m"].get<double>());
        std::printf("\n");
        std::fflush(stdout);
      }
      rows.push_back(std::move(row));
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  std::vector<std::string> files;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--json") == 0) {
      options.json = true;
    } else if (std::strcmp(argv[i], "--measure") == 0) {
      options.measure = true;
    } else {
      files.emplace_back(argv[i]);
    }
  }
  GDALAllRegister();
  CPLSetConfigOption("GDAL_PAM_ENABLED", "NO");
  nlohmann::json rows = nlohmann::json::array();
  if (!options.json)
    std::printf("%-16s %9s %5s  %-8s %9s %7s %7s %9s %9s %9s\n", "dem", "samples", "max m", "bound",
                "triangles", "s", "cpu s", "samples m", "surface m", "ambig. m");
  if (files.empty()) {
    if (const auto path = scarp::test::shared_data("projected/bigtujunga_srtm30m_utm11.tif")) {
      const Dataset refined = refined_big_tujunga(*path);
      bench("u1024", refined.get(), options, rows);
    }
    for (const char* name : {"mt_st_helens_usgs30m.dem", "slovenia_lidar1m_nan_nodata.tif"})
      if (const auto path = scarp::test::shared_data(std::string("projected/") + name))
        files.push_back(*path);
  }
  for (const std::string& file : files) {
    const Dataset dataset = open(file);
    if (!dataset) {
      std::fprintf(stderr, "'%s' cannot be opened\n", file.c_str());
      return 1;
    }
    const std::string name = file.substr(file.find_last_of('/') + 1);
    bench(name.substr(0, 16), dataset.get(), options, rows);
  }
  if (options.json) std::printf("%s\n", rows.dump(1).c_str());
  return 0;
}
