#include <fmt/format.h>
#include <gdal_priv.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/shared_data.h"
#include "tests/support/temp_folder.h"

/// How far `scarp viewshed`, gdal_viewshed and GRASS's r.viewshed (where it is installed) agree,
/// cell by cell, on the flat earth and with curvature: eyes 2 m over the highest, the lowest and
/// the middle sample of DEMs. Scarp's answers are those of the exhaustive judge (scripts/prove
/// viewshed), so what the others have besides is invented, and what they lack is missed.
/// Usage: agreement_bench
namespace scarp {
namespace {

std::vector<std::uint8_t> read_seen(const std::string& path) {
  const GDALDatasetUniquePtr file(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER));
  if (!file) return {};
  const int columns = file->GetRasterXSize(), rows = file->GetRasterYSize();
  std::vector<std::uint8_t> seen(static_cast<std::size_t>(columns) *
                                 static_cast<std::size_t>(rows));
  if (file->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, columns, rows, seen.data(), columns, rows,
                                       GDT_Byte, 0, 0, nullptr) != CE_None)
    return {};
  return seen;
}

void tell(const std::string& name, const std::vector<std::uint8_t>& truth,
          const std::vector<std::uint8_t>& other, std::uint8_t seen_value) {
  if (other.size() != truth.size()) {
    fmt::print("  {:<24} gave no raster of the DEM's cells\n", name);
    return;
  }
  std::size_t seen = 0, missed = 0, invented = 0, known = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (truth[i] == 255) continue;
    ++known;
    const bool is_seen = truth[i] == 1, has = other[i] == seen_value;
    seen += is_seen;
    missed += is_seen && !has;
    invented += !is_seen && has;
  }
  const auto share = [](std::size_t part, std::size_t of) {
    return of == 0 ? 0.0 : 100 * static_cast<double>(part) / static_cast<double>(of);
  };
  fmt::print(
      "  {:<24} differs on {:6.3f} % of {} cells; of {} seen missed {:6.2f} %, invented "
      "{:6.2f} %\n",
      name, share(missed + invented, known), known, seen, share(missed, seen),
      share(invented, seen));
}

struct Place {
  std::string name;
  double x, y;
};

/// Centres of the highest, the lowest and the middle cell.
std::vector<Place> places_of(const std::string& dem) {
  const GDALDatasetUniquePtr file(GDALDataset::Open(dem.c_str(), GDAL_OF_RASTER));
  const int columns = file->GetRasterXSize(), rows = file->GetRasterYSize();
  std::vector<float> heights(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  if (file->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, columns, rows, heights.data(), columns, rows,
                                       GDT_Float32, 0, 0, nullptr) != CE_None)
    std::exit(1);
  int has_nodata = 0;
  const double nodata = file->GetRasterBand(1)->GetNoDataValue(&has_nodata);
  double g[6];
  file->GetGeoTransform(g);
  std::size_t highest = 0, lowest = 0;
  bool any = false;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    if (std::isnan(heights[i]) || (has_nodata && heights[i] == static_cast<float>(nodata)))
      continue;
    if (!any || heights[i] > heights[highest]) highest = i;
    if (!any || heights[i] < heights[lowest]) lowest = i;
    any = true;
  }
  const auto place = [&](const char* name, std::size_t i) {
    const auto width = static_cast<std::size_t>(columns);
    return Place{name, g[0] + (static_cast<double>(i % width) + 0.5) * g[1],
                 g[3] + (static_cast<double>(i / width) + 0.5) * g[5]};
  };
  const std::size_t middle =
      static_cast<std::size_t>(rows / 2) * static_cast<std::size_t>(columns) +
      static_cast<std::size_t>(columns / 2);
  return {place("highest", highest), place("lowest", lowest), place("middle", middle)};
}

void run(const std::string& line) {
  if (std::system((line + " > /dev/null 2>&1").c_str()) != 0)
    fmt::print("  failed: {}\n", line.substr(0, line.find(' ')));
}

void compare(const std::string& scarp, const std::string& dem, const test::TempFolder& folder) {
  const std::string ours = folder.path("ours.tif"), gdal = folder.path("gdal.tif"),
                    grass = folder.path("grass.tif"), script = folder.path("grass.sh");
  const bool has_grass = std::system("command -v grass > /dev/null") == 0;
  for (const Place& at : places_of(dem)) {
    for (const bool curved : {false, true}) {
      fmt::print("{}, {} sample, {}\n", std::filesystem::path(dem).filename().string(), at.name,
                 curved ? "curved earth" : "flat earth");
      run(
          fmt::format("'{}' viewshed '{}' --observer {:.6f},{:.6f},2 --earth {} -o '{}' "
                      "--overwrite",
                      scarp, dem, at.x, at.y, curved ? "ellipsoid" : "flat", ours));
      const std::vector<std::uint8_t> truth = read_seen(ours);
      std::filesystem::remove(gdal);
      run(fmt::format("gdal_viewshed -q -md 0 -ox {:.6f} -oy {:.6f} -oz 2 -cc {} '{}' '{}'", at.x,
                      at.y, curved ? 1 : 0, dem, gdal));
      tell("gdal_viewshed", truth, read_seen(gdal), 255);
      if (!has_grass) continue;
      std::filesystem::remove(grass);
      std::ofstream(script) << fmt::format(
          "set -e\nr.in.gdal -o --quiet input='{}' output=dem\ng.region raster=dem\n"
          "r.viewshed -b {} --quiet input=dem output=seen coordinates={:.6f},{:.6f} "
          "observer_elevation=2 target_elevation=0 memory=4000\n"
          "r.out.gdal -f --quiet input=seen output='{}' type=Byte nodata=255\n",
          dem, curved ? "-c" : "", at.x, at.y, grass);
      run(fmt::format("grass --tmp-location '{}' --exec bash '{}'", dem, script));
      tell("r.viewshed", truth, read_seen(grass), 1);
    }
  }
}

}  // namespace
}  // namespace scarp

int main(int, char** argv) {
  GDALAllRegister();
  const std::string program =
      (std::filesystem::canonical(argv[0]).parent_path().parent_path() / "scarp").string();
  const scarp::test::TempFolder folder;
  for (const char* name : {"projected/bigtujunga_srtm30m_utm11.tif",
                           "projected/mt_st_helens_usgs30m.dem", "projected/gabilan_lidar1m.bil"}) {
    const auto dem = scarp::test::shared_data(name);
    if (!dem) {
      fmt::print(stderr, "agreement_bench: the shared data are not there\n");
      return 1;
    }
    scarp::compare(program, *dem, folder);
  }
}
