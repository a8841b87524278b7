#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/horizon/certified/fan.h"

namespace scarp {

inline constexpr std::size_t kPlacesAtOnce = 8;

/// Places in a fan's frame as columns, so that lines and planes over all of them are found side by
/// side. The last place is repeated to fill up kPlacesAtOnce: nothing asked here counts places.
class Places {
 public:
  Places() = default;
  explicit Places(std::span<const FanPlace> places) {
    clear(places.size());
    for (const FanPlace& place : places) push_back(place);
    complete(0);
  }

  /// Forgets all places, and has room for so many. Memory is reused.
  void clear(std::size_t room);
  /// Requires room. Nothing is asked until all are complete.
  void push_back(const FanPlace& place) {
    u_m_[size_] = place.u_m, v_m_[size_] = place.v_m, z_m_[size_] = place.z_m;
    ++size_;
  }
  /// Ends the list, which is not empty, and raises all places.
  void complete(double raise_m);

  std::size_t size() const { return size_; }
  FanPlace operator[](std::size_t i) const { return {u_m_[i], v_m_[i], z_m_[i]}; }
  double high_u_m() const { return high_u_m_; }

  /// Of a plane through an edge: see EdgePlane::hold, for all places.
  struct EdgeLine {
    double u_m, v_m, z_m;  // of its beginning
    double eu, ev, along;  // its direction and slope
    double error_m, height_error_m, least_behind_m;
  };
  /// Of lines from all places over the nearer and the farther end of a part of an edge: see
  /// CurtainPlane.
  struct CurtainLine {
    double near_u_m, near_z_m, far_u_m, far_z_m;
    double error_m, height_error_m, least_way_m;
  };
  struct Rises {
    double edge;     ///< least rise; -infinity where a place is too near or beyond
    double curtain;  ///< least slope; -infinity where a place is not least_way_m before both ends
  };
  Rises least_rises(const EdgeLine& edge, const CurtainLine& curtain) const;
  double least_rise(const EdgeLine& edge) const;

  /// A line height = base_m + slope * u.
  struct Line {
    double slope, base_m;
  };
  /// The lowest line of a slope that has all places on or under it.
  Line tangent(double slope) const;
  /// The same for the least slope of lines from the places to one beyond; nearer ones count as if
  /// least_way_m away.
  Line line_to(double u_m, double z_m, double least_way_m) const;

 private:
  std::size_t size_ = 0, filled_ = 0;  // the latter a multiple of kPlacesAtOnce
  double high_u_m_ = 0;
  std::vector<double> u_m_, v_m_, z_m_;
};

}  // namespace scarp
