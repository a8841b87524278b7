#include "core/horizon/certified/places.h"

#include <cmath>

#include "core/threads/for_each_target.h"

namespace scarp {
namespace {

SCARP_FOR_EACH_TARGET
double least_rise_of(const double* u_m, const double* v_m, const double* z_m, std::size_t count,
                     const Places::EdgeLine& edge) {
  const Places::EdgeLine e = edge;
  double least[kPlacesAtOnce];
  for (double& lane : least) lane = HUGE_VAL;
  for (std::size_t i = 0; i < count; i += kPlacesAtOnce)
    for (std::size_t j = 0; j < kPlacesAtOnce; ++j) {
      const double du_m = u_m[i + j] - e.u_m, dv_m = v_m[i + j] - e.v_m;
      const double behind_m = e.eu * dv_m - e.ev * du_m;
      const double above_m =
          z_m[i + j] - e.z_m - e.along * (e.eu * du_m + e.ev * dv_m) + e.height_error_m;
      // The plane falls outwards where the place is above the edge.
      const double rise = -above_m / (behind_m + (above_m > 0 ? -e.error_m : e.error_m));
      const double sure = behind_m > e.least_behind_m ? rise : -HUGE_VAL;
      least[j] = sure < least[j] ? sure : least[j];
    }
  double least_of_all = HUGE_VAL;
  for (const double lane : least) least_of_all = lane < least_of_all ? lane : least_of_all;
  return least_of_all;
}

SCARP_FOR_EACH_TARGET
double least_slope_of(const double* u_m, const double* z_m, std::size_t count, double over_u_m,
                      double over_z_m, double error_m, double height_error_m, double least_way_m) {
  double least[kPlacesAtOnce];
  for (double& lane : least) lane = HUGE_VAL;
  for (std::size_t i = 0; i < count; i += kPlacesAtOnce)
    for (std::size_t j = 0; j < kPlacesAtOnce; ++j) {
      const double way_m = over_u_m - u_m[i + j];
      const double above_m = over_z_m - z_m[i + j] - height_error_m;
      const double slope = above_m / (way_m + (above_m > 0 ? error_m : -error_m));
      const double sure = way_m > least_way_m ? slope : -HUGE_VAL;
      least[j] = sure < least[j] ? sure : least[j];
    }
  double least_of_all = HUGE_VAL;
  for (const double lane : least) least_of_all = lane < least_of_all ? lane : least_of_all;
  return least_of_all;
}

SCARP_FOR_EACH_TARGET
double tangent_of(const double* u_m, const double* z_m, std::size_t count, double slope) {
  double most[kPlacesAtOnce];
  for (double& lane : most) lane = -HUGE_VAL;
  for (std::size_t i = 0; i < count; i += kPlacesAtOnce)
    for (std::size_t j = 0; j < kPlacesAtOnce; ++j) {
      const double base_m = z_m[i + j] - slope * u_m[i + j];
      most[j] = base_m > most[j] ? base_m : most[j];
    }
  double most_of_all = -HUGE_VAL;
  for (const double lane : most) most_of_all = lane > most_of_all ? lane : most_of_all;
  return most_of_all;
}

SCARP_FOR_EACH_TARGET
double slope_to_place(const double* u_m, const double* z_m, std::size_t count, double over_u_m,
                      double over_z_m, double least_way_m) {
  double least[kPlacesAtOnce];
  for (double& lane : least) lane = HUGE_VAL;
  for (std::size_t i = 0; i < count; i += kPlacesAtOnce)
    for (std::size_t j = 0; j < kPlacesAtOnce; ++j) {
      const double way_m = over_u_m - u_m[i + j];
      const double slope = (over_z_m - z_m[i + j]) / (way_m > least_way_m ? way_m : least_way_m);
      least[j] = slope < least[j] ? slope : least[j];
    }
  double least_of_all = HUGE_VAL;
  for (const double lane : least) least_of_all = lane < least_of_all ? lane : least_of_all;
  return least_of_all;
}

}  // namespace

void Places::assign(std::span<const FanPlace> places) {
  size_ = (places.size() + kPlacesAtOnce - 1) / kPlacesAtOnce * kPlacesAtOnce;
  if (u_m_.size() < size_) u_m_.resize(size_), v_m_.resize(size_), z_m_.resize(size_);
  for (std::size_t i = 0; i < size_; ++i) {
    const FanPlace& place = places[i < places.size() ? i : places.size() - 1];
    u_m_[i] = place.u_m, v_m_[i] = place.v_m, z_m_[i] = place.z_m;
  }
}

double Places::least_rise(const EdgeLine& edge) const {
  return least_rise_of(u_m_.data(), v_m_.data(), z_m_.data(), size_, edge);
}

double Places::least_slope(const FanPlace& over, double error_m, double height_error_m,
                           double least_way_m) const {
  return least_slope_of(u_m_.data(), z_m_.data(), size_, over.u_m, over.z_m, error_m,
                        height_error_m, least_way_m);
}

double Places::tangent_m(double slope) const {
  return tangent_of(u_m_.data(), z_m_.data(), size_, slope);
}

double Places::slope_to(double u_m, double z_m, double least_way_m) const {
  return slope_to_place(u_m_.data(), z_m_.data(), size_, u_m, z_m, least_way_m);
}

}  // namespace scarp
