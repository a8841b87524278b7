#include "core/viewshed/seen_ground.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/occlusion/splitmix64.h"
#include "core/threads/parallel_for.h"

namespace scarp {

std::uint64_t count_known(const GroundGrid& grid) {
  std::uint64_t known = 0;
  for (std::int32_t row = 0; row < grid.rows(); ++row)
    for (std::int32_t column = 0; column < grid.columns(); ++column)
      known += grid.is_known(column, row) ? 1 : 0;
  return known;
}

std::vector<SamplePlace> choose_samples(const GroundGrid& grid, std::uint64_t count,
                                        std::uint64_t seed) {
  std::uint64_t left = count_known(grid);
  std::uint64_t wanted = std::min(count, left);
  std::vector<SamplePlace> chosen;
  chosen.reserve(wanted);
  SplitMix64 random(seed);
  for (std::int32_t row = 0; row < grid.rows(); ++row) {
    for (std::int32_t column = 0; column < grid.columns(); ++column) {
      if (!grid.is_known(column, row)) continue;
      if (random.below(left--) >= wanted) continue;
      chosen.push_back({column, row});
      --wanted;
    }
  }
  return chosen;
}

double cell_area_m2(const GroundGrid& grid, const std::optional<EarthFrame>& earth,
                    const SamplePlace& place) {
  // Half a cell to each side; at the border the cell inwards of it.
  const double column = std::clamp(place.column + 0.0, 0.5, grid.columns() - 1.5);
  const double row = std::clamp(place.row + 0.0, 0.5, grid.rows() - 1.5);
  struct Vector {
    double x, y, z;
  };
  const auto at = [&](double right, double down) {
    const Position p = grid.place(column + right, row + down, 0);
    if (!earth) return Vector{p.x_m, p.y_m, 0};
    const EcefPoint e = earth->frame.unflatten(p);
    return Vector{e.x_m, e.y_m, e.z_m};
  };
  const Vector nw = at(-0.5, -0.5), ne = at(0.5, -0.5), sw = at(-0.5, 0.5), se = at(0.5, 0.5);
  // A quadrangle's area is half the product of its diagonals across each other.
  const Vector a{se.x - nw.x, se.y - nw.y, se.z - nw.z}, b{sw.x - ne.x, sw.y - ne.y, sw.z - ne.z};
  return std::hypot(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x) / 2;
}

SeenGround::SeenGround(const GroundGrid& grid)
    : columns_(static_cast<std::size_t>(grid.columns())),
      area_m2_(columns_ * static_cast<std::size_t>(grid.rows())) {
  parallel_for(static_cast<std::size_t>(grid.rows()), [&](std::size_t row) {
    for (std::size_t column = 0; column < columns_; ++column)
      area_m2_[row * columns_ + column] =
          grid.is_known(static_cast<std::int32_t>(column), static_cast<std::int32_t>(row))
              ? 0
              : std::numeric_limits<double>::quiet_NaN();
  });
}

void SeenGround::add(const SampleWindow& window, std::span<const Seen> sight, double area_m2) {
  if (window.last_row < window.first_row || window.last_column < window.first_column) return;
  parallel_for(
      static_cast<std::size_t>(window.last_row - window.first_row + 1), [&](std::size_t r) {
        const std::size_t begin = (static_cast<std::size_t>(window.first_row) + r) * columns_;
        for (std::size_t i = begin + static_cast<std::size_t>(window.first_column);
             i <= begin + static_cast<std::size_t>(window.last_column); ++i)
          if (sight[i] == Seen::kVisible) area_m2_[i] += area_m2;
      });
}

std::span<const float> SeenGround::finish_km2(double share) {
  constexpr double kM2PerKm2 = 1e6;
  auto* bytes = reinterpret_cast<std::byte*>(area_m2_.span().data());
  for (std::size_t i = 0; i < area_m2_.size(); ++i) {
    double m2;
    std::memcpy(&m2, bytes + i * sizeof(double), sizeof(double));
    const auto km2 = static_cast<float>(m2 / share / kM2PerKm2);
    std::memcpy(bytes + i * sizeof(float), &km2, sizeof(float));
    constexpr std::size_t kAtOnce = std::size_t{1} << 18;
    if (i % kAtOnce == 0) relieve_large_memory();
  }
  return {reinterpret_cast<const float*>(bytes), area_m2_.size()};
}

}  // namespace scarp
