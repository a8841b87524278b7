#include "core/viewshed/viewshed.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/threads/for_each_target.h"
#include "core/threads/parallel_for.h"
#include "core/viewshed/tin_viewshed.h"

namespace scarp {
namespace {

/// Calls body(row, index of the row's first sample in the window) for a window's rows, in blocks
/// on all threads.
template <typename Body>
void for_rows(const SampleWindow& window, const Body& body) {
  if (window.last_row < window.first_row || window.last_column < window.first_column) return;
  constexpr std::int32_t kRowsPerTask = 32;
  const std::int32_t rows = window.last_row - window.first_row + 1;
  parallel_for(static_cast<std::size_t>((rows + kRowsPerTask - 1) / kRowsPerTask),
               [&](std::size_t task) {
                 const std::int32_t first =
                     window.first_row + static_cast<std::int32_t>(task) * kRowsPerTask;
                 for (std::int32_t row = first;
                      row <= std::min(window.last_row, first + kRowsPerTask - 1); ++row)
                   body(row);
               });
}

void keep_within(const GroundGrid& grid, const EyeBearings& bearings, const ViewshedEye& eye,
                 const SampleWindow& window, std::span<Seen> sight) {
  for_rows(window, [&](std::int32_t row) {
    for (std::int32_t column = window.first_column; column <= window.last_column; ++column) {
      Seen& at = sight[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns()) +
                       static_cast<std::size_t>(column)];
      if (at == Seen::kHidden || !grid.is_known(column, row)) continue;
      const Position target = grid.raised(column, row, eye.target_height_m);
      if (!bearings.surely_within(eye.limits, target) && !within(eye.limits, bearings.to(target)))
        at = Seen::kHidden;
    }
  });
}

SampleWindow window_of(const GroundGrid& grid, const ViewshedEye& eye,
                       const EyeBearings& bearings) {
  return eye.limits.max_distance_m < std::numeric_limits<double>::infinity()
             ? reach_window(grid, eye.position, bearings, eye.limits.max_distance_m)
             : whole_window(grid);
}

/// A least height within the limits of pitch, or NaN. Pitch rises with height.
float climb_to_pitch(const GroundGrid& grid, const EyeBearings& bearings, const ViewLimits& limits,
                     std::int32_t column, std::int32_t row, float least_m) {
  const auto pitch_at = [&](double height_m) {
    return bearings.to(grid.raised(column, row, height_m)).pitch_rad;
  };
  constexpr float kNever = std::numeric_limits<float>::quiet_NaN();
  if (limits.min_pitch_rad <= ViewLimits().min_pitch_rad &&
      limits.max_pitch_rad >= ViewLimits().max_pitch_rad)
    return least_m;
  constexpr double kHighestM = 100'000;
  if (pitch_at(least_m) < limits.min_pitch_rad) {
    double low_m = least_m, high_m = kHighestM;
    if (pitch_at(high_m) < limits.min_pitch_rad) return kNever;
    while (high_m - low_m > kLatticeStepM / 2) {
      const double middle_m = (low_m + high_m) / 2;
      (pitch_at(middle_m) < limits.min_pitch_rad ? low_m : high_m) = middle_m;
    }
    least_m = std::nextafter(static_cast<float>(high_m), std::numeric_limits<float>::infinity());
  }
  return pitch_at(least_m) > limits.max_pitch_rad ? kNever : least_m;
}

/// Counts of a view over a TIN.
SweepCounts counts_of(const SampleWindow& window, std::uint64_t judged) {
  SweepCounts counts;
  if (window.last_column < window.first_column || window.last_row < window.first_row) return counts;
  counts.targets = static_cast<std::uint64_t>(window.last_column - window.first_column + 1) *
                   static_cast<std::uint64_t>(window.last_row - window.first_row + 1);
  counts.traced_whole = judged;
  return counts;
}

/// What a view over thinned ground finds, given to all samples that each of its own stands for.
/// @param look     (ground, eye, raster of its samples) -> window
/// @param of_void, beyond  the answers of void samples, and of those that the sweep does not reach
template <typename Value, typename Look>
SampleWindow over_thinned(const ViewGround& ground, const std::optional<EarthFrame>& earth,
                          const ViewshedEye& eye, std::span<Value> result, Value of_void,
                          Value beyond, const Look& look) {
  constexpr std::int32_t kStep = ThinnedGround::kStep;
  const ThinnedGround& thin = *ground.thinned;
  ViewGround over = ground.obstacles ? ViewGround::under(thin.stands(), thin.blocks())
                                     : ViewGround(thin.stands());
  over.tops = &thin.tops();
  over.deciding = ground.deciding;
  ViewshedEye from = eye;
  from.position = raised_over(eye.position, ground_under_m(ground.blocks(), eye.position),
                              ground_under_m(thin.blocks(), eye.position));
  const auto thin_columns = static_cast<std::size_t>(thin.stands().columns());
  LargeArray<Value> found(thin_columns * static_cast<std::size_t>(thin.stands().rows()));
  const SampleWindow swept = look(over, from, found.span());
  const GroundGrid& grid = ground.stands;
  SampleWindow window = window_of(grid, eye, EyeBearings(eye.position, earth));
  for_rows(window, [&](std::int32_t row) {
    for (std::int32_t column = window.first_column; column <= window.last_column; ++column) {
      const std::int32_t c = column / kStep, r = row / kStep;
      Value& to = result[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns()) +
                         static_cast<std::size_t>(column)];
      to = !grid.is_known(column, row) ? of_void
           : swept.contains(c, r)
               ? found[static_cast<std::size_t>(r) * thin_columns + static_cast<std::size_t>(c)]
               : beyond;
    }
  });
  return window;
}

/// The least height at a sample within an eye's limits, from that which the ground leaves.
float within_limits(const GroundGrid& grid, const EyeBearings& bearings, const ViewLimits& limits,
                    std::int32_t column, std::int32_t row, float least_m) {
  ViewLimits aside = limits;
  aside.min_pitch_rad = ViewLimits().min_pitch_rad;
  aside.max_pitch_rad = ViewLimits().max_pitch_rad;
  const Position ground = grid.at(column, row);
  if (bearings.surely_within(limits, ground)) return least_m;
  return within(aside, bearings.to(ground))
             ? climb_to_pitch(grid, bearings, limits, column, row, least_m)
             : std::numeric_limits<float>::quiet_NaN();
}

/// Requires fewer than 2^31 samples.
SCARP_FOR_EACH_TARGET
SeenTotals count_piece(std::span<const Seen> sight) {
  const auto* values = reinterpret_cast<const std::uint8_t*>(sight.data());
  constexpr auto kVisible = static_cast<std::uint8_t>(Seen::kVisible);
  constexpr auto kUnknown = static_cast<std::uint8_t>(Seen::kUnknown);
  std::int32_t visible = 0, unknown = 0;
  for (std::size_t i = 0; i < sight.size(); ++i) {
    visible += values[i] == kVisible ? 1 : 0;
    unknown += values[i] == kUnknown ? 1 : 0;
  }
  SeenTotals totals;
  totals.visible = static_cast<std::uint64_t>(visible);
  totals.unknown = static_cast<std::uint64_t>(unknown);
  totals.hidden = sight.size() - totals.visible - totals.unknown;
  return totals;
}

}  // namespace

SampleWindow heights_from(const ViewGround& ground, const std::optional<EarthFrame>& earth,
                          const ViewshedEye& eye, std::span<float> least_m, SweepCounts* counts) {
  const GroundGrid& grid = ground.stands;
  if (ground.thinned)
    return over_thinned(ground, earth, eye, least_m, std::numeric_limits<float>::quiet_NaN(),
                        std::numeric_limits<float>::quiet_NaN(),
                        [&](const ViewGround& over, const ViewshedEye& from, std::span<float> to) {
                          return heights_from(over, earth, from, to, counts);
                        });
  const EyeBearings bearings(eye.position, earth);
  const SampleWindow window = window_of(grid, eye, bearings);
  SweepCounts found;
  if (ground.tin) {
    found = counts_of(window, tin_heights(*ground.tin, grid, eye.position, window, least_m));
  } else {
    found = sweep_heights(ground.swept(), eye.position, window, least_m);
  }
  if (counts) *counts = found;
  for_rows(window, [&](std::int32_t row) {
    for (std::int32_t column = window.first_column; column <= window.last_column; ++column) {
      float& at = least_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns()) +
                          static_cast<std::size_t>(column)];
      if (std::isinf(at)) at = std::numeric_limits<float>::quiet_NaN();
      if (std::isnan(at) || !eye.limits.any()) continue;
      at = within_limits(grid, bearings, eye.limits, column, row, at);
    }
  });
  return window;
}

void LeastHeight::lower(const ViewGround& ground, const std::optional<EarthFrame>& earth,
                        const ViewshedEye& eye, SweepCounts* counts) {
  const GroundGrid& grid = ground.stands;
  if (ground.tin || ground.thinned) {
    LargeArray<float> own_m(least_m_.size());
    add(heights_from(ground, earth, eye, own_m.span(), counts), own_m.span());
    return;
  }
  const EyeBearings bearings(eye.position, earth);
  HeightLimit limit;
  if (eye.limits.any())
    limit = [&](std::int32_t column, std::int32_t row, float least_m) {
      return within_limits(grid, bearings, eye.limits, column, row, least_m);
    };
  SweptGround swept = ground.swept();
  swept.least_tops = &tops_;
  const SweepCounts found =
      lower_heights(swept, eye.position, window_of(grid, eye, bearings), limit, least_m_.span());
  if (counts) *counts = found;
}

LeastHeight::LeastHeight(const GroundGrid& grid)
    : columns_(static_cast<std::size_t>(grid.columns())),
      least_m_(columns_ * static_cast<std::size_t>(grid.rows())),
      tops_(grid) {
  for_rows(whole_window(grid), [&](std::int32_t row) {
    std::fill_n(least_m_.span().begin() +
                    static_cast<std::ptrdiff_t>(static_cast<std::size_t>(row) * columns_),
                columns_, std::numeric_limits<float>::quiet_NaN());
  });
}

void LeastHeight::add(const SampleWindow& window, std::span<const float> least_m) {
  for_rows(window, [&](std::int32_t row) {
    const std::size_t begin = static_cast<std::size_t>(row) * columns_;
    for (std::size_t i = begin + static_cast<std::size_t>(window.first_column);
         i <= begin + static_cast<std::size_t>(window.last_column); ++i)
      least_m_[i] = std::fmin(least_m_[i], least_m[i]);
  });
}

SampleWindow view_from(const ViewGround& ground, const std::optional<EarthFrame>& earth,
                       const ViewshedEye& eye, std::span<Seen> sight, SweepCounts* counts,
                       const Progress& progress) {
  const GroundGrid& grid = ground.stands;
  if (ground.thinned)
    return over_thinned(ground, earth, eye, sight, Seen::kUnknown, Seen::kHidden,
                        [&](const ViewGround& over, const ViewshedEye& from, std::span<Seen> to) {
                          return view_from(over, earth, from, to, counts);
                        });
  const EyeBearings bearings(eye.position, earth);
  const SampleWindow window = window_of(grid, eye, bearings);
  SweepCounts found;
  if (ground.tin) {
    found = counts_of(window, tin_viewshed(*ground.tin, grid, eye.position, eye.target_height_m,
                                           window, sight, progress));
  } else {
    found = sweep_viewshed(ground.swept(), eye.position, eye.target_height_m, window, sight);
  }
  if (counts) *counts = found;
  if (eye.limits.any()) keep_within(grid, bearings, eye, window, sight);
  return window;
}

SeenTotals count_seen(std::span<const Seen> sight) {
  constexpr std::size_t kPiece = std::size_t{1} << 20;
  std::vector<SeenTotals> totals((sight.size() + kPiece - 1) / kPiece);
  parallel_for(totals.size(), [&](std::size_t i) {
    totals[i] = count_piece(sight.subspan(i * kPiece, std::min(kPiece, sight.size() - i * kPiece)));
  });
  SeenTotals sum;
  for (const SeenTotals& piece : totals) {
    sum.visible += piece.visible;
    sum.hidden += piece.hidden;
    sum.unknown += piece.unknown;
  }
  return sum;
}

AnyEye::AnyEye(const GroundGrid& grid)
    : columns_(static_cast<std::size_t>(grid.columns())),
      sight_(columns_ * static_cast<std::size_t>(grid.rows())) {
  for_rows(whole_window(grid), [&](std::int32_t row) {
    for (std::int32_t column = 0; column < grid.columns(); ++column)
      sight_[static_cast<std::size_t>(row) * columns_ + static_cast<std::size_t>(column)] =
          grid.is_known(column, row) ? Seen::kHidden : Seen::kUnknown;
  });
}

void AnyEye::add(const SampleWindow& window, std::span<const Seen> sight) {
  for_rows(window, [&](std::int32_t row) {
    const std::size_t begin = static_cast<std::size_t>(row) * columns_;
    for (std::size_t i = begin + static_cast<std::size_t>(window.first_column);
         i <= begin + static_cast<std::size_t>(window.last_column); ++i) {
      if (sight[i] == Seen::kVisible || sight_[i] == Seen::kHidden) {
        if (sight[i] != Seen::kHidden) sight_[i] = sight[i];
      }
    }
  });
}

EyeCount::EyeCount(const GroundGrid& grid)
    : columns_(static_cast<std::size_t>(grid.columns())),
      counts_(columns_ * static_cast<std::size_t>(grid.rows())) {
  for_rows(whole_window(grid), [&](std::int32_t row) {
    for (std::int32_t column = 0; column < grid.columns(); ++column)
      counts_[static_cast<std::size_t>(row) * columns_ + static_cast<std::size_t>(column)] =
          grid.is_known(column, row) ? 0 : kVoid;
  });
}

void EyeCount::add(const SampleWindow& window, std::span<const Seen> sight) {
  for_rows(window, [&](std::int32_t row) {
    const std::size_t begin = static_cast<std::size_t>(row) * columns_;
    for (std::size_t i = begin + static_cast<std::size_t>(window.first_column);
         i <= begin + static_cast<std::size_t>(window.last_column); ++i)
      if (sight[i] == Seen::kVisible) ++counts_[i];
  });
}

}  // namespace scarp
