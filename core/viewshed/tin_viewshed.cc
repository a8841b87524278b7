#include "core/viewshed/tin_viewshed.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/sight/line_of_sight.h"
#include "core/threads/parallel_for.h"

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

/// Ground at a sample's place, or beside it towards the middle of the raster.
std::optional<double> ground_near_m(const TinIndex& index, const GroundGrid& samples,
                                    std::int32_t column, std::int32_t row) {
  const Position p = samples.at(column, row);
  if (const auto ground_m = index.ground_height_m(p.x_m, p.y_m)) return ground_m;
  if (!std::holds_alternative<BlockPlacement>(samples.placement())) return {};
  for (const double down : {-kInwardsCells, kInwardsCells}) {
    for (const double right : {-kInwardsCells, kInwardsCells}) {
      const double c = column + right, r = row + down;
      if (c < 0 || r < 0 || c > samples.columns() - 1 || r > samples.rows() - 1) continue;
      const Position q = samples.place(c, r, samples.height_m(column, row));
      if (const auto ground_m = index.ground_height_m(q.x_m, q.y_m)) return ground_m;
    }
  }
  return {};
}

void stand(const TinIndex& index, GroundGrid& samples, std::int32_t column, std::int32_t row) {
  // Where normals lean, the place depends on the height: each round leaves a thousandth.
  constexpr int kRounds = 3;
  samples.set_z(column, row, 0);
  for (int round = 0; round < kRounds; ++round) {
    const auto ground_m = ground_near_m(index, samples, column, row);
    if (!ground_m) {
      samples.set_void(column, row);
      return;
    }
    samples.set_z(column, row, std::ceil(*ground_m / kLatticeStepM) * kLatticeStepM);
  }
  while (index.above_ground(samples.at(column, row)).value_or(0) < 0)
    samples.set_z(column, row, samples.at(column, row).z_m + kLatticeStepM);
}

Seen seen_of(Sight sight) {
  return sight == Sight::kVisible  ? Seen::kVisible
         : sight == Sight::kHidden ? Seen::kHidden
                                   : Seen::kUnknown;
}

/// Calls body(column, row) for the samples of a window, on all threads, a part of the rows after
/// the other, so that progress is told from one thread.
template <typename Body>
void for_samples(const SampleWindow& window, const Progress& progress, const Body& body) {
  if (window.last_row < window.first_row || window.last_column < window.first_column) return;
  constexpr std::int32_t kSlices = 50;
  const std::int32_t rows = window.last_row - window.first_row + 1;
  for (std::int32_t slice = 0; slice < kSlices; ++slice) {
    const auto at = [&](std::int64_t i) { return static_cast<std::int32_t>(rows * i / kSlices); };
    const std::int32_t first = window.first_row + at(slice);
    parallel_for(static_cast<std::size_t>(at(slice + 1) - at(slice)), [&](std::size_t r) {
      for (std::int32_t column = window.first_column; column <= window.last_column; ++column)
        body(column, first + static_cast<std::int32_t>(r));
    });
    if (progress) progress(static_cast<double>(slice + 1) / kSlices);
  }
}

/// Flattened height that a target over a sample must have at least for nothing to block it.
double least_z_m(const TinIndex& index, const Position& eye, const Position& sample) {
  double rise_m = -std::numeric_limits<double>::infinity();
  for (const GroundCrossing& crossing : ground_along(index, eye, sample).crossings)
    rise_m = std::max(rise_m, (crossing.ground_z_m - eye.z_m) / to_double(crossing.at));
  return eye.z_m + rise_m;
}

float least_height_m(const TinIndex& index, const GroundGrid& samples, const Position& eye,
                     std::int32_t column, std::int32_t row) {
  constexpr float kNever = std::numeric_limits<float>::infinity();
  const Position ground = samples.at(column, row);
  const auto sight_at = [&](double height_m) {
    return line_of_sight(index, eye, samples.raised(column, row, height_m));
  };
  const Sight sight = line_of_sight(index, eye, ground);
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
  for_samples(whole_window(samples), {},
              [&](std::int32_t column, std::int32_t row) { stand(index, samples, column, row); });
}

void tin_viewshed(const TinIndex& index, const GroundGrid& samples, const Position& eye,
                  double target_height_m, const SampleWindow& window, std::span<Seen> sight,
                  const Progress& progress) {
  for_samples(window, progress, [&](std::int32_t column, std::int32_t row) {
    sight[index_of(samples, column, row)] =
        samples.is_known(column, row)
            ? seen_of(line_of_sight(index, eye, samples.raised(column, row, target_height_m)))
            : Seen::kUnknown;
  });
}

void tin_heights(const TinIndex& index, const GroundGrid& samples, const Position& eye,
                 const SampleWindow& window, std::span<float> least_m) {
  for_samples(window, {}, [&](std::int32_t column, std::int32_t row) {
    least_m[index_of(samples, column, row)] = samples.is_known(column, row)
                                                  ? least_height_m(index, samples, eye, column, row)
                                                  : std::numeric_limits<float>::quiet_NaN();
  });
}

}  // namespace scarp
