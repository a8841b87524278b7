#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace scarp {

/// What the horizons of all azimuths say together, taken in one after the other.
///
/// Sky view factor: the share of the light of an evenly bright sky that reaches a level surface,
///   mean over the azimuths of cos^2 h, with h the horizon's elevation and at least 0
/// (Dozier and Frew 1990, equation 7b for no slope). 1 on a plain, 0 in a well.
///
/// Positive openness: mean over the azimuths of the zenith angle of the horizon, 90 degrees - h, h
/// below 0 counted as such (Yokoyama, Shirasawa and Pike 2002; with no limit of distance). Above 90
/// degrees on summits. Azimuths in which no ground lies within the data are left out.
///
/// A sample with an unknown horizon has neither: NaN.
/// Accuracy: that of the horizons; sums are rounded to 1e-6 of the result.
class SkyView {
 public:
  SkyView(std::size_t samples, bool wants_sky_view, bool wants_openness);

  /// One azimuth's horizons, [samples], as Skyline gives them.
  void add(std::span<const std::int16_t> elevations);

  /// [samples]; afterwards nothing is to be added.
  std::span<const float> sky_view();
  std::span<const float> openness_deg();

 private:
  std::size_t samples_, azimuths_ = 0;
  std::vector<float> light_by_elevation_;
  std::vector<float> light_, zenith_steps_;
  std::vector<std::uint16_t> met_;
  bool light_done_ = false, zenith_done_ = false;
};

}  // namespace scarp
