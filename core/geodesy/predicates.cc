#include "core/geodesy/predicates.h"

#include <atomic>
#include <cmath>

namespace scarp {
namespace {

using Wide = __int128;

std::atomic<unsigned long> exact_count{0};

int sign(double value) {
  return (value > 0) - (value < 0);
}
int sign(Wide value) {
  return (value > 0) - (value < 0);
}

/// Difference of two lattice coordinates in steps: at most 2^40, exact.
Wide steps(double to_m, double from_m) {
  return Wide{lattice_steps(to_m) - lattice_steps(from_m)};
}

}  // namespace

unsigned long exact_predicate_count() {
  return exact_count.load(std::memory_order_relaxed);
}

int orient2d(const Position& a, const Position& b, const Position& c) {
  // Differences are exact (40 bits). Each product and the subtraction round once, so the error
  // is below (2u + u^2) (|left| + |right|) with u = 2^-53; 4u leaves room for the bound itself.
  const double left = (b.x_m - a.x_m) * (c.y_m - a.y_m);
  const double right = (b.y_m - a.y_m) * (c.x_m - a.x_m);
  const double det = left - right;
  if (std::abs(det) > 0x1p-51 * (std::abs(left) + std::abs(right))) return sign(det);
  exact_count.fetch_add(1, std::memory_order_relaxed);
  return sign(steps(b.x_m, a.x_m) * steps(c.y_m, a.y_m) -
              steps(b.y_m, a.y_m) * steps(c.x_m, a.x_m));
}

int orient3d(const Position& a, const Position& b, const Position& c, const Position& d) {
  const double bx = b.x_m - a.x_m, by = b.y_m - a.y_m, bz = b.z_m - a.z_m;
  const double cx = c.x_m - a.x_m, cy = c.y_m - a.y_m, cz = c.z_m - a.z_m;
  const double dx = d.x_m - a.x_m, dy = d.y_m - a.y_m, dz = d.z_m - a.z_m;
  // Differences are exact. A minor rounds three times, its product with dz once more and the two
  // additions twice: below 7u times the sum of absolute products. 16u is used.
  const double xy = bx * cy - by * cx, yz = by * cz - bz * cy, zx = bz * cx - bx * cz;
  const double det = yz * dx + zx * dy + xy * dz;
  const double bound = (std::abs(by * cz) + std::abs(bz * cy)) * std::abs(dx) +
                       (std::abs(bz * cx) + std::abs(bx * cz)) * std::abs(dy) +
                       (std::abs(bx * cy) + std::abs(by * cx)) * std::abs(dz);
  if (std::abs(det) > 0x1p-49 * bound) return sign(det);
  exact_count.fetch_add(1, std::memory_order_relaxed);
  // |differences| <= 2^40, so |determinant| <= (sqrt(3) 2^40)^3 < 2^123, and every partial sum
  // is below 6 * 2^120 < 2^123.
  const Wide ibx = steps(b.x_m, a.x_m), iby = steps(b.y_m, a.y_m), ibz = steps(b.z_m, a.z_m);
  const Wide icx = steps(c.x_m, a.x_m), icy = steps(c.y_m, a.y_m), icz = steps(c.z_m, a.z_m);
  const Wide idx = steps(d.x_m, a.x_m), idy = steps(d.y_m, a.y_m), idz = steps(d.z_m, a.z_m);
  return sign((iby * icz - ibz * icy) * idx + (ibz * icx - ibx * icz) * idy +
              (ibx * icy - iby * icx) * idz);
}

int above_line(const Position& a, const Position& b, const Position& p) {
  // The steeper of the two plane axes gives the position along the line: the ratio is the same.
  const bool along_x = std::abs(b.x_m - a.x_m) >= std::abs(b.y_m - a.y_m);
  const Wide run = along_x ? steps(b.x_m, a.x_m) : steps(b.y_m, a.y_m);
  const Wide at = along_x ? steps(p.x_m, a.x_m) : steps(p.y_m, a.y_m);
  const Wide difference = steps(p.z_m, a.z_m) * run - steps(b.z_m, a.z_m) * at;
  return run > 0 ? sign(difference) : -sign(difference);
}

}  // namespace scarp
