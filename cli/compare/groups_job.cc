#include "cli/compare/groups_job.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

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
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Layouts of the thesis, from few sectors to more than it looked at.
constexpr SectorLayout kThesisLayouts[] = {{8, 1}, {8, 8}, {16, 4}, {32, 4}, {64, 1}, {64, 8}};

/// A method with its parameters, and what came of it.
struct Setting {
  std::string method;
  std::string label;  ///< short, unique within the method
  std::optional<SectorLayout> thesis = {};
  std::optional<CertifiedSettings> certified = {};
  bool is_default = false;
  double seconds = 0;  ///< of preparation, wall; of those left out, predicted
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

  ComparedJob run() {
    grow();
    judge();
    run_thesis();
    run_certified();
    std::stable_sort(done_.begin(), done_.end(), [](const Setting& a, const Setting& b) {
      if (!a.certified || !b.certified) return !a.certified && b.certified;
      return std::pair(a.certified->sectors, a.certified->fans) <
             std::pair(b.certified->sectors, b.certified->fans);
    });
    return job();
  }

 private:
  void grow() {
    const Progress progress = stage_("groups");
    leaves_ = grow_hidden_together(scene_.tin, scene_.growth, progress);
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

  void run_thesis() {
    const Progress progress = stage_("thesis");
    double part_s = 0;  // of a subsector, as far as is known
    for (const SectorLayout& layout : kThesisLayouts) {
      Setting setting{"thesis", fmt::format("{}/{}", layout.count, layout.subsectors), layout, {}};
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
      return setting;
    };
    const auto with_bytes = [&](double bytes) {
      Setting setting{"certified", "", {}, usual};
      setting.certified->sectors = sectors_within(bytes, triangles, leaves_.count);
      setting.label = fmt::format("{} sectors", setting.certified->sectors);
      return setting;
    };
    Setting standard{"certified", "", {}, usual, true};
    standard.label = fmt::format("{} fans, {} sectors", usual.fans, usual.sectors);
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
        scene_.tin, groups, certified_settings()[0].certified.value(), stage_("measure"));
    for (Setting& setting : certified_settings()) {
      const auto is_same = [&](const Setting& s) { return s.certified == setting.certified; };
      if (std::any_of(done_.begin(), done_.end(), is_same)) continue;
      setting.seconds = cost.at(setting.certified->fans);
      if (!fits(setting.seconds)) {
        left_out_.push_back(setting);
        continue;
      }
      const Progress progress = stage_("certified, " + setting.label);
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

  ComparedJob job() const {
    ComparedJob job;
    job.name = "groups";
    job.title = "Hidden triangles that are drawn all the same";
    job.notes = {
        fmt::format("{} triangles, {} thread{}; judged from {} eyes at each of {} heights above "
                    "ground ({} m), all together.",
                    scene_.tin.triangles.size(), thread_count(), thread_count() == 1 ? "" : "s",
                    options_.eyes, options_.heights_m.size(), fmt::join(options_.heights_m, ", ")),
        "thesis by sectors/subsectors, certified by fans or sectors."};
    constexpr char kDrawn[] = "hidden triangles drawn, %";
    job.charts = {
        {"seconds", "preparation, seconds", "hidden_drawn_percent", kDrawn, ""},
        {"bytes_a_triangle", "kept, bytes a triangle", "hidden_drawn_percent", kDrawn, ""}};
    for (const Setting& s : done_) job.points.push_back(point(s));
    for (const Setting& s : left_out_)
      job.left_out.push_back(
          fmt::format("{} {}: about {:.0f} s, for lack of time", s.method, s.label, s.seconds));
    return job;
  }

  ComparedPoint point(const Setting& s) const {
    const VerifyCounts sum = total(s);
    ComparedPoint point{s.method,  s.label, {}, s.is_default, false, sum.falsely_culled > 0,
                        command(s)};
    point.figures = {
        {"seconds", s.seconds},
        {"us_a_triangle", 1e6 * s.seconds / static_cast<double>(scene_.tin.triangles.size())},
        {"bytes_a_triangle", s.bytes_per_triangle},
        {"hidden_drawn_percent", 100 * (1 - ratio(sum.culled - sum.falsely_culled,
                                                  std::max<std::uint64_t>(1, sum.hidden)))},
        {"falsely_culled_triangles", static_cast<double>(sum.falsely_culled)},
        {"falsely_culled_percent", 100 * ratio(sum.falsely_culled, sum.triangles - sum.hidden)}};
    for (const VerifyCounts& c : s.counts)
      if (c.in_hidden_groups > 0)
        point.figures[fmt::format("share_from_{:g}_m", c.eye_height_m)] =
            ratio(c.culled, c.in_hidden_groups);
    return point;
  }

  std::string command(const Setting& s) const {
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
  LeafGroups leaves_;
  std::vector<TriangleIndex> all_triangles_;
  std::vector<JudgedEye> eyes_;
  std::vector<Setting> done_, left_out_;
};

}  // namespace

ComparedJob compare_groups(const CulledGround& ground, const GroupsQuestion& question,
                           const StageProgress& stage) {
  return GroupsComparison(ground, question, stage).run();
}

}  // namespace scarp
