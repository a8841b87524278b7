#include <cpl_error.h>
#include <fmt/format.h>
#include <gdal_alg.h>
#include <gdal_priv.h>

#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <optional>

#include "cli/accuracy.h"
#include "cli/compare/jobs.h"
#include "core/error/error.h"
#include "core/sight/tin_index.h"
#include "core/threads/parallel_for.h"
#include "core/viewshed/least_height.h"
#include "core/viewshed/thinned_ground.h"
#include "core/viewshed/tin_viewshed.h"
#include "core/viewshed/viewshed.h"
#include "ingest/mesh/mesh.h"

namespace scarp {
namespace {

std::size_t sample_count(const ComparedGround& ground) {
  return static_cast<std::size_t>(ground.dem.columns) * static_cast<std::size_t>(ground.dem.rows);
}

ViewshedEye eye_over(const GroundGrid& grid, const ComparedGround::Eye& eye) {
  return {grid.raised(eye.column, eye.row, kComparedEyeHeightM), 0, {}};
}

/// A ground of our own at an accuracy, with what that needs.
struct AccuracyGround {
  AccuracyGround(const GroundGrid& grid, Accuracy accuracy) : tops(grid), ground(grid) {
    ground.tops = &tops;
    if (accuracy != Accuracy::kExact) ground.deciding = Deciding::kByBounds;
    if (accuracy == Accuracy::kFast) ground.thinned = &thinned.emplace(grid, grid);
  }
  AccuracyGround(const AccuracyGround&) = delete;
  AccuracyGround& operator=(const AccuracyGround&) = delete;

  GroundTops tops;
  std::optional<ThinnedGround> thinned;
  ViewGround ground;
};

std::string command_of(const ComparedGround& ground, const std::string& flags) {
  return fmt::format(
      "scarp viewshed '{}' --observer {} -o seen.tif{}{}", fmt::join(ground.files, "' '"),
      ground.typed(ground.eyes.front(), kComparedEyeHeightM), flags, ground.surface_flags);
}

/// gdal_viewshed's algorithm, called in this process, so that no start of a program and no file
/// counts. It wants map units that are metres.
class GdalViewshed {
 public:
  explicit GdalViewshed(const ComparedGround& ground) : ground_(ground) {
    GDALAllRegister();
    auto* driver = GetGDALDriverManager()->GetDriverByName("MEM");
    dataset_.reset(
        driver->Create("", ground.dem.columns, ground.dem.rows, 1, GDT_Float32, nullptr));
    std::array<double, 6> to_map = ground.dem.geotransform;
    dataset_->SetGeoTransform(to_map.data());
    const std::string& wkt = ground.dem.frame->description().crs_wkt;
    if (!wkt.empty()) dataset_->SetProjection(wkt.c_str());
    std::vector<double> heights_m = ground.dem.heights_m;
    if (dataset_->GetRasterBand(1)->RasterIO(GF_Write, 0, 0, ground.dem.columns, ground.dem.rows,
                                             heights_m.data(), ground.dem.columns, ground.dem.rows,
                                             GDT_Float64, 0, 0, nullptr) != CE_None)
      throw Error(ErrorCode::kResource,
                  std::string("no memory for a raster: ") + CPLGetLastErrorMsg());
  }

  /// Earth's curvature without refraction is 1 for GDAL.
  double curvature() const {
    const FrameDescription& frame = ground_.dem.frame->description();
    return frame.earth == Earth::kFlat ? 0 : 1 - frame.refraction;
  }

  std::string command(const std::string& flags) const {
    const ComparedGround::Eye& eye = ground_.eyes.front();
    return fmt::format("gdal_viewshed{} -ox {:.10g} -oy {:.10g} -oz 2 -md 0 -cc {:g} '{}' seen.tif",
                       flags, ground_.dem.x_of(eye.column), ground_.dem.y_of(eye.row), curvature(),
                       ground_.files.front());
  }

  /// @param values[out]  [rows * columns]
  template <typename Value>
  void look(const ComparedGround::Eye& eye, GDALViewshedMode mode, GDALViewshedOutputType what,
            GDALDataType type, std::vector<Value>& values) const {
    values.resize(sample_count(ground_));
    const std::unique_ptr<GDALDataset> seen(GDALDataset::FromHandle(GDALViewshedGenerate(
        dataset_->GetRasterBand(1), "MEM", "", nullptr, ground_.dem.x_of(eye.column),
        ground_.dem.y_of(eye.row), kComparedEyeHeightM, 0, 1, 0, 0, -1, curvature(), mode, 0,
        nullptr, nullptr, what, nullptr)));
    if (!seen || seen->GetRasterBand(1)->RasterIO(
                     GF_Read, 0, 0, ground_.dem.columns, ground_.dem.rows, values.data(),
                     ground_.dem.columns, ground_.dem.rows, type, 0, 0, nullptr) != CE_None)
      throw Error(ErrorCode::kResource,
                  std::string("GDAL's viewshed gave no answer: ") + CPLGetLastErrorMsg());
  }

 private:
  const ComparedGround& ground_;
  std::unique_ptr<GDALDataset> dataset_;
};

/// Errors of all eyes together.
struct Wrong {
  std::uint64_t known = 0, visible = 0, falsely_visible = 0, falsely_hidden = 0;

  void add(std::span<const Seen> truth, std::span<const Seen> found) {
    for (std::size_t i = 0; i < truth.size(); ++i) {
      if (truth[i] == Seen::kUnknown) continue;
      ++known;
      visible += truth[i] == Seen::kVisible;
      falsely_visible += truth[i] == Seen::kHidden && found[i] == Seen::kVisible;
      falsely_hidden += truth[i] == Seen::kVisible && found[i] != Seen::kVisible;
    }
  }
  void put(ComparedPoint& point) const {
    const auto share = [&](std::uint64_t n) {
      return 100 * static_cast<double>(n) / static_cast<double>(std::max<std::uint64_t>(1, known));
    };
    point.figures["wrong_percent"] = share(falsely_visible + falsely_hidden);
    point.figures["falsely_visible_percent"] = share(falsely_visible);
    point.figures["falsely_hidden_percent"] = share(falsely_hidden);
    point.figures["visible_percent"] = share(visible);
  }
};

/// Answers of eyes beside the judge's, for all samples.
/// @tparam Errors  add(truth, found) of one eye after the other, then put(point)
template <typename Value, typename Errors>
class EyeComparison {
 protected:
  EyeComparison(const ComparedGround& ground, const Progress& progress)
      : ground_(ground), progress_(progress), found_(sample_count(ground)) {}

  void tell(double share) const {
    if (progress_) progress_(share);
  }

  /// @param look  (eye number, found[out])
  template <typename Look>
  void judge(const Look& look) {
    truth_.assign(ground_.eyes.size(), std::vector<Value>(found_.size()));
    const Timed time = timed(1, [&] {
      for (std::size_t i = 0; i < truth_.size(); ++i) look(i, std::span<Value>(truth_[i]));
    });
    Errors none;
    for (const std::vector<Value>& truth : truth_) none.add(truth, truth);
    finish({"scarp, every sample judged", "judge", {}, false, true, false, ""}, time, none);
  }

  /// Times a look from all eyes, and counts what it gets wrong.
  template <typename Look>
  void point(ComparedPoint point, const Look& look) {
    const Timed time = timed(kComparedRuns, [&] {
      for (std::size_t i = 0; i < truth_.size(); ++i) look(i, std::span<Value>(found_));
    });
    Errors errors;
    for (std::size_t i = 0; i < truth_.size(); ++i) {
      look(i, std::span<Value>(found_));
      errors.add(truth_[i], found_);
    }
    finish(std::move(point), time, errors);
  }

  /// Every accuracy of ours.
  /// @param flags  of the command besides
  /// @param look   (ground, eye, found[out])
  template <typename Look>
  void points_of_ours(const std::string& flags, const Look& look) {
    const int threads = thread_count();
    for (const Accuracy accuracy : {Accuracy::kExact, Accuracy::kHigh, Accuracy::kFast}) {
      const AccuracyGround at(ground_.grid, accuracy);
      const bool is_exact = accuracy == Accuracy::kExact;
      const std::string chosen =
          is_exact ? std::string() : std::string(" --accuracy ") + name_of(accuracy);
      const auto look_from = [&](std::size_t i, std::span<Value> found) {
        look(at.ground, eye_over(ground_.grid, ground_.eyes[i]), found);
      };
      point({"scarp",
             name_of(accuracy),
             {},
             is_exact,
             false,
             false,
             command_of(ground_, flags + chosen)},
            look_from);
      if (threads == 1) continue;
      set_thread_count(1);
      point({"scarp, one thread",
             name_of(accuracy),
             {},
             false,
             false,
             false,
             command_of(ground_, flags + chosen + " --threads 1")},
            look_from);
      set_thread_count(threads);
    }
  }

  /// gdal_viewshed's algorithm, or nothing where it cannot be asked, which the job then says.
  std::optional<GdalViewshed> gdal() {
    if (!ground_.dem.frame->is_geographic())
      return std::optional<GdalViewshed>(std::in_place, ground_);
    job_.left_out.push_back("gdal_viewshed: it takes degrees for metres");
    return {};
  }

  /// @param time  of all eyes together
  void finish(ComparedPoint point, const Timed& time, const Errors& errors) {
    const auto eyes = static_cast<double>(ground_.eyes.size());
    add_time(point, {time.median_s / eyes, time.least_s / eyes, time.most_s / eyes});
    errors.put(point);
    job_.points.push_back(std::move(point));
  }

  const ComparedGround& ground_;
  const Progress& progress_;
  ComparedJob job_;
  std::vector<Value> found_;
  std::vector<std::vector<Value>> truth_;  // of each eye
};

class ViewshedComparison : private EyeComparison<Seen, Wrong> {
 public:
  ViewshedComparison(const ComparedGround& ground, const Progress& progress,
                     std::span<const ViewshedPeer> peers)
      : EyeComparison(ground, progress), peers_(peers) {}

  ComparedJob run() {
    job_.name = "viewshed";
    job_.title = "What an eye sees, and how much of it is wrong";
    job_.notes = {
        fmt::format("{} x {} samples, {} eyes 2 m over ground, the first over the highest sample; "
                    "seconds an eye, reading and writing not counted,",
                    ground_.dem.columns, ground_.dem.rows, ground_.eyes.size()),
        fmt::format(
            "median of {} runs, lines from the least to the most. Ours on {} thread{}, other "
            "programs on one.",
            kComparedRuns, thread_count(), thread_count() == 1 ? "" : "s")};
    job_.charts = {{"seconds", "seconds an eye", "wrong_percent", "samples wrong, %", ""},
                   {"seconds", "seconds an eye", "falsely_visible_percent",
                    "hidden samples called visible, % of all", ""},
                   {"seconds", "seconds an eye", "falsely_hidden_percent",
                    "visible samples called hidden, % of all", ""}};
    judge([&](std::size_t i, std::span<Seen> truth) {
      exhaustive_viewshed(ground_.grid, eye_over(ground_.grid, ground_.eyes[i]).position, 0, truth);
    });
    tell(0.3);
    points_of_ours("", [&](const ViewGround& over, const ViewshedEye& eye, std::span<Seen> seen) {
      view_from(over, ground_.earth, eye, seen);
    });
    tell(0.5);
    look_over_meshes();
    tell(0.9);
    look_with_gdal();
    for (const ViewshedPeer& peer : peers_) look_with(peer);
    return std::move(job_);
  }

 private:
  void look_with(const ViewshedPeer& peer) {
    Wrong wrong;
    std::vector<double> seconds(kComparedRuns);  // of all eyes together
    try {
      for (std::size_t i = 0; i < ground_.eyes.size(); ++i) {
        const std::vector<double> took = peer.look(ground_.eyes[i], found_);
        std::transform(took.begin(), took.end(), seconds.begin(), seconds.begin(), std::plus());
        wrong.add(truth_[i], found_);
      }
    } catch (const Error& failure) {
      job_.left_out.push_back(peer.method + ": " + failure.what());
      return;
    }
    finish({peer.method, peer.setting, {}, false, false, false, peer.command},
           median_of(std::move(seconds)), wrong);
  }

  void look_over_meshes() {
    for (const double cells : {0.1, 0.5, 2.0}) {
      const double error_m = cells * ground_.cell_m();
      const Mesh mesh = mesh_samples(ground_.samples, {.max_error_m = error_m}, {});
      const TinIndex index(mesh.tin);
      GroundGrid stands(ground_.samples);
      stand_on(index, stands);
      const std::string build =
          fmt::format("scarp build '{}' -o S --max-error {:g}{} && ",
                      fmt::join(ground_.files, "' '"), error_m, ground_.surface_flags);
      const std::string look =
          fmt::format("scarp viewshed S --observer {} -o seen.tif",
                      ground_.typed(ground_.eyes.front(), kComparedEyeHeightM));
      const std::string name = fmt::format("{:.3g} m", error_m);
      // A border sample may lie beside the mesh.
      const auto eye_at = [&](std::size_t i) {
        const ComparedGround::Eye& eye = ground_.eyes[i];
        return eye_over(stands.is_known(eye.column, eye.row) ? stands : ground_.grid, eye);
      };
      point({"scarp, mesh", name, {}, false, false, false, build + look},
            [&](std::size_t i, std::span<Seen> seen) {
              view_from(ViewGround::of_tin(stands, index), ground_.earth, eye_at(i), seen);
            });
      job_.points.back().figures["triangles"] = static_cast<double>(mesh.tin.triangles.size());
      const AccuracyGround raster(stands, Accuracy::kHigh);
      point({"scarp, mesh as raster",
             name,
             {},
             false,
             false,
             false,
             build + look + " --accuracy high"},
            [&](std::size_t i, std::span<Seen> seen) {
              view_from(raster.ground, ground_.earth, eye_at(i), seen);
            });
    }
  }

  void look_with_gdal() {
    const std::optional<GdalViewshed> gdal = this->gdal();
    if (!gdal) return;
    constexpr std::pair<GDALViewshedMode, const char*> kModes[] = {
        {GVM_Edge, "edge"}, {GVM_Diagonal, "diagonal"}, {GVM_Max, "max"}, {GVM_Min, "min"}};
    std::vector<std::uint8_t> values;
    for (const auto& [mode, name] : kModes)
      point({"gdal_viewshed",
             name,
             {},
             false,
             false,
             false,
             mode == GVM_Edge ? gdal->command("") : std::string()},
            [&](std::size_t i, std::span<Seen> seen) {
              gdal->look(ground_.eyes[i], mode, GVOT_NORMAL, GDT_Byte, values);
              std::transform(values.begin(), values.end(), seen.begin(), [](std::uint8_t v) {
                return v == 1 ? Seen::kVisible : Seen::kHidden;
              });
            });
  }

  const std::span<const ViewshedPeer> peers_;
};

/// How far heights of all eyes are off, metres, where the judge has one.
struct HeightsOff {
  double sum_m = 0, most_too_low_m = 0, most_too_high_m = 0;
  std::uint64_t count = 0;

  void add(std::span<const float> truth_m, std::span<const float> found_m) {
    for (std::size_t i = 0; i < truth_m.size(); ++i) {
      if (!std::isfinite(truth_m[i]) || !std::isfinite(found_m[i])) continue;
      const double off_m = static_cast<double>(found_m[i]) - static_cast<double>(truth_m[i]);
      sum_m += std::abs(off_m);
      most_too_low_m = std::max(most_too_low_m, -off_m);
      most_too_high_m = std::max(most_too_high_m, off_m);
      ++count;
    }
  }
  void put(ComparedPoint& point) const {
    point.figures["mean_error_m"] = sum_m / static_cast<double>(std::max<std::uint64_t>(1, count));
    point.figures["most_too_low_m"] = most_too_low_m;
    point.figures["most_too_high_m"] = most_too_high_m;
  }
};

class HeightComparison : private EyeComparison<float, HeightsOff> {
 public:
  HeightComparison(const ComparedGround& ground, const Progress& progress)
      : EyeComparison(ground, progress) {}

  ComparedJob run() {
    job_.name = "heights";
    job_.title = "From which height on a target is seen, and how far off that is";
    job_.notes = {
        fmt::format("{} x {} samples, {} eyes 2 m over ground; seconds an eye, median of {} runs, "
                    "lines from the least to the most.",
                    ground_.dem.columns, ground_.dem.rows, ground_.eyes.size(), kComparedRuns)};
    job_.charts = {
        {"seconds", "seconds an eye", "mean_error_m", "mean error of the least height, m", ""}};
    judge(
        [&](std::size_t i, std::span<float> truth_m) { judge_heights(ground_.eyes[i], truth_m); });
    tell(0.5);
    points_of_ours(" --mode ground",
                   [&](const ViewGround& over, const ViewshedEye& eye, std::span<float> to) {
                     heights_from(over, ground_.earth, eye, to);
                   });
    tell(0.8);
    look_with_gdal();
    return std::move(job_);
  }

 private:
  void judge_heights(const ComparedGround::Eye& eye, std::span<float> truth_m) const {
    const GroundGrid& grid = ground_.grid;
    const GridSight sight(grid, eye_over(grid, eye).position);
    parallel_for(static_cast<std::size_t>(grid.rows()), [&](std::size_t r) {
      const auto row = static_cast<std::int32_t>(r);
      for (std::int32_t column = 0; column < grid.columns(); ++column)
        truth_m[r * static_cast<std::size_t>(grid.columns()) + static_cast<std::size_t>(column)] =
            grid.is_known(column, row) ? least_height_m(sight, grid, column, row)
                                       : std::numeric_limits<float>::quiet_NaN();
    });
  }

  void look_with_gdal() {
    const std::optional<GdalViewshed> gdal = this->gdal();
    if (!gdal) return;
    std::vector<double> values;
    point({"gdal_viewshed", "GROUND", {}, false, false, false, gdal->command(" -om GROUND")},
          [&](std::size_t i, std::span<float> to) {
            gdal->look(ground_.eyes[i], GVM_Edge, GVOT_MIN_TARGET_HEIGHT_FROM_GROUND, GDT_Float64,
                       values);
            for (std::size_t k = 0; k < values.size(); ++k)
              to[k] = static_cast<float>(std::max(0.0, values[k]));
          });
    point({"gdal_viewshed", "DEM", {}, false, false, false, gdal->command(" -om DEM")},
          [&](std::size_t i, std::span<float> to) {
            gdal->look(ground_.eyes[i], GVM_Edge, GVOT_MIN_TARGET_HEIGHT_FROM_DEM, GDT_Float64,
                       values);
            for (std::size_t k = 0; k < values.size(); ++k)
              to[k] = static_cast<float>(std::max(0.0, values[k] - ground_.dem.heights_m[k]));
          });
  }
};

}  // namespace

ComparedJob compare_viewsheds(const ComparedGround& ground, const Progress& progress,
                              std::span<const ViewshedPeer> peers) {
  return ViewshedComparison(ground, progress, peers).run();
}

ComparedJob compare_heights(const ComparedGround& ground, const Progress& progress) {
  return HeightComparison(ground, progress).run();
}

}  // namespace scarp
