// What certified regions cull on the meshes that users get.
//   built_bench [--dem NAME[,NAME]] [--eyes N] [--groups N] [--fans N[,N]] [--patch X] [--bytes N]
//               [--threads N] [--json]
// Every listed DEM is meshed as `scarp build` does unless told otherwise, to a tenth of a cell (of
// rasters of more than 1500 samples a side the middle), and all of it is grouped. So many groups
// drawn at random are certified and judged from seeded eyes 2, 50, 300 and 1,000 m above vertices:
// a fair sample of all, because groups do not depend on each other. `share` is triangles in culled
// groups over triangles in truly hidden ones; `raw` before bounds are coded in the bytes allowed.
// Means are over the DEMs of which at least kLeastShare is in hidden groups. Needs the shared data.

#include <fmt/core.h>
#include <gdal_priv.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <numeric>
#include <sstream>
#include <string>
#include <vector>

#include "cli/build/certified_settings.h"
#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/hidden_together.h"
#include "core/occlusion/splitmix64.h"
#include "core/sight/triangle_sight.h"
#include "core/threads/parallel_for.h"
#include "tests/judge/listed_mesh.h"
#include "tests/support/eyes_over_ground.h"

namespace scarp {
namespace {

constexpr std::size_t kHeights = test::kEyeHeightsM.size();
constexpr double kLeastShare = 0.005;
constexpr std::uint64_t kGroupSeed = 11;

struct Settings {
  std::string dems;
  int eyes = 4;
  std::uint32_t groups = 100;
  std::vector<int> fans = {CertifiedSettings{}.fans};
  double patch = CertifiedSettings{}.patch;
  double bytes = kCertifiedBytes;
  bool json = false;
};

/// Some groups of a mesh, and what the judge says of them.
struct Sample {
  Tin tin;
  std::uint32_t all_groups = 0;
  LeafGroups groups;              // those drawn; all other triangles have none
  std::vector<double> triangles;  // [groups]
  struct Look {
    std::size_t height;
    Position eye;
    std::vector<std::uint8_t> is_seen;  // [groups]
  };
  std::vector<Look> looks;
};

/// Keeps some groups, drawn at random.
void draw(std::uint32_t count, LeafGroups& groups) {
  if (count >= groups.count) return;
  SplitMix64 random(kGroupSeed);
  std::vector<GroupIndex> order(groups.count), number(groups.count, kNone);
  std::iota(order.begin(), order.end(), 0U);
  for (GroupIndex g = 0; g < count; ++g) {
    std::swap(order[g], order[g + random.below(groups.count - g)]);
    number[order[g]] = g;
  }
  for (GroupIndex& g : groups.group_of_triangle)
    if (g != kNone) g = number[g];
  groups.count = count;
}

void judge(int eyes, Sample& sample) {
  std::vector<TriangleIndex> members;
  const auto& group_of = sample.groups.group_of_triangle;
  sample.triangles.assign(sample.groups.count, 0);
  for (TriangleIndex t = 0; t < group_of.size(); ++t) {
    if (group_of[t] == kNone) continue;
    members.push_back(t);
    ++sample.triangles[group_of[t]];
  }
  const TinIndex index(sample.tin);
  test::for_each_eye(sample.tin, eyes, [&](std::size_t height, const Position& eye) {
    Sample::Look look{height, eye, std::vector<std::uint8_t>(sample.groups.count, 0)};
    const std::vector<TriangleSight> sight = judge_each(index, eye, members);
    for (std::size_t i = 0; i < members.size(); ++i)
      if (sight[i] == TriangleSight::kVisible) look.is_seen[group_of[members[i]]] = 1;
    sample.looks.push_back(std::move(look));
  });
}

/// Whether bounds hide a group, before they are coded.
bool is_under(const HidingBounds& bounds, GroupIndex group, const Position& eye) {
  const Circle& circle = bounds.circle[group];
  const double x_m = eye.x_m - circle.x_m, y_m = eye.y_m - circle.y_m;
  const double distance_m = std::hypot(x_m, y_m);
  const double inner_m = circle.radius_m * kFirstRing;
  if (!(distance_m > inner_m)) return false;
  const std::int32_t ring =
      ring_of(bounds.layout, static_cast<float>(distance_m * distance_m / (inner_m * inner_m)));
  if (ring < 0) return false;
  const float slope =
      bounds.at(group, sector_of(bounds.layout, x_m, y_m))[static_cast<std::size_t>(ring)];
  return eye.z_m < bounds.height_m[group] + static_cast<double>(slope) * distance_m;
}

nlohmann::json measure(const test::ListedDem& listed, const Sample& sample, int fans,
                       const Settings& settings) {
  CertifiedSettings certified;
  certified.fans = fans;
  certified.patch = settings.patch;
  certified.sectors =
      sectors_within(settings.bytes, sample.tin.triangles.size(), sample.all_groups);
  const auto& groups = sample.groups;
  const HidingBounds bounds =
      bound_hiding(sample.tin, groups.group_of_triangle, groups.count, hiding_options(certified));
  const CertifiedRegions regions = compress_bounds(bounds, LeastGround(sample.tin));
  std::array<double, kHeights> all{}, hidden{}, raw{}, culled{};
  std::uint64_t false_culls = 0;
  for (const Sample::Look& look : sample.looks)
    for (GroupIndex g = 0; g < groups.count; ++g) {
      const bool is_culled = hides_group(regions, g, look.eye);
      const bool is_bound = is_under(bounds, g, look.eye);
      all[look.height] += sample.triangles[g];
      if (look.is_seen[g]) {
        false_culls += is_culled || is_bound;
        continue;
      }
      hidden[look.height] += sample.triangles[g];
      raw[look.height] += is_bound ? sample.triangles[g] : 0;
      culled[look.height] += is_culled ? sample.triangles[g] : 0;
    }
  nlohmann::json row = {{"dem", listed.name},
                        {"triangles", sample.tin.triangles.size()},
                        {"groups", sample.all_groups},
                        {"fans", fans},
                        {"false_culls", false_culls}};
  for (std::size_t h = 0; h < kHeights; ++h) {
    const double share = hidden[h] / all[h];
    row["heights"].push_back({{"eye_height_m", test::kEyeHeightsM[h]},
                              {"in_hidden_groups", share},
                              {"counts", share >= kLeastShare},
                              {"raw", hidden[h] > 0 ? raw[h] / hidden[h] : 0},
                              {"share", hidden[h] > 0 ? culled[h] / hidden[h] : 0}});
  }
  return row;
}

void print_row(const nlohmann::json& row) {
  std::string text = fmt::format("| {} | {} | {} ", row["dem"].get<std::string>(),
                                 row["triangles"].get<std::size_t>(), row["fans"].get<int>());
  for (const auto& h : row["heights"]) {
    if (h["counts"].get<bool>())
      text += fmt::format("| {:.3f} ", h["share"].get<double>());
    else
      text += "| – ";
  }
  fmt::print("{}| {} |\n", text, row["false_culls"].get<std::uint64_t>());
  std::fflush(stdout);
}

/// Means of a figure over the DEMs that count, for one number of fans.
nlohmann::json means(const nlohmann::json& rows, int fans, const char* figure) {
  nlohmann::json all = nlohmann::json::array();
  for (std::size_t h = 0; h < kHeights; ++h) {
    double sum = 0;
    int dems = 0;
    for (const auto& row : rows) {
      const auto& height = row["heights"][h];
      if (row["fans"] != fans || !height["counts"].get<bool>()) continue;
      sum += height[figure].get<double>();
      ++dems;
    }
    all.push_back({{"eye_height_m", test::kEyeHeightsM[h]},
                   {"dems", dems},
                   {"mean", dems > 0 ? sum / dems : 0}});
  }
  return all;
}

int run(const Settings& settings) {
  nlohmann::json rows = nlohmann::json::array(), summary = nlohmann::json::array();
  if (!settings.json)
    fmt::print(
        "| DEM | triangles | fans | 2 m | 50 m | 300 m | 1000 m | false culls |\n"
        "|---|---|---|---|---|---|---|---|\n");
  for (const test::ListedDem& listed : test::kListedDems) {
    if (!test::is_asked_for(listed, settings.dems)) continue;
    Sample sample;
    auto tin = test::built_mesh_of(listed);
    if (!tin) {
      fmt::print(stderr, "left out, shared data not found: {}\n", listed.file);
      continue;
    }
    sample.tin = std::move(*tin);
    sample.groups = grow_hidden_together(sample.tin, {});
    sample.all_groups = sample.groups.count;
    draw(settings.groups, sample.groups);
    judge(settings.eyes, sample);
    for (const int fans : settings.fans) {
      rows.push_back(measure(listed, sample, fans, settings));
      if (!settings.json) print_row(rows.back());
    }
  }
  std::uint64_t false_culls = 0;
  for (const auto& row : rows) false_culls += row["false_culls"].get<std::uint64_t>();
  for (const int fans : settings.fans) {
    summary.push_back(
        {{"fans", fans}, {"share", means(rows, fans, "share")}, {"raw", means(rows, fans, "raw")}});
    if (settings.json) continue;
    for (const char* figure : {"share", "raw"}) {
      fmt::print("{} fans, mean {:<5}", fans, figure);
      for (const auto& h : summary.back()[figure])
        fmt::print("  {:g} m: {:.3f} ({} DEMs)", h["eye_height_m"].get<double>(),
                   h["mean"].get<double>(), h["dems"].get<int>());
      fmt::print("\n");
    }
  }
  if (settings.json)
    fmt::print("{}\n", nlohmann::json{{"dems", rows}, {"summary", summary}}.dump(2));
  return rows.empty() || false_culls > 0 ? 1 : 0;
}

/// Reads the value of an option that has one. @return whether it is known
bool take_value(Settings& settings, const std::string& name, const char* value) {
  if (name == "--dem") {
    settings.dems = value;
  } else if (name == "--eyes") {
    settings.eyes = std::max(1, std::atoi(value));
  } else if (name == "--groups") {
    settings.groups = static_cast<std::uint32_t>(std::max(1, std::atoi(value)));
  } else if (name == "--patch") {
    settings.patch = std::max(0.01, std::atof(value));
  } else if (name == "--bytes") {
    settings.bytes = std::atof(value);
  } else if (name == "--threads") {
    set_thread_count(std::max(1, std::atoi(value)));
  } else if (name == "--fans") {
    settings.fans.clear();
    std::istringstream list(value);
    for (std::string one; std::getline(list, one, ',');)
      settings.fans.push_back(std::max(8, std::atoi(one.c_str()) / 8 * 8));
  } else {
    return false;
  }
  return true;
}

}  // namespace
}  // namespace scarp

int main(int argc, char** argv) {
  scarp::Settings settings;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--json") {
      settings.json = true;
    } else if (i + 1 < argc && scarp::take_value(settings, name, argv[i + 1])) {
      ++i;
    } else {
      fmt::print(stderr,
                 "usage: built_bench [--dem NAME[,NAME]] [--eyes N] [--groups N] [--fans N[,N]] "
                 "[--patch X] [--bytes N] [--threads N] [--json]\n");
      return 2;
    }
  }
  GDALAllRegister();
  return scarp::run(settings);
}
