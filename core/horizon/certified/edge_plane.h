#pragma once

#include <algorithm>
#include <cmath>

#include "core/horizon/certified/fan.h"
#include "core/horizon/certified/places.h"

namespace scarp {

/// Places nearer to the line of an edge than this many rounding errors have no slope worth
/// computing from it.
inline constexpr double kTooNear = 0x1p10;

/// A plane in a fan's frame: height_m at place (u_m, v_m), rising by `ahead` for each metre of u
/// and by `left` for each of v. What its numbers lack in accuracy is in error_m, and for each metre
/// from the place in slope_error.
struct SkyPlane {
  double u_m, v_m, height_m;
  double ahead, left;
  double error_m, slope_error;
  /// The same in another form: a camera beyond the edge and strictly under line_m + line_slope * u
  /// is hidden, too, on any ray of the fan that crosses the edge within a beam.
  double line_m, line_slope;
  /// Rays over a piece that meet the edge within the beam lead this way: v for each metre of u.
  double low_turn = -HUGE_VAL, high_turn = HUGE_VAL;
  double beyond_m = -HUGE_VAL;  ///< the greatest u of the part that they meet
};

/// The lowest plane through an edge that has none of some places above it, on the side behind the
/// edge, where those are. A camera on the other side, strictly under the plane, whose sight line to
/// such a place passes the edge, does not see the place: the line passes strictly under the edge.
///
/// Side: never above the true plane. Accuracy: the rounding of the fan's frame, over the distance
/// of a place from the edge.
class EdgePlane {
 public:
  /// The edge's right side is the outer one, so that v rises from a to b.
  EdgePlane(const FanView& view, const FanPlace& a, const FanPlace& b) : view_(view), a_(a) {
    const double du_m = b.u_m - a.u_m, dv_m = b.v_m - a.v_m;
    const double length_m = std::sqrt(du_m * du_m + dv_m * dv_m);
    eu_ = du_m / length_m, ev_ = dv_m / length_m;
    along_ = (b.z_m - a.z_m) / length_m;
    error_m_ = 8 * view.error_m;
    height_error_m_ = 4 * view.height_error_m + 2 * std::abs(along_) * error_m_;
    if (!(length_m > kTooNear * error_m_)) give_up();
  }

  double behind_m(const FanPlace& place) const {
    return eu_ * (place.v_m - a_.v_m) - ev_ * (place.u_m - a_.u_m);
  }
  bool is_too_near(const FanPlace& place) const { return !(behind_m(place) > kTooNear * error_m_); }

  /// Has a place on or under the plane. One that is too near, or beyond, cannot be.
  void hold(const FanPlace& place) {
    const double behind = behind_m(place);
    if (!(behind > kTooNear * error_m_)) return give_up();
    const double above_m = place.z_m - a_.z_m -
                           along_ * (eu_ * (place.u_m - a_.u_m) + ev_ * (place.v_m - a_.v_m)) +
                           height_error_m_;
    // The plane falls outwards where the place is above the edge.
    const double rise = -above_m / (behind + (above_m > 0 ? -error_m_ : error_m_));
    rise_ = rise < rise_ ? rise : rise_;
  }

  /// Has all of some places on or under the plane.
  void hold(const Places& places) { hold_rise(places.least_rise(line())); }

  /// What Places want to know, and what they answer.
  Places::EdgeLine line() const {
    return {
        a_.u_m, a_.v_m, a_.z_m, eu_, ev_, along_, error_m_, height_error_m_, kTooNear * error_m_};
  }
  void hold_rise(double rise) { rise_ = rise < rise_ ? rise : rise_; }

  /// The plane has to pass under everything: it is of no use.
  void give_up() { rise_ = -HUGE_VAL; }
  /// Whether it has held a place, and none that it could not.
  bool is_held() const { return rise_ > -HUGE_VAL && rise_ < HUGE_VAL; }

  /// @param from, to  the part of the edge that a beam crosses
  /// Requires is_held().
  SkyPlane plane(const FanPlace& from, const FanPlace& to) const {
    const double steepness = std::abs(along_) + std::abs(rise_);
    SkyPlane plane{a_.u_m,
                   a_.v_m,
                   a_.z_m,
                   along_ * eu_ + rise_ * ev_,
                   along_ * ev_ - rise_ * eu_,
                   height_error_m_ + steepness * error_m_,
                   steepness * 0x1p-44,
                   0,
                   0};
    plane.line_slope = plane.ahead - std::abs(plane.left) * view_.fan.tan_half - plane.slope_error;
    plane.line_m =
        std::min(from.z_m - plane.line_slope * from.u_m, to.z_m - plane.line_slope * to.u_m) -
        2 * plane.error_m;
    return plane;
  }

 private:
  const FanView& view_;
  const FanPlace a_;
  double eu_, ev_, along_, error_m_, height_error_m_;
  double rise_ = HUGE_VAL;  // outwards, square to the edge
};

/// The plane level across the fan that stands on a part of an edge and has all of some places under
/// it, whichever way rays of the fan cross the edge. A camera with u beyond the edge's, strictly
/// under the plane, whose sight line to such a place passes the part, does not see the place.
///
/// Along a ray height is linear in u, so the line from a place p over a place x of the edge rises
/// by (z_x - z_p) / (u_x - u_p). That is monotone along the edge and between places: the least is
/// at corners. Side: never above the true plane. Accuracy: the rounding of the fan's frame, over
/// the way from a place to the edge.
class CurtainPlane {
 public:
  CurtainPlane(const FanView& view, const FanPlace& from, const FanPlace& to)
      : view_(view), near_(from.u_m < to.u_m ? from : to), far_(from.u_m < to.u_m ? to : from) {}

  /// What Places want to know, and what they answer. Places that are too near, or beyond, cannot
  /// be on or under the plane.
  Places::CurtainLine line() const {
    return {near_.u_m,
            near_.z_m,
            far_.u_m,
            far_.z_m,
            8 * view_.error_m,
            4 * view_.height_error_m,
            kTooNear * 8 * view_.error_m};
  }
  void hold_slope(double slope) { slope_ = slope < slope_ ? slope : slope_; }

  bool is_held() const { return slope_ > -HUGE_VAL && slope_ < HUGE_VAL; }

  /// Requires is_held().
  SkyPlane plane() const {
    const double steepness = std::abs(slope_);
    const double height_m = std::min(far_.z_m, near_.z_m + slope_ * (far_.u_m - near_.u_m));
    SkyPlane plane{far_.u_m,
                   far_.v_m,
                   height_m,
                   slope_,
                   0,
                   4 * view_.height_error_m + steepness * 16 * view_.error_m,
                   steepness * 0x1p-44,
                   0,
                   0};
    plane.line_slope = slope_ - plane.slope_error;
    plane.line_m = height_m - plane.line_slope * far_.u_m - 2 * plane.error_m;
    return plane;
  }

 private:
  const FanView& view_;
  const FanPlace near_, far_;
  double slope_ = HUGE_VAL;
};

}  // namespace scarp
