// Repeats tables 2 and 3 of Edmondson 2004 on the thesis's own terrains and prints them beside the
// published figures: thesis_bench [--json] [--runs N] [FOLDER OF THE SHARED DATA]
//
// Times are wall seconds on all threads, the median of the runs.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <nlohmann/json.hpp>

#include "core/horizon/stewart.h"
#include "core/occlusion/build_groups.h"
#include "core/threads/parallel_for.h"
#include "ingest/dem/dem.h"
#include "ingest/mesh/mesh.h"
#include "tests/support/shared_data.h"

namespace {

using namespace scarp;

/// A row of the thesis's tables: times in seconds on a dual 2.4 GHz machine of 2003.
struct Published {
  SectorLayout layout;
  double subsector_s;
  double horizons_s;
  int passes;
  int orphans;
  int groups;
  double grouping_s;
};

struct Terrain {
  const char* name;
  const char* file;
  std::uint32_t vertices;
  std::uint32_t seeds;
  std::uint32_t max_groups;
  std::vector<Published> rows;
};

const Terrain kTerrains[] = {{"Ashby Gap",
                              "literature/ashby_gap_va_i16.tif",
                              10'000,
                              100,
                              200,
                              {{{8, 1}, 0.035, 0.344, 3, 8'890, 200, 0.047},
                               {{8, 2}, 0.030, 0.484, 5, 2'878, 200, 0.062},
                               {{8, 4}, 0.026, 0.859, 10, 766, 161, 0.062},
                               {{8, 8}, 0.024, 1.531, 10, 357, 113, 0.063},
                               {{16, 4}, 0.024, 1.547, 10, 697, 144, 0.094},
                               {{32, 2}, 0.024, 1.547, 10, 1'488, 200, 0.140},
                               {{64, 1}, 0.024, 1.547, 3, 5'659, 200, 0.188}}},
                             {"Mt. Tiefort",
                              "literature/ntc_fort_irwin_i16.tif",
                              100'000,
                              500,
                              1'000,
                              {{{8, 1}, 0.873, 7.063, 6, 22'036, 1'000, 1.203},
                               {{8, 2}, 0.709, 11.422, 10, 9'032, 839, 1.406},
                               {{8, 4}, 0.607, 19.516, 10, 3'966, 622, 1.343},
                               {{8, 8}, 0.535, 34.359, 10, 1'508, 555, 1.375},
                               {{16, 4}, 0.532, 34.141, 10, 3'796, 633, 1.391},
                               {{32, 2}, 0.533, 34.266, 10, 8'525, 842, 2.469},
                               {{64, 1}, 0.542, 34.985, 5, 27'961, 1'000, 3.187}}}};

template <class Body>
double median_seconds(int runs, Body body) {
  std::vector<double> seconds;
  for (int i = 0; i < runs; ++i) {
    const auto begun = std::chrono::steady_clock::now();
    body();
    seconds.push_back(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count());
  }
  std::sort(seconds.begin(), seconds.end());
  return seconds[seconds.size() / 2];
}

Mesh mesh_of(const std::string& path, std::uint32_t vertices) {
  DemOptions flat;
  flat.earth = Earth::kFlat;
  MeshOptions options;
  options.vertex_budget = vertices;
  return mesh_samples(place_samples(read_dem({path}, flat, {})), options, {});
}

nlohmann::json measure(const Terrain& terrain, const Tin& tin, const Published& row, int runs) {
  HorizonTable horizons;
  const double horizons_s =
      median_seconds(runs, [&] { horizons = stewart_horizons(tin.vertices, row.layout, {}); });
  CrystalOptions options;  // the settings of table 3
  options.seeds = terrain.seeds;
  options.max_groups = terrain.max_groups;
  options.max_passes = 10;
  options.min_group_triangles = 30;
  options.merge_small = false;
  Groups groups;
  GroupingReport grouping;
  const double grouping_s =
      median_seconds(runs, [&] { groups = build_groups(tin, horizons, options, {}, &grouping); });
  return {{"terrain", terrain.name},
          {"sectors", row.layout.count},
          {"subsectors", row.layout.subsectors},
          {"subsector_s", horizons_s / (row.layout.count * row.layout.subsectors)},
          {"horizons_s", horizons_s},
          {"passes", grouping.passes},
          {"orphans", grouping.orphans},
          {"groups", groups.leaf_count},
          {"grouping_s", grouping_s},
          {"published",
           {{"subsector_s", row.subsector_s},
            {"horizons_s", row.horizons_s},
            {"passes", row.passes},
            {"orphans", row.orphans},
            {"groups", row.groups},
            {"grouping_s", row.grouping_s}}}};
}

void print_tables(const nlohmann::json& rows) {
  fmt::print(
      "| terrain, sectors/subsectors | a subsector, s | published | all horizons, s | published | "
      "times faster |\n");
  fmt::print("|---|---|---|---|---|---|\n");
  for (const auto& r : rows) {
    const auto& p = r["published"];
    fmt::print("| {} {}/{} | {:.4f} | {:.3f} | {:.3f} | {:.3f} | {:.0f} |\n",
               r["terrain"].get<std::string>(), r["sectors"].get<int>(), r["subsectors"].get<int>(),
               r["subsector_s"].get<double>(), p["subsector_s"].get<double>(),
               r["horizons_s"].get<double>(), p["horizons_s"].get<double>(),
               p["horizons_s"].get<double>() / r["horizons_s"].get<double>());
  }
  fmt::print(
      "\n| terrain, sectors/subsectors | passes | published | orphans | published | groups | "
      "published | grouping, s | published |\n");
  fmt::print("|---|---|---|---|---|---|---|---|---|\n");
  for (const auto& r : rows) {
    const auto& p = r["published"];
    fmt::print("| {} {}/{} | {} | {} | {} | {} | {} | {} | {:.3f} | {:.3f} |\n",
               r["terrain"].get<std::string>(), r["sectors"].get<int>(), r["subsectors"].get<int>(),
               r["passes"].get<int>(), p["passes"].get<int>(), r["orphans"].get<int>(),
               p["orphans"].get<int>(), r["groups"].get<int>(), p["groups"].get<int>(),
               r["grouping_s"].get<double>(), p["grouping_s"].get<double>());
  }
}

}  // namespace

int main(int argc, char** argv) {
  bool json = false;
  int runs = 3;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--json") == 0) json = true;
    if (std::strcmp(argv[i], "--runs") == 0 && i + 1 < argc)
      runs = std::max(1, std::atoi(argv[++i]));
  }
  nlohmann::json rows = nlohmann::json::array();
  for (const Terrain& terrain : kTerrains) {
    const auto path = test::shared_data(terrain.file);
    if (!path) {
      fmt::print(stderr, "left out, shared data not found: {}\n", terrain.file);
      continue;
    }
    const Mesh mesh = mesh_of(*path, terrain.vertices);
    if (!json)
      fmt::print("{}: {} vertices, {} triangles, error at samples {:.2f} m, {} threads\n",
                 terrain.name, mesh.tin.vertices.size(), mesh.tin.triangles.size(),
                 mesh.error_at_samples_m, thread_count());
    for (const Published& row : terrain.rows) rows.push_back(measure(terrain, mesh.tin, row, runs));
  }
  if (json)
    fmt::print("{}\n", rows.dump(2));
  else if (!rows.empty())
    print_tables(rows);
  return rows.empty() ? 1 : 0;
}
