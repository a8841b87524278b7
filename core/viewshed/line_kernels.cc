#include "core/viewshed/line_kernels.h"

#include <algorithm>
#include <cmath>

#include "core/threads/for_each_target.h"

namespace scarp {
namespace {

/// By value, unlike std::max: the compiler makes vectors of these.
inline float greater(float a, float b) {
  return a < b ? b : a;
}
inline float lesser(float a, float b) {
  return b < a ? b : a;
}

/// BlockPlacement::Along::at, written out so that loops over it become vectors.
struct Quadratic {
  double k0, k1, k2, k3, k4, k5, k6, k7, k8;

  explicit Quadratic(const BlockPlacement::Biquadratic& k)
      : k0(k[0]), k1(k[1]), k2(k[2]), k3(k[3]), k4(k[4]), k5(k[5]), k6(k[6]), k7(k[7]), k8(k[8]) {}

  double at(double u, double v) const {
    const double constant = k0 + v * (k1 + v * k2);
    const double linear = k3 + v * (k4 + v * k5);
    const double square = k6 + v * (k7 + v * k8);
    return constant + u * (linear + u * square);
  }
};

}  // namespace

SCARP_FOR_EACH_TARGET
bool load_heights(const std::int32_t* steps, std::size_t stride, std::size_t count,
                  double* __restrict z_m, std::uint8_t* __restrict is_void) {
  std::int32_t any = 0;
  if (stride == 1) {
    for (std::size_t i = 0; i < count; ++i) {
      const std::int32_t step = steps[i];
      any |= step == GroundGrid::kVoid ? 1 : 0;
      z_m[i] = (step == GroundGrid::kVoid ? 0 : step) * kLatticeStepM;
    }
    for (std::size_t i = 0; i < count; ++i) is_void[i] = steps[i] == GroundGrid::kVoid ? 1 : 0;
    return any != 0;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t step = steps[i * stride];
    const std::uint8_t missing = step == GroundGrid::kVoid;
    any |= missing;
    is_void[i] = missing;
    z_m[i] = (missing != 0 ? 0 : step) * kLatticeStepM;
  }
  return any != 0;
}

SCARP_FOR_EACH_TARGET
void place_run(const BlockPlacement::Block& block, double u, double du, double v, double dv,
               std::size_t count, const double* __restrict z_m, const PlanFrame& frame,
               double* __restrict across, double* __restrict down) {
  const Quadratic x(block[BlockPlacement::kX]), tilt_x(block[BlockPlacement::kTiltX]),
      y(block[BlockPlacement::kY]), tilt_y(block[BlockPlacement::kTiltY]);
  const PlanFrame f = frame;
  for (std::size_t i = 0; i < count; ++i) {
    const double at = static_cast<double>(static_cast<std::int32_t>(i));
    const double ui = u + at * du, vi = v + at * dv;
    const double x_m = round_to_lattice(x.at(ui, vi) + tilt_x.at(ui, vi) * z_m[i]);
    const double y_m = round_to_lattice(y.at(ui, vi) + tilt_y.at(ui, vi) * z_m[i]);
    across[i] = (x_m - f.eye_x_m) * f.across_x + (y_m - f.eye_y_m) * f.across_y;
    down[i] = (x_m - f.eye_x_m) * f.down_x + (y_m - f.eye_y_m) * f.down_y;
  }
}

SCARP_FOR_EACH_TARGET
void raise_run(const BlockPlacement::Block& block, double u, double du, double v, double dv,
               std::size_t count, const double* __restrict z_m, double height_m,
               double* __restrict raised_m) {
  const Quadratic height(block[BlockPlacement::kHeight]), lift(block[BlockPlacement::kLift]),
      fall(block[BlockPlacement::kFall]);
  for (std::size_t i = 0; i < count; ++i) {
    const double at = static_cast<double>(static_cast<std::int32_t>(i));
    const double ui = u + at * du, vi = v + at * dv;
    const double base = height.at(ui, vi), rate = lift.at(ui, vi), bend = fall.at(ui, vi);
    const double rise = z_m[i] - base;
    const double h = rise / (rate - rise * bend) + height_m;
    raised_m[i] = round_to_lattice(base + h * rate / (1 + h * bend));
  }
}

SCARP_FOR_EACH_TARGET
bool take_picture(std::size_t count, const double* __restrict forwards,
                  const double* __restrict sideways, const double* __restrict z_m,
                  const std::uint8_t* __restrict is_void, double eye_z_m, double low_tangent,
                  double bins_per_tangent, double least_forwards, float* __restrict t,
                  float* __restrict s) {
  std::int32_t near = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double inverse = 1 / forwards[i];
    near |= forwards[i] < least_forwards ? 1 : 0;
    t[i] = static_cast<float>((sideways[i] * inverse - low_tangent) * bins_per_tangent);
    s[i] = static_cast<float>((z_m[i] - eye_z_m) * inverse);
  }
  if (is_void != nullptr)
    for (std::size_t i = 0; i < count; ++i) s[i] = is_void[i] != 0 ? kNoGround : s[i];
  return near == 0;
}

SCARP_FOR_EACH_TARGET
void take_level_picture(std::size_t count, double forwards, const double* __restrict sideways,
                        const double* __restrict z_m, const std::uint8_t* __restrict is_void,
                        double eye_z_m, double low_tangent, double bins_per_tangent,
                        float* __restrict t, float* __restrict s) {
  const double inverse = 1 / forwards;
  for (std::size_t i = 0; i < count; ++i) {
    t[i] = static_cast<float>((sideways[i] * inverse - low_tangent) * bins_per_tangent);
    s[i] = static_cast<float>((z_m[i] - eye_z_m) * inverse);
  }
  if (is_void != nullptr)
    for (std::size_t i = 0; i < count; ++i) s[i] = is_void[i] != 0 ? kNoGround : s[i];
}

SCARP_FOR_EACH_TARGET
bool take_rises(std::size_t count, const float* __restrict t, const float* __restrict s,
                const std::uint8_t* __restrict is_void, float least_spacing, float* __restrict rise,
                float* __restrict steep) {
  if (count == 0) return true;
  const std::size_t segments = count - 1;
  steep[segments] = rise[segments] = 0;
  std::int32_t close = 0;
  for (std::size_t i = 0; i < segments; ++i) {
    rise[i] = std::abs(s[i + 1] - s[i]);
    close |= t[i + 1] - t[i] < least_spacing ? 1 : 0;
  }
  if (is_void != nullptr)
    for (std::size_t i = 0; i < segments; ++i)
      if ((is_void[i] | is_void[i + 1]) != 0) rise[i] = 0;
  for (std::size_t i = 1; i < segments; ++i)
    steep[i] = greater(rise[i - 1], greater(rise[i], rise[i + 1]));
  if (segments > 0) steep[0] = greater(rise[0], rise[1]);
  return close == 0;
}

SCARP_FOR_EACH_TARGET
bool near_even_places(std::int32_t first_edge, std::size_t edges, std::size_t count,
                      const float* __restrict t, float* __restrict place) {
  const float spacing =
      (t[count - 1] - t[0]) / static_cast<float>(static_cast<std::int32_t>(count) - 1);
  const float per_edge = 1 / spacing, begin = -t[0] / spacing;
  const auto last = static_cast<std::int32_t>(count) - 2;
  std::int32_t misses = 0;
  for (std::size_t e = 0; e < edges; ++e) {
    const auto edge = static_cast<float>(first_edge + static_cast<std::int32_t>(e));
    std::int32_t guess = static_cast<std::int32_t>(edge * per_edge + begin);
    guess = guess < 1 ? 1 : guess;
    guess = guess > last - 1 ? last - 1 : guess;
    guess += (t[guess + 1] <= edge ? 1 : 0) - (t[guess] > edge ? 1 : 0);
    const float from = t[guess], to = t[guess + 1];
    misses |= (from > edge ? 1 : 0) | (to <= edge ? 1 : 0);
    place[e] = static_cast<float>(guess) + (edge - from) / (to - from);
  }
  return misses == 0;
}

SCARP_FOR_EACH_TARGET
void even_places(std::size_t count, float per_edge, float begin, float* __restrict place) {
  for (std::size_t e = 0; e < count; ++e)
    place[e] = static_cast<float>(static_cast<std::int32_t>(e)) * per_edge + begin;
}

SCARP_FOR_EACH_TARGET
void shift_places(std::size_t count, const float* __restrict place, float by,
                  float* __restrict shifted) {
  for (std::size_t e = 0; e < count; ++e) shifted[e] = place[e] + by;
}

SCARP_FOR_EACH_TARGET
void edge_bounds(std::size_t edges, const float* __restrict place, const float* __restrict s,
                 const float* __restrict steep, float per_rise, float slope_margin,
                 std::int32_t* __restrict before, float* __restrict this_s,
                 float* __restrict next_s, float* __restrict low, float* __restrict high) {
  for (std::size_t e = 0; e < edges; ++e) {
    const auto j = static_cast<std::int32_t>(place[e]);
    const float f = place[e] - static_cast<float>(j);
    const float from = s[j], to = s[j + 1];
    const float at = from + f * (to - from);
    const float margin = per_rise * steep[j] + slope_margin * std::abs(at);
    before[e] = j;
    this_s[e] = from;
    next_s[e] = to;
    low[e] = at - margin;
    high[e] = at + margin;
  }
}

SCARP_FOR_EACH_TARGET
bool bin_bounds(std::size_t bins, const float* __restrict place,
                const float* __restrict place_before, float slack, const float* __restrict higher,
                const float* __restrict higher_of_two, const std::int32_t* __restrict before,
                const float* __restrict this_s, const float* __restrict next_s,
                const float* __restrict edge_low, const float* __restrict edge_high,
                float* __restrict up, float* __restrict low, float* __restrict high) {
  std::int32_t many = 0;
  for (std::size_t b = 0; b < bins; ++b) {
    // Segments that touch the bin: from the first sample that is past its lower edge on either
    // line to the last that is not past its upper edge.
    const float begin = lesser(place[b], place_before[b]) - slack;
    const float end = greater(place[b + 1], place_before[b + 1]) + slack;
    const std::int32_t first = static_cast<std::int32_t>(begin) + 1;
    const auto last = static_cast<std::int32_t>(end);
    many |= last - first > 2 ? 1 : 0;
    const float ends = greater(edge_high[b], edge_high[b + 1]);
    const float pair = greater(higher_of_two[first], higher[last]);
    const float between = last > first ? pair : higher[last];
    const float upper = last >= first ? greater(ends, between) : ends;
    // Where a sample lies in the bin, the line may dip to it.
    const float edge = lesser(edge_low[b], edge_low[b + 1]);
    const float dip = lesser(edge, lesser(next_s[b], this_s[b + 1]));
    const float lower = before[b + 1] > before[b] ? dip : edge;
    up[b] = upper;
    low[b] = greater(low[b], lower);
    high[b] = greater(high[b], upper);
  }
  return many == 0;
}

SCARP_FOR_EACH_TARGET
void take_pairs(std::size_t count, const float* __restrict values, float* __restrict pairs) {
  for (std::size_t i = 0; i + 1 < count; ++i) pairs[i] = greater(values[i], values[i + 1]);
  if (count > 0) pairs[count - 1] = values[count - 1];
}

SCARP_FOR_EACH_TARGET
void take_maximum(std::size_t count, const float* __restrict values, float* __restrict into) {
  for (std::size_t i = 0; i < count; ++i) into[i] = greater(into[i], values[i]);
}

SCARP_FOR_EACH_TARGET
void take_top(std::size_t bins, const float* __restrict up, const float* __restrict high,
              std::int32_t line, std::int32_t* __restrict top) {
  for (std::size_t b = 0; b < bins; ++b) top[b] = up[b] >= high[b] ? line : top[b];
}

SCARP_FOR_EACH_TARGET
void classify(std::size_t count, const float* __restrict t, const float* __restrict s,
              std::int32_t bins, const float* __restrict low, const float* __restrict high,
              float slope_margin, Decision* __restrict decision) {
  auto* to = reinterpret_cast<std::uint8_t*>(decision);
  for (std::size_t i = 0; i < count; ++i) {
    // Beyond the part's ends by rounding only; what is farther is nobody's target here.
    const float within = lesser(greater(t[i], 0.0F), static_cast<float>(bins));
    const std::int32_t floor = static_cast<std::int32_t>(within);
    const std::int32_t bin = floor < bins ? floor : bins - 1;
    const float margin = slope_margin * std::abs(s[i]);
    const std::int32_t seen = s[i] >= high[bin] + margin ? 1 : 2;
    to[i] = static_cast<std::uint8_t>(s[i] < low[bin] - margin ? 0 : seen);
  }
}

}  // namespace scarp
