#include "core/viewshed/viewshed.h"

#include <algorithm>

#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Calls body(row, index of the row's first sample in the window) for a window's rows, in blocks
/// on all threads.
template <typename Body>
void for_rows(const SampleWindow& window, const Body& body) {
  if (window.last_row < window.first_row) return;
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
      if (!within(eye.limits, bearings.to(grid.raised(column, row, eye.target_height_m))))
        at = Seen::kHidden;
    }
  });
}

}  // namespace

SampleWindow view_from(const GroundGrid& grid, const std::optional<EarthFrame>& earth,
                       const ViewshedEye& eye, std::span<Seen> sight, SweepCounts* counts) {
  const EyeBearings bearings(eye.position, earth);
  const bool bounded = eye.limits.max_distance_m < std::numeric_limits<double>::infinity();
  const SampleWindow window =
      bounded ? reach_window(grid, eye.position, bearings, eye.limits.max_distance_m)
              : whole_window(grid);
  const SweepCounts found = sweep_viewshed(grid, eye.position, eye.target_height_m, window, sight);
  if (counts) *counts = found;
  if (eye.limits.any()) keep_within(grid, bearings, eye, window, sight);
  return window;
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
