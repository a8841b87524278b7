#include "cli/compare/flight_job.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "cli/fly/contenders.h"
#include "cli/fly/flight.h"
#include "cli/fly/flight_path.h"
#include "cli/stopwatch.h"
#include "core/error/error.h"

namespace scarp {
namespace {

/// Frames that are flown between two looks at the clock.
constexpr std::size_t kLeg = 5;

/// Frames of all flights, method by method.
struct MethodSum {
  std::vector<double> find_ms, frame_ms;                          // of each frame
  double drawn_of_visible = 0, drawn = 0, wrong = 0, judged = 0;  // sums over the frames
};

/// The median of values, and those that a tenth of them is below and above.
void add_spread(ComparedPoint& point, const std::string& figure, std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  point.figures[figure] = values[n / 2];
  point.figures[figure + "_least"] = values[n / 10];
  point.figures[figure + "_most"] = values[n - 1 - n / 10];
}

class FlightComparison {
 public:
  FlightComparison(const FlownGround& ground, const FlightQuestion& question,
                   const Progress& progress)
      : ground_(ground), question_(question), progress_(progress) {}

  std::optional<ComparedJob> run(std::string& why) {
    if (question_.limit_s > 0) {
      const Prepared prepared(ground_, {});
      for (std::size_t r = 0; r < question_.routes.size(); ++r) fly_along(r, prepared);
    }
    if (sums_.empty()) {
      why = job_.left_out.empty() ? "for lack of time; give --time more" : job_.left_out.front();
      return {};
    }
    describe();
    for (auto& [method, sum] : sums_) job_.points.push_back(point(method, sum));
    return std::move(job_);
  }

 private:
  /// Leg by leg, while another like the last still fits.
  void fly_along(std::size_t route, const Prepared& prepared) {
    const std::string& name = question_.routes[route];
    const Stopwatch watch;
    const double limit_s = (question_.limit_s - watch_.seconds()) /
                           static_cast<double>(question_.routes.size() - route);
    std::vector<Waypoint> path;
    try {
      path = find_path(ground_, route_of(name), question_.frames, question_.seed);
    } catch (const Error& failure) {
      job_.left_out.push_back(fmt::format("{}: {}", name, failure.what()));
      return;
    }
    const GeoFrame::Placer placer(ground_.frame);
    std::vector<Contender> contenders = contenders_of(ground_, prepared, {});
    std::size_t flown = 0;
    for (double leg_s = 0; flown < path.size() && watch.seconds() + leg_s <= limit_s;) {
      const Stopwatch leg;
      FlightPlan plan;
      for (; flown < path.size() && plan.shots.size() < kLeg; ++flown)
        plan.shots.push_back(shot_at(placer, path[flown], Lens{}));
      add(fly(ground_.index, prepared.batches, plan, contenders,
              [](std::size_t, std::size_t, const Target&, const Target&) {}, {}),
          contenders);
      leg_s = leg.seconds();
      if (progress_)
        progress_((static_cast<double>(route) +
                   static_cast<double>(flown) / static_cast<double>(path.size())) /
                  static_cast<double>(question_.routes.size()));
    }
    if (flown > 0) flown_.push_back(fmt::format("{} of {}", flown, name));
    if (flown < path.size())
      job_.left_out.push_back(fmt::format("{} of {} frames of {}: for lack of time",
                                          path.size() - flown, path.size(), name));
  }

  void add(const Flight& flight, const std::vector<Contender>& contenders) {
    for (std::size_t c = 0; c < contenders.size(); ++c) {
      MethodSum& sum = sums_[contenders[c].label];
      for (std::size_t f = 0; f < flight.truth.size(); ++f) {
        const FrameCounts& counts = flight.counts[c][f];
        const double visible = static_cast<double>(flight.truth[f].in_visible_groups);
        sum.find_ms.push_back(counts.find_ms);
        sum.frame_ms.push_back(counts.find_ms + counts.draw_ms);
        sum.drawn += static_cast<double>(counts.drawn);
        sum.drawn_of_visible += static_cast<double>(counts.drawn) / std::max(1.0, visible);
        sum.wrong += static_cast<double>(counts.wrong_px[0]);
        sum.judged += static_cast<double>(counts.judged_wrong_px[0]);
      }
    }
  }

  void describe() {
    job_.name = "flight";
    job_.title = "Wrong pixels of flights, and what they gain";
    job_.notes = {fmt::format("{}, {} pixels wide; frames: {}.", question_.ground, Lens{}.width_px,
                              fmt::join(flown_, ", ")),
                  "Lines leave out the fastest and the slowest tenth of the frames. Hollow: an "
                  "exact ray confirms a wrong pixel."};
    constexpr char kWrong[] = "wrong pixels a frame";
    constexpr char kDrawn[] =
        "triangles drawn, of those in groups that are seen, mean of the frames";
    constexpr char kFrame[] = "milliseconds a frame, finding and drawing, median";
    job_.charts = {{"frame_ms", kFrame, "wrong_pixels", kWrong, ""},
                   {"drawn_of_visible", kDrawn, "wrong_pixels", kWrong, ""},
                   {"find_ms", "milliseconds to find what is visible, median", "drawn_of_visible",
                    kDrawn, ""}};
  }

  ComparedPoint point(const std::string& method, MethodSum& sum) const {
    const auto frames = static_cast<double>(sum.find_ms.size());
    ComparedPoint point{
        method,
        method,
        {},
        method == "certified",
        false,
        sum.judged > 0,
        fmt::format("{}for route in {}; do scarp fly {} --route $route --frames {} --seed {} "
                    "--methods {} -o $route; done",
                    question_.commands, fmt::join(question_.routes, " "), question_.scene,
                    question_.frames, question_.seed, method)};
    point.figures = {{"drawn_of_visible", sum.drawn_of_visible / frames},
                     {"triangles", sum.drawn / frames},
                     {"wrong_pixels", sum.wrong / frames},
                     {"judged_wrong_pixels", sum.judged / frames}};
    add_spread(point, "find_ms", std::move(sum.find_ms));
    add_spread(point, "frame_ms", std::move(sum.frame_ms));
    return point;
  }

  const FlownGround& ground_;
  const FlightQuestion& question_;
  const Progress& progress_;
  const Stopwatch watch_;
  ComparedJob job_;
  std::vector<std::string> flown_;
  std::map<std::string, MethodSum> sums_;
};

}  // namespace

std::optional<ComparedJob> compare_flight(const FlownGround& ground, const FlightQuestion& question,
                                          const Progress& progress, std::string& why) {
  return FlightComparison(ground, question, progress).run(why);
}

}  // namespace scarp
