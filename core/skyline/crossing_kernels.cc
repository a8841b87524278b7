#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/skyline/crossing_kernels.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once more for each instruction set.
#include <hwy/highway.h>

#include <bit>

#include "core/skyline/crossing_kernels.h"
#include "core/skyline/march_ground.h"

HWY_BEFORE_NAMESPACE();
namespace scarp {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// As many rays at once as the processor takes, but never more than a group.
using Tag = hn::CappedTag<float, kGroup>;
using Vector = hn::Vec<Tag>;
using Mask = hn::Mask<Tag>;
constexpr Tag kTag;
constexpr float kGroundBound = -1e29F, kVoidBound = -1.5e30F;

HWY_INLINE Vector value(float v) {
  return hn::Set(kTag, v);
}
/// Magnitude of a rise between samples; 0 where one of them is no ground.
HWY_INLINE Vector steepness(Vector difference) {
  const Vector magnitude = hn::Abs(difference);
  return hn::IfThenElseZero(magnitude < value(-kGroundBound), magnitude);
}
HWY_INLINE bool takes_part(unsigned groups, std::size_t ray) {
  return (groups >> (ray / kGroup) & 1) != 0;
}

/// @tparam kFans  places and runs differ from ray to ray
template <bool kError, bool kDistance, bool kFans>
HWY_INLINE unsigned meet_noting(const Crossing* crossings, std::size_t count, std::ptrdiff_t shift,
                                unsigned groups, RayBundle& rays) {
  unsigned raised = 0;
  const std::size_t lanes = hn::Lanes(kTag), parts = kGroup / lanes;
  for (std::size_t part = 0; groups != 0; part = part + 1 == parts ? 0 : part + 1) {
    const std::size_t ray =
        static_cast<std::size_t>(std::countr_zero(groups)) * kGroup + part * lanes;
    if (part + 1 == parts) groups &= groups - 1;
    const Vector before = hn::Load(kTag, rays.slope + ray);
    const Vector eye = hn::Load(kTag, rays.eye_z + ray);
    const Vector number = hn::Iota(kTag, static_cast<float>(ray));
    Vector greatest = before, error = hn::Load(kTag, rays.error + ray);
    Vector run = hn::Load(kTag, rays.slope_run + ray);
    for (std::size_t i = 0; i < count; ++i) {
      const Crossing& c = crossings[i];
      const Vector a = hn::LoadU(kTag, c.a + shift + ray);
      const Vector difference = hn::LoadU(kTag, c.b + shift + ray) - a;
      Vector share = value(c.share), inverse = value(c.inverse_run);
      if constexpr (kFans) {
        share = share + value(c.share_step) * number;
        inverse = inverse + value(c.inverse_run_step) * number;
      }
      const Vector slope = ((a - eye) + share * difference) * inverse;
      if constexpr (kDistance)
        run = hn::IfThenElse(greatest < slope, value(1 / c.inverse_run), run);
      greatest = hn::Max(greatest, slope);
      if constexpr (kError) error = hn::Max(error, steepness(difference) * value(c.slack));
    }
    if (!hn::AllFalse(kTag, before < greatest)) raised |= 1U << (ray / kGroup);
    hn::Store(greatest, kTag, rays.slope + ray);
    if constexpr (kError) hn::Store(error, kTag, rays.error + ray);
    if constexpr (kDistance) hn::Store(run, kTag, rays.slope_run + ray);
  }
  return raised;
}

unsigned meet_now(const Crossing* crossings, std::size_t count, std::ptrdiff_t shift,
                  unsigned groups, const MeetNotes& notes, RayBundle& rays) {
  if (notes.distance) return meet_noting<true, true, true>(crossings, count, shift, groups, rays);
  if (notes.error)
    return notes.fans ? meet_noting<true, false, true>(crossings, count, shift, groups, rays)
                      : meet_noting<true, false, false>(crossings, count, shift, groups, rays);
  return notes.fans ? meet_noting<false, false, true>(crossings, count, shift, groups, rays)
                    : meet_noting<false, false, false>(crossings, count, shift, groups, rays);
}

unsigned meet_samples_now(const SampleCrossing* crossings, std::size_t count, std::ptrdiff_t shift,
                          unsigned groups, RayBundle& rays) {
  const Vector none = value(MarchGround::kNothing), bound = value(kGroundBound);
  unsigned raised = 0;
  for (std::size_t ray = 0; ray < kBundle; ray += hn::Lanes(kTag)) {
    if (!takes_part(groups, ray)) continue;
    const Vector before = hn::Load(kTag, rays.slope + ray);
    const Vector eye = hn::Load(kTag, rays.eye_z + ray);
    Vector greatest = before, high = hn::Load(kTag, rays.high + ray);
    Vector slope_run = hn::Load(kTag, rays.slope_run + ray), run = hn::Load(kTag, rays.run + ray);
    for (std::size_t i = 0; i < count; ++i) {
      const SampleCrossing& c = crossings[i];
      const float* z = c.z + shift + ray;
      const Vector slope = (hn::LoadU(kTag, z) - eye) * value(c.inverse_run);
      const Mask sure = hn::Min(hn::LoadU(kTag, z - 1), hn::LoadU(kTag, z + 1)) > bound;
      const Vector met = hn::IfThenElse(sure, slope, none);
      const Vector may = hn::IfThenElse(sure, none, slope + value(c.error));
      const Vector run_m = value(1 / c.inverse_run);
      slope_run = hn::IfThenElse(greatest < met, run_m, slope_run);
      run = hn::IfThenElse(high < may, run_m, run);
      greatest = hn::Max(greatest, met);
      high = hn::Max(high, may);
    }
    if (!hn::AllFalse(kTag, before < greatest)) raised |= 1U << (ray / kGroup);
    hn::Store(greatest, kTag, rays.slope + ray);
    hn::Store(slope_run, kTag, rays.slope_run + ray);
    hn::Store(high, kTag, rays.high + ray);
    hn::Store(run, kTag, rays.run + ray);
  }
  return raised;
}

void meet_high_now(const PossibleCrossing& c, unsigned groups, RayBundle& rays) {
  const Vector none = value(MarchGround::kNothing), bound = value(kGroundBound);
  for (std::size_t ray = 0; ray < kBundle; ray += hn::Lanes(kTag)) {
    if (!takes_part(groups, ray)) continue;
    const Vector number = hn::Iota(kTag, static_cast<float>(ray));
    const Vector a = hn::LoadU(kTag, c.a + ray), b = hn::LoadU(kTag, c.b + ray);
    const Vector difference = b - a;
    const Mask known = hn::And(a > bound, b > bound);
    const Vector reach =
        hn::IfThenElse(difference < hn::Zero(kTag), value(-c.reach), value(c.reach));
    const Vector share = value(c.share) + value(c.share_step) * number + reach;
    const Vector inside = hn::Min(hn::Max(share, hn::Zero(kTag)), value(1));
    const Vector rise = (a - hn::Load(kTag, rays.eye_z + ray)) + inside * difference;
    const Vector slope =
        rise * hn::IfThenElse(rise < hn::Zero(kTag), value(c.inverse_far), value(c.inverse_near));
    const Vector most = hn::IfThenElse(known, slope, none);
    const Vector high = hn::Load(kTag, rays.high + ray);
    hn::Store(hn::IfThenElse(high < most, value(2 / (c.inverse_near + c.inverse_far)),
                             hn::Load(kTag, rays.run + ray)),
              kTag, rays.run + ray);
    hn::Store(hn::Max(high, most), kTag, rays.high + ray);
  }
}

unsigned meet_loosely_now(const LooseCrossing& c, RayBundle& rays) {
  const Vector none = value(MarchGround::kNothing), bound = value(kGroundBound);
  const Vector zero = hn::Zero(kTag);
  unsigned raised = 0;
  const std::size_t lanes = hn::Lanes(kTag);
  const auto end = static_cast<std::size_t>(c.end_ray);
  for (std::size_t ray = static_cast<std::size_t>(c.first_ray) / lanes * lanes; ray < end;
       ray += lanes) {
    const Vector number = hn::Iota(kTag, static_cast<float>(ray));
    const Mask taken = hn::And(number >= value(static_cast<float>(c.first_ray)),
                               number < value(static_cast<float>(c.end_ray)));
    const Vector z0 = hn::LoadU(kTag, c.z + ray), z1 = hn::LoadU(kTag, c.z + ray + 1);
    const Vector z2 = hn::LoadU(kTag, c.z + ray + 2);
    const Vector past = value(c.place) + value(c.place_step) * number - value(1);
    const Mask before = past < zero, near = hn::Abs(past) <= value(c.reach);
    const Mask known = z1 > bound;
    // Where a side is missing, its rise counts as none.
    const Mask has_left = hn::And(known, z0 > bound), has_right = hn::And(known, z2 > bound);
    const Vector left = hn::IfThenElseZero(has_left, z1 - z0);
    const Vector right = hn::IfThenElseZero(has_right, z2 - z1);
    const Vector one_side = hn::Abs(hn::IfThenElse(before, left, right));
    const Vector steep = hn::IfThenElse(near, hn::Max(hn::Abs(left), hn::Abs(right)), one_side);
    const Vector rise = hn::IfThenElse(before, left, right);
    const Vector slope =
        ((z1 - hn::Load(kTag, rays.eye_z + ray)) + past * rise) * value(c.inverse_run);
    const Vector error = steep * value(c.reach * c.inverse_run);
    const Mask has_side = hn::Or(hn::And(before, has_left), hn::AndNot(before, has_right));
    // At the sample itself, the ray may pass on the side that is missing.
    const Mask both = hn::And(has_left, has_right);
    const Mask met = hn::And(taken, hn::Or(hn::And(near, both), hn::AndNot(near, has_side)));
    const Mask may = hn::And(taken, hn::Or(hn::And(near, known), hn::AndNot(near, has_side)));
    const Vector most = hn::IfThenElse(may, slope + error, none);
    const Vector least = hn::IfThenElse(met, slope - error, none);
    const Vector high = hn::Load(kTag, rays.high + ray);
    hn::Store(hn::IfThenElse(high < most, value(1 / c.inverse_run), hn::Load(kTag, rays.run + ray)),
              kTag, rays.run + ray);
    const Vector low = hn::Load(kTag, rays.low + ray);
    if (!hn::AllFalse(kTag, low < least)) raised |= 1U << (ray / kGroup);
    hn::Store(hn::Max(low, least), kTag, rays.low + ray);
    hn::Store(hn::Max(high, most), kTag, rays.high + ray);
  }
  return raised;
}

/// The steepest that rays can see the ground of a square.
HWY_INLINE Vector steepest(const Square& square, std::size_t ray, Vector eye) {
  Vector most = hn::LoadU(kTag, square.highest[0] + ray);
  for (int i = 1; i < square.count; ++i)
    most = hn::Max(most, hn::LoadU(kTag, square.highest[i] + ray));
  const Vector rise = most - eye;
  return hn::Max(rise * value(square.inverse_near), rise * value(square.inverse_far));
}

/// Above this ground might block.
HWY_INLINE Vector least_to_block(const RayBundle& rays, std::size_t ray, float tolerance) {
  const Vector met = hn::Max(hn::Load(kTag, rays.low + ray), hn::Load(kTag, rays.slope + ray));
  return hn::Max(met + value(tolerance), value(RayBundle::kNone));
}

/// A group that fits into one vector, without branches.
HWY_INLINE void ask_vector(const Square* squares, std::size_t count, float tolerance,
                           std::size_t ray, RayBundle& rays, unsigned* open) {
  // What is left out of a group that stays closed, and of one that is opened.
  static constexpr float kMostRest[] = {1e30F, -1e30F};
  const Vector eye = hn::Load(kTag, rays.eye_z + ray);
  const Vector least = least_to_block(rays, ray, tolerance);
  Vector rest = hn::Load(kTag, rays.rest + ray);
  for (std::size_t i = 0; i < count; ++i) {
    const Vector slope = steepest(squares[i], ray, eye);
    const unsigned is_open = hn::AllFalse(kTag, slope > least) ? 0 : 1;
    rest = hn::Max(rest, hn::Min(slope, value(kMostRest[is_open])));
    open[i] |= is_open << (ray / kGroup);
  }
  hn::Store(rest, kTag, rays.rest + ray);
}

void may_block_now(const Square* squares, std::size_t count, float tolerance, unsigned groups,
                   RayBundle& rays, unsigned* open) {
  for (std::size_t i = 0; i < count; ++i) open[i] = 0;
  const std::size_t lanes = hn::Lanes(kTag);
  for (; groups != 0; groups &= groups - 1) {
    const std::size_t first = static_cast<std::size_t>(std::countr_zero(groups)) * kGroup;
    if (lanes == kGroup) {
      ask_vector(squares, count, tolerance, first, rays, open);
      continue;
    }
    for (std::size_t i = 0; i < count; ++i) {
      bool is_open = false;
      for (std::size_t ray = first; ray < first + kGroup && !is_open; ray += lanes) {
        const Vector slope = steepest(squares[i], ray, hn::Load(kTag, rays.eye_z + ray));
        is_open = !hn::AllFalse(kTag, slope > least_to_block(rays, ray, tolerance));
      }
      open[i] |= (is_open ? 1U : 0U) << (first / kGroup);
      for (std::size_t ray = first; ray < first + kGroup && !is_open; ray += lanes) {
        const Vector slope = steepest(squares[i], ray, hn::Load(kTag, rays.eye_z + ray));
        hn::Store(hn::Max(hn::Load(kTag, rays.rest + ray), slope), kTag, rays.rest + ray);
      }
    }
  }
}

/// Known ground and void that rays meet, in this order.
HWY_INLINE void note(Mask known, Mask is_void, std::size_t ray, RayBundle& rays) {
  const Vector over = hn::Load(kTag, rays.over_void + ray);
  const Vector before = hn::Load(kTag, rays.void_before + ray);
  hn::Store(hn::Max(before, hn::IfThenElseZero(known, over)), kTag, rays.void_before + ray);
  hn::Store(hn::IfThenElse(is_void, value(1), over), kTag, rays.over_void + ray);
}

void note_void_now(const float* a, const float* b, unsigned groups, RayBundle& rays) {
  const Vector ground = value(kGroundBound), missing = value(kVoidBound);
  for (std::size_t ray = 0; ray < kBundle; ray += hn::Lanes(kTag)) {
    if (!takes_part(groups, ray)) continue;
    const Vector lower = hn::Min(hn::LoadU(kTag, a + ray), hn::LoadU(kTag, b + ray));
    note(lower > ground, lower < missing, ray, rays);
  }
}

void note_void_loosely_now(const LooseCrossing& c, RayBundle& rays) {
  const Vector ground = value(kGroundBound), missing = value(kVoidBound);
  const std::size_t lanes = hn::Lanes(kTag);
  const auto end = static_cast<std::size_t>(c.end_ray);
  for (std::size_t ray = static_cast<std::size_t>(c.first_ray) / lanes * lanes; ray < end;
       ray += lanes) {
    const Vector number = hn::Iota(kTag, static_cast<float>(ray));
    const Mask taken = hn::And(number >= value(static_cast<float>(c.first_ray)),
                               number < value(static_cast<float>(c.end_ray)));
    const Vector place = value(c.place) + value(c.place_step) * number;
    const Mask left = place<value(1 + c.reach), right = place> value(1 - c.reach);
    const Vector z0 = hn::LoadU(kTag, c.z + ray), z1 = hn::LoadU(kTag, c.z + ray + 1);
    const Vector z2 = hn::LoadU(kTag, c.z + ray + 2);
    const Vector beside = hn::Min(hn::IfThenElse(left, z0, z1), hn::IfThenElse(right, z2, z1));
    const Vector lower = hn::Min(z1, beside);
    // Known wherever it may be: a ray over the sample itself needs neither side.
    const Mask side_known = hn::Or(hn::And(left, z0 > ground), hn::And(right, z2 > ground));
    const Mask known = hn::And(z1 > ground, hn::Or(hn::And(left, right), side_known));
    note(hn::And(taken, known), hn::And(taken, lower < missing), ray, rays);
  }
}

void note_ground_behind_now(const Square& square, unsigned groups, RayBundle& rays) {
  for (std::size_t ray = 0; ray < kBundle; ray += hn::Lanes(kTag)) {
    if (!takes_part(groups, ray)) continue;
    Vector most = hn::LoadU(kTag, square.highest[0] + ray);
    for (int i = 1; i < square.count; ++i)
      most = hn::Max(most, hn::LoadU(kTag, square.highest[i] + ray));
    note(most > value(kGroundBound), most > value(1e30F), ray, rays);
  }
}

/// Arc tangent in steps of 0.01 degree, error below 0.004 of them.
/// Source: Cephes atanf (Moshier), reduction at tan(pi/8) and tan(3 pi/8).
HWY_INLINE Vector arc_tangent_steps(Vector x) {
  const Vector t = hn::Abs(x), one = value(1);
  const Mask large = t > value(2.414213562F), middle = t > value(0.4142135624F);
  const Vector base =
      hn::IfThenElse(large, value(1.5707963268F), hn::IfThenElseZero(middle, value(0.7853981634F)));
  const Vector numerator = hn::IfThenElse(large, value(-1), hn::IfThenElse(middle, t - one, t));
  const Vector denominator = hn::IfThenElse(large, t, hn::IfThenElse(middle, t + one, one));
  const Vector r = numerator / denominator, z = r * r;
  const Vector p =
      (((value(8.05374449538e-2F) * z - value(1.38776856032e-1F)) * z + value(1.99777106478e-1F)) *
           z -
       value(3.33329491539e-1F)) *
          z * r +
      r;
  return hn::CopySign((base + p) * value(5729.577951F), x);
}

/// Never below what the angles of two tangents differ by, steps of 0.01 degree, and little above:
/// the angle grows no faster than where the tangent between them is nearest to 0. 0 where b < a.
HWY_INLINE Vector steps_between(Vector a, Vector b) {
  const Vector zero = hn::Zero(kTag);
  const Vector nearest = hn::Max(hn::Max(a, zero - b), zero);
  const Vector difference = hn::Max(b - a, zero);
  return difference * value(5729.58F * (1 + 1e-6F)) / (value(1) + nearest * nearest);
}

void elevations_now(const ElevationRow& k, const RayBundle& rays, std::int16_t* estimate,
                    std::int16_t* lower, std::int16_t* upper) {
  constexpr float kRounding = 0.02F;  // of the steps: floats up to 9000, and the polynomial
  // Slopes are steeper than the model is good for, and than makes a difference.
  constexpr float kSteep = 4, kSteepAllowance = 5, kSteepest = 1e5F;
  const Vector one = value(1), none = value(RayBundle::kNone);
  const auto clamped = [](Vector v) {
    return hn::Min(hn::Max(v, value(-kSteepest)), value(kSteepest));
  };
  const auto write = [](Vector v, std::int16_t* to) {
    const hn::RebindToSigned<Tag> whole;
    const hn::Rebind<std::int16_t, Tag> half;
    hn::StoreU(hn::DemoteTo(half, hn::ConvertTo(whole, v)), half, to);
  };
  for (std::size_t i = 0; i < kBundle; i += hn::Lanes(kTag)) {
    const Vector number = hn::Iota(kTag, static_cast<float>(i));
    const Vector z = hn::Load(kTag, rays.eye_z + i);
    const Vector level = value(k.level) + number * value(k.level_step) + z * value(k.level_z);
    const Vector rise = value(k.rise) + number * value(k.rise_step) + z * value(k.rise_z);
    const Vector shrink = value(k.shrink) + number * value(k.shrink_step);
    const Vector slope = hn::Load(kTag, rays.slope + i);
    const Vector error = hn::Max(hn::Load(kTag, rays.error + i), value(k.least_error)) +
                         hn::Abs(slope) * value(k.drift);
    const Vector ray_low = hn::Max(hn::Load(kTag, rays.low + i), slope - error);
    const Vector loose_high = hn::Load(kTag, rays.high + i);
    const Vector ray_high =
        hn::Max(loose_high + hn::Abs(loose_high) * value(k.drift), slope + error);
    const Vector rest = hn::Load(kTag, rays.rest + i);
    const Vector most =
        hn::Max(ray_high, rest + hn::Abs(rest) * value(k.drift) + value(k.least_error));
    const Mask met = most > none, met_low = ray_low > none;
    const Vector low = clamped(ray_low * shrink - value(k.slope_error));
    const Vector high = clamped(most * shrink + value(k.slope_error));
    // Of what was compared; its bounds are almost equal, but where it is not certain that some of
    // it is met, and then it most often is.
    const Vector middle = clamped(hn::Max(loose_high, slope) * shrink);
    const auto tangent = [&](Vector s) { return level + s * (rise + s * value(k.bend)); };
    const Vector low_tangent = tangent(low) - value(k.error) * (one + low * low);
    const Vector high_tangent = tangent(high) + value(k.error) * (one + high * high);
    const Vector middle_tangent = tangent(middle), middle_steps = arc_tangent_steps(middle_tangent);
    const Vector below = steps_between(low_tangent, middle_tangent);
    const Vector above = steps_between(middle_tangent, high_tangent);
    Vector least = hn::Floor(middle_steps - below - value(kRounding));
    Vector greatest = hn::Ceil(middle_steps + above + value(kRounding));
    least = hn::IfThenElse(hn::Abs(low) > value(kSteep), least - value(kSteepAllowance), least);
    greatest =
        hn::IfThenElse(hn::Abs(high) > value(kSteep), greatest + value(kSteepAllowance), greatest);
    least = hn::IfThenElse(met_low, hn::Max(least, value(-9000)), value(-9000));
    greatest = hn::Min(greatest, value(9000));
    const Vector nearest = hn::Floor(middle_steps + value(0.5F));
    const Vector best = hn::Min(hn::Max(nearest, least), greatest);
    const Vector nothing = value(kNothingSeen);
    write(hn::IfThenElse(met, best, nothing), estimate + i);
    write(hn::IfThenElse(met, least, nothing), lower + i);
    write(hn::IfThenElse(met, greatest, nothing), upper + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace scarp
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace scarp {

HWY_EXPORT(meet_now);
HWY_EXPORT(meet_samples_now);
HWY_EXPORT(meet_high_now);
HWY_EXPORT(meet_loosely_now);
HWY_EXPORT(may_block_now);
HWY_EXPORT(elevations_now);
HWY_EXPORT(note_void_now);
HWY_EXPORT(note_void_loosely_now);
HWY_EXPORT(note_ground_behind_now);

unsigned meet(const Crossing* crossings, std::size_t count, std::ptrdiff_t shift, unsigned groups,
              const MeetNotes& notes, RayBundle& rays) {
  return HWY_DYNAMIC_DISPATCH(meet_now)(crossings, count, shift, groups, notes, rays);
}

unsigned meet_samples(const SampleCrossing* crossings, std::size_t count, std::ptrdiff_t shift,
                      unsigned groups, RayBundle& rays) {
  return HWY_DYNAMIC_DISPATCH(meet_samples_now)(crossings, count, shift, groups, rays);
}

void meet_high(const PossibleCrossing& crossing, unsigned groups, RayBundle& rays) {
  HWY_DYNAMIC_DISPATCH(meet_high_now)(crossing, groups, rays);
}

unsigned meet_loosely(const LooseCrossing& crossing, RayBundle& rays) {
  return HWY_DYNAMIC_DISPATCH(meet_loosely_now)(crossing, rays);
}

void may_block(const Square* squares, std::size_t count, float tolerance, unsigned groups,
               RayBundle& rays, unsigned* open) {
  HWY_DYNAMIC_DISPATCH(may_block_now)(squares, count, tolerance, groups, rays, open);
}

void elevations(const ElevationRow& row, const RayBundle& rays, std::int16_t* estimate,
                std::int16_t* lower, std::int16_t* upper) {
  HWY_DYNAMIC_DISPATCH(elevations_now)(row, rays, estimate, lower, upper);
  if (!row.has_unknown) return;
  for (int i = 0; i < kBundle; ++i)
    if (rays.void_before[i] > 0) estimate[i] = lower[i] = upper[i] = kUnknownElevation;
}

void note_void(const float* a, const float* b, unsigned groups, RayBundle& rays) {
  HWY_DYNAMIC_DISPATCH(note_void_now)(a, b, groups, rays);
}

void note_void_loosely(const LooseCrossing& crossing, RayBundle& rays) {
  HWY_DYNAMIC_DISPATCH(note_void_loosely_now)(crossing, rays);
}

void note_ground_behind(const Square& square, unsigned groups, RayBundle& rays) {
  HWY_DYNAMIC_DISPATCH(note_ground_behind_now)(square, groups, rays);
}

}  // namespace scarp
#endif  // HWY_ONCE
