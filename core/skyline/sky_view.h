#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/skyline/skyline.h"

namespace scarp {

/// What the horizons of all azimuths say together, taken in one after the other.
///
/// Sky view factor: the share of the light of an evenly bright sky that reaches a level surface,
///   mean over the azimuths of cos^2 h, with h the horizon's elevation and at least 0
/// (Dozier and Frew 1990, equation 7b for no slope). 1 on a plain, 0 in a well.
///
/// Openness: mean over the azimuths of 90 degrees - h, h below 0 counted as such (Yokoyama,
/// Shirasawa and Pike 2002; with no limit of distance). Of horizons this is positive openness, the
/// mean zenith angle, above 90 degrees on summits; of horizons upside down (Sight::kDown) negative
/// openness, the mean nadir angle, above 90 degrees in hollows. Azimuths in which no ground lies
/// within the data are left out.
///
/// A sample with an unknown horizon has neither: NaN.
/// Accuracy: that of the horizons; sums are rounded to 1e-6 of the result.
class SkyView {
 public:
  SkyView(std::int32_t columns, std::int32_t rows, bool wants_sky_view, bool wants_openness);

  /// Before the parts of each azimuth.
  void begin_azimuth();
  /// Parts of one azimuth may come from several threads at once.
  void add(const SkylinePart& part);

  /// [rows * columns]; afterwards nothing is to be added.
  std::span<const float> sky_view();
  std::span<const float> openness_deg();

 private:
  std::int32_t columns_;
  std::size_t samples_, azimuths_ = 0;
  std::vector<float> light_by_elevation_;
  std::vector<float> light_, zenith_steps_;
  std::vector<std::uint16_t> met_;
  bool light_done_ = false, zenith_done_ = false;
};

}  // namespace scarp
