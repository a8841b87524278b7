// What certified regions cull of what can be culled, what they cost, and how fast they answer.
//   certified_bench [--dem NAME[,NAME]] [--vertices N | --built] [--groups N] [--eyes N]
//                   [--whole N] [--group-triangles N] [--compactness X] [--fans N[,N]]
//                   [--sectors N] [--bytes N[,N]] [--patch X] [--threads N] [--json] [--markdown]
//                   [--front SVG]
//   certified_bench --scale [--triangles N[,N]] [...]
// On every listed DEM groups are grown hidden together, as by the product, and squares of a
// quadtree are made with the same mean size; both are certified with the same settings. The exact
// judge tells from seeded eyes 2, 50, 300 and 1,000 m above vertices how many triangles are in
// truly hidden groups. `share` is what is culled of them, `raw` before bounds are coded in the
// bytes allowed, `of hidden` what is culled of all hidden triangles, in hidden groups or not. Means
// are over the DEMs that have something to cull at a height: at least kLeastInHiddenGroups of the
// triangles. Microseconds are user time of all threads, a triangle.
// --built takes the meshes that users get, as `scarp build` makes them unless told otherwise, to a
// tenth of a cell (of rasters of more than 1500 samples a side the middle). With --groups so many
// groups, drawn by their triangles, stand for all: a fair sample, because groups do not depend on
// each other; but meshes of at most --whole triangles are judged whole, from three times the eyes.
// scripts/bench built is --built --groups 100 --eyes 4 --whole 80000. `ratio` is what crystals cull
// over what squares do, of the same hidden triangles, with its standard error where groups were
// drawn. At last the time that one camera takes with 10,000 groups: those of the last DEM, laid
// side by side, and cameras that fly over them; memory that was asked for meanwhile is counted.
// --markdown leaves out the DEMs' rows: what one setting comes to beside what is wanted of it.
// --front tries several numbers of fans and of bytes, crystals only, and draws what they come to.
// --scale measures how cost grows with the mesh, on one large DEM, and tells the bits of the
// result; on two idle cores a million triangles take minutes. Needs the shared data.

#include <fmt/core.h>
#include <gdal_priv.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "core/culling/certified_culling.h"
#include "core/occlusion/splitmix64.h"
#include "core/threads/parallel_for.h"
#include "tests/bench/certified_front.h"
#include "tests/bench/certified_measure.h"
#include "tests/judge/listed_mesh.h"

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

using test::Partition;

constexpr std::size_t kHeights = test::kEyeHeightsM.size();
constexpr std::size_t kRuntimeGroups = 10'000;
constexpr int kRuntimeCameras = 1'001;
constexpr test::ListedDem kLargeDem = {"taiwan-north", "scale/taiwan_north_20m_twd97.tif"};

struct Settings {
  std::uint32_t vertices = 25'000;
  bool built = false;
  std::string dems;
  test::CertifiedQuestion question;
  std::vector<int> fans = {CertifiedSettings{}.fans};  // with the first of the bytes
  std::vector<double> bytes = {kCertifiedBytes};       // with the first of the fans
  bool json = false, markdown = false, scale = false;
  std::string front;  // where the picture is to be
  std::vector<std::uint32_t> triangles = {100'000, 300'000, 1'000'000};
};

std::optional<Tin> mesh(const test::ListedDem& listed, const Settings& settings) {
  auto tin =
      settings.built ? test::built_mesh_of(listed) : test::mesh_of(listed, settings.vertices);
  if (!tin) fmt::print(stderr, "left out, shared data not found: {}\n", listed.file);
  return tin;
}

/// The regions of the last DEM measured, for the run-time test.
struct Measured {
  nlohmann::json row;
  CertifiedRegions regions;
};

Measured measure(const test::ListedDem& listed, const Tin& tin, const Settings& settings) {
  Partition crystals = test::crystals_of(tin, settings.question);
  Partition squares = test::squares_like(tin, crystals, settings.question);
  const auto eyes = test::judge_eyes(tin, {&crystals, &squares}, eyes_for(tin, settings.question));
  const auto triangles = static_cast<double>(tin.triangles.size());
  nlohmann::json row = {{"dem", listed.name},
                        {"triangles", tin.triangles.size()},
                        {"grow_us_per_triangle", 1e6 * crystals.grow_user_s / triangles}};
  for (Partition* part : {&crystals, &squares}) {
    test::certify(tin, settings.question, *part);
    test::count_eyes(eyes, *part);
    row[part->name] = row_of(tin, *part);
  }
  if (const auto advantage = test::advantage_of(crystals, squares))
    row["over_squares"] = {{"culled", advantage->culled},
                           {"culled_error", advantage->error},
                           {"in_hidden_groups", advantage->in_hidden}};
  return {row, std::move(crystals.regions)};
}

std::string number(const nlohmann::json& value) {
  return value.is_null() ? "-" : fmt::format("{:.3f}", value.get<double>());
}

/// Culled of all hidden triangles, at all heights together.
double of_hidden(const nlohmann::json& part) {
  double culled = 0, hidden = 0;
  for (const auto& h : part["heights"])
    culled += h["culled"].get<double>(), hidden += h["hidden"].get<double>();
  return hidden > 0 ? culled / hidden : 0;
}

/// Culled by crystals over culled by squares, and how much that is worth.
std::string ratio_of(const nlohmann::json& row) {
  if (!row.contains("over_squares")) return "–";
  const nlohmann::json& over = row["over_squares"];
  const auto error = over["culled_error"].get<double>();
  return fmt::format("{:.3f}", over["culled"].get<double>()) +
         (error > 0 ? fmt::format(" ± {:.3f}", error) : "");
}

/// Crystals and, after a stroke, squares.
void print_row(const nlohmann::json& row) {
  const nlohmann::json &crystals = row["crystals"], &squares = row["squares"];
  std::string text =
      fmt::format("| {} | {} ", row["dem"].get<std::string>(), row["triangles"].get<std::size_t>());
  for (std::size_t h = 0; h < kHeights; ++h) {
    const auto& height = crystals["heights"][h];
    if (height["counts"].get<bool>())
      text += fmt::format("| {} / {} ", number(height["share"]),
                          number(squares["heights"][h]["share"]));
    else
      text += "| – ";
  }
  fmt::print(
      "{}| {:.3f} / {:.3f} | {} | {} | {:.1f} | {:.1f} | {:.0f} | {:.0f} | {:g} |\n", text,
      of_hidden(crystals), of_hidden(squares), ratio_of(row), crystals["median_group"].get<int>(),
      100 * crystals["orphans"].get<double>(), crystals["bytes_per_triangle"].get<double>(),
      crystals["certify_us_per_triangle"].get<double>(), row["grow_us_per_triangle"].get<double>(),
      crystals["false_culls"].get<double>() + squares["false_culls"].get<double>());
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

/// Crystals over squares, a figure of test::Advantage, over the DEMs.
nlohmann::json against_squares(const nlohmann::json& rows, const char* figure) {
  double sum = 0, worst = 0;
  int dems = 0;
  std::string worst_dem;
  for (const auto& row : rows) {
    if (!row.contains("over_squares")) continue;
    const auto ratio = row["over_squares"][figure].get<double>();
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
                     {"raw", means(rows, part, "raw")},
                     {"of_hidden", means(rows, part, "of_hidden")}};
    double false_culls = 0, orphans = 0, bytes = 0, user_us = 0, most_us = 0;
    std::uint32_t least_median = kNone;
    for (const auto& row : rows) {
      false_culls += row[part]["false_culls"].get<double>();
      orphans = std::max(orphans, row[part]["orphans"].get<double>());
      bytes = std::max(bytes, row[part]["bytes_per_triangle"].get<double>());
      user_us += row[part]["certify_us_per_triangle"].get<double>();
      most_us = std::max(most_us, row[part]["certify_us_per_triangle"].get<double>());
      least_median = std::min(least_median, row[part]["median_group"].get<std::uint32_t>());
    }
    summary[part]["false_culls"] = false_culls;
    summary[part]["most_orphans"] = orphans;
    summary[part]["most_bytes_per_triangle"] = bytes;
    summary[part]["least_median_group"] = least_median;
    summary[part]["most_certify_us_per_triangle"] = most_us;
    summary[part]["mean_certify_us_per_triangle"] = user_us / static_cast<double>(rows.size());
  }
  summary["culled_crystals_over_squares"] = against_squares(rows, "culled");
  summary["in_hidden_groups_crystals_over_squares"] = against_squares(rows, "in_hidden_groups");
  return summary;
}

std::string figures(const nlohmann::json& heights, bool with_dems) {
  std::string text;
  for (const auto& h : heights)
    text += fmt::format("{}{}{}", text.empty() ? "" : " / ", number(h["mean"]),
                        with_dems ? fmt::format(" ({})", h["dems"].get<int>()) : "");
  return text;
}

/// What one setting comes to beside what is wanted of it, as the table of docs/verify.md.
void print_one_setting(const nlohmann::json& summary, const nlohmann::json& runtime,
                       const nlohmann::json& rows) {
  const nlohmann::json& crystals = summary["crystals"];
  const nlohmann::json& squares = summary["squares"];
  const nlohmann::json& ratio = summary["culled_crystals_over_squares"];
  std::size_t least = SIZE_MAX, most = 0;
  for (const auto& row : rows) {
    least = std::min(least, row["triangles"].get<std::size_t>());
    most = std::max(most, row["triangles"].get<std::size_t>());
  }
  const auto line = [](const std::string& what, const std::string& wanted,
                       const std::string& measured) {
    fmt::print("| {} | {} | {} |\n", what, wanted, measured);
  };
  fmt::print("| {} DEMs, meshes of {} to {} triangles | wanted | measured |\n|---|---|---|\n",
             rows.size(), least, most);
  line("visible triangles culled", "0", fmt::format("{:g}", crystals["false_culls"].get<double>()));
  for (std::size_t h = 0; h < kHeights; ++h)
    line(fmt::format("culled of hidden groups, {:g} m: mean of {} DEMs", test::kEyeHeightsM[h],
                     crystals["share"][h]["dems"].get<int>()),
         fmt::format("{:.2f}", test::kWantedShare[h]),
         fmt::format("{} ({} before coding)", number(crystals["share"][h]["mean"]),
                     number(crystals["raw"][h]["mean"])));
  line("culled of all hidden triangles, 2 / 50 / 300 / 1000 m: crystals", "not below squares",
       figures(crystals["of_hidden"], false));
  line("the same: squares", "", figures(squares["of_hidden"], false));
  if (ratio["dems"].get<int>() > 0) {
    line("culled by crystals over squares, mean", fmt::format("{:.2f}", test::kLeastOverSquares),
         fmt::format("{:.2f}", ratio["mean"].get<double>()));
    line("the same, worst", "1",
         fmt::format("{:.2f} ({})", ratio["worst"].get<double>(),
                     ratio["worst_dem"].get<std::string>()));
    const nlohmann::json& hidden = summary["in_hidden_groups_crystals_over_squares"];
    line("triangles in truly hidden groups, crystals over squares, mean and worst", "",
         fmt::format("{:.2f}, {:.2f} ({})", hidden["mean"].get<double>(),
                     hidden["worst"].get<double>(), hidden["worst_dem"].get<std::string>()));
  }
  line("orphans of the triangles, most", fmt::format("{:.0f} %", 100 * test::kMostOrphans),
       fmt::format("{:.1f} %", 100 * crystals["most_orphans"].get<double>()));
  line("triangles of the median group, least", fmt::format("{}", test::kLeastMedianGroup),
       fmt::format("{}", crystals["least_median_group"].get<std::uint32_t>()));
  line("bytes a triangle, most", fmt::format("{:g}", test::kMostBytes),
       fmt::format("{:.2f}", crystals["most_bytes_per_triangle"].get<double>()));
  line("processor time to certify a triangle, mean and most", fmt::format("{:g} us", test::kMostUs),
       fmt::format("{:.0f} us, {:.0f} us", crystals["mean_certify_us_per_triangle"].get<double>(),
                   crystals["most_certify_us_per_triangle"].get<double>()));
  line("10,000 groups, median and slowest per cent; allocations",
       fmt::format("{:g} us; 0", test::kMostRuntimeUs),
       fmt::format("{:.0f} us, {:.0f} us; {}", runtime["median_us"].get<double>(),
                   runtime["slowest_percent_us"].get<double>(),
                   runtime["allocations"].get<std::uint64_t>()));
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
    const double begun_s = test::wall_seconds();
    seen += static_cast<double>(culling.visible_into(camera, visible));
    times_us.push_back(1e6 * (test::wall_seconds() - begun_s));
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
  const bool with_rows = !settings.json && !settings.markdown;
  if (with_rows)
    fmt::print(
        "| DEM | triangles | 2 m | 50 m | 300 m | 1000 m | of all hidden | ratio | median group | "
        "orphans, % | bytes | certify, us | grow, us | false culls |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const test::ListedDem& listed : test::kListedDems) {
    if (!test::is_asked_for(listed, settings.dems)) continue;
    const auto tin = mesh(listed, settings);
    if (!tin) continue;
    Measured measured = measure(listed, *tin, settings);
    rows.push_back(std::move(measured.row));
    last = std::move(measured.regions);
    if (with_rows) print_row(rows.back());
  }
  if (rows.empty()) return 1;
  const nlohmann::json summary = summary_of(rows), runtime = measure_runtime(last);
  if (settings.json) {
    fmt::print("{}\n",
               nlohmann::json{{"dems", rows}, {"summary", summary}, {"runtime", runtime}}.dump(2));
  } else {
    if (with_rows) fmt::print("\n");
    print_one_setting(summary, runtime, rows);
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

/// What several settings come to on crystals: fans with the first of the bytes, then the other way
/// round.
int run_settings(const Settings& settings) {
  struct Trial {
    test::CertifiedQuestion question;
    nlohmann::json point, rows = nlohmann::json::array();
  };
  std::vector<Trial> trials;
  const auto add = [&](int fans, double bytes, const char* varies, const std::string& label) {
    Trial trial{settings.question, {}, nlohmann::json::array()};
    trial.question.certified.fans = fans;
    trial.question.bytes = bytes;
    const bool is_default = fans == CertifiedSettings{}.fans && bytes == kCertifiedBytes;
    trial.point = {
        {"fans", fans}, {"varies", varies}, {"label", label}, {"is_default", is_default}};
    trials.push_back(std::move(trial));
  };
  for (const int fans : settings.fans)
    add(fans, settings.bytes[0], "fans", fmt::format("{} fans", fans));
  for (std::size_t i = 1; i < settings.bytes.size(); ++i)
    add(settings.fans[0], settings.bytes[i], "bytes", fmt::format("{:g} B", settings.bytes[i]));
  std::string names;
  for (const test::ListedDem& listed : test::kListedDems) {
    if (!test::is_asked_for(listed, settings.dems)) continue;
    const auto tin = mesh(listed, settings);
    if (!tin) continue;
    names += (names.empty() ? "" : ", ") + std::string(listed.name);
    Partition crystals = test::crystals_of(*tin, settings.question);
    const auto eyes = test::judge_eyes(*tin, {&crystals}, eyes_for(*tin, settings.question));
    for (Trial& trial : trials) {
      test::certify(*tin, trial.question, crystals);
      test::count_eyes(eyes, crystals);
      trial.rows.push_back({{"dem", listed.name}, {"crystals", row_of(*tin, crystals)}});
    }
  }
  if (names.empty()) return 1;
  nlohmann::json points = nlohmann::json::array();
  double false_culls = 0;
  if (!settings.json)
    fmt::print(
        "| fans | B/triangle | 2 m | 50 m | 300 m | 1000 m | us a triangle | false culls |\n"
        "|---|---|---|---|---|---|---|---|\n");
  for (Trial& trial : trials) {
    const auto shares = means(trial.rows, "crystals", "share");
    double us = 0, bytes = 0, falsely = 0;
    for (const auto& row : trial.rows) {
      const auto count = static_cast<double>(trial.rows.size());
      us += row["crystals"]["certify_us_per_triangle"].get<double>() / count;
      bytes += row["crystals"]["bytes_per_triangle"].get<double>() / count;
      falsely += row["crystals"]["false_culls"].get<double>();
    }
    trial.point["us"] = us, trial.point["bytes"] = bytes;
    for (const auto& h : shares)
      trial.point["share"].push_back(h["mean"].is_null() ? 0.0 : h["mean"].get<double>());
    false_culls += falsely;
    points.push_back(trial.point);
    if (settings.json) continue;
    fmt::print(
        "| {} | {:.1f} | {} | {:.0f} | {:g} |\n", trial.point["fans"].get<int>(), bytes,
        [&] {
          std::string text;
          for (const auto& h : shares) text += (text.empty() ? "" : " | ") + number(h["mean"]);
          return text;
        }(),
        us, falsely);
  }
  if (settings.json) fmt::print("{}\n", points.dump(2));
  if (!settings.front.empty()) {
    std::ofstream out(settings.front);
    out << test::front_picture(points, "Culled of hidden groups against cost, mean of " + names);
    if (!out.flush()) {
      fmt::print(stderr, "certified_bench: cannot write '{}'\n", settings.front);
      return 1;
    }
  }
  return false_culls == 0 ? 0 : 1;
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
    Partition part = test::crystals_of(*tin, settings.question);
    test::certify(*tin, settings.question, part);
    const auto count = static_cast<double>(tin->triangles.size());
    rows.push_back({{"triangles", tin->triangles.size()},
                    {"groups", part.all_groups},
                    {"grow_us_per_triangle", 1e6 * part.grow_user_s / count},
                    {"certify_us_per_triangle", 1e6 * part.certify_user_s / count},
                    {"certify_wall_us_per_triangle", 1e6 * part.certify_wall_s / count},
                    {"certify_wall_s", part.certify_wall_s},
                    {"threads", thread_count()},
                    {"bits", bits_of(part.regions)}});
    if (settings.json) continue;
    fmt::print("| {} | {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {} | {} |\n", tin->triangles.size(),
               part.all_groups, 1e6 * part.grow_user_s / count, 1e6 * part.certify_user_s / count,
               1e6 * part.certify_wall_s / count, part.certify_wall_s, thread_count(),
               bits_of(part.regions));
    std::fflush(stdout);
  }
  if (settings.json)
    fmt::print("{}\n", nlohmann::json{{"dem", kLargeDem.name}, {"sizes", rows}}.dump(2));
  return 0;
}

/// The numbers of a list, each no less than `least`; empty where one is no number.
template <class Number>
std::vector<Number> numbers(const char* text, double least) {
  std::vector<Number> all;
  std::istringstream list(text);
  for (std::string one; std::getline(list, one, ',');)
    all.push_back(static_cast<Number>(std::max(least, std::atof(one.c_str()))));
  return all;
}

/// Reads the value of an option that has one. @return whether it is known and proper
bool take_value(Settings& settings, const std::string& name, const char* value) {
  test::CertifiedQuestion& question = settings.question;
  const auto whole = [&](int least) { return std::max(least, std::atoi(value)); };
  if (!*value) return false;
  if (name == "--dem") {
    settings.dems = value;
  } else if (name == "--vertices") {
    settings.vertices = static_cast<std::uint32_t>(whole(4));
  } else if (name == "--groups") {
    question.groups = static_cast<std::uint32_t>(whole(1));
  } else if (name == "--eyes") {
    question.eyes = whole(1);
  } else if (name == "--whole") {
    question.whole_triangles = static_cast<std::uint32_t>(whole(0));
  } else if (name == "--group-triangles") {
    question.group_triangles = static_cast<std::uint32_t>(whole(2));
  } else if (name == "--compactness") {
    question.compactness = std::atof(value);
  } else if (name == "--fans") {
    settings.fans = numbers<int>(value, 8);
    for (int& fans : settings.fans) fans = fans / 8 * 8;
  } else if (name == "--sectors") {
    question.sectors = whole(8);
  } else if (name == "--bytes") {
    settings.bytes = numbers<double>(value, 0.1);
  } else if (name == "--patch") {
    question.certified.patch = std::max(0.01, std::atof(value));
  } else if (name == "--threads") {
    set_thread_count(whole(1));
  } else if (name == "--front") {
    settings.front = value;
  } else if (name == "--triangles") {
    settings.triangles = numbers<std::uint32_t>(value, 100);
  } else {
    return false;
  }
  return !settings.fans.empty() && !settings.bytes.empty() && !settings.triangles.empty();
}

/// Around the usual setting.
void take_front(Settings& settings) {
  const int usual = CertifiedSettings{}.fans;
  if (settings.fans.size() == 1)
    settings.fans = {usual, usual / 64 * 8, usual / 32 * 8, usual / 16 * 8, 2 * usual};
  if (settings.bytes.size() == 1)
    settings.bytes = {kCertifiedBytes, kCertifiedBytes / 4, kCertifiedBytes / 2,
                      2 * kCertifiedBytes};
}

int run(Settings& settings) {
  if (!settings.front.empty()) take_front(settings);
  settings.question.certified.fans = settings.fans[0];
  settings.question.bytes = settings.bytes[0];
  if (settings.scale) return run_scale(settings);
  const bool is_one = settings.fans.size() == 1 && settings.bytes.size() == 1;
  return is_one && settings.front.empty() ? run_dems(settings) : run_settings(settings);
}

}  // namespace
}  // namespace scarp

int main(int argc, char** argv) {
  scarp::Settings settings;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--json") {
      settings.json = true;
    } else if (name == "--markdown") {
      settings.markdown = true;
    } else if (name == "--built") {
      settings.built = true;
    } else if (name == "--scale") {
      settings.scale = true;
    } else if (i + 1 < argc && scarp::take_value(settings, name, argv[i + 1])) {
      ++i;
    } else {
      fmt::print(stderr,
                 "usage: certified_bench [--dem NAME[,NAME]] [--vertices N | --built] [--groups N] "
                 "[--eyes N] [--whole N] [--group-triangles N] [--compactness X] [--fans N[,N]] "
                 "[--sectors N] "
                 "[--bytes N[,N]] [--patch X] [--threads N] [--scale [--triangles N[,N]]] "
                 "[--front SVG] [--markdown] [--json]\n");
      return 2;
    }
  }
  GDALAllRegister();
  return scarp::run(settings);
}
