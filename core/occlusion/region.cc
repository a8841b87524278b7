#include "core/occlusion/region.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace scarp {
namespace {

/// Relative bound on the rounding of the short expressions below: each is at most six operations
/// of 2^-53 on terms of the magnitude that it is multiplied with.
constexpr double kRounding = 0x1p-50;

/// Height at u_m of the line through p with a slope that is right to three roundings, rounded down.
double line_height_m(const RegionPoint& p, double slope, double u_m) {
  if (u_m == p.u_m) return p.z_m;
  const double rise_m = slope * (u_m - p.u_m);
  return p.z_m + rise_m - kRounding * (std::abs(p.z_m) + std::abs(rise_m));
}

double slope_between(const RegionPoint& a, const RegionPoint& b) {
  return (b.z_m - a.z_m) / (b.u_m - a.u_m);
}

/// Certainly left * 1 < right * 1, both products of differences.
bool certainly_less(double left, double right) {
  return left < right - kRounding * (std::abs(left) + std::abs(right));
}

/// Whether b lies strictly above the line from a to c, for certain.
bool bends_down(const RegionPoint& a, const RegionPoint& b, const RegionPoint& c) {
  return certainly_less((c.z_m - b.z_m) * (b.u_m - a.u_m), (b.z_m - a.z_m) * (c.u_m - b.u_m));
}

/// Whether the line from a to b is strictly steeper than the slope, for certain.
bool bends_down(const RegionPoint& a, const RegionPoint& b, double slope) {
  return certainly_less(slope * (b.u_m - a.u_m), b.z_m - a.z_m);
}

/// A region read from left to right, each look-up from where the last one ended.
class Reader {
 public:
  Reader(const RegionView& region, double start_m) : region_(region) { advance(start_m); }

  /// Height at u_m, which must not be left of the last call's.
  double height_m(double u_m) {
    advance(u_m);
    const RegionPoint& p = region_.points[segment_];
    if (segment_ + 1 == region_.count) return line_height_m(p, region_.end_slope, u_m);
    return line_height_m(p, slope_between(p, region_.points[segment_ + 1]), u_m);
  }

  /// The next point to the right of where the last look-up was, infinity after the last.
  double next_m() const {
    return segment_ + 1 == region_.count ? HUGE_VAL : region_.points[segment_ + 1].u_m;
  }

 private:
  void advance(double u_m) {
    while (segment_ + 1 < region_.count && region_.points[segment_ + 1].u_m <= u_m) ++segment_;
  }

  RegionView region_;
  std::uint32_t segment_ = 0;
};

/// Adds a point to the right, and drops those that it makes useless. Points all lie under one
/// concave curve, so that dropping any but the first is safe. The first is where the region starts.
void push_concave(std::vector<RegionPoint>& points, const RegionPoint& p) {
  if (p.u_m <= points.back().u_m || !std::isfinite(p.u_m) || !std::isfinite(p.z_m)) return;
  while (points.size() >= 2 && !bends_down(points[points.size() - 2], points.back(), p))
    points.pop_back();
  points.push_back(p);
}

}  // namespace

RayRegion region_of_vertex(const Position& vertex, const Position& horizon,
                           const SectorAxis& axis) {
  // Differences of lattice positions are exact. The horizon lies within 51 degrees of the axis (45,
  // and what the horizon's own rounding adds for the nearest), so that the sum cannot cancel to
  // less than 0.6 of its terms' length.
  const double run_m = axis.x * (horizon.x_m - vertex.x_m) + axis.y * (horizon.y_m - vertex.y_m);
  assert(run_m > 0);
  const double slope = (horizon.z_m - vertex.z_m) / run_m;
  const double lower_slope = slope - kRounding * std::abs(slope);
  const double start_m = distance_along(axis, horizon) + kRegionShiftM;
  // The camera may be nearer than its u says by the shift (matters on a rising ray, which is
  // moved away) or farther (matters on a falling one, which is moved near).
  if (lower_slope >= 0) return {{start_m, horizon.z_m}, lower_slope};
  const double fall_m = -2 * kRegionShiftM * lower_slope;
  const double z_m = horizon.z_m - fall_m - kRounding * (std::abs(horizon.z_m) + fall_m);
  return {{start_m, z_m}, lower_slope};
}

void merge_regions(const RegionView& a, const RegionView& b, Region& merged) {
  merged.points.clear();
  merged.end_slope = std::min(a.end_slope, b.end_slope);
  if (a.count == 0 || b.count == 0) {
    merged.end_slope = 0;
    return;
  }
  double u_m = std::max(a.points[0].u_m, b.points[0].u_m);
  Reader read_a(a, u_m), read_b(b, u_m);
  double a_m = read_a.height_m(u_m), b_m = read_b.height_m(u_m);
  merged.points.push_back({u_m, std::min(a_m, b_m)});
  for (;;) {
    const double gap_m = a_m - b_m;
    const double next_a_m = read_a.next_m(), next_b_m = read_b.next_m();
    const double next_m = std::min(next_a_m, next_b_m);
    const bool last = next_m == HUGE_VAL;
    // Where a and b cross before the next point. Its u may be inexact: both heights are taken there
    double crossing_m = HUGE_VAL;
    Reader ahead_a = read_a, ahead_b = read_b;
    if (last) {
      const double closing = b.end_slope - a.end_slope;
      if (gap_m * closing > 0) crossing_m = u_m + gap_m / closing;
    } else {
      a_m = ahead_a.height_m(next_m);
      b_m = ahead_b.height_m(next_m);
      const double next_gap_m = a_m - b_m;
      if ((gap_m < 0 && next_gap_m > 0) || (gap_m > 0 && next_gap_m < 0))
        crossing_m = u_m + (next_m - u_m) * (gap_m / (gap_m - next_gap_m));
    }
    if (crossing_m > u_m && crossing_m < next_m)
      push_concave(merged.points, {crossing_m, std::min(read_a.height_m(crossing_m),
                                                        read_b.height_m(crossing_m))});
    if (last) break;
    // A point of the higher one does not count.
    if ((next_a_m == next_m && a_m <= b_m) || (next_b_m == next_m && b_m <= a_m))
      push_concave(merged.points, {next_m, std::min(a_m, b_m)});
    read_a = ahead_a;
    read_b = ahead_b;
    u_m = next_m;
  }
  while (merged.points.size() >= 2 && !bends_down(merged.points[merged.points.size() - 2],
                                                  merged.points.back(), merged.end_slope))
    merged.points.pop_back();
}

double region_height_m(const RegionView& region, double u_m) {
  assert(region.count > 0 && u_m >= region.points[0].u_m);
  const RegionPoint* end = region.points + region.count;
  const RegionPoint* right = std::upper_bound(
      region.points, end, u_m, [](double u, const RegionPoint& p) { return u < p.u_m; });
  const RegionPoint& left = right[-1];
  return line_height_m(left, right == end ? region.end_slope : slope_between(left, *right), u_m);
}

bool hides(const RegionView& region, double u_m, double z_m) {
  return region.count > 0 && u_m >= region.points[0].u_m && z_m < region_height_m(region, u_m);
}

std::optional<std::string> check_regions(const Regions& regions, std::size_t nodes) {
  const auto sectors = static_cast<std::size_t>(regions.layout.count);
  const std::size_t rows = nodes * sectors;
  if (regions.first.size() != rows + 1 || regions.end_slope.size() != rows)
    return "a region is missing";
  if (regions.first[0] != 0 || regions.first[rows] != regions.points.size())
    return "the regions do not use all points";
  for (std::size_t row = 0; row < rows; ++row) {
    const std::string name = "the region of node " + std::to_string(row / sectors) + " in sector " +
                             std::to_string(row % sectors);
    const std::uint32_t first = regions.first[row], end = regions.first[row + 1];
    if (end < first || end > regions.points.size()) return name + " has a negative length";
    if (!std::isfinite(regions.end_slope[row])) return name + " has a slope that is no number";
    for (std::uint32_t i = first; i < end; ++i) {
      const RegionPoint& p = regions.points[i];
      if (!std::isfinite(p.u_m) || !std::isfinite(p.z_m)) return name + " is not finite";
      if (i == first) continue;
      const RegionPoint& before = regions.points[i - 1];
      if (p.u_m <= before.u_m) return name + " does not rise in u";
      const bool concave = i + 1 == end ? bends_down(before, p, regions.end_slope[row])
                                        : bends_down(before, p, regions.points[i + 1]);
      if (!concave) return name + " is not concave";
    }
  }
  return {};
}

}  // namespace scarp
