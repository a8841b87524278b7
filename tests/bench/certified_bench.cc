// What certified regions cull of what can be culled, what they cost, and how fast they answer.
//   certified_bench [--dem NAME[,NAME]] [--vertices N] [--eyes N] [--group-triangles N] [--fans N]
//                   [--compactness X] [--sectors N] [--bytes N] [--patch X] [--threads N] [--json]
//   certified_bench --scale [--triangles N[,N]] [...]
// On every listed DEM groups are grown hidden together, as by the product, and squares of a
// quadtree are made with the same mean size; both are certified with the same settings. The exact
// judge tells from seeded eyes 2, 50, 300 and 1,000 m above vertices how many triangles are in
// truly hidden groups. `share` is what is culled of them, `of hidden` what is culled of all hidden
// triangles, in hidden groups or not. Means are over the DEMs that have something to cull at a
// height: at least kLeastShare of the triangles in hidden groups. Microseconds are user time of all
// threads, a triangle.
// At last the time that one camera takes with 10,000 groups: those of the last DEM, laid side by
// side, and cameras that fly over them; memory that was asked for meanwhile is counted.
// --scale measures how cost grows with the mesh, on one large DEM, and tells the bits of the
// result; on two idle cores a million triangles take minutes. Needs the shared data.

#include <fmt/core.h>
#include <gdal_priv.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "cli/build/certified_settings.h"
#include "core/culling/certified_culling.h"
#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/hidden_together.h"
#include "core/occlusion/splitmix64.h"
#include "core/occlusion/squares.h"
#include "core/sight/triangle_sight.h"
#include "core/threads/parallel_for.h"
#include "tests/judge/listed_mesh.h"
#include "tests/support/eyes_over_ground.h"

namespace {
std::atomic<std::uint64_t> allocations = 0;
}  // namespace

// Not inlined, so that the compiler sees a pair of new and delete.
__attribute__((noinline)) void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
__attribute__((noinline)) void operator delete(void* memory) noexcept {
  std::free(memory);
}
__attribute__((noinline)) void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace scarp {
namespace {

constexpr std::size_t kHeights = test::kEyeHeightsM.size();
constexpr double kLeastShare = 0.005;
constexpr std::size_t kRuntimeGroups = 10'000;
constexpr int kRuntimeCameras = 1'001;
constexpr test::ListedDem kLargeDem = {"taiwan-north", "scale/taiwan_north_20m_twd97.tif"};

struct Settings {
  std::uint32_t vertices = 25'000;
  int eyes = 30;
  std::string dems;
  std::uint32_t group_triangles = 128;
  double compactness = HiddenTogetherOptions{}.compactness;
  double bytes = kCertifiedBytes;
  std::optional<int> sectors;  // instead of bytes
  CertifiedSettings certified;
  bool json = false;
  bool scale = false;
  std::vector<std::uint32_t> triangles = {100'000, 300'000, 1'000'000};
};

double user_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec);
}

double wall_seconds() {
  using Clock = std::chrono::steady_clock;
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

/// Triangles over all eyes of a height.
struct Counts {
  double triangles = 0, hidden = 0, in_hidden = 0, culled = 0, falsely = 0;
};

struct Partition {
  std::string name;
  LeafGroups groups;
  CertifiedRegions regions;
  std::array<Counts, kHeights> counts{};
  double certify_user_s = 0, certify_wall_s = 0;
};

void certify(const Tin& tin, const Settings& settings, Partition& part) {
  CertifiedSettings certified = settings.certified;
  certified.sectors = settings.sectors.value_or(
      sectors_within(settings.bytes, tin.triangles.size(), part.groups.count));
  const double user_s = user_seconds(), wall_s = wall_seconds();
  part.regions = certify_groups(tin, part.groups.group_of_triangle, part.groups.count,
                                hiding_options(certified));
  part.certify_user_s = user_seconds() - user_s;
  part.certify_wall_s = wall_seconds() - wall_s;
  if (const auto broken = check_certified(part.regions)) {
    fmt::print(stderr, "BROKEN: {}\n", *broken);
    std::exit(1);
  }
}

void count(const std::vector<TriangleSight>& sight, const Position& eye, const Partition& part,
           Counts& counts) {
  std::vector<std::uint8_t> seen(part.groups.count, 0), culled(part.groups.count, 1);
  const auto& group_of = part.groups.group_of_triangle;
  for (std::size_t t = 0; t < sight.size(); ++t)
    if (sight[t] == TriangleSight::kVisible && group_of[t] != kNone) seen[group_of[t]] = 1;
  for (const GroupIndex g : CertifiedCulling(part.regions).visible({eye, {}}).visible_groups)
    culled[g] = 0;
  for (std::size_t t = 0; t < sight.size(); ++t) {
    const bool hidden = sight[t] == TriangleSight::kHidden;
    const bool is_culled = group_of[t] != kNone && culled[group_of[t]];
    ++counts.triangles;
    counts.hidden += hidden;
    counts.in_hidden += group_of[t] != kNone && !seen[group_of[t]];
    counts.culled += is_culled;
    counts.falsely += is_culled && !hidden;
  }
}

nlohmann::json row_of(const Tin& tin, const Partition& part) {
  const double triangles = static_cast<double>(tin.triangles.size());
  std::vector<std::uint32_t> sizes(part.groups.count, 0);
  double orphans = 0;
  for (const GroupIndex g : part.groups.group_of_triangle) {
    if (g == kNone)
      ++orphans;
    else
      ++sizes[g];
  }
  std::sort(sizes.begin(), sizes.end());
  nlohmann::json row = {
      {"groups", part.groups.count},
      {"median_group", sizes[sizes.size() / 2]},
      {"orphans", orphans / triangles},
      {"sectors", part.regions.layout.sectors},
      {"bytes_per_triangle", static_cast<double>(certified_bytes(part.regions)) / triangles},
      {"certify_us_per_triangle", 1e6 * part.certify_user_s / triangles},
      {"certify_wall_s", part.certify_wall_s}};
  double false_culls = 0;
  for (std::size_t h = 0; h < kHeights; ++h) {
    const Counts& c = part.counts[h];
    false_culls += c.falsely;
    const auto ratio = [](double part_of, double whole) {
      return whole > 0 ? nlohmann::json(part_of / whole) : nlohmann::json();
    };
    row["heights"].push_back({{"eye_height_m", test::kEyeHeightsM[h]},
                              {"hidden", ratio(c.hidden, c.triangles)},
                              {"in_hidden_groups", ratio(c.in_hidden, c.triangles)},
                              {"culled", ratio(c.culled, c.triangles)},
                              {"share", ratio(c.culled, c.in_hidden)},
                              {"of_hidden", ratio(c.culled, c.hidden)},
                              {"counts", c.in_hidden >= kLeastShare * c.triangles}});
  }
  row["false_culls"] = false_culls;
  return row;
}

/// The regions of the last DEM measured, for the run-time test.
struct Measured {
  nlohmann::json row;
  CertifiedRegions regions;
};

Measured measure(const test::ListedDem& listed, const Tin& tin, const Settings& settings) {
  HiddenTogetherOptions together;
  together.group_triangles = settings.group_triangles;
  together.compactness = settings.compactness;
  std::array<Partition, 2> parts;
  parts[0].name = "crystals";
  const double begun_s = user_seconds();
  parts[0].groups = grow_hidden_together(tin, together);
  const double grown_s = user_seconds() - begun_s;
  parts[1].name = "squares";
  parts[1].groups = group_by_squares(
      tin, static_cast<std::uint32_t>(tin.triangles.size() / parts[0].groups.count));
  for (Partition& part : parts) certify(tin, settings, part);
  const TinIndex index(tin);
  test::for_each_eye(tin, settings.eyes, [&](std::size_t h, const Position& eye) {
    const std::vector<TriangleSight> sight = judge_all(index, eye);
    for (Partition& part : parts) count(sight, eye, part, part.counts[h]);
  });
  const auto triangles = static_cast<double>(tin.triangles.size());
  nlohmann::json row = {{"dem", listed.name},
                        {"triangles", tin.triangles.size()},
                        {"grow_us_per_triangle", 1e6 * grown_s / triangles}};
  for (const Partition& part : parts) row[part.name] = row_of(tin, part);
  return {row, std::move(parts[0].regions)};
}

std::string number(const nlohmann::json& value) {
  return value.is_null() ? "-" : fmt::format("{:.3f}", value.get<double>());
}

void print_row(const nlohmann::json& row) {
  for (const char* name : {"crystals", "squares"}) {
    const nlohmann::json& part = row[name];
    std::string text = fmt::format("| {} | {} | {} ", row["dem"].get<std::string>(), name,
                                   row["triangles"].get<std::size_t>());
    for (const nlohmann::json& h : part["heights"])
      text += fmt::format("| {} ({}{}) | {} ", number(h["share"]), number(h["in_hidden_groups"]),
                          h["counts"].get<bool>() ? "" : ", not counted", number(h["of_hidden"]));
    fmt::print("{}| {} | {} | {:.3f} | {:.1f} | {:.0f} | {:.0f} |\n", text,
               part["false_culls"].get<double>(), part["median_group"].get<int>(),
               part["orphans"].get<double>(), part["bytes_per_triangle"].get<double>(),
               part["certify_us_per_triangle"].get<double>(),
               row["grow_us_per_triangle"].get<double>());
  }
  std::fflush(stdout);
}

/// Means of one figure by height, over the DEMs that count there.
nlohmann::json means(const nlohmann::json& rows, const char* part, const char* figure) {
  nlohmann::json all = nlohmann::json::array();
  for (std::size_t h = 0; h < kHeights; ++h) {
    double sum = 0;
    int dems = 0;
    for (const auto& row : rows) {
      const auto& height = row[part]["heights"][h];
      if (!row["crystals"]["heights"][h]["counts"].get<bool>() || height[figure].is_null())
        continue;
      sum += height[figure].get<double>();
      ++dems;
    }
    all.push_back({{"eye_height_m", test::kEyeHeightsM[h]},
                   {"dems", dems},
                   {"mean", dems > 0 ? nlohmann::json(sum / dems) : nlohmann::json()}});
  }
  return all;
}

/// Culled by crystals over culled by squares, of all heights of a DEM that count together: where
/// squares cull next to nothing a ratio for each height would say nothing.
nlohmann::json against_squares(const nlohmann::json& rows) {
  double sum = 0, worst = 0;
  int dems = 0;
  std::string worst_dem;
  for (const auto& row : rows) {
    double crystals = 0, squares = 0;
    for (std::size_t h = 0; h < kHeights; ++h) {
      if (!row["crystals"]["heights"][h]["counts"].get<bool>()) continue;
      crystals += row["crystals"]["heights"][h]["culled"].get<double>();
      squares += row["squares"]["heights"][h]["culled"].get<double>();
    }
    if (squares == 0) continue;
    const double ratio = crystals / squares;
    if (dems == 0 || ratio < worst) worst = ratio, worst_dem = row["dem"].get<std::string>();
    sum += ratio;
    ++dems;
  }
  if (dems == 0) return {{"dems", 0}};
  return {{"dems", dems}, {"mean", sum / dems}, {"worst", worst}, {"worst_dem", worst_dem}};
}

nlohmann::json summary_of(const nlohmann::json& rows) {
  nlohmann::json summary;
  for (const char* part : {"crystals", "squares"}) {
    summary[part] = {{"share", means(rows, part, "share")},
                     {"of_hidden", means(rows, part, "of_hidden")}};
    double false_culls = 0, orphans = 0, bytes = 0, user_us = 0;
    std::uint32_t least_median = kNone;
    for (const auto& row : rows) {
      false_culls += row[part]["false_culls"].get<double>();
      orphans = std::max(orphans, row[part]["orphans"].get<double>());
      bytes = std::max(bytes, row[part]["bytes_per_triangle"].get<double>());
      user_us += row[part]["certify_us_per_triangle"].get<double>();
      least_median = std::min(least_median, row[part]["median_group"].get<std::uint32_t>());
    }
    summary[part]["false_culls"] = false_culls;
    summary[part]["most_orphans"] = orphans;
    summary[part]["most_bytes_per_triangle"] = bytes;
    summary[part]["least_median_group"] = least_median;
    summary[part]["mean_certify_us_per_triangle"] = user_us / static_cast<double>(rows.size());
  }
  summary["culled_crystals_over_squares"] = against_squares(rows);
  return summary;
}

void print_summary(const nlohmann::json& summary) {
  for (const char* part : {"crystals", "squares"}) {
    for (const char* figure : {"share", "of_hidden"}) {
      fmt::print("{:<9} mean {:<9}", part, figure);
      for (const auto& h : summary[part][figure])
        fmt::print("  {:g} m: {} ({} DEMs)", h["eye_height_m"].get<double>(), number(h["mean"]),
                   h["dems"].get<int>());
      fmt::print("\n");
    }
    fmt::print(
        "{:<9} false culls {:g}, orphans at most {:.3f}, bytes a triangle at most {:.2f}, median "
        "group at least {}, certify {:.0f} us a triangle on average\n",
        part, summary[part]["false_culls"].get<double>(),
        summary[part]["most_orphans"].get<double>(),
        summary[part]["most_bytes_per_triangle"].get<double>(),
        summary[part]["least_median_group"].get<std::uint32_t>(),
        summary[part]["mean_certify_us_per_triangle"].get<double>());
  }
  fmt::print("culled, crystals / squares: {}\n", summary["culled_crystals_over_squares"].dump());
}

/// The regions over and over, side by side, as far as there are groups of them.
CertifiedRegions side_by_side(const CertifiedRegions& regions, std::size_t groups) {
  double low_x_m = HUGE_VAL, high_x_m = -HUGE_VAL, low_y_m = HUGE_VAL, high_y_m = -HUGE_VAL;
  for (const CertifiedGroup& g : regions.groups) {
    low_x_m = std::min(low_x_m, g.centre_x_m), high_x_m = std::max(high_x_m, g.centre_x_m);
    low_y_m = std::min(low_y_m, g.centre_y_m), high_y_m = std::max(high_y_m, g.centre_y_m);
  }
  const std::size_t each = regions.groups.size();
  const auto across = static_cast<std::size_t>(
      std::ceil(std::sqrt(static_cast<double>(groups) / static_cast<double>(each))));
  CertifiedRegions all{regions.layout, {}, {}};
  for (std::size_t i = 0; i < groups; ++i) {
    CertifiedGroup g = regions.groups[i % each];
    g.centre_x_m += static_cast<double>(i / each % across) * (high_x_m - low_x_m);
    g.centre_y_m += static_cast<double>(i / each / across) * (high_y_m - low_y_m);
    all.groups.push_back(g);
    const auto sectors = static_cast<std::size_t>(regions.layout.sectors);
    for (std::size_t s = 0; s < sectors; ++s)
      all.steps.push_back(regions.steps[i % each * sectors + s]);
  }
  return all;
}

nlohmann::json measure_runtime(const CertifiedRegions& measured) {
  const CertifiedRegions regions = side_by_side(measured, kRuntimeGroups);
  const CertifiedCulling culling(regions);
  std::vector<GroupIndex> visible(kRuntimeGroups);
  std::vector<double> times_us;
  times_us.reserve(kRuntimeCameras);
  SplitMix64 random(test::kEyeSeed);
  const std::uint64_t before = allocations;
  double seen = 0;
  for (int i = 0; i < kRuntimeCameras; ++i) {
    const CertifiedGroup& over = regions.groups[random.below(kRuntimeGroups)];
    const Camera camera{
        {over.centre_x_m, over.centre_y_m, over.height_m + test::kEyeHeightsM[random.below(4)]},
        {}};
    const double begun_s = wall_seconds();
    seen += static_cast<double>(culling.visible_into(camera, visible));
    times_us.push_back(1e6 * (wall_seconds() - begun_s));
  }
  const std::uint64_t allocated = allocations - before;
  std::sort(times_us.begin(), times_us.end());
  return {{"groups", kRuntimeGroups},
          {"cameras", kRuntimeCameras},
          {"median_us", times_us[times_us.size() / 2]},
          {"slowest_percent_us", times_us[times_us.size() * 99 / 100]},
          {"mean_visible", seen / kRuntimeCameras},
          {"allocations", allocated}};
}

int run_dems(const Settings& settings) {
  nlohmann::json rows = nlohmann::json::array();
  CertifiedRegions last;
  if (!settings.json)
    fmt::print(
        "| DEM | groups | triangles | 2 m: share (in hidden groups) | of hidden | 50 m | of hidden "
        "| 300 m | of hidden | 1,000 m | of hidden | false culls | median | orphans | B/triangle | "
        "certify us | grow us |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"
        "---|\n");
  for (const test::ListedDem& listed : test::kListedDems) {
    if (!test::is_asked_for(listed, settings.dems)) continue;
    const auto tin = test::mesh_of(listed, settings.vertices);
    if (!tin) {
      fmt::print(stderr, "left out, shared data not found: {}\n", listed.file);
      continue;
    }
    Measured measured = measure(listed, *tin, settings);
    rows.push_back(std::move(measured.row));
    last = std::move(measured.regions);
    if (!settings.json) print_row(rows.back());
  }
  if (rows.empty()) return 1;
  const nlohmann::json summary = summary_of(rows), runtime = measure_runtime(last);
  if (settings.json) {
    fmt::print("{}\n",
               nlohmann::json{{"dems", rows}, {"summary", summary}, {"runtime", runtime}}.dump(2));
  } else {
    print_summary(summary);
    fmt::print("run time: {}\n", runtime.dump());
  }
  return summary["crystals"]["false_culls"] == 0 && summary["squares"]["false_culls"] == 0 ? 0 : 1;
}

/// A number that changes with any bit of the steps, to compare builds and thread counts (FNV-1a).
std::string bits_of(const CertifiedRegions& regions) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const SectorSteps& steps : regions.steps)
    for (const std::uint16_t step : steps) hash = (hash ^ step) * 0x100000001b3;
  return fmt::format("{:016x}", hash);
}

int run_scale(const Settings& settings) {
  nlohmann::json rows = nlohmann::json::array();
  if (!settings.json)
    fmt::print(
        "| triangles | groups | grow us a triangle | certify us a triangle | wall us a triangle | "
        "certify wall s | threads | bits |\n|---|---|---|---|---|---|---|---|\n");
  for (const std::uint32_t triangles : settings.triangles) {
    const auto tin = test::mesh_of(kLargeDem, triangles / 2);
    if (!tin) {
      fmt::print(stderr, "left out, shared data not found: {}\n", kLargeDem.file);
      return 1;
    }
    Partition part;
    HiddenTogetherOptions together;
    together.group_triangles = settings.group_triangles;
    together.compactness = settings.compactness;
    const double begun_s = user_seconds();
    part.groups = grow_hidden_together(*tin, together);
    const double grown_s = user_seconds() - begun_s;
    certify(*tin, settings, part);
    const auto count = static_cast<double>(tin->triangles.size());
    rows.push_back({{"triangles", tin->triangles.size()},
                    {"groups", part.groups.count},
                    {"grow_us_per_triangle", 1e6 * grown_s / count},
                    {"certify_us_per_triangle", 1e6 * part.certify_user_s / count},
                    {"certify_wall_us_per_triangle", 1e6 * part.certify_wall_s / count},
                    {"certify_wall_s", part.certify_wall_s},
                    {"threads", thread_count()},
                    {"bits", bits_of(part.regions)}});
    if (settings.json) continue;
    fmt::print("| {} | {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {} | {} |\n", tin->triangles.size(),
               part.groups.count, 1e6 * grown_s / count, 1e6 * part.certify_user_s / count,
               1e6 * part.certify_wall_s / count, part.certify_wall_s, thread_count(),
               bits_of(part.regions));
    std::fflush(stdout);
  }
  if (settings.json)
    fmt::print("{}\n", nlohmann::json{{"dem", kLargeDem.name}, {"sizes", rows}}.dump(2));
  return 0;
}

/// Reads the value of an option that has one. @return whether it is known and proper
bool take_value(Settings& settings, const std::string& name, const char* value) {
  const auto whole = [&](int least) { return std::max(least, std::atoi(value)); };
  if (!*value) return false;
  if (name == "--dem") {
    settings.dems = value;
  } else if (name == "--vertices") {
    settings.vertices = static_cast<std::uint32_t>(whole(4));
  } else if (name == "--eyes") {
    settings.eyes = whole(1);
  } else if (name == "--group-triangles") {
    settings.group_triangles = static_cast<std::uint32_t>(whole(2));
  } else if (name == "--fans") {
    settings.certified.fans = whole(8);
  } else if (name == "--sectors") {
    settings.sectors = whole(8);
  } else if (name == "--bytes") {
    settings.bytes = std::atof(value);
  } else if (name == "--compactness") {
    settings.compactness = std::atof(value);
  } else if (name == "--patch") {
    settings.certified.patch = std::atof(value);
  } else if (name == "--threads") {
    set_thread_count(whole(1));
  } else if (name == "--triangles") {
    settings.triangles.clear();
    std::istringstream list(value);
    for (std::string one; std::getline(list, one, ',');)
      settings.triangles.push_back(
          static_cast<std::uint32_t>(std::max(100, std::atoi(one.c_str()))));
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
    } else if (name == "--scale") {
      settings.scale = true;
    } else if (i + 1 < argc && scarp::take_value(settings, name, argv[i + 1])) {
      ++i;
    } else {
      fmt::print(stderr,
                 "usage: certified_bench [--dem NAME[,NAME]] [--vertices N] [--eyes N] "
                 "[--group-triangles N] [--fans N] [--sectors N] [--bytes N] [--patch X] "
                 "[--threads N] [--scale [--triangles N[,N]]] [--json]\n");
      return 2;
    }
  }
  GDALAllRegister();
  return settings.scale ? scarp::run_scale(settings) : scarp::run_dems(settings);
}
