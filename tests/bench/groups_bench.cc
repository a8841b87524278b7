// How much groups cull that are grown by being hidden together, against the squares of a quadtree
// at equal mean size, on every listed DEM.
//   groups_bench [--vertices N] [--eyes N] [--dem NAME] [--threads N] [--no-regions] [--json]
// First what a perfect region could cull: the share of all triangles that are in truly hidden
// groups, by the exact judge, from seeded eyes 2, 50, 300 and 1,000 m above vertices. Then what the
// regions of method `stewart` do cull, with groups grown for them. A height counts where the
// squares hide at least kLeastShare; a DEM without such heights has nothing to cull. Seconds are
// CPU seconds of growing alone. Needs the shared data.

#include <fmt/core.h>
#include <gdal_priv.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/culling/visible_groups.h"
#include "core/horizon/stewart.h"
#include "core/occlusion/build_groups.h"
#include "core/occlusion/group_tree.h"
#include "core/occlusion/hidden_together.h"
#include "core/occlusion/squares.h"
#include "core/sight/triangle_sight.h"
#include "core/threads/parallel_for.h"
#include "tests/judge/listed_mesh.h"
#include "tests/support/eyes_over_ground.h"

namespace scarp {
namespace {

constexpr double kLeastShare = 0.05;
using test::for_each_eye;
using Shares = std::array<double, test::kEyeHeightsM.size()>;

struct Settings {
  std::uint32_t vertices = 25'000;
  int eyes = 30;
  std::string dem;
  bool regions = true;
  bool json = false;
};

double cpu_seconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

std::vector<std::uint32_t> sizes_of(const LeafGroups& leaves) {
  std::vector<std::uint32_t> sizes(leaves.count, 0);
  for (const GroupIndex g : leaves.group_of_triangle)
    if (g != kNone) ++sizes[g];
  return sizes;
}

/// Shares of all triangles that are hidden, and that are in hidden groups of each partition.
std::vector<Shares> judge(const Tin& tin, int eyes, const std::vector<const LeafGroups*>& parts) {
  std::vector<Shares> shares(1 + parts.size(), Shares{});
  const TinIndex index(tin);
  const double all = eyes * static_cast<double>(tin.triangles.size());
  for_each_eye(tin, eyes, [&](std::size_t h, const Position& eye) {
    const std::vector<TriangleSight> sight = judge_all(index, eye);
    const auto hidden = std::count(sight.begin(), sight.end(), TriangleSight::kHidden);
    shares[0][h] += static_cast<double>(hidden) / all;
    for (std::size_t p = 0; p < parts.size(); ++p) {
      std::vector<std::uint32_t> in_hidden = sizes_of(*parts[p]);
      for (TriangleIndex t = 0; t < sight.size(); ++t) {
        const GroupIndex group = parts[p]->group_of_triangle[t];
        if (group != kNone && sight[t] == TriangleSight::kVisible) in_hidden[group] = 0;
      }
      for (const std::uint32_t triangles : in_hidden) shares[p + 1][h] += triangles / all;
    }
  });
  return shares;
}

/// Share of all triangles that the regions of `stewart` cull.
Shares cull(const Tin& tin, const HorizonTable& horizon, int eyes, LeafGroups leaves) {
  Shares shares{};
  const Groups groups = build_group_tree(tin, horizon, std::move(leaves));
  const double all = eyes * static_cast<double>(tin.triangles.size());
  for_each_eye(tin, eyes, [&](std::size_t h, const Position& eye) {
    const CullingAnswer answer = visible_groups(groups, {eye, {}});
    for (const std::uint8_t culled : culled_triangles(groups, answer)) shares[h] += culled / all;
  });
  return shares;
}

/// Crystals / squares at each height, null where there is too little to cull, and their mean.
nlohmann::json ratios_of(const Shares& crystals, const Shares& squares) {
  nlohmann::json ratios = nlohmann::json::array();
  double sum = 0;
  int counted = 0;
  for (std::size_t h = 0; h < squares.size(); ++h) {
    const bool counts = squares[h] >= kLeastShare;
    ratios.push_back(counts ? nlohmann::json(crystals[h] / squares[h]) : nlohmann::json());
    if (!counts) continue;
    sum += crystals[h] / squares[h];
    ++counted;
  }
  return {{"squares", squares},
          {"crystals", crystals},
          {"ratios", ratios},
          {"mean_ratio", counted > 0 ? nlohmann::json(sum / counted) : nlohmann::json()}};
}

nlohmann::json measure(const test::ListedDem& listed, const Tin& tin, const Settings& settings) {
  HiddenTogetherOptions options;
  const double begun_s = cpu_seconds();
  const LeafGroups crystals = grow_hidden_together(tin, options);
  const double grown_s = cpu_seconds() - begun_s;
  // Both divide by the number of groups: squares of the mean size that the crystals have.
  const auto mean = static_cast<std::uint32_t>(tin.triangles.size() / crystals.count);
  const LeafGroups squares = group_by_squares(tin, mean);
  const std::vector<Shares> shares = judge(tin, settings.eyes, {&squares, &crystals});
  std::vector<std::uint32_t> sizes = sizes_of(crystals);
  std::sort(sizes.begin(), sizes.end());
  const auto orphans = std::count(crystals.group_of_triangle.begin(),
                                  crystals.group_of_triangle.end(), GroupIndex{kNone});
  nlohmann::json row = {
      {"dem", listed.name},
      {"triangles", tin.triangles.size()},
      {"groups", {{"squares", squares.count}, {"crystals", crystals.count}}},
      {"smallest", sizes.front()},
      {"median", sizes[sizes.size() / 2]},
      {"largest", sizes.back()},
      {"orphans", static_cast<double>(orphans) / static_cast<double>(tin.triangles.size())},
      {"cpu_s", grown_s},
      {"hidden_triangles", shares[0]},
      {"hidden_groups", ratios_of(shares[2], shares[1])}};
  if (settings.regions) {
    const HorizonTable horizon = stewart_horizons(tin.vertices, {}, {});
    row["stewart_regions"] =
        ratios_of(cull(tin, horizon, settings.eyes, grow_hidden_together(tin, options)),
                  cull(tin, horizon, settings.eyes, squares));
  }
  return row;
}

std::string number(const nlohmann::json& value) {
  return value.is_null() ? "-" : fmt::format("{:.3f}", value.get<double>());
}

void print_row(const nlohmann::json& row) {
  const nlohmann::json& hidden = row["hidden_groups"];
  std::string text =
      fmt::format("| {} | {} ", row["dem"].get<std::string>(), row["triangles"].get<std::size_t>());
  for (std::size_t h = 0; h < test::kEyeHeightsM.size(); ++h)
    text += fmt::format("| {} / {} = {} ", number(hidden["crystals"][h]),
                        number(hidden["squares"][h]), number(hidden["ratios"][h]));
  text += fmt::format("| {} ", number(hidden["mean_ratio"]));
  if (row.contains("stewart_regions"))
    text += fmt::format("| {} ", number(row["stewart_regions"]["mean_ratio"]));
  fmt::print("{}| {} | {} | {:.3f} | {:.2f} |\n", text, row["groups"]["crystals"].get<int>(),
             row["median"].get<int>(), row["orphans"].get<double>(), row["cpu_s"].get<double>());
  std::fflush(stdout);
}

/// Means and worst of the mean ratios over the DEMs that have something to cull.
nlohmann::json summary_of(const nlohmann::json& rows, const char* what) {
  double sum = 0, worst = 0;
  int counted = 0;
  for (const auto& row : rows) {
    if (!row.contains(what) || row[what]["mean_ratio"].is_null()) continue;
    const auto ratio = row[what]["mean_ratio"].get<double>();
    worst = counted == 0 ? ratio : std::min(worst, ratio);
    sum += ratio;
    ++counted;
  }
  if (counted == 0) return {{"dems", 0}};
  return {{"dems", counted}, {"mean", sum / counted}, {"worst", worst}};
}

int run(const Settings& settings) {
  GDALAllRegister();
  nlohmann::json rows = nlohmann::json::array();
  if (!settings.json)
    fmt::print(
        "| DEM | triangles | 2 m | 50 m | 300 m | 1,000 m | mean {}| groups | median | orphans | "
        "CPU s |\n|---|---|---|---|---|---|---|---|---|---|---|{}\n",
        settings.regions ? "| stewart " : "", settings.regions ? "---|" : "");
  for (const test::ListedDem& listed : test::kListedDems) {
    if (!settings.dem.empty() && settings.dem != listed.name) continue;
    const auto tin = test::mesh_of(listed, settings.vertices);
    if (!tin) {
      fmt::print(stderr, "left out, shared data not found: {}\n", listed.file);
      continue;
    }
    rows.push_back(measure(listed, *tin, settings));
    if (!settings.json) print_row(rows.back());
  }
  const nlohmann::json summary = {{"hidden_groups", summary_of(rows, "hidden_groups")},
                                  {"stewart_regions", summary_of(rows, "stewart_regions")}};
  if (settings.json)
    fmt::print("{}\n", nlohmann::json{{"dems", rows}, {"summary", summary}}.dump(2));
  else
    fmt::print("crystals / squares: {}\n", summary.dump());
  return rows.empty() ? 1 : 0;
}

}  // namespace
}  // namespace scarp

int main(int argc, char** argv) {
  scarp::Settings settings;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    const char* value = i + 1 < argc ? argv[i + 1] : "";
    if (name == "--json") {
      settings.json = true;
    } else if (name == "--no-regions") {
      settings.regions = false;
    } else if (name == "--dem" && *value) {
      settings.dem = argv[++i];
    } else if (name == "--vertices" && std::atol(value) > 3) {
      settings.vertices = static_cast<std::uint32_t>(std::atol(argv[++i]));
    } else if (name == "--eyes" && std::atoi(value) > 0) {
      settings.eyes = std::atoi(argv[++i]);
    } else if (name == "--threads" && std::atoi(value) > 0) {
      scarp::set_thread_count(std::atoi(argv[++i]));
    } else {
      fmt::print(stderr,
                 "usage: groups_bench [--vertices N] [--eyes N] [--dem NAME] [--threads N] "
                 "[--no-regions] [--json]\n");
      return 2;
    }
  }
  return scarp::run(settings);
}
