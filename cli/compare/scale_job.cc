#include "cli/compare/scale_job.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "cli/accuracy.h"
#include "cli/compare/compared_ground.h"
#include "cli/compare/jobs.h"
#include "cli/stage_clock.h"
#include "cli/stopwatch.h"
#include "core/error/error.h"
#include "core/skyline/skyline.h"
#include "core/threads/parallel_for.h"
#include "core/viewshed/viewshed.h"
#include "ingest/dem/dem_windows.h"
#include "ingest/mesh/mesh.h"

namespace scarp {
namespace {

/// Smaller squares take no time that could be measured.
constexpr std::int32_t kLeastSide = 16;
/// Exponents are those of the largest sizes, as many as this, and of no fewer.
constexpr std::size_t kFittedSizes = 3;
/// What a sample takes at most, of the DEM, its places and the work on them, bytes.
constexpr double kBytesPerSample = 160;
/// How much steeper than linear a prediction goes.
constexpr double kPredictedPower = 1.2;
/// Error of the meshes, in cells.
constexpr double kMeshErrorCells = 0.5;

/// Memory that is free goes back to the system, so that what comes next is counted.
/// @return what the process then has
std::uint64_t resident_bytes() {
  malloc_trim(0);
  StageClock clock;
  clock.begin("now");
  clock.end();
  return clock.costs().back().peak_bytes;
}

double samples_of(const ComparedGround& ground) {
  return static_cast<double>(ground.dem.columns) * static_cast<double>(ground.dem.rows);
}

/// What is done at every size, and what it took last.
struct Work {
  std::string name, words, command;
  std::function<void(const ComparedGround&)> run;
  double last_s = 0, last_samples = 0;
  bool is_over = false;  ///< the next size would not fit
};

void look_around(const ComparedGround& ground) {
  const GroundTops tops(ground.grid);
  ViewGround over(ground.grid);
  over.tops = &tops;
  const ComparedGround::Eye& eye = ground.eyes.front();
  std::vector<Seen> seen(static_cast<std::size_t>(samples_of(ground)));
  view_from(over, ground.earth,
            {ground.grid.raised(eye.column, eye.row, kComparedEyeHeightM), 0, {}}, seen);
}

void find_horizons(const ComparedGround& ground) {
  const auto samples = static_cast<std::size_t>(samples_of(ground));
  std::vector<std::int16_t> estimate(samples), lower(samples), upper(samples);
  SkylineBands bands;
  bands.estimate = estimate, bands.lower = lower, bands.upper = upper;
  SkylineOptions options;
  options.tolerance_rad = horizon_accuracy(Accuracy::kExact).tolerance_deg * std::numbers::pi / 180;
  Skyline skyline(ground.grid, ground.earth, options);
  for (int a = 0; a < kComparedAzimuths; ++a)
    skyline.look(fixed_azimuth(2 * std::numbers::pi * a / kComparedAzimuths), bands);
}

class ScaleComparison {
 public:
  ScaleComparison(const ScaleQuestion& question, const Progress& progress)
      : question_(question),
        progress_(progress),
        whole_(DemWindows(question.files, question.dem).dem()) {
    mesh_error_m_ = 0;
    works_ = {
        {"viewshed", "a viewshed", "scarp viewshed {0} --observer {1} -o seen.tif{2}", look_around},
        {"horizons", "horizons in 16 directions",
         "scarp horizon {0} -o horizons.tif --azimuths 16{2}", find_horizons},
        {"mesh", "a mesh", "scarp build {0} -o S --max-error {3:g}{2}",
         [this](const ComparedGround& ground) {
           mesh_samples(ground.samples, {.max_error_m = mesh_error_m_}, {});
         }}};
  }

  std::optional<ComparedJob> run(std::string& why) {
    const std::vector<std::int32_t> sides = this->sides();
    std::size_t done = 0;
    for (const std::int32_t side : sides) {
      if (!fits(side)) break;
      measure(side);
      if (progress_) progress_(static_cast<double>(++done) / static_cast<double>(sides.size()));
    }
    if (job_.points.empty()) {
      why = "for lack of time; give --time more";
      return {};
    }
    describe();
    return std::move(job_);
  }

 private:
  /// Of squares, from the smallest to one that holds the whole DEM.
  std::vector<std::int32_t> sides() const {
    std::vector<std::int32_t> sides;
    for (std::int32_t side = std::max(whole_.columns, whole_.rows);
         side >= kLeastSide || sides.empty(); side /= 2)
      sides.push_back(side);
    std::reverse(sides.begin(), sides.end());
    return sides;
  }

  double samples_at(std::int32_t side) const {
    return static_cast<double>(std::min(side, whole_.columns)) *
           static_cast<double>(std::min(side, whole_.rows));
  }

  double left_s() const { return question_.limit_s - watch_.seconds(); }

  /// Whether there is memory and time to read a square and do anything with it; says if not.
  bool fits(std::int32_t side) {
    const double samples = samples_at(side);
    const double memory = question_.memory_bytes > 0
                              ? static_cast<double>(question_.memory_bytes)
                              : static_cast<double>(machine_memory_bytes()) / 2;
    const double read_s = read_s_per_sample_ * samples;
    if (samples * kBytesPerSample > memory)
      job_.left_out.push_back(fmt::format("{:.3g} M samples: would take {:.3g} GiB of memory",
                                          samples / 1e6, samples * kBytesPerSample / 0x1p30));
    else if (read_s > left_s())
      job_.left_out.push_back(fmt::format("{:.3g} M samples: for lack of time", samples / 1e6));
    else
      return std::any_of(works_.begin(), works_.end(), [](const Work& w) { return !w.is_over; });
    return false;
  }

  void measure(std::int32_t side) {
    const std::uint64_t before_bytes = resident_bytes();
    const Stopwatch reading;
    std::optional<ComparedGround> ground;
    try {
      ground = read_compared_ground(question_.files, question_.dem, side, 1, question_.seed);
    } catch (const Error& failure) {
      if (failure.code() != ErrorCode::kInput || side >= std::max(whole_.columns, whole_.rows))
        throw;
      return;  // a void middle: larger squares may have ground
    }
    read_s_per_sample_ = reading.seconds() / samples_of(*ground);
    if (mesh_error_m_ == 0) mesh_error_m_ = kMeshErrorCells * ground->cell_m();
    for (Work& work : works_)
      if (!work.is_over) measure(*ground, before_bytes, work);
  }

  void measure(const ComparedGround& ground, std::uint64_t before_bytes, Work& work) {
    const double samples = samples_of(ground);
    const double predicted_s =
        work.last_samples > 0 ? work.last_s * std::pow(samples / work.last_samples, kPredictedPower)
                              : 0;
    if (predicted_s > left_s()) {
      work.is_over = true;
      job_.left_out.push_back(
          fmt::format("{} of {:.3g} M samples: about {:.2g} s, for lack of time", work.name,
                      samples / 1e6, predicted_s));
      return;
    }
    malloc_trim(0);
    StageClock clock;
    clock.begin(work.name);
    std::vector<double> seconds;
    do {
      const Stopwatch watch;
      work.run(ground);
      seconds.push_back(watch.seconds());
    } while (seconds.size() < kComparedRuns && seconds.back() < left_s() / 10);
    clock.end();
    const Timed time = median_of(std::move(seconds));
    work.last_s = time.median_s, work.last_samples = samples;
    ComparedPoint point{work.name,
                        fmt::format("{:.3g} k", samples / 1e3),
                        {},
                        false,
                        false,
                        false,
                        (ground.cut_command.empty() ? "" : ground.cut_command + " && ") +
                            fmt::format(fmt::runtime(work.command),
                                        fmt::format("'{}'", fmt::join(ground.files, "' '")),
                                        ground.typed(ground.eyes.front(), kComparedEyeHeightM),
                                        ground.surface_flags, mesh_error_m_)};
    const std::uint64_t peak_bytes = clock.costs().back().peak_bytes;
    point.figures = {{"samples", samples},
                     {work.name + "_seconds", time.median_s},
                     {work.name + "_seconds_least", time.least_s},
                     {work.name + "_seconds_most", time.most_s}};
    if (peak_bytes > before_bytes)
      point.figures[work.name + "_mib"] = static_cast<double>(peak_bytes - before_bytes) / 0x1p20;
    job_.points.push_back(std::move(point));
  }

  void describe() {
    job_.name = "scale";
    job_.title = "Viewshed, horizons and mesh by size";
    job_.notes = {
        fmt::format("The DEM and squares around its middle, each half as wide; {} thread{}, "
                    "reading not counted, up to {} runs; the",
                    thread_count(), thread_count() == 1 ? "" : "s", kComparedRuns),
        fmt::format("mesh within {:.3g} m. Memory: what the program has more at its height "
                    "than before it read the square.",
                    mesh_error_m_)};
    for (const Work& work : works_) {
      note_exponents(work);
      const std::string seconds = work.name + "_seconds", mib = work.name + "_mib";
      job_.charts.push_back({"samples", "samples", seconds, "seconds of " + work.words, work.name});
      job_.charts.push_back({"samples", "samples", mib, "MiB of " + work.words, work.name});
    }
    std::stable_sort(job_.points.begin(), job_.points.end(),
                     [&](const ComparedPoint& a, const ComparedPoint& b) {
                       return rank_of(a.method) < rank_of(b.method);
                     });
  }

  std::size_t rank_of(const std::string& method) const {
    return static_cast<std::size_t>(std::find_if(works_.begin(), works_.end(),
                                                 [&](const Work& w) { return w.name == method; }) -
                                    works_.begin());
  }

  void note_exponents(const Work& work) {
    const auto with = [&](const std::string& figure) {
      std::vector<ComparedPoint> points;
      for (const ComparedPoint& p : job_.points)
        if (p.figures.contains(figure)) points.push_back(p);
      if (points.size() > kFittedSizes) points.erase(points.begin(), points.end() - kFittedSizes);
      return points;
    };
    const auto timed = with(work.name + "_seconds"), sized = with(work.name + "_mib");
    if (timed.size() < kFittedSizes) return;
    std::string note = fmt::format("{}: time grows as samples to the power of {:.2f}", work.name,
                                   fitted_exponent(timed, work.name + "_seconds_least"));
    if (sized.size() >= kFittedSizes)
      note += fmt::format(", memory {:.2f}", fitted_exponent(sized, work.name + "_mib"));
    job_.notes.push_back(note + fmt::format(" (the {} largest sizes).", kFittedSizes));
  }

  const ScaleQuestion& question_;
  const Progress& progress_;
  const Stopwatch watch_;
  const Dem whole_;  // without its heights
  double mesh_error_m_ = 0, read_s_per_sample_ = 0;
  std::vector<Work> works_;
  ComparedJob job_;
};

}  // namespace

double fitted_exponent(std::span<const ComparedPoint> points, const std::string& figure) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const ComparedPoint& p : points) {
    const double x = std::log(p.figures.at("samples")), y = std::log(p.figures.at(figure));
    n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

std::optional<ComparedJob> compare_scale(const ScaleQuestion& question, const Progress& progress,
                                         std::string& why) {
  return ScaleComparison(question, progress).run(why);
}

}  // namespace scarp
