#include "cli/compare/grass_peers.h"

#include <fmt/format.h>
#include <gdal_priv.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <numbers>

#include "core/error/error.h"

namespace scarp {
namespace {

constexpr double kNoData = -32768;

/// The square as a file that other programs read.
void write_square(const ComparedGround& ground, const std::string& path) {
  GDALAllRegister();
  GDALDatasetUniquePtr dataset(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      path.c_str(), ground.dem.columns, ground.dem.rows, 1, GDT_Float32, nullptr));
  const auto refuse = [&] {
    throw Error(ErrorCode::kResource, fmt::format("'{}' cannot be written", path));
  };
  if (!dataset) refuse();
  std::array<double, 6> to_map = ground.dem.geotransform;
  dataset->SetGeoTransform(to_map.data());
  const std::string& wkt = ground.dem.frame->description().crs_wkt;
  if (!wkt.empty()) dataset->SetProjection(wkt.c_str());
  GDALRasterBand* band = dataset->GetRasterBand(1);
  band->SetNoDataValue(kNoData);
  std::vector<double> heights_m = ground.dem.heights_m;
  for (std::size_t i = 0; i < heights_m.size(); ++i)
    if (!ground.dem.known[i]) heights_m[i] = kNoData;
  if (band->RasterIO(GF_Write, 0, 0, ground.dem.columns, ground.dem.rows, heights_m.data(),
                     ground.dem.columns, ground.dem.rows, GDT_Float64, 0, 0, nullptr) != CE_None)
    refuse();
}

/// @param samples  how many are expected
std::vector<double> read_raster(const std::string& path, std::size_t samples) {
  GDALDatasetUniquePtr dataset(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER));
  std::vector<double> values(samples);
  const int columns = dataset ? dataset->GetRasterXSize() : 0;
  const int rows = dataset ? dataset->GetRasterYSize() : 0;
  if (static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) != samples ||
      dataset->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, columns, rows, values.data(), columns,
                                          rows, GDT_Float64, 0, 0, nullptr) != CE_None)
    throw Error(ErrorCode::kResource, "gave no raster of the square's size");
  return values;
}

bool is_installed() {
  return std::system("command -v grass > /dev/null 2>&1") == 0;
}

}  // namespace

std::unique_ptr<GrassPeers> GrassPeers::find(const ComparedGround& ground, std::string& why) {
  if (!is_installed())
    why = "GRASS is not installed";
  else if (ground.dem.frame->is_geographic())
    why = "it takes degrees for metres";
  else
    return std::unique_ptr<GrassPeers>(new GrassPeers(ground));
  return nullptr;
}

GrassPeers::GrassPeers(const ComparedGround& ground) : ground_(ground) {
  write_square(ground, square_.path());
}

/// @return seconds of each run of the timed command
std::vector<double> GrassPeers::run(const std::string& timed, const std::string& then) const {
  const std::string script = square_.beside("grass.sh"), times = square_.beside("grass.times");
  std::ofstream(script) << "set -e\nr.in.gdal -o --quiet input='" << square_.path()
                        << "' output=dem\ng.region raster=dem\nfor run in $(seq " << kComparedRuns
                        << "); do\nstart=$(date +%s.%N)\n"
                        << timed << " --overwrite > /dev/null 2>&1\necho $start $(date +%s.%N)\n"
                        << "done > '" << times << "'\n"
                        << then << '\n';
  if (std::system(fmt::format("grass --tmp-location '{}' --exec bash '{}' > /dev/null 2>&1",
                              square_.path(), script)
                      .c_str()) != 0)
    throw Error(ErrorCode::kResource, fmt::format("'{}' failed", timed));
  std::vector<double> seconds;
  std::ifstream file(times);
  for (double begun_s = 0, ended_s = 0; file >> begun_s >> ended_s;)
    seconds.push_back(ended_s - begun_s);
  if (seconds.size() != kComparedRuns)
    throw Error(ErrorCode::kResource, fmt::format("'{}' was not timed", timed));
  return seconds;
}

std::string GrassPeers::viewshed_command(const ComparedGround::Eye& eye) const {
  const FrameDescription& frame = ground_.dem.frame->description();
  std::string bend;
  if (frame.earth != Earth::kFlat) bend = " -c";
  if (!bend.empty() && frame.refraction != 0)
    bend += fmt::format("r refraction_coeff={:g}", frame.refraction);
  return fmt::format(
      "r.viewshed -b{} input=dem output=seen coordinates={:.10g},{:.10g} observer_elevation={:g} "
      "memory=4000",
      bend, ground_.dem.x_of(eye.column), ground_.dem.y_of(eye.row), kComparedEyeHeightM);
}

ViewshedPeer GrassPeers::viewshed() const {
  return {"r.viewshed", "grid", viewshed_command(ground_.eyes.front()),
          [this](const ComparedGround::Eye& eye, std::span<Seen> seen) {
            const std::string out = square_.beside("seen.tif");
            const std::vector<double> seconds =
                run(viewshed_command(eye), "r.out.gdal --overwrite input=seen output='" + out +
                                               "' type=Byte nodata=255 format=GTiff");
            const std::vector<double> values = read_raster(out, seen.size());
            for (std::size_t i = 0; i < seen.size(); ++i)
              seen[i] = values[i] == 1 ? Seen::kVisible : Seen::kHidden;
            return seconds;
          }};
}

HorizonPeer GrassPeers::horizon() const {
  const std::string command =
      fmt::format("r.horizon elevation=dem step={} start=0 output=h", 360.0 / kComparedAzimuths);
  const std::size_t samples = ground_.dem.heights_m.size();
  return {"r.horizon", "every cell", command, static_cast<double>(samples) * kComparedAzimuths,
          [this, command, samples](std::span<const ComparedGround::Eye> places,
                                   std::span<double> elevation_deg) {
            const auto file = [&](int i) { return square_.beside(fmt::format("h{}.tif", i)); };
            std::string then;
            for (int i = 0; i < kComparedAzimuths; ++i)
              then += fmt::format(
                  "r.out.gdal -f --overwrite input=$(g.list raster pattern='h_*' | sed -n {}p) "
                  "output='{}' type=Float32 format=GTiff\n",
                  i + 1, file(i));
            const std::vector<double> seconds = run(command, then);
            for (int i = 0; i < kComparedAzimuths; ++i) {
              const std::vector<double> values = read_raster(file(i), samples);
              // It counts from east, against the clock; elevations are radians.
              const int azimuth =
                  (kComparedAzimuths / 4 - i + kComparedAzimuths) % kComparedAzimuths;
              for (std::size_t p = 0; p < places.size(); ++p)
                elevation_deg[p * kComparedAzimuths + static_cast<std::size_t>(azimuth)] =
                    values[static_cast<std::size_t>(places[p].row) *
                               static_cast<std::size_t>(ground_.dem.columns) +
                           static_cast<std::size_t>(places[p].column)] *
                    180 / std::numbers::pi;
            }
            return seconds;
          }};
}

}  // namespace scarp
