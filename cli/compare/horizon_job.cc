#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "cli/accuracy.h"
#include "cli/compare/jobs.h"
#include "core/error/error.h"
#include "core/horizon/stewart.h"
#include "core/skyline/crossing_kernels.h"
#include "core/skyline/skyline.h"
#include "core/threads/parallel_for.h"
#include "core/viewshed/grid_sight.h"
#include "core/viewshed/ray_horizon.h"
#include "ingest/mesh/mesh.h"

namespace scarp {
namespace {

constexpr std::size_t kJudgedPlaces = 400;
constexpr std::uint32_t kStewartVertices = 20'000;
constexpr double kDegreesPerRadian = 180 / std::numbers::pi;
constexpr double kBandDeg = 0.01;  ///< a step of a band

double azimuth_rad(int i) {
  return 2 * std::numbers::pi * i / kComparedAzimuths;
}

/// How far horizons are off, degrees.
struct DegreesOff {
  double sum = 0, most = 0, width = 0;
  std::uint64_t count = 0, outside = 0;  ///< outside: of the bounds

  void add(double truth_deg, double found_deg) {
    const double off = std::abs(found_deg - truth_deg);
    sum += off;
    most = std::max(most, off);
    ++count;
  }
  void put(ComparedPoint& point) const {
    const auto n = static_cast<double>(std::max<std::uint64_t>(1, count));
    point.figures["mean_error_deg"] = sum / n;
    point.figures["largest_error_deg"] = most;
    point.figures["judged"] = static_cast<double>(count);
  }
  void put_bounds(ComparedPoint& point) const {
    const auto n = static_cast<double>(std::max<std::uint64_t>(1, count));
    point.figures["mean_width_of_bounds_deg"] = width / n;
    point.figures["outside_bounds"] = static_cast<double>(outside);
  }
};

class HorizonComparison {
 public:
  HorizonComparison(const ComparedGround& ground, std::uint64_t seed, const Progress& progress,
                    std::span<const HorizonPeer> peers)
      : ground_(ground),
        progress_(progress),
        peers_(peers),
        places_(ground.draw(kJudgedPlaces, seed)) {}

  ComparedJob run() {
    job_.name = "horizon";
    job_.title = "The horizon of every point, and how far it is off";
    job_.notes = {
        fmt::format("{} x {} samples in {} directions, judged at {} samples. Ours: a sweep along "
                    "lines, by tolerance; thesis: by",
                    ground_.dem.columns, ground_.dem.rows, kComparedAzimuths, kJudgedPlaces),
        fmt::format(
            "sectors/subsectors, {} vertices, judged in the middle of sectors. Median of {} "
            "runs on {} thread{}, lines from",
            kStewartVertices, kComparedRuns, thread_count(), thread_count() == 1 ? "" : "s"),
        "the least to the most; r.horizon on one thread."};
    constexpr char kTime[] = "ns_a_point_and_direction";
    constexpr char kTimeWords[] = "nanoseconds a point and direction";
    job_.charts = {{kTime, kTimeWords, "mean_error_deg", "mean error, degrees", ""},
                   {kTime, kTimeWords, "largest_error_deg", "largest error, degrees", ""},
                   {kTime, kTimeWords, "mean_width_of_bounds_deg",
                    "mean width between the bounds, degrees", ""}};
    judge();
    if (progress_) progress_(0.2);
    for (const double tolerance_deg : {0.03, 0.1, 0.3, 1.0, 3.0}) look(tolerance_deg, true);
    look(horizon_accuracy(Accuracy::kFast).tolerance_deg, false);
    if (progress_) progress_(0.5);
    look_by_thesis();
    for (const HorizonPeer& peer : peers_) look_with(peer);
    return std::move(job_);
  }

 private:
  struct Truth {
    bool is_usable = false;
    double elevation_deg = 0;
  };

  void judge() {
    truth_.resize(places_.size() * kComparedAzimuths);
    const Timed time = timed(1, [&] {
      parallel_for(truth_.size(), [&](std::size_t i) {
        const ComparedGround::Eye& at = places_[i / kComparedAzimuths];
        const JudgedHorizon judged =
            judge_horizon(ground_.grid, ground_.earth, 0, at.column, at.row,
                          azimuth_rad(static_cast<int>(i % kComparedAzimuths)));
        truth_[i] = {judged.is_known && judged.met, judged.elevation_rad * kDegreesPerRadian};
      });
    });
    ComparedPoint judge{"scarp, each ray judged", "judge", {}, false, true, false, ""};
    judge.figures["ns_a_point_and_direction"] =
        1e9 * time.median_s / static_cast<double>(truth_.size());
    DegreesOff().put(judge);
    job_.points.push_back(judge);
  }

  std::string command(double tolerance_deg, bool has_bounds) const {
    return fmt::format("scarp horizon '{}' -o horizons.tif --azimuths {} --tolerance {:g}{}{}",
                       fmt::join(ground_.files, "' '"), kComparedAzimuths, tolerance_deg,
                       has_bounds ? "" : " --estimate-only", ground_.surface_flags);
  }

  void look(double tolerance_deg, bool has_bounds) {
    const std::size_t samples =
        static_cast<std::size_t>(ground_.dem.columns) * static_cast<std::size_t>(ground_.dem.rows);
    std::vector<std::int16_t> estimate(samples), lower(samples), upper(samples);
    SkylineBands bands;
    bands.estimate = estimate;
    if (has_bounds) bands.lower = lower, bands.upper = upper;
    SkylineOptions options;
    options.tolerance_rad = tolerance_deg / kDegreesPerRadian;
    Skyline skyline(ground_.grid, ground_.earth, options);
    ComparedPoint point{has_bounds ? "scarp" : "scarp, without bounds",
                        fmt::format("{:g} degree{}", tolerance_deg, tolerance_deg == 1 ? "" : "s"),
                        {},
                        false,
                        false,
                        false,
                        command(tolerance_deg, has_bounds)};
    point.is_default =
        has_bounds && tolerance_deg == horizon_accuracy(Accuracy::kExact).tolerance_deg;
    const Timed time = timed(kComparedRuns, [&] {
      for (int a = 0; a < kComparedAzimuths; ++a)
        skyline.look(fixed_azimuth(azimuth_rad(a)), bands);
    });
    add_cost(point, time, static_cast<double>(samples) * kComparedAzimuths);
    DegreesOff off;
    for (int a = 0; a < kComparedAzimuths; ++a) {
      skyline.look(fixed_azimuth(azimuth_rad(a)), bands);
      for (std::size_t p = 0; p < places_.size(); ++p) {
        const Truth& truth = truth_[p * kComparedAzimuths + static_cast<std::size_t>(a)];
        const std::size_t i = static_cast<std::size_t>(places_[p].row) *
                                  static_cast<std::size_t>(ground_.dem.columns) +
                              static_cast<std::size_t>(places_[p].column);
        if (!truth.is_usable || estimate[i] <= kNothingSeen) continue;
        off.add(truth.elevation_deg, kBandDeg * estimate[i]);
        if (!has_bounds) continue;
        off.width += kBandDeg * (upper[i] - lower[i]);
        off.outside += truth.elevation_deg < kBandDeg * lower[i] - kRoundingDeg ||
                       truth.elevation_deg > kBandDeg * upper[i] + kRoundingDeg;
      }
    }
    off.put(point);
    if (has_bounds) off.put_bounds(point);
    job_.points.push_back(std::move(point));
  }

  void add_cost(ComparedPoint& point, const Timed& time, double looks) const {
    add_time(point, time);
    const std::string name = "ns_a_point_and_direction";
    point.figures[name] = 1e9 * time.median_s / looks;
    point.figures[name + "_least"] = 1e9 * time.least_s / looks;
    point.figures[name + "_most"] = 1e9 * time.most_s / looks;
  }

  void look_with(const HorizonPeer& peer) {
    std::vector<double> elevation_deg(truth_.size());
    std::vector<double> seconds;
    try {
      seconds = peer.look(places_, elevation_deg);
    } catch (const Error& failure) {
      job_.left_out.push_back(peer.method + ": " + failure.what());
      return;
    }
    DegreesOff off;
    for (std::size_t i = 0; i < truth_.size(); ++i)
      if (truth_[i].is_usable && !std::isnan(elevation_deg[i]))
        off.add(truth_[i].elevation_deg, elevation_deg[i]);
    ComparedPoint point{peer.method, peer.setting, {}, false, false, false, peer.command};
    add_cost(point, median_of(std::move(seconds)),
             peer.looks > 0 ? peer.looks : static_cast<double>(truth_.size()));
    off.put(point);
    job_.points.push_back(std::move(point));
  }

  /// The horizon of the grid at a vertex, in a direction of the plane.
  std::optional<double> true_elevation_deg(const Position& eye, double direction_rad) const {
    const double reach_m = 2 * (ground_.samples.cell_x_m * ground_.dem.columns +
                                ground_.samples.cell_y_m * ground_.dem.rows);
    const Position end = ray_end(eye, direction_rad, reach_m);
    const auto horizon = ray_horizon(eye, end, GridSight(ground_.grid, eye).ground_along(end));
    if (!horizon || horizon->over_void) return {};
    return EyeBearings(eye, ground_.earth).to(horizon->place).pitch_rad * kDegreesPerRadian;
  }

  void look_by_thesis() {
    const Mesh mesh = mesh_samples(ground_.samples, {.vertex_budget = kStewartVertices}, {});
    const std::vector<Position>& vertices = mesh.tin.vertices;
    constexpr SectorLayout kLayouts[] = {{8, 1}, {8, 8}, {16, 4}, {32, 4}, {64, 1}, {64, 8}};
    for (const SectorLayout& layout : kLayouts) {
      HorizonTable table;
      const Timed time =
          timed(kComparedRuns, [&] { table = stewart_horizons(vertices, layout, {}); });
      ComparedPoint point{"thesis",
                          fmt::format("{}/{}", layout.count, layout.subsectors),
                          {},
                          false,
                          false,
                          false,
                          fmt::format("scarp build '{}' -o S --vertices {} --horizon stewart "
                                      "--sectors {} --subsectors {}{}",
                                      fmt::join(ground_.files, "' '"), kStewartVertices,
                                      layout.count, layout.subsectors, ground_.surface_flags)};
      add_cost(point, time,
               static_cast<double>(vertices.size()) * static_cast<double>(layout.count));
      judge_table(table, vertices).put(point);
      job_.points.push_back(std::move(point));
    }
  }

  DegreesOff judge_table(const HorizonTable& table, const std::vector<Position>& vertices) const {
    const std::size_t step = std::max<std::size_t>(1, vertices.size() / kJudgedPlaces);
    const std::int32_t sectors = table.layout.count;
    const std::size_t judged = vertices.size() / step * static_cast<std::size_t>(sectors);
    std::vector<std::optional<std::pair<double, double>>> both(judged);
    parallel_for(judged, [&](std::size_t i) {
      const auto vertex = static_cast<VertexIndex>(i / static_cast<std::size_t>(sectors) * step);
      const auto sector = static_cast<std::int32_t>(i % static_cast<std::size_t>(sectors));
      const VertexIndex horizon = table.at(vertex, sector);
      if (horizon == kNone) return;
      const SectorAxis axis = sector_axis(table.layout, sector);
      const Position& eye = vertices[vertex];
      const auto truth = true_elevation_deg(eye, std::atan2(axis.y, axis.x));
      if (!truth) return;
      both[i] = {*truth, EyeBearings(eye, ground_.earth).to(vertices[horizon]).pitch_rad *
                             kDegreesPerRadian};
    });
    DegreesOff off;
    for (const auto& pair : both)
      if (pair) off.add(pair->first, pair->second);
    return off;
  }

  /// Of the comparison in double.
  static constexpr double kRoundingDeg = 1e-9;

  const ComparedGround& ground_;
  const Progress& progress_;
  const std::span<const HorizonPeer> peers_;
  std::vector<ComparedGround::Eye> places_;
  std::vector<Truth> truth_;  // [places * azimuths]
  ComparedJob job_;
};

}  // namespace

ComparedJob compare_horizons(const ComparedGround& ground, std::uint64_t seed,
                             const Progress& progress, std::span<const HorizonPeer> peers) {
  return HorizonComparison(ground, seed, progress, peers).run();
}

}  // namespace scarp
