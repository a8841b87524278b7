#pragma once

#include <cmath>
#include <cstdint>

namespace scarp {

/// Step of the lattice that every position is rounded to, once, when it enters the program.
/// 2^-12 m = 0.24 mm: below what any survey resolves, and coarse enough that differences of
/// positions within kLatticeReachM are exact in double and their products exact in 128 bits.
inline constexpr double kLatticeStepM = 0x1p-12;

/// Greatest absolute coordinate, metres. 2^27 m = 134,000 km holds every flattened scene that
/// stays 87 degrees away from its centre.
inline constexpr double kLatticeReachM = 0x1p27;

/// A point in the scene's flattened frame, metres: x and y in the plane (east and north at the
/// scene's centre), z along the radial lines. Coordinates are multiples of kLatticeStepM and at
/// most kLatticeReachM in absolute value.
struct Position {
  double x_m = 0;
  double y_m = 0;
  double z_m = 0;

  friend bool operator==(const Position&, const Position&) = default;
};

/// Nearest multiple of kLatticeStepM; ties to even. Requires |value_m| <= kLatticeReachM.
inline double round_to_lattice(double value_m) {
  // A double this large has steps of the lattice, so the addition rounds to it.
  constexpr double kRounder = 0x1.8p52 * kLatticeStepM;
  return (value_m + kRounder) - kRounder;
}

inline Position round_to_lattice(const Position& p) {
  return {round_to_lattice(p.x_m), round_to_lattice(p.y_m), round_to_lattice(p.z_m)};
}

/// The coordinate in lattice steps. Exact; |result| <= 2^39.
inline std::int64_t lattice_steps(double value_m) {
  return static_cast<std::int64_t>(value_m / kLatticeStepM);
}

}  // namespace scarp
