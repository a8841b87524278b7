#pragma once

#include <boost/multiprecision/cpp_int.hpp>

#include "core/occlusion/region.h"

namespace scarp {

using Rational = boost::multiprecision::cpp_rational;

inline Rational exact_along(const SectorAxis& axis, const Position& p) {
  return Rational(axis.x) * Rational(p.x_m) + Rational(axis.y) * Rational(p.y_m);
}

/// Whether the camera lies in the region of a vertex, without any rounding: at or beyond the
/// horizon's u and strictly under the ray, by `margin_m` each.
inline bool exactly_hidden(const Position& vertex, const Position& horizon, const SectorAxis& axis,
                           const Position& camera, double margin_m = 0) {
  const Rational from = exact_along(axis, vertex), over = exact_along(axis, horizon);
  const Rational at = exact_along(axis, camera);
  if (at - Rational(margin_m) < over) return false;
  const Rational rise = Rational(horizon.z_m) - Rational(vertex.z_m);
  const Rational height = Rational(horizon.z_m) + rise * (at - over) / (over - from);
  return Rational(camera.z_m) + Rational(margin_m) < height;
}

}  // namespace scarp
