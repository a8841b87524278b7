#include "cli/compare/groups_job.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <tuple>

#include "cli/build/budget.h"
#include "cli/build/certified_settings.h"
#include "cli/scene_culling.h"
#include "cli/stopwatch.h"
#include "cli/verify.h"
#include "core/culling/certified_culling.h"
#include "core/culling/visible_groups.h"
#include "core/horizon/stewart.h"
#include "core/occlusion/build_groups.h"
#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/group_tree.h"
#include "core/occlusion/squares.h"
#include "core/threads/parallel_for.h"
#include "tiles/store/groups_file.h"

namespace scarp {
namespace {

/// Layouts of the thesis, from few sectors to more than it looked at.
constexpr SectorLayout kThesisLayouts[] = {{8, 1}, {8, 8}, {16, 4}, {32, 4}, {64, 1}, {64, 8}};

/// Of squares, which are there for comparison with crystals.
constexpr SectorLayout kThesisLayoutsOfSquares[] = {{8, 1}, {16, 4}, {64, 1}};

/// Triangles in groups, which regions are made for.
struct Partition {
  LeafGroups leaves;
  std::vector<double> seconds = {};  ///< of each time that it was grown
};

/// A method with its parameters, and what came of it.
struct Setting {
  std::string method;
  std::string label;  ///< short, unique within the method
  const Partition* partition = nullptr;
  std::optional<SectorLayout> thesis = {};
  std::optional<CertifiedSettings> certified = {};
  bool is_default = false;
  double predicted_s = 0;
  std::vector<double> seconds = {};  ///< of each time that its regions were made
  double bytes_per_triangle = 0;
  std::vector<VerifyCounts> counts = {};  ///< by height
};

/// An eye and what the judge sees from it.
struct JudgedEye {
  std::size_t height;
  Position eye;
  std::vector<TriangleSight> sight;
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

class GroupsComparison {
 public:
  GroupsComparison(const CulledGround& scene, const GroupsQuestion& question,
                   const StageProgress& stage)
      : scene_(scene), options_(question), stage_(stage) {}

  ComparedJob run(Groups* prepared) {
    prepared_ = prepared;
    grow();
    judge();
    run_thesis();
    run_certified();
    run_again();
    std::stable_sort(done_.begin(), done_.end(), [](const Setting& a, const Setting& b) {
      const auto order = [](const Setting& s) {
        return std::tuple(s.certified.has_value(), s.method, s.certified ? s.certified->sectors : 0,
                          s.certified ? s.certified->fans : 0);
      };
      return order(a) < order(b);
    });
    return job();
  }

 private:
  void grow() {
    grow_crystals(stage_("groups"));
    grow_squares();
  }

  void grow_crystals(const Progress& progress) {
    const Stopwatch watch;
    crystals_.leaves = grow_hidden_together(scene_.tin, scene_.growth, progress);
    crystals_.seconds.push_back(watch.seconds());
  }

  /// Of the crystals' mean size.
  void grow_squares() {
    const Stopwatch watch;
    squares_.leaves = group_by_squares(
        scene_.tin,
        static_cast<std::uint32_t>(scene_.tin.triangles.size() / crystals_.leaves.count));
    squares_.seconds.push_back(watch.seconds());
  }

  void judge() {
    const Progress progress = stage_("judge");
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

  static std::string method_of(const char* name, bool in_squares) {
    return std::string(name) + (in_squares ? ", in squares" : "");
  }

  std::vector<Setting> thesis_settings() const {
    std::vector<Setting> settings;
    const auto add = [&](const Partition& partition, std::span<const SectorLayout> layouts) {
      for (const SectorLayout& layout : layouts)
        settings.push_back({method_of("thesis", &partition == &squares_),
                            fmt::format("{}/{}", layout.count, layout.subsectors), &partition,
                            layout});
    };
    add(crystals_, kThesisLayouts);
    add(squares_, kThesisLayoutsOfSquares);
    return settings;
  }

  void run_thesis() {
    const Progress progress = stage_("thesis");
    double part_s = 0;  // of a subsector, as far as is known
    for (Setting& setting : thesis_settings()) {
      const int parts = setting.thesis->count * setting.thesis->subsectors;
      setting.predicted_s = part_s * parts;
      if (!run_first(setting, {})) continue;
      part_s = setting.seconds.front() / parts;
      progress(static_cast<double>(done_.size()) /
               static_cast<double>(std::size(kThesisLayouts) + std::size(kThesisLayoutsOfSquares)));
    }
  }

  /// In the order in which they are worth their time.
  std::vector<Setting> certified_settings() const {
    const std::size_t triangles = scene_.tin.triangles.size();
    const auto sectors_of = [&](const Partition& partition, double bytes) {
      CertifiedSettings settings;
      settings.sectors = sectors_within(bytes, triangles, partition.leaves.count);
      return settings;
    };
    const auto certified = [&](const Partition& partition, const CertifiedSettings& settings,
                               std::string label) {
      return Setting{method_of("certified", &partition == &squares_),
                     std::move(label),
                     &partition,
                     {},
                     settings};
    };
    const auto with_fans = [&](const Partition& partition, int fans) {
      CertifiedSettings settings = sectors_of(partition, kCertifiedBytes);
      settings.fans = fans;
      return certified(partition, settings, fmt::format("{} fans", fans));
    };
    const auto with_bytes = [&](const Partition& partition, double bytes) {
      const CertifiedSettings settings = sectors_of(partition, bytes);
      return certified(partition, settings, fmt::format("{} sectors", settings.sectors));
    };
    const auto usual = [&](const Partition& partition) {
      const CertifiedSettings settings = sectors_of(partition, kCertifiedBytes);
      return certified(partition, settings,
                       fmt::format("{} fans, {} sectors", settings.fans, settings.sectors));
    };
    Setting standard = usual(crystals_);
    standard.is_default = true;
    const int fans = CertifiedSettings{}.fans;
    const auto part = [&](int divisor) { return std::max(kFewestFans, fans / divisor / 8 * 8); };
    return {with_fans(crystals_, part(8)),
            with_fans(crystals_, part(4)),
            standard,
            usual(squares_),
            with_fans(squares_, part(4)),
            with_bytes(crystals_, 4),
            with_bytes(squares_, 4),
            with_fans(crystals_, part(2)),
            with_bytes(crystals_, 8),
            with_fans(crystals_, part(16)),
            with_bytes(crystals_, 2),
            with_bytes(crystals_, 32),
            with_fans(squares_, part(8)),
            with_fans(crystals_, 2 * fans)};
  }

  void run_certified() {
    Groups groups;
    groups.group_of_triangle = crystals_.leaves.group_of_triangle;
    groups.leaf_count = crystals_.leaves.count;
    CertifyCost cost = measure_certify_cost(
        scene_.tin, groups, certified_settings()[0].certified.value(), stage_("measure"));
    for (Setting& setting : certified_settings()) {
      const auto is_same = [&](const Setting& s) {
        return s.partition == setting.partition && s.certified == setting.certified;
      };
      if (std::any_of(done_.begin(), done_.end(), is_same)) continue;
      setting.predicted_s = cost.at(setting.certified->fans);
      if (!run_first(setting, stage_(setting.method + ", " + setting.label))) continue;
      // What was seen last corrects what was measured on a sample.
      const double correction = setting.seconds.front() / std::max(setting.predicted_s, 1e-9);
      cost.base_s *= correction, cost.fan_s *= correction;
    }
  }

  /// Groups with the setting's regions; takes down the time of making those.
  Groups prepare(Setting& setting, const Progress& progress) const {
    const LeafGroups& leaves = setting.partition->leaves;
    const Stopwatch watch;
    Groups groups;
    if (setting.thesis) {
      groups = build_group_tree(scene_.tin,
                                stewart_horizons(scene_.tin.vertices, *setting.thesis, {}), leaves);
    } else {
      groups.group_of_triangle = leaves.group_of_triangle;
      groups.leaf_count = leaves.count;
      groups.certified = certify_groups(scene_.tin, groups.group_of_triangle, groups.leaf_count,
                                        hiding_options(*setting.certified), progress);
    }
    setting.seconds.push_back(watch.seconds());
    return groups;
  }

  /// Prepares and judges a setting for which there is time.
  /// @return whether there was
  bool run_first(Setting& setting, const Progress& progress) {
    if (!fits(setting.predicted_s)) {
      left_out_.push_back(setting);
      return false;
    }
    const Groups groups = prepare(setting, progress);
    if (prepared_ != nullptr) keep(setting, groups);
    if (setting.thesis) {
      setting.bytes_per_triangle = bytes_a_triangle(region_bytes(groups, "thesis"));
      ThesisCulling culling(groups);
      count(setting, groups, culling);
    } else {
      setting.bytes_per_triangle = bytes_a_triangle(kept_bytes(groups.certified));
      CertifiedCulling culling(groups.certified);
      count(setting, groups, culling);
    }
    done_.push_back(setting);
    return true;
  }

  /// Keeps what a build would make: the regions of either kind that it would, or others where there
  /// are none yet.
  void keep(const Setting& setting, const Groups& groups) const {
    if (setting.partition != &crystals_) return;
    prepared_->group_of_triangle = groups.group_of_triangle;
    prepared_->leaf_count = groups.leaf_count;
    if (setting.certified && (setting.is_default || !prepared_->has_certified()))
      prepared_->certified = groups.certified;
    if (setting.thesis && (*setting.thesis == SectorLayout{} || prepared_->nodes.empty())) {
      prepared_->nodes = groups.nodes;
      prepared_->regions = groups.regions;
    }
  }

  /// Spends what time is left on the spread of times.
  void run_again() {
    const Progress progress = stage_("again");
    const auto again = [&](const std::vector<double>& seconds) {
      return static_cast<int>(seconds.size()) < kComparedRuns && fits(seconds.front());
    };
    while (again(crystals_.seconds)) grow_crystals({});
    while (again(squares_.seconds)) grow_squares();
    double tried = 0;
    for (Setting& setting : done_) {
      while (again(setting.seconds)) prepare(setting, {});
      if (progress) progress(++tried / static_cast<double>(done_.size()));
    }
  }

  double bytes_a_triangle(std::size_t bytes) const {
    return static_cast<double>(bytes) / static_cast<double>(scene_.tin.triangles.size());
  }

  void count(Setting& setting, const Groups& groups, CullingMethod& culling) const {
    for (const double height_m : options_.heights_m) {
      VerifyCounts& counts = setting.counts.emplace_back();
      counts.method = setting.method;
      counts.eye_height_m = height_m;
      counts.bytes_per_triangle = setting.bytes_per_triangle;
    }
    for (const JudgedEye& judged : eyes_)
      count_eye(groups, all_triangles_, judged.sight, culling.visible({judged.eye, {}}),
                setting.counts[judged.height]);
  }

  ComparedJob job() const {
    ComparedJob job;
    job.name = "groups";
    job.title = "Hidden triangles that are drawn all the same";
    job.notes = {
        fmt::format("{} triangles, {} thread{}; judged from {} eyes at each of {} heights above "
                    "ground ({} m), all together.",
                    scene_.tin.triangles.size(), thread_count(), thread_count() == 1 ? "" : "s",
                    options_.eyes, options_.heights_m.size(), fmt::join(options_.heights_m, ", ")),
        "Thesis by sectors/subsectors, certified by fans or sectors; of crystals, and of as many "
        "squares. Growing counts as",
        fmt::format("preparation; lines reach from the least to the most of up to {} runs.",
                    kComparedRuns)};
    constexpr char kDrawn[] = "hidden triangles drawn, %";
    constexpr char kFalse[] = "visible triangles culled, %";
    constexpr char kSeconds[] = "preparation, seconds", kBytes[] = "kept, bytes a triangle";
    job.charts = {{"seconds", kSeconds, "hidden_drawn_percent", kDrawn, "", true},
                  {"bytes_a_triangle", kBytes, "hidden_drawn_percent", kDrawn, "", true},
                  {"seconds", kSeconds, "falsely_culled_percent", kFalse, ""},
                  {"bytes_a_triangle", kBytes, "falsely_culled_percent", kFalse, ""}};
    for (const Setting& s : done_) job.points.push_back(point(s));
    for (const Setting& s : left_out_)
      job.left_out.push_back(
          fmt::format("{} {}: about {:.0f} s, for lack of time", s.method, s.label, s.predicted_s));
    return job;
  }

  ComparedPoint point(const Setting& s) const {
    const VerifyCounts sum = total(s);
    ComparedPoint point{s.method,  s.label, {}, s.is_default, false, sum.falsely_culled > 0,
                        command(s)};
    const Timed growing = median_of(s.partition->seconds), regions = median_of(s.seconds);
    point.figures = {
        {"growing_seconds", growing.median_s},
        {"regions_us_a_triangle",
         1e6 * regions.median_s / static_cast<double>(scene_.tin.triangles.size())},
        {"bytes_a_triangle", s.bytes_per_triangle},
        {"hidden_drawn_percent", 100 * (1 - ratio(sum.culled - sum.falsely_culled,
                                                  std::max<std::uint64_t>(1, sum.hidden)))},
        {"falsely_culled_triangles", static_cast<double>(sum.falsely_culled)},
        {"falsely_culled_percent", 100 * ratio(sum.falsely_culled, sum.triangles - sum.hidden)}};
    for (const VerifyCounts& c : s.counts)
      if (c.in_hidden_groups > 0)
        point.figures[fmt::format("share_from_{:g}_m", c.eye_height_m)] =
            ratio(c.culled, c.in_hidden_groups);
    add_time(point, {growing.median_s + regions.median_s, growing.least_s + regions.least_s,
                     growing.most_s + regions.most_s});
    return point;
  }

  std::string command(const Setting& s) const {
    if (s.partition == &squares_) return {};  // which no build makes
    if (s.thesis)
      return fmt::format("{} --horizon stewart --sectors {} --subsectors {}", scene_.build_command,
                         s.thesis->count, s.thesis->subsectors);
    return fmt::format("{} --fans {} --sectors {}", scene_.build_command, s.certified->fans,
                       s.certified->sectors);
  }

  const CulledGround& scene_;
  const GroupsQuestion& options_;
  const StageProgress& stage_;
  Stopwatch watch_;
  Partition crystals_, squares_;
  Groups* prepared_ = nullptr;  // null: nobody wants them
  std::vector<TriangleIndex> all_triangles_;
  std::vector<JudgedEye> eyes_;
  std::vector<Setting> done_, left_out_;
};

}  // namespace

ComparedJob compare_groups(const CulledGround& ground, const GroupsQuestion& question,
                           const StageProgress& stage, Groups* prepared) {
  return GroupsComparison(ground, question, stage).run(prepared);
}

}  // namespace scarp
