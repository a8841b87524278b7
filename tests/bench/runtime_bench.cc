// What an answer costs at run time, in C++ and in JavaScript, on 10,000 groups.
//   runtime_bench [--groups N] [--cameras N] [--json]
// Fractal ground with samples 30 m apart, groups of about 12 triangles, regions of 248 sectors (the
// size of look-ups does not depend on the triangles of a group). Cameras: places drawn at random,
// which know nothing of each other, and a flight at 120 m/s and 60 pictures a second. Medians over
// calls, microseconds of CPU time, on one thread; node where it is installed. Shared data: none.

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "core/culling/certified_culling.h"
#include "tests/support/fractal_ground.h"
#include "tests/support/temp_folder.h"
#include "tests/tiles/culling_scene.h"
#include "tiles/runtime/scarp_runtime.h"

namespace scarp {
namespace {

using runtime::Culling;
constexpr double kCellM = 30;

double cpu_us() {
  timespec now;
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) * 1e-3;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

/// Median time of ask(camera).
template <class Ask>
double time_us(const std::vector<Position>& eyes, Ask ask) {
  std::vector<double> times;
  for (const Position& eye : eyes) {
    const double begun = cpu_us();
    ask(eye);
    times.push_back(cpu_us() - begun);
  }
  return median(std::move(times));
}

std::vector<Position> random_eyes(const Tin& tin, int count) {
  std::mt19937_64 random(5);
  std::vector<Position> eyes;
  for (int i = 0; i < count; ++i) {
    Position eye = tin.vertices[random() % tin.vertices.size()];
    eye.z_m += static_cast<double>(2 + random() % 300);
    eyes.push_back(eye);
  }
  return eyes;
}

std::vector<Position> flight(const Tin& tin, int count) {
  const Bounds bounds = bounds_of(tin.vertices);
  const Position from{bounds.low.x_m * 0.9 + bounds.high.x_m * 0.1, bounds.low.y_m,
                      (bounds.low.z_m + bounds.high.z_m) / 2};
  std::vector<Position> eyes;
  for (int i = 0; i < count; ++i)
    eyes.push_back({from.x_m + 1.4 * i, from.y_m + 1.4 * i, from.z_m + 0.1 * i});
  return eyes;
}

/// The same in JavaScript, by its own clock; nothing where node is missing or fails.
nlohmann::json javascript(const std::string& file, const std::string& eyes) {
  const std::string command = "node '" + std::string(SCARP_SOURCE_DIR) +
                              "/tests/bench/runtime_bench.mjs' '" + file + "' '" + eyes +
                              "' 2>/dev/null";
  FILE* pipe = ::popen(command.c_str(), "r");
  std::string text;
  char piece[512];
  for (std::size_t got; pipe && (got = std::fread(piece, 1, sizeof piece, pipe)) > 0;)
    text.append(piece, got);
  if (!pipe || ::pclose(pipe) != 0) return nullptr;
  return nlohmann::json::parse(text, nullptr, false);
}

void write_bytes(const std::string& path, const void* bytes, std::size_t size) {
  std::ofstream(path, std::ios::binary)
      .write(static_cast<const char*>(bytes), static_cast<std::streamsize>(size));
}

int run(std::uint32_t groups, int cameras, bool json) {
  const auto side = static_cast<std::int32_t>(std::sqrt(groups * 6.0)) + 1;
  const test::FractalGround fractal(1);
  std::vector<std::int16_t> row_m(static_cast<std::size_t>(side));
  std::int32_t row_at = -1;
  const Tin tin = test::triangulated(
      test::grid_of(side, side, kCellM,
                    [&](std::int32_t column, std::int32_t row) {
                      if (row != row_at) fractal.row(row, 0, row_m);
                      row_at = row;
                      return static_cast<double>(row_m[static_cast<std::size_t>(column)]);
                    }),
      1);
  const auto scene = test::culling_scene(tin, 12, 32, 248);
  Culling culling;
  double begun = cpu_us();
  if (culling.open(scene->file.data(), scene->file.size()) != runtime::Status::kOk) return 1;
  const double open_us = cpu_us() - begun;
  begun = cpu_us();
  (void)culling.open(scene->file.data(), scene->file.size(), runtime::Check::kStructure);
  const double structure_us = cpu_us() - begun;

  std::vector<std::uint32_t> visible(culling.groups());
  std::vector<runtime::MovingView::Kept> kept(culling.groups());
  std::vector<double> units(culling.tiles());
  runtime::MovingView moving(culling, kept.data(), units.data());
  const CertifiedCulling certified(scene->groups.certified);
  std::uint64_t shown = 0, looked_at = 0;
  const auto camera_at = [&](const Position& p) {
    return culling.camera_in_frame(p.x_m, p.y_m, p.z_m);
  };
  const std::vector<Position> eyes = random_eyes(tin, cameras), path = flight(tin, cameras);
  const double turned_rad = 0.7;
  const auto frustum_of = [&](const Position& p, const runtime::Camera& camera) {
    double planes[8];
    for (int i = 0; i < 2; ++i) {
      const double at = turned_rad + (i == 0 ? 1 : -1) * 0.5;
      const double a = std::sin(at) * (i == 0 ? 1 : -1), b = std::cos(at) * (i == 0 ? -1 : 1);
      planes[4 * i] = a, planes[4 * i + 1] = b, planes[4 * i + 2] = 0;
      planes[4 * i + 3] = -(a * p.x_m + b * p.y_m);
    }
    return culling.frustum(camera, planes, 2);
  };
  nlohmann::json result;
  result["groups"] = culling.groups();
  result["file_bytes"] = scene->file.size();
  result["open_us"] = open_us;
  result["open_structure_us"] = structure_us;
  auto& cpp = result["cpp"];
  cpp["random_us"] = time_us(eyes, [&](const Position& p) {
    shown += culling.visible(camera_at(p), nullptr, visible.data());
  });
  result["visible_share"] =
      static_cast<double>(shown) / cameras / static_cast<double>(culling.groups());
  cpp["random_frustum_us"] = time_us(eyes, [&](const Position& p) {
    const auto camera = camera_at(p);
    const auto frustum = frustum_of(p, camera);
    (void)culling.visible(camera, &frustum, visible.data());
  });
  cpp["flight_us"] = time_us(path, [&](const Position& p) {
    (void)culling.visible(camera_at(p), nullptr, visible.data());
  });
  cpp["flight_moving_us"] = time_us(path, [&](const Position& p) {
    (void)moving.visible(camera_at(p), nullptr, visible.data());
    looked_at += moving.looked_at();
  });
  cpp["looked_at_share"] =
      static_cast<double>(looked_at) / cameras / static_cast<double>(culling.groups());
  cpp["box_us"] = time_us(eyes, [&](const Position& p) {
    const Position& at = eyes[static_cast<std::size_t>(std::abs(p.x_m)) % eyes.size()];
    (void)culling.box_visible(
        camera_at(p), culling.box_in_frame(at.x_m - 2, at.y_m - 2, at.x_m + 2, at.y_m + 2, at.z_m));
  });
  cpp["certified_in_core_us"] = time_us(eyes, [&](const Position& p) {
    (void)certified.visible_into({p, {}}, visible);
  });
  const test::TempFolder folder;
  write_bytes(folder.path("groups.scarp"), scene->file.data(), scene->file.size());
  std::vector<Position> all = eyes;
  all.insert(all.end(), path.begin(), path.end());
  write_bytes(folder.path("eyes"), all.data(), all.size() * sizeof(Position));
  result["javascript"] = javascript(folder.path("groups.scarp"), folder.path("eyes"));
  if (json) {
    fmt::print("{}\n", result.dump(2));
    return 0;
  }
  fmt::print("{} groups, file of {:.1f} MB, {:.0f} % visible\n", culling.groups(),
             static_cast<double>(scene->file.size()) * 1e-6,
             100 * result["visible_share"].get<double>());
  for (const char* where : {"cpp", "javascript"})
    for (const auto& [name, value] : result[where].items())
      fmt::print("| {} | {} | {:.3g} |\n", where, name, value.get<double>());
  return 0;
}

}  // namespace
}  // namespace scarp

int main(int argc, char** argv) {
  std::uint32_t groups = 10'000;
  int cameras = 2'000;
  bool json = false;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    const char* value = i + 1 < argc ? argv[i + 1] : "";
    if (name == "--json") {
      json = true;
    } else if (name == "--groups" && std::atoi(value) > 0) {
      groups = static_cast<std::uint32_t>(std::atoi(argv[++i]));
    } else if (name == "--cameras" && std::atoi(value) > 0) {
      cameras = std::atoi(argv[++i]);
    } else {
      fmt::print(stderr, "usage: runtime_bench [--groups N] [--cameras N] [--json]\n");
      return 2;
    }
  }
  return scarp::run(groups, cameras, json);
}
