#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/geodesy/earth_frame.h"
#include "core/sight/ground_along.h"

namespace scarp {

/// A crossing of a sight line, measured on the Earth.
struct ProfilePoint {
  Position ground, line;        ///< unrounded; one above the other in the frame
  double distance_m = 0;        ///< from the eye along the ground, as EyeBearings has it
  double clearance_m = 0;       ///< of the line above the ground, along the frame's vertical
  double fresnel_radius_m = 0;  ///< of the first zone, 0 without a wavelength
  bool blocks = false;          ///< exact; clearance_m is rounded and decides nothing
  bool void_before = false;

  /// Share of the first Fresnel zone's radius that is clear; below 0 where the ground blocks.
  /// Requires a wavelength.
  double fresnel_ratio() const { return clearance_m / fresnel_radius_m; }
};

/// Measures each crossing of the line from an eye to a target.
/// @param earth         of the frame; nothing where it is flat
/// @param wavelength_m  0: no Fresnel zone
///
/// Accuracy: nanometres of rounding in clearance_m; the frame's vertical leans against the normal
/// by less than 1e-4 within 100 km of the centre. The zone is that of the straight line.
std::vector<ProfilePoint> sight_profile(const Position& eye, const Position& target,
                                        const GroundAlong& along,
                                        const std::optional<EarthFrame>& earth,
                                        double wavelength_m);

/// Radius of the first Fresnel zone, metres, at true distances from both ends.
double fresnel_radius_m(double wavelength_m, double from_eye_m, double from_target_m);

/// Heights beyond this are not looked for.
inline constexpr double kGreatestFreeHeightM = 100'000;

/// The least multiple of kLatticeStepM, from 0, at which one end of a line is free, or nothing up
/// to kGreatestFreeHeightM. Requires that whoever is free stays so higher up.
/// Cost: about 30 calls of is_free.
std::optional<double> least_free_height_m(const std::function<bool(double height_m)>& is_free);

}  // namespace scarp
