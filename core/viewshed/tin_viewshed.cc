#include "core/viewshed/tin_viewshed.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <vector>

#include "core/sight/line_of_sight.h"
#include "core/sight/triangle_walk.h"
#include "core/threads/parallel_for.h"
#include "core/viewshed/tin_horizon.h"

namespace scarp {
namespace {

/// How far inwards a border sample outside the mesh looks for it, in cells: more than it can lie
/// outside, less than would matter on a map.
constexpr double kInwardsCells = 1.0 / 8;

/// Heights beyond this are not looked for, metres.
constexpr double kHighestM = 100'000;

std::size_t index_of(const GroundGrid& samples, std::int32_t column, std::int32_t row) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(samples.columns()) +
         static_cast<std::size_t>(column);
}

bool is_empty(const SampleWindow& window) {
  return window.last_row < window.first_row || window.last_column < window.first_column;
}

/// Ground at a sample's place, or beside it towards the middle of the raster.
std::optional<double> ground_near_m(TriangleWalk& ground, const GroundGrid& samples,
                                    std::int32_t column, std::int32_t row) {
  const Position p = samples.at(column, row);
  if (const auto ground_m = ground.ground_height_m(p.x_m, p.y_m)) return ground_m;
  if (!std::holds_alternative<BlockPlacement>(samples.placement())) return {};
  for (const double down : {-kInwardsCells, kInwardsCells}) {
    for (const double right : {-kInwardsCells, kInwardsCells}) {
      const double c = column + right, r = row + down;
      if (c < 0 || r < 0 || c > samples.columns() - 1 || r > samples.rows() - 1) continue;
      const Position q = samples.place(c, r, samples.height_m(column, row));
      if (const auto ground_m = ground.ground_height_m(q.x_m, q.y_m)) return ground_m;
    }
  }
  return {};
}

void stand(TriangleWalk& ground, GroundGrid& samples, std::int32_t column, std::int32_t row) {
  // Where normals lean, the place depends on the height: each round leaves a thousandth.
  constexpr int kRounds = 3;
  samples.set_z(column, row, 0);
  double z_m = 0;
  for (int round = 0; round < kRounds; ++round) {
    const auto ground_m = ground_near_m(ground, samples, column, row);
    if (!ground_m) {
      samples.set_void(column, row);
      return;
    }
    const double next_m = std::ceil(*ground_m / kLatticeStepM) * kLatticeStepM;
    if (next_m == z_m) break;  // so would be all rounds to come
    samples.set_z(column, row, z_m = next_m);
  }
  while (ground.above_ground(samples.at(column, row)).value_or(0) < 0)
    samples.set_z(column, row, samples.at(column, row).z_m + kLatticeStepM);
}

Seen seen_of(Sight sight) {
  return sight == Sight::kVisible  ? Seen::kVisible
         : sight == Sight::kHidden ? Seen::kHidden
                                   : Seen::kUnknown;
}

/// Calls body(column, row, ground) for the samples of a window, on all threads, a part of the rows
/// after the other, so that progress is told from one thread.
/// @return the sum of what it returns
template <typename Body>
std::uint64_t for_samples(const TinIndex& index, const SampleWindow& window,
                          const Progress& progress, const Body& body) {
  if (is_empty(window)) return 0;
  constexpr std::int32_t kSlices = 50;
  const std::int32_t rows = window.last_row - window.first_row + 1;
  std::vector<std::uint64_t> sums(static_cast<std::size_t>(rows));
  for (std::int32_t slice = 0; slice < kSlices; ++slice) {
    const auto at = [&](std::int64_t i) { return static_cast<std::int32_t>(rows * i / kSlices); };
    const std::int32_t first = at(slice);
    parallel_for(static_cast<std::size_t>(at(slice + 1) - first), [&](std::size_t r) {
      const std::int32_t row = first + static_cast<std::int32_t>(r);
      TriangleWalk ground(index);
      std::uint64_t sum = 0;
      for (std::int32_t column = window.first_column; column <= window.last_column; ++column)
        sum += body(column, window.first_row + row, ground);
      sums[static_cast<std::size_t>(row)] = sum;
    });
    if (progress) progress(static_cast<double>(slice + 1) / kSlices);
  }
  return std::accumulate(sums.begin(), sums.end(), std::uint64_t{0});
}

/// Places around the targets of a window, and the distance between samples there.
struct Outline {
  std::vector<Position> places;
  double spacing_m = 1;
};

Outline outline_of(const GroundGrid& samples, const SampleWindow& window) {
  Outline outline;
  const auto add = [&](std::int32_t column, std::int32_t row) {
    outline.places.push_back(samples.at(column, row));
  };
  for (std::int32_t c = window.first_column; c <= window.last_column; ++c)
    add(c, window.first_row), add(c, window.last_row);
  for (std::int32_t r = window.first_row; r <= window.last_row; ++r)
    add(window.first_column, r), add(window.last_column, r);
  const Bounds bounds = bounds_of(outline.places);
  const double cells =
      std::max(1, window.last_column - window.first_column + window.last_row - window.first_row);
  outline.spacing_m = std::max(
      (bounds.high.x_m - bounds.low.x_m + bounds.high.y_m - bounds.low.y_m) / cells, kLatticeStepM);
  return outline;
}

/// line_of_sight from one eye to many targets.
class TinSight {
 public:
  /// @param outline  of the targets
  TinSight(const TinIndex& index, const Position& eye, const Outline& outline)
      : index_(index), eye_(eye), horizon_(index, eye, outline.places, outline.spacing_m) {
    const bool is_over_ground = index.triangle_at(eye.x_m, eye.y_m) != kNone;
    is_clear_ = !is_over_ground || TriangleWalk(index).stands_clear(eye);
    asks_void_ = !is_over_ground;
  }

  struct Judged {
    Sight sight;
    bool whole;  ///< by line_of_sight
  };
  /// @param ground  for one thread
  Judged judge(const Position& target, TriangleWalk& ground) const {
    const TinHorizon::Found found = horizon_.ask(target);
    if (found.answer == TinHorizon::Answer::kBlocked) return {Sight::kHidden, false};
    if (found.answer == TinHorizon::Answer::kOpen || !is_clear_ || !ground.stands_clear(target))
      return {line_of_sight(index_, eye_, target), true};
    const bool asks_void = asks_void_ || found.may_meet_border;
    return {asks_void ? unblocked_sight(index_, eye_, target) : Sight::kVisible, false};
  }

 private:
  const TinIndex& index_;
  Position eye_;
  TinHorizon horizon_;
  bool is_clear_;   // the eye is not under ground
  bool asks_void_;  // it is not over ground
};

/// Flattened height that a target over a sample must have at least for nothing to block it.
double least_z_m(const TinIndex& index, const Position& eye, const Position& sample) {
  double rise_m = -std::numeric_limits<double>::infinity();
  for (const GroundCrossing& crossing : ground_along(index, eye, sample).crossings)
    rise_m = std::max(rise_m, (crossing.ground_z_m - eye.z_m) / to_double(crossing.at));
  return eye.z_m + rise_m;
}

/// @param sight  of the ground at the sample
float least_height_m(const TinIndex& index, const GroundGrid& samples, const Position& eye,
                     std::int32_t column, std::int32_t row, Sight sight) {
  constexpr float kNever = std::numeric_limits<float>::infinity();
  const Position ground = samples.at(column, row);
  const auto sight_at = [&](double height_m) {
    return line_of_sight(index, eye, samples.raised(column, row, height_m));
  };
  if (sight == Sight::kUnknown) return std::numeric_limits<float>::quiet_NaN();
  if (sight == Sight::kVisible) return 0;
  if (eye.x_m == ground.x_m && eye.y_m == ground.y_m) return kNever;
  // Beyond this the line is over ground that it cannot clear: the eye is under it.
  if (sight_at(kHighestM) == Sight::kHidden) return kNever;
  double height_m = samples.height_above_ground_m(
      column, row, std::max(least_z_m(index, eye, ground), ground.z_m));
  // On a leaning normal the raised target stands a little aside, and it is put on the lattice.
  for (double more_m = kLatticeStepM; height_m < kHighestM; more_m *= 2) {
    height_m += more_m;
    const Sight raised = sight_at(height_m);
    if (raised == Sight::kUnknown) return std::numeric_limits<float>::quiet_NaN();
    if (raised == Sight::kVisible) return std::nextafter(static_cast<float>(height_m), kNever);
  }
  return kNever;
}

}  // namespace

void stand_on(const TinIndex& index, GroundGrid& samples) {
  for_samples(index, whole_window(samples), {},
              [&](std::int32_t column, std::int32_t row, TriangleWalk& ground) {
                stand(ground, samples, column, row);
                return 0U;
              });
}

std::uint64_t tin_viewshed(const TinIndex& index, const GroundGrid& samples, const Position& eye,
                           double target_height_m, const SampleWindow& window,
                           std::span<Seen> sight, const Progress& progress) {
  if (is_empty(window)) return 0;
  const TinSight from(index, eye, outline_of(samples, window));
  return for_samples(
      index, window, progress, [&](std::int32_t column, std::int32_t row, TriangleWalk& ground) {
        Seen& seen = sight[index_of(samples, column, row)];
        seen = Seen::kUnknown;
        if (!samples.is_known(column, row)) return 0U;
        const auto judged = from.judge(samples.raised(column, row, target_height_m), ground);
        seen = seen_of(judged.sight);
        return judged.whole ? 1U : 0U;
      });
}

void judge_tin_viewshed(const TinIndex& index, const GroundGrid& samples, const Position& eye,
                        double target_height_m, const SampleWindow& window, std::span<Seen> sight) {
  for_samples(index, window, {}, [&](std::int32_t column, std::int32_t row, TriangleWalk&) {
    sight[index_of(samples, column, row)] =
        samples.is_known(column, row)
            ? seen_of(line_of_sight(index, eye, samples.raised(column, row, target_height_m)))
            : Seen::kUnknown;
    return 0U;
  });
}

std::uint64_t tin_heights(const TinIndex& index, const GroundGrid& samples, const Position& eye,
                          const SampleWindow& window, std::span<float> least_m) {
  if (is_empty(window)) return 0;
  const TinSight from(index, eye, outline_of(samples, window));
  return for_samples(index, window, {},
                     [&](std::int32_t column, std::int32_t row, TriangleWalk& ground) {
                       float& least = least_m[index_of(samples, column, row)];
                       least = std::numeric_limits<float>::quiet_NaN();
                       if (!samples.is_known(column, row)) return 0U;
                       const Sight sight = from.judge(samples.at(column, row), ground).sight;
                       least = least_height_m(index, samples, eye, column, row, sight);
                       return sight == Sight::kHidden ? 1U : 0U;
                     });
}

}  // namespace scarp
