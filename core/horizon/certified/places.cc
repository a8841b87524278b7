#include "core/horizon/certified/places.h"

#include <cmath>

#include "core/threads/for_each_target.h"

namespace scarp {
namespace {

/// One of each kind for every place of kPlacesAtOnce.
using Lanes = double[kPlacesAtOnce];

inline void fill(Lanes& lanes, double value) {
  for (double& lane : lanes) lane = value;
}

inline double least_of(Lanes& lanes) {
  for (std::size_t half = kPlacesAtOnce / 2; half > 0; half /= 2)
    for (std::size_t j = 0; j < half; ++j)
      lanes[j] = lanes[j + half] < lanes[j] ? lanes[j + half] : lanes[j];
  return lanes[0];
}

inline double greatest_of(Lanes& lanes) {
  for (std::size_t half = kPlacesAtOnce / 2; half > 0; half /= 2)
    for (std::size_t j = 0; j < half; ++j)
      lanes[j] = lanes[j + half] > lanes[j] ? lanes[j + half] : lanes[j];
  return lanes[0];
}

/// The rise of the plane through an edge over a place.
inline double rise_over(const Places::EdgeLine& e, double u_m, double v_m, double z_m) {
  const double du_m = u_m - e.u_m, dv_m = v_m - e.v_m;
  const double behind_m = e.eu * dv_m - e.ev * du_m;
  const double above_m = z_m - e.z_m - e.along * (e.eu * du_m + e.ev * dv_m) + e.height_error_m;
  // The plane falls outwards where the place is above the edge.
  const double rise = -above_m / (behind_m + (above_m > 0 ? -e.error_m : e.error_m));
  return behind_m > e.least_behind_m ? rise : -HUGE_VAL;
}

/// The slope of the line from a place over one that is ahead.
inline double slope_over(const Places::CurtainLine& c, double over_u_m, double over_z_m, double u_m,
                         double z_m) {
  const double way_m = over_u_m - u_m;
  const double above_m = over_z_m - z_m - c.height_error_m;
  const double slope = above_m / (way_m + (above_m > 0 ? c.error_m : -c.error_m));
  return way_m > c.least_way_m ? slope : -HUGE_VAL;
}

SCARP_FOR_EACH_TARGET
double least_rise_of(const double* u_m, const double* v_m, const double* z_m, std::size_t count,
                     const Places::EdgeLine& edge) {
  const Places::EdgeLine e = edge;
  Lanes least;
  fill(least, HUGE_VAL);
  for (std::size_t i = 0; i < count; i += kPlacesAtOnce)
    for (std::size_t j = 0; j < kPlacesAtOnce; ++j) {
      const double rise = rise_over(e, u_m[i + j], v_m[i + j], z_m[i + j]);
      least[j] = rise < least[j] ? rise : least[j];
    }
  return least_of(least);
}

SCARP_FOR_EACH_TARGET
Places::Rises least_rises_of(const double* u_m, const double* v_m, const double* z_m,
                             std::size_t count, const Places::EdgeLine& edge,
                             const Places::CurtainLine& curtain) {
  const Places::EdgeLine e = edge;
  const Places::CurtainLine c = curtain;
  Lanes least, least_slope;
  fill(least, HUGE_VAL);
  fill(least_slope, HUGE_VAL);
  for (std::size_t i = 0; i < count; i += kPlacesAtOnce)
    for (std::size_t j = 0; j < kPlacesAtOnce; ++j) {
      const double u = u_m[i + j], v = v_m[i + j], z = z_m[i + j];
      const double rise = rise_over(e, u, v, z);
      least[j] = rise < least[j] ? rise : least[j];
      const double near_slope = slope_over(c, c.near_u_m, c.near_z_m, u, z);
      const double far_slope = slope_over(c, c.far_u_m, c.far_z_m, u, z);
      const double slope = near_slope < far_slope ? near_slope : far_slope;
      least_slope[j] = slope < least_slope[j] ? slope : least_slope[j];
    }
  return {least_of(least), least_of(least_slope)};
}

SCARP_FOR_EACH_TARGET
double tangent_of(const double* u_m, const double* z_m, std::size_t count, double slope) {
  Lanes most;
  fill(most, -HUGE_VAL);
  for (std::size_t i = 0; i < count; i += kPlacesAtOnce)
    for (std::size_t j = 0; j < kPlacesAtOnce; ++j) {
      const double base_m = z_m[i + j] - slope * u_m[i + j];
      most[j] = base_m > most[j] ? base_m : most[j];
    }
  return greatest_of(most);
}

SCARP_FOR_EACH_TARGET
double slope_to_place(const double* u_m, const double* z_m, std::size_t count, double over_u_m,
                      double over_z_m, double least_way_m) {
  Lanes least;
  fill(least, HUGE_VAL);
  for (std::size_t i = 0; i < count; i += kPlacesAtOnce)
    for (std::size_t j = 0; j < kPlacesAtOnce; ++j) {
      const double way_m = over_u_m - u_m[i + j];
      const double slope = (over_z_m - z_m[i + j]) / (way_m > least_way_m ? way_m : least_way_m);
      least[j] = slope < least[j] ? slope : least[j];
    }
  return least_of(least);
}

}  // namespace

void Places::clear(std::size_t room) {
  const std::size_t filled = (room + kPlacesAtOnce - 1) / kPlacesAtOnce * kPlacesAtOnce;
  if (u_m_.size() < filled) u_m_.resize(filled), v_m_.resize(filled), z_m_.resize(filled);
  size_ = filled_ = 0;
}

void Places::complete(double raise_m) {
  filled_ = (size_ + kPlacesAtOnce - 1) / kPlacesAtOnce * kPlacesAtOnce;
  for (std::size_t i = size_; i < filled_; ++i)
    u_m_[i] = u_m_[size_ - 1], v_m_[i] = v_m_[size_ - 1], z_m_[i] = z_m_[size_ - 1];
  high_u_m_ = -HUGE_VAL;
  for (std::size_t i = 0; i < filled_; ++i) {
    z_m_[i] += raise_m;
    high_u_m_ = high_u_m_ < u_m_[i] ? u_m_[i] : high_u_m_;
  }
}

Places::Rises Places::least_rises(const EdgeLine& edge, const CurtainLine& curtain) const {
  return least_rises_of(u_m_.data(), v_m_.data(), z_m_.data(), filled_, edge, curtain);
}

double Places::least_rise(const EdgeLine& edge) const {
  return least_rise_of(u_m_.data(), v_m_.data(), z_m_.data(), filled_, edge);
}

Places::Line Places::tangent(double slope) const {
  return {slope, tangent_of(u_m_.data(), z_m_.data(), filled_, slope)};
}

Places::Line Places::line_to(double u_m, double z_m, double least_way_m) const {
  return tangent(slope_to_place(u_m_.data(), z_m_.data(), filled_, u_m, z_m, least_way_m));
}

}  // namespace scarp
