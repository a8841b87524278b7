#include "core/skyline/crossing_kernels.h"

#include <cstring>

#include "core/skyline/march_ground.h"
#include "core/threads/for_each_target.h"

namespace scarp {
namespace {

constexpr float kNothing = MarchGround::kNothing;
constexpr float kGroundBound = -1e29F, kVoidBound = -1.5e30F;

/// A group of rays as one value; the compiler lowers it to what the processor has.
typedef float Lanes __attribute__((vector_size(kGroup * sizeof(float))));
typedef float LooseLanes __attribute__((vector_size(kGroup * sizeof(float)), aligned(4)));

constexpr Lanes kCount = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};

inline float greater(float a, float b) {
  return a < b ? b : a;
}
inline float magnitude(float a) {
  return a < 0 ? -a : a;
}

}  // namespace

SCARP_FOR_EACH_TARGET
void meet(const Crossing* crossings, std::size_t count, unsigned groups, RayBundle& rays) {
  for (int group = 0; group < kGroups; ++group) {
    if ((groups >> group & 1) == 0) continue;
    const std::ptrdiff_t first = group * kGroup;
    Lanes low = *reinterpret_cast<const Lanes*>(rays.low + first);
    Lanes high = *reinterpret_cast<const Lanes*>(rays.high + first);
    const Lanes eye = *reinterpret_cast<const Lanes*>(rays.eye_z + first);
    const Lanes number = kCount + static_cast<float>(first);
    for (std::size_t i = 0; i < count; ++i) {
      const Crossing& c = crossings[i];
      const Lanes a = *reinterpret_cast<const LooseLanes*>(c.a + first);
      const Lanes b = *reinterpret_cast<const LooseLanes*>(c.b + first);
      const Lanes difference = b - a;
      const Lanes share = c.share + c.share_step * number;
      const Lanes inverse = c.inverse_run + c.inverse_run_step * number;
      const Lanes slope = ((a - eye) + share * difference) * inverse;
      const Lanes error = (difference < 0 ? -difference : difference) * c.slack +
                          (slope < 0 ? -slope : slope) * c.drift;
      const Lanes least = slope - error, most = slope + error;
      low = low < least ? least : low;
      high = high < most ? most : high;
    }
    *reinterpret_cast<Lanes*>(rays.low + first) = low;
    *reinterpret_cast<Lanes*>(rays.high + first) = high;
  }
}

SCARP_FOR_EACH_TARGET
void meet_and_measure(const Crossing* crossings, std::size_t count, unsigned groups,
                      RayBundle& rays) {
  for (std::size_t i = 0; i < count; ++i) {
    const Crossing c = crossings[i];
    const float run_m = 1 / c.inverse_run;
    for (int lane = 0; lane < kBundle; ++lane) {
      const bool taken = (groups >> (lane / kGroup) & 1) != 0;
      const float a = c.a[lane], difference = c.b[lane] - a;
      const float share = c.share + c.share_step * static_cast<float>(lane);
      const float inverse = c.inverse_run + c.inverse_run_step * static_cast<float>(lane);
      const float slope = ((a - rays.eye_z[lane]) + share * difference) * inverse;
      const float error = magnitude(difference) * c.slack + magnitude(slope) * c.drift;
      const float least = taken ? slope - error : kNothing, most = taken ? slope + error : kNothing;
      rays.run[lane] = rays.high[lane] < most ? run_m : rays.run[lane];
      rays.low[lane] = greater(rays.low[lane], least);
      rays.high[lane] = greater(rays.high[lane], most);
    }
  }
}

SCARP_FOR_EACH_TARGET
void meet_high(const PossibleCrossing& crossing, int group, RayBundle& rays) {
  const PossibleCrossing c = crossing;
  const int first = group * kGroup;
  const float run_m = 2 / (c.inverse_near + c.inverse_far);
  for (int lane = first; lane < first + kGroup; ++lane) {
    const float a = c.a[lane], difference = c.b[lane] - a;
    const bool known = a > kGroundBound && c.b[lane] > kGroundBound;
    float share = c.share + c.share_step * static_cast<float>(lane);
    share = difference < 0 ? share - c.reach : share + c.reach;
    share = share < 0 ? 0 : share;
    share = share > 1 ? 1 : share;
    const float rise = (a - rays.eye_z[lane]) + share * difference;
    const float slope = rise * (rise < 0 ? c.inverse_far : c.inverse_near);
    const float most = known ? slope : kNothing;
    rays.run[lane] = rays.high[lane] < most ? run_m : rays.run[lane];
    rays.high[lane] = greater(rays.high[lane], most);
  }
}

SCARP_FOR_EACH_TARGET
void meet_loosely(const LooseCrossing& crossing, RayBundle& rays) {
  const LooseCrossing c = crossing;
  const float run_m = 1 / c.inverse_run;
  for (int i = 0; i < c.end_ray - c.first_ray; ++i) {
    const int lane = c.first_ray + i;
    const float z0 = c.z[i], z1 = c.z[i + 1], z2 = c.z[i + 2];
    const float place = c.place + static_cast<float>(i) * c.place_step;
    const bool before = place < 1;
    const bool near = magnitude(place - 1) <= c.reach;
    const float left = z1 - z0, right = z2 - z1;
    const bool has_left = z0 > kGroundBound && z1 > kGroundBound;
    const bool has_right = z1 > kGroundBound && z2 > kGroundBound;
    const float left_steep = has_left ? magnitude(left) : 0;
    const float right_steep = has_right ? magnitude(right) : 0;
    const float steep = near ? greater(left_steep, right_steep) : before ? left_steep : right_steep;
    // At the sample itself where one side is missing: the ray may pass on the other.
    const float past = (place - 1) * (before ? (has_left ? left : 0) : (has_right ? right : 0));
    const float slope = ((z1 - rays.eye_z[lane]) + past) * c.inverse_run;
    const float error = steep * c.reach * c.inverse_run;
    const bool met = near ? has_left && has_right : before ? has_left : has_right;
    const bool may = near ? z1 > kGroundBound : met;
    const float most = may ? slope + error : kNothing;
    rays.run[lane] = rays.high[lane] < most ? run_m : rays.run[lane];
    rays.low[lane] = greater(rays.low[lane], met ? slope - error : kNothing);
    rays.high[lane] = greater(rays.high[lane], most);
  }
}

SCARP_FOR_EACH_TARGET
void note_void(const float* first, const float* second, unsigned groups, RayBundle& rays) {
  for (int lane = 0; lane < kBundle; ++lane) {
    const bool taken = (groups >> (lane / kGroup) & 1) != 0;
    const float a = first[lane], b = second[lane];
    const bool is_void = taken && (a < kVoidBound || b < kVoidBound);
    const bool known = taken && a > kGroundBound && b > kGroundBound;
    rays.void_before[lane] = rays.void_before[lane] | (known ? rays.over_void[lane] : 0);
    rays.over_void[lane] = rays.over_void[lane] | (is_void ? 1 : 0);
  }
}

SCARP_FOR_EACH_TARGET
void note_void_loosely(const LooseCrossing& crossing, RayBundle& rays) {
  const LooseCrossing c = crossing;
  for (int i = 0; i < c.end_ray - c.first_ray; ++i) {
    const int lane = c.first_ray + i;
    const float place = c.place + static_cast<float>(i) * c.place_step;
    const bool left = place < 1 + c.reach, right = place > 1 - c.reach;
    const float z0 = c.z[i], z1 = c.z[i + 1], z2 = c.z[i + 2];
    const bool is_void =
        z1 < kVoidBound || (left && z0 < kVoidBound) || (right && z2 < kVoidBound);
    const bool known = z1 > kGroundBound && (left ? z0 > kGroundBound : z2 > kGroundBound);
    rays.void_before[lane] = rays.void_before[lane] | (known ? rays.over_void[lane] : 0);
    rays.over_void[lane] = rays.over_void[lane] | (is_void ? 1 : 0);
  }
}

SCARP_FOR_EACH_TARGET
unsigned may_block(const Square& square, float tolerance, unsigned groups, RayBundle& rays) {
  unsigned open = 0;
  for (int group = 0; group < kGroups; ++group) {
    if ((groups >> group & 1) == 0) continue;
    const std::ptrdiff_t first = group * kGroup;
    Lanes most = *reinterpret_cast<const LooseLanes*>(square.highest[0] + first);
    for (int i = 1; i < square.count; ++i) {
      const Lanes more = *reinterpret_cast<const LooseLanes*>(square.highest[i] + first);
      most = most < more ? more : most;
    }
    const Lanes rise = most - *reinterpret_cast<const Lanes*>(rays.eye_z + first);
    const Lanes near = rise * square.inverse_near, far = rise * square.inverse_far;
    const Lanes slope = near < far ? far : near;
    const Lanes bound = *reinterpret_cast<const Lanes*>(rays.low + first) + tolerance;
    const Lanes rest = *reinterpret_cast<const Lanes*>(rays.rest + first);
    const Lanes raised = rest < slope ? slope : rest;
    int blocked = 0;
    const auto above = (slope > bound) & (slope > RayBundle::kNone);
    for (int i = 0; i < kGroup; ++i) blocked |= above[i];
    if (blocked != 0)
      open |= 1U << group;
    else
      *reinterpret_cast<Lanes*>(rays.rest + first) = raised;
  }
  return open;
}

SCARP_FOR_EACH_TARGET
void note_ground_behind(const Square& square, unsigned groups, RayBundle& rays) {
  for (int i = 0; i < square.count; ++i) {
    const float* highest = square.highest[i];
    for (int lane = 0; lane < kBundle; ++lane) {
      const bool known = (groups >> (lane / kGroup) & 1) != 0 && highest[lane] > kGroundBound;
      rays.void_before[lane] = rays.void_before[lane] | (known ? rays.over_void[lane] : 0);
    }
  }
}

namespace {

/// Arc tangent in steps of 0.01 degree, error below 0.004 of them.
/// Source: Cephes atanf (Moshier), reduction at tan(pi/8) and tan(3 pi/8).
inline float arc_tangent_steps(float x) {
  const float t = magnitude(x);
  const bool large = t > 2.414213562F, middle = t > 0.4142135624F;
  const float y = large ? 1.5707963268F : middle ? 0.7853981634F : 0.0F;
  const float numerator = large ? -1.0F : middle ? t - 1.0F : t;
  const float denominator = large ? t : middle ? t + 1.0F : 1.0F;
  const float r = numerator / denominator;
  const float z = r * r;
  const float p =
      (((8.05374449538e-2F * z - 1.38776856032e-1F) * z + 1.99777106478e-1F) * z -
       3.33329491539e-1F) *
          z * r +
      r;
  const float steps = (y + p) * 5729.577951F;
  return x < 0 ? -steps : steps;
}

/// Largest whole number not above x, for |x| below 2^22.
inline float whole_below(float x) {
  const auto cut = static_cast<float>(static_cast<std::int32_t>(x));
  return cut > x ? cut - 1 : cut;
}

}  // namespace

SCARP_FOR_EACH_TARGET
void elevations(const ElevationRow& row, const RayBundle& rays, std::int16_t* __restrict estimate,
                std::int16_t* __restrict lower, std::int16_t* __restrict upper) {
  const ElevationRow k = row;
  constexpr float kRounding = 0.02F;  // of the steps: floats up to 9000, and the polynomial
  constexpr float kSteepest = 1e5F;   // beyond it is 90 degrees within a step
  for (int i = 0; i < kBundle; ++i) {
    const auto at = static_cast<float>(i);
    const float z = rays.eye_z[i];
    const float level = k.level + at * k.level_step + z * k.level_z;
    const float rise = k.rise + at * k.rise_step + z * k.rise_z;
    const float shrink = k.shrink + at * k.shrink_step;
    float low = rays.low[i] * shrink - k.slope_error;
    const bool met_low = rays.low[i] > RayBundle::kNone;
    float middle = (met_low ? (rays.low[i] + rays.high[i]) * 0.5F
                                               : rays.high[i]) *
                   shrink;
    float high = greater(rays.high[i], rays.rest[i]) * shrink + k.slope_error;
    const bool met = high > RayBundle::kNone;
    low = low < -kSteepest ? -kSteepest : low > kSteepest ? kSteepest : low;
    middle = middle < -kSteepest ? -kSteepest : middle > kSteepest ? kSteepest : middle;
    high = high < -kSteepest ? -kSteepest : high > kSteepest ? kSteepest : high;
    const float low_tangent =
        level + low * (rise + low * k.bend) - k.error * (1 + low * low);
    const float tangent = level + middle * (rise + middle * k.bend);
    const float high_tangent =
        level + high * (rise + high * k.bend) + k.error * (1 + high * high);
    float least = whole_below(arc_tangent_steps(low_tangent) - kRounding);
    float most = -whole_below(-arc_tangent_steps(high_tangent) - kRounding);
    // Slopes whose tangent is not modelled well any more.
    constexpr float kSteep = 4, kSteepAllowance = 5;
    least = magnitude(low) > kSteep ? least - kSteepAllowance : least;
    most = magnitude(high) > kSteep ? most + kSteepAllowance : most;
    float best = whole_below(arc_tangent_steps(tangent) + 0.5F);
    least = met_low ? (least < -9000 ? -9000 : least) : -9000;
    most = most > 9000 ? 9000 : most;
    best = best < least ? least : best > most ? most : best;
    const float nothing = kNothingSeen;
    const bool is_unknown = rays.void_before[i] != 0;
    const float unknown = kUnknownElevation;
    estimate[i] = static_cast<std::int16_t>(is_unknown ? unknown : met ? best : nothing);
    lower[i] = static_cast<std::int16_t>(is_unknown ? unknown : met ? least : nothing);
    upper[i] = static_cast<std::int16_t>(is_unknown ? unknown : met ? most : nothing);
  }
}

}  // namespace scarp
