#include "cli/compare/compared_ground.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error/error.h"
#include "core/occlusion/splitmix64.h"
#include "ingest/dem/dem_windows.h"

namespace scarp {
namespace {

std::string flags_of(const DemOptions& options) {
  std::string flags;
  if (options.earth)
    flags += *options.earth == Earth::kFlat ? " --earth flat" : " --earth ellipsoid";
  if (options.refraction != 0) flags += fmt::format(" --refraction {:g}", options.refraction);
  if (!options.geoid_file.empty()) flags += fmt::format(" --geoid '{}'", options.geoid_file);
  if (options.height_unit) flags += " --height-unit " + *options.height_unit;
  if (options.nodata) flags += fmt::format(" --nodata {:g}", *options.nodata);
  return flags;
}

constexpr char kSquareName[] = "square.tif";

std::string cut_command_of(const std::vector<std::string>& files, const SampleRect& rect) {
  std::string gather, from = "'" + files.front() + "'";
  if (files.size() > 1) {
    gather = fmt::format("gdalbuildvrt all.vrt '{}' && ", fmt::join(files, "' '"));
    from = "all.vrt";
  }
  return fmt::format("{}gdal_translate -srcwin {} {} {} {} {} {}", gather, rect.first_column,
                     rect.first_row, rect.columns, rect.rows, from, kSquareName);
}

ComparedGround::Eye highest_of(const ComparedGround& ground) {
  ComparedGround::Eye best;
  double most_m = -HUGE_VAL;
  for (std::int32_t row = 0; row < ground.grid.rows(); ++row)
    for (std::int32_t column = 0; column < ground.grid.columns(); ++column) {
      if (!ground.grid.is_known(column, row)) continue;
      const double height_m = ground.grid.height_m(column, row);
      if (height_m > most_m) most_m = height_m, best = {column, row};
    }
  return best;
}

}  // namespace

double ComparedGround::cell_m() const {
  return std::min(samples.cell_x_m, samples.cell_y_m);
}

std::vector<std::uint32_t> ComparedGround::cell_corners() const {
  std::vector<std::uint32_t> corners;
  for (std::int32_t row = 0; row + 1 < samples.rows; ++row)
    for (std::int32_t column = 0; column + 1 < samples.columns; ++column) {
      if (!samples.is_ground_cell(column, row)) continue;
      const auto at = [&](std::int32_t dc, std::int32_t dr) {
        return static_cast<std::uint32_t>(samples.index(column + dc, row + dr));
      };
      for (const std::uint32_t i : {at(0, 0), at(0, 1), at(1, 0), at(1, 0), at(0, 1), at(1, 1)})
        corners.push_back(i);
    }
  return corners;
}

std::string ComparedGround::typed(const Eye& eye, double height_m) const {
  return fmt::format("{:.10g},{:.10g},{:g}", dem.x_of(eye.column), dem.y_of(eye.row), height_m);
}

std::vector<ComparedGround::Eye> ComparedGround::draw(std::size_t count, std::uint64_t seed) const {
  SplitMix64 random(seed);
  std::vector<Eye> drawn;
  while (drawn.size() < count) {
    const Eye at{static_cast<std::int32_t>(random.below(static_cast<std::uint64_t>(dem.columns))),
                 static_cast<std::int32_t>(random.below(static_cast<std::uint64_t>(dem.rows)))};
    if (grid.is_known(at.column, at.row)) drawn.push_back(at);
  }
  return drawn;
}

ComparedGround read_compared_ground(const std::vector<std::string>& files,
                                    const DemOptions& options, std::int32_t side, int eyes,
                                    std::uint64_t seed) {
  const DemWindows windows(files, options);
  ComparedGround ground;
  ground.files = files;
  ground.surface_flags = flags_of(options);
  ground.dem = windows.dem();
  Dem& dem = ground.dem;
  SampleRect rect;
  rect.columns = std::min(side, dem.columns);
  rect.rows = std::min(side, dem.rows);
  rect.first_column = (dem.columns - rect.columns) / 2;
  rect.first_row = (dem.rows - rect.rows) / 2;
  HeightWindow window = windows.read(rect);
  if (std::none_of(window.known.begin(), window.known.end(), [](std::uint8_t k) { return k; }))
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': its middle, {} x {} samples, is void; known ground was "
                            "expected; cut it with gdal_translate -srcwin",
                            files.front(), rect.columns, rect.rows));
  if (rect.columns < dem.columns || rect.rows < dem.rows) {
    ground.cut_command = cut_command_of(files, rect);
    ground.files = {kSquareName};
  }
  ground.samples = place_window(dem, window);
  dem.geotransform[0] += rect.first_column * dem.geotransform[1];
  dem.geotransform[3] += rect.first_row * dem.geotransform[5];
  dem.columns = rect.columns;
  dem.rows = rect.rows;
  dem.heights_m = std::move(window.heights_m);
  dem.known = std::move(window.known);
  ground.grid = GroundGrid(ground.samples);
  ground.earth = dem.frame->earth_frame();
  ground.eyes.push_back(highest_of(ground));
  for (const ComparedGround::Eye& eye : ground.draw(static_cast<std::size_t>(eyes - 1), seed))
    ground.eyes.push_back(eye);
  return ground;
}

}  // namespace scarp
