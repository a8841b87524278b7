#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/build/budget.h"
#include "cli/build/certified_settings.h"
#include "cli/commands.h"
#include "cli/compare_picture.h"
#include "cli/loaded_scene.h"
#include "cli/outputs.h"
#include "cli/progress_bar.h"
#include "cli/scene_culling.h"
#include "cli/verify.h"
#include "core/culling/certified_culling.h"
#include "core/culling/visible_groups.h"
#include "core/error/error.h"
#include "core/horizon/stewart.h"
#include "core/occlusion/build_groups.h"
#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/group_tree.h"
#include "core/occlusion/hidden_together.h"
#include "core/threads/parallel_for.h"
#include "tiles/store/part_file.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;

/// Layouts of the thesis, from few sectors to more than it looked at.
constexpr SectorLayout kThesisLayouts[] = {{8, 1}, {8, 8}, {16, 4}, {32, 4}, {64, 1}, {64, 8}};

/// A method with its parameters, and what came of it.
struct Setting {
  std::string method;
  std::string label;  ///< short, unique within the method
  std::optional<SectorLayout> thesis = {};
  std::optional<CertifiedSettings> certified = {};
  bool is_default = false;
  std::string time_label = {},
              bytes_label = {};  ///< in the charts against time and bytes; empty: in none
  double seconds = 0;            ///< of preparation, wall; of those left out, predicted
  double bytes_per_triangle = 0;
  std::vector<VerifyCounts> counts = {};  ///< by height
};

/// An eye and what the judge sees from it.
struct JudgedEye {
  std::size_t height;
  Position eye;
  std::vector<TriangleSight> sight;
};

class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(Clock::now() - begun_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point begun_ = Clock::now();
};

std::int64_t whole_parameter(const SceneDescription& scene, const char* name,
                             std::int64_t otherwise) {
  const auto found = scene.parameters.find(name);
  if (found == scene.parameters.end()) return otherwise;
  const auto* value = std::get_if<std::int64_t>(&found->second);
  return value ? *value : otherwise;
}

/// What the scene's groups were asked to be, grown as certified regions like them best.
HiddenTogetherOptions growth_of(const SceneDescription& scene) {
  HiddenTogetherOptions growth;
  growth.seed = static_cast<std::uint64_t>(
      whole_parameter(scene, "seed", static_cast<std::int64_t>(growth.seed)));
  growth.group_triangles =
      static_cast<std::uint32_t>(whole_parameter(scene, "group_triangles", growth.group_triangles));
  growth.min_group_triangles = static_cast<std::uint32_t>(
      whole_parameter(scene, "min_group_triangles", growth.min_group_triangles));
  return growth;
}

class Comparison {
 public:
  Comparison(const CompareOptions& options, const LoadedScene& scene)
      : options_(options), scene_(scene), bar_(!options.common.json) {}

  void run() {
    grow();
    judge();
    run_thesis();
    run_certified();
    bar_.clear();
    std::stable_sort(done_.begin(), done_.end(), [](const Setting& a, const Setting& b) {
      if (!a.certified || !b.certified) return !a.certified && b.certified;
      return std::pair(a.certified->sectors, a.certified->fans) <
             std::pair(b.certified->sectors, b.certified->fans);
    });
  }

  const std::vector<Setting>& done() const { return done_; }
  const std::vector<Setting>& left_out() const { return left_out_; }

 private:
  void grow() {
    const Progress progress = bar_.stage("groups");
    leaves_ = grow_hidden_together(scene_.tin, growth_of(scene_.scene.description()), progress);
  }

  void judge() {
    const Progress progress = bar_.stage("judge");
    const GeoFrame::Placer placer(scene_.frame);
    for (TriangleIndex t = 0; t < scene_.tin.triangles.size(); ++t) all_triangles_.push_back(t);
    for (std::size_t h = 0; h < options_.heights_m.size(); ++h) {
      SplitMix64 random(options_.seed);  // the same places at every height
      for (int i = 0; i < options_.eyes; ++i) {
        MapPoint at = random_ground(scene_.index, placer, random);
        at.height_m += options_.heights_m[h];
        const Position eye = placer.place(at);
        eyes_.push_back({h, eye, judge_all(scene_.index, eye)});
        progress(
            static_cast<double>(eyes_.size()) /
            (static_cast<double>(options_.eyes) * static_cast<double>(options_.heights_m.size())));
      }
    }
  }

  bool fits(double predicted_s) const { return watch_.seconds() + predicted_s <= options_.limit_s; }

  void run_thesis() {
    const Progress progress = bar_.stage("thesis");
    double part_s = 0;  // of a subsector, as far as is known
    for (const SectorLayout& layout : kThesisLayouts) {
      Setting setting{"thesis", fmt::format("{}/{}", layout.count, layout.subsectors), layout, {}};
      setting.is_default = layout == SectorLayout{};
      setting.time_label = setting.bytes_label = setting.label;
      const int parts = layout.count * layout.subsectors;
      setting.seconds = part_s * parts;
      if (!fits(setting.seconds)) {
        left_out_.push_back(setting);
        continue;
      }
      const Stopwatch watch;
      const Groups groups =
          build_group_tree(scene_.tin, stewart_horizons(scene_.tin.vertices, layout, {}), leaves_);
      setting.seconds = watch.seconds();
      part_s = setting.seconds / parts;
      setting.bytes_per_triangle = bytes_a_triangle(region_bytes(groups, "thesis"));
      ThesisCulling culling(groups);
      finish(setting, groups, culling);
      progress(static_cast<double>(done_.size()) / std::size(kThesisLayouts));
    }
  }

  /// In the order in which they are worth their time.
  std::vector<Setting> certified_settings() const {
    const std::size_t triangles = scene_.tin.triangles.size();
    CertifiedSettings usual;
    usual.sectors = sectors_within(kCertifiedBytes, triangles, leaves_.count);
    const auto with_fans = [&](int fans) {
      Setting setting{"certified", fmt::format("{} fans", fans), {}, usual};
      setting.certified->fans = fans;
      setting.time_label = setting.label;
      return setting;
    };
    const auto with_bytes = [&](double bytes) {
      Setting setting{"certified", "", {}, usual};
      setting.certified->sectors = sectors_within(bytes, triangles, leaves_.count);
      setting.label = setting.bytes_label = fmt::format("{} sectors", setting.certified->sectors);
      return setting;
    };
    Setting standard{"certified", "", {}, usual, true};
    standard.time_label = fmt::format("{} fans", usual.fans);
    standard.bytes_label = fmt::format("{} sectors", usual.sectors);
    standard.label = standard.time_label + ", " + standard.bytes_label;
    const auto part = [&](int divisor) {
      return std::max(kFewestFans, usual.fans / divisor / 8 * 8);
    };
    return {with_fans(part(8)),
            with_fans(part(4)),
            standard,
            with_bytes(4),
            with_fans(part(2)),
            with_bytes(8),
            with_fans(part(16)),
            with_bytes(2),
            with_bytes(32),
            with_fans(2 * usual.fans)};
  }

  void run_certified() {
    Groups groups;
    groups.group_of_triangle = leaves_.group_of_triangle;
    groups.leaf_count = leaves_.count;
    CertifyCost cost = measure_certify_cost(
        scene_.tin, groups, certified_settings()[0].certified.value(), bar_.stage("measure"));
    for (Setting& setting : certified_settings()) {
      const auto is_same = [&](const Setting& s) { return s.certified == setting.certified; };
      if (std::any_of(done_.begin(), done_.end(), is_same)) continue;
      setting.seconds = cost.at(setting.certified->fans);
      if (!fits(setting.seconds)) {
        left_out_.push_back(setting);
        continue;
      }
      const Progress progress = bar_.stage("certified, " + setting.label);
      const Stopwatch watch;
      groups.certified = certify_groups(scene_.tin, groups.group_of_triangle, groups.leaf_count,
                                        hiding_options(*setting.certified), progress);
      // What was seen last corrects what was measured on a sample.
      const double correction = watch.seconds() / std::max(setting.seconds, 1e-9);
      cost.base_s *= correction, cost.fan_s *= correction;
      setting.seconds = watch.seconds();
      setting.bytes_per_triangle = bytes_a_triangle(certified_bytes(groups.certified));
      CertifiedCulling culling(groups.certified);
      finish(setting, groups, culling);
    }
  }

  double bytes_a_triangle(std::size_t bytes) const {
    return static_cast<double>(bytes) / static_cast<double>(scene_.tin.triangles.size());
  }

  void finish(Setting& setting, const Groups& groups, CullingMethod& culling) {
    for (const double height_m : options_.heights_m) {
      VerifyCounts& counts = setting.counts.emplace_back();
      counts.method = setting.method;
      counts.eye_height_m = height_m;
      counts.bytes_per_triangle = setting.bytes_per_triangle;
    }
    for (const JudgedEye& judged : eyes_)
      count_eye(groups, all_triangles_, judged.sight, culling.visible({judged.eye, {}}),
                setting.counts[judged.height]);
    done_.push_back(setting);
  }

  const CompareOptions& options_;
  const LoadedScene& scene_;
  ProgressBar bar_;
  Stopwatch watch_;
  LeafGroups leaves_;
  std::vector<TriangleIndex> all_triangles_;
  std::vector<JudgedEye> eyes_;
  std::vector<Setting> done_, left_out_;
};

double ratio(std::uint64_t part, std::uint64_t whole) {
  return static_cast<double>(part) / static_cast<double>(std::max<std::uint64_t>(1, whole));
}

/// Of all heights together.
VerifyCounts total(const Setting& setting) {
  VerifyCounts sum;
  for (const VerifyCounts& c : setting.counts) {
    sum.triangles += c.triangles, sum.hidden += c.hidden, sum.culled += c.culled;
    sum.in_hidden_groups += c.in_hidden_groups, sum.falsely_culled += c.falsely_culled;
  }
  return sum;
}

double us_a_triangle(const Setting& setting, std::size_t triangles) {
  return 1e6 * setting.seconds / static_cast<double>(triangles);
}

nlohmann::json json_of(const Comparison& comparison, std::size_t triangles) {
  nlohmann::json result = {{"triangles", triangles}, {"threads", thread_count()}};
  result["settings"] = nlohmann::json::array();
  for (const Setting& s : comparison.done())
    result["settings"].push_back({{"method", s.method},
                                  {"setting", s.label},
                                  {"default", s.is_default},
                                  {"seconds", s.seconds},
                                  {"bytes_per_triangle", s.bytes_per_triangle},
                                  {"heights", to_json(s.counts)}});
  result["left_out"] = nlohmann::json::array();
  for (const Setting& s : comparison.left_out())
    result["left_out"].push_back(
        {{"method", s.method}, {"setting", s.label}, {"predicted_s", s.seconds}});
  return result;
}

/// A line for each setting and height.
std::string csv_of(const Comparison& comparison, std::size_t triangles) {
  std::string csv =
      "method,setting,default,fans,sectors,subsectors,patch,seconds,us_per_triangle,"
      "bytes_per_triangle,eye_height_m,eyes,triangles,hidden,in_hidden_groups,culled,"
      "falsely_culled,share,of_hidden\n";
  for (const Setting& s : comparison.done()) {
    const std::string parameters =
        s.certified ? fmt::format("{},{},,{:g}", s.certified->fans, s.certified->sectors,
                                  s.certified->patch)
                    : fmt::format(",{},{},", s.thesis->count, s.thesis->subsectors);
    for (const VerifyCounts& c : s.counts)
      csv +=
          fmt::format("{},\"{}\",{},{},{:.4f},{:.2f},{:.3f},{:g},{},{},{},{},{},{},{:.4f},{:.4f}\n",
                      s.method, s.label, s.is_default ? 1 : 0, parameters, s.seconds,
                      us_a_triangle(s, triangles), s.bytes_per_triangle, c.eye_height_m, c.eyes,
                      c.triangles, c.hidden, c.in_hidden_groups, c.culled, c.falsely_culled,
                      ratio(c.culled, c.in_hidden_groups), ratio(c.culled, c.hidden));
  }
  return csv;
}

std::string picture_of(const Comparison& comparison, const CompareOptions& options,
                       std::size_t triangles) {
  PictureComparison picture;
  picture.title = "What culling costs: " + fs::path(options.scene).filename().string();
  picture.notes.push_back(fmt::format(
      "{} triangles, {} thread{}; judged from {} eyes at each of {} heights above ground ({} m), "
      "all together.",
      triangles, thread_count(), thread_count() == 1 ? "" : "s", options.eyes,
      options.heights_m.size(), fmt::join(options.heights_m, ", ")));
  picture.notes.push_back(
      "Left: thesis by sectors/subsectors, certified by fans. Right: certified by sectors.");
  for (const char* method : {"thesis", "certified"}) {
    PictureMethod& drawn = picture.methods.emplace_back();
    drawn.name = method;
    drawn.is_joined = drawn.name == "certified";
    for (const Setting& s : comparison.done()) {
      if (s.method != method) continue;
      const VerifyCounts sum = total(s);
      drawn.points.push_back({s.seconds, s.bytes_per_triangle,
                              ratio(sum.culled - sum.falsely_culled, sum.hidden), s.time_label,
                              s.bytes_label, s.is_default, sum.falsely_culled == 0});
    }
  }
  return draw_comparison(picture);
}

void print_table(const Comparison& comparison, const CompareOptions& options,
                 std::size_t triangles) {
  fmt::print("{:<10} {:<24} {:>9} {:>12} {:>10}", "method", "setting", "seconds", "us/triangle",
             "B/triangle");
  for (const double height_m : options.heights_m)
    fmt::print(" {:>9}", fmt::format("{:g} m", height_m));
  fmt::print(" {:>10} {:>16}\n", "of hidden", "falsely culled");
  for (const Setting& s : comparison.done()) {
    fmt::print("{:<10} {:<24} {:>9.2f} {:>12.1f} {:>10.2f}", s.method,
               s.label + (s.is_default ? " *" : ""), s.seconds, us_a_triangle(s, triangles),
               s.bytes_per_triangle);
    for (const VerifyCounts& c : s.counts)
      fmt::print(" {:>9}", c.in_hidden_groups > 0
                               ? fmt::format("{:.3f}", ratio(c.culled, c.in_hidden_groups))
                               : "-");
    const VerifyCounts sum = total(s);
    fmt::print(" {:>10.3f} {:>7} ({:.2f} %)\n", ratio(sum.culled, sum.hidden), sum.falsely_culled,
               100 * ratio(sum.falsely_culled, sum.triangles - sum.hidden));
  }
  fmt::print(
      "By height: culled, of the triangles in hidden groups. Of hidden: culled, of all hidden "
      "triangles. * default.\n");
  for (const Setting& s : comparison.left_out())
    fmt::print("Left out for lack of time: {} {}, about {:.0f} s\n", s.method, s.label, s.seconds);
}

/// The two files of an answer in a folder, which is made, and gone again if nothing comes of it.
class OutputFolder {
 public:
  OutputFolder(const std::string& path, Existing existing) : path_(path) {
    std::error_code failure;
    made_ = fs::create_directory(path, failure);
    if (failure || !fs::is_directory(path))
      throw Error(ErrorCode::kInput,
                  fmt::format("'{}': not a folder, and none can be made there; a folder beside "
                              "existing ones was expected",
                              path));
    try {
      svg_.emplace(path + "/compare.svg", existing);
      csv_.emplace(path + "/compare.csv", existing);
    } catch (...) {
      give_up();
      throw;
    }
  }
  ~OutputFolder() {
    if (svg_) give_up();
  }
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  void commit(const std::string& svg, const std::string& csv) {
    svg_->append(std::as_bytes(std::span(svg)));
    csv_->append(std::as_bytes(std::span(csv)));
    svg_->commit();
    csv_->commit();
    svg_.reset();
    csv_.reset();
  }

 private:
  void give_up() {
    svg_.reset();
    csv_.reset();
    std::error_code ignored;
    if (made_) fs::remove(path_, ignored);
  }

  std::string path_;
  bool made_ = false;
  std::optional<PartFile> svg_, csv_;
};

}  // namespace

int run_compare(const CompareOptions& options) {
  for (const double height_m : options.heights_m)
    if (!(std::abs(height_m) <= 1e7))
      throw Error(ErrorCode::kUsage,
                  fmt::format("--heights {}: metres above ground were expected", height_m));
  const LoadedScene scene(options.scene, {options.common.memory_budget_bytes});
  OutputFolder output(options.output, existing(options.common));
  Comparison comparison(options, scene);
  comparison.run();
  const std::size_t triangles = scene.tin.triangles.size();
  if (comparison.done().empty())
    throw Error(ErrorCode::kResource,
                fmt::format("--time {:g}s: no setting fits; give more", options.limit_s));
  output.commit(picture_of(comparison, options, triangles), csv_of(comparison, triangles));
  if (options.common.json)
    fmt::print("{}\n", json_of(comparison, triangles).dump(2));
  else
    print_table(comparison, options, triangles);
  return 0;
}

}  // namespace scarp
