#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/horizon/certified/fan.h"

namespace scarp {

/// Places in a fan's frame as columns, so that lines and planes over all of them are found side by
/// side. The last place is repeated to fill up kPlacesAtOnce: nothing asked here counts places.
class Places {
 public:
  Places() = default;
  explicit Places(std::span<const FanPlace> places) { assign(places); }

  /// Requires a place. Its memory is reused.
  void assign(std::span<const FanPlace> places);

  /// Of a plane through an edge: see EdgePlane::hold, for all places.
  struct EdgeLine {
    double u_m, v_m, z_m;  // of its beginning
    double eu, ev, along;  // its direction and slope
    double error_m, height_error_m, least_behind_m;
  };
  /// @return the least rise; -infinity where a place is too near or beyond
  double least_rise(const EdgeLine& edge) const;

  /// Of lines from all places over a place: see CurtainPlane::hold.
  /// @return the least slope; -infinity where a place is not least_way_m before it
  double least_slope(const FanPlace& over, double error_m, double height_error_m,
                     double least_way_m) const;

  /// Height at u = 0 of the lowest line of a slope that has all places on or under it.
  double tangent_m(double slope) const;

  /// Least slope of lines from the places to one beyond; nearer ones count as if least_way_m away.
  double slope_to(double u_m, double z_m, double least_way_m) const;

 private:
  std::size_t size_ = 0;  // a multiple of kPlacesAtOnce
  std::vector<double> u_m_, v_m_, z_m_;
};

inline constexpr std::size_t kPlacesAtOnce = 8;

}  // namespace scarp
