#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/culling/horizon_kernels.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once more for each instruction set.
#include <hwy/highway.h>

#include <bit>
#include <cmath>

#include "core/culling/horizon_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace scarp {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, kLaidOut>;
using Steps = hn::Rebind<std::int32_t, Doubles>;
using Vector = hn::Vec<Doubles>;
using Mask = hn::Mask<Doubles>;
constexpr Doubles kDoubles;
constexpr Steps kSteps;

HWY_INLINE Vector value(double v) {
  return hn::Set(kDoubles, v);
}

struct Corner {
  Vector ahead, right, across, up;
};

/// RisingHorizon::place.
HWY_INLINE Corner place(const HorizonEye& eye, const Position& origin, const std::int32_t* steps) {
  const auto metres = [&](const std::int32_t* from, double at_m, double eye_m) {
    const Vector off = hn::PromoteTo(kDoubles, hn::LoadU(kSteps, from)) * value(kLatticeStepM);
    return (value(at_m) + off) - value(eye_m);
  };
  const Vector x = metres(steps, origin.x_m, eye.at.x_m);
  const Vector y = metres(steps + kLaidOut, origin.y_m, eye.at.y_m);
  const Vector z = metres(steps + 2 * kLaidOut, origin.z_m, eye.at.z_m);
  Corner c;
  c.ahead = value(eye.ahead_x) * x + value(eye.ahead_y) * y;
  c.right = value(eye.ahead_y) * x - value(eye.ahead_x) * y;
  const Vector each = value(1) / c.ahead;
  c.across = c.right * each;
  c.up = z * each;
  return c;
}

HWY_INLINE void order(Corner& a, Corner& b) {
  const Mask swaps = hn::Lt(b.across, a.across);
  const Vector across = a.across, up = a.up;
  a.across = hn::IfThenElse(swaps, b.across, across);
  a.up = hn::IfThenElse(swaps, b.up, up);
  b.across = hn::IfThenElse(swaps, across, b.across);
  b.up = hn::IfThenElse(swaps, up, b.up);
}

HWY_INLINE Mask is_placed(const Corner& c) {
  return hn::And(hn::Ge(c.ahead, value(kNearestAheadM)),
                 hn::Le(hn::Abs(c.across), value(kMostAcross)));
}

/// RisingHorizon's faces_away.
HWY_INLINE Mask faces_away(const Corner& a, const Corner& b, const Corner& c) {
  const Vector ax = b.across - a.across, ay = b.up - a.up;
  const Vector bx = c.across - a.across, by = c.up - a.up;
  const Vector wide = value(1) + hn::Abs(a.across) + hn::Abs(b.across) + hn::Abs(c.across);
  const Vector high = hn::Abs(a.up) + hn::Abs(b.up) + hn::Abs(c.up);
  return hn::Lt(ax * by - ay * bx, value(-kAreaRounding) * wide * wide * high);
}

HWY_INLINE std::uint64_t bits_of(Mask mask) {
  std::uint64_t bits = 0;
  hn::StoreMaskBits(kDoubles, mask, reinterpret_cast<std::uint8_t*>(&bits));
  return bits;
}

/// An edge's slope, and where it begins for what hides.
HWY_INLINE void set_up_edge(const Corner& from, const Corner& to, double* slope, double* begin) {
  const Vector across = to.across - from.across;
  const Mask is_long = hn::Ge(across, value(kLeastEdge));
  hn::Store(hn::IfThenElseZero(is_long, (to.up - from.up) / across), kDoubles, slope);
  if (begin != nullptr)
    hn::Store(hn::IfThenElse(is_long, from.up, value(-HUGE_VAL)), kDoubles, begin);
}

HWY_INLINE Vector clamped(Vector v, Vector most) {
  return hn::Min(hn::Max(v, value(0)), most);
}

void set_up_now(const HorizonEye& eye, const HorizonBins& bins, const Position& origin,
                const std::int32_t* steps, std::size_t count, SeenTriangles& seen) {
  const std::size_t lanes = hn::Lanes(kDoubles);
  const Vector left = value(bins.left), right = value(bins.right), width = value(bins.width);
  seen.open = seen.facing = seen.spanning = 0;
  for (std::size_t i = 0; i < count; i += lanes) {
    const std::int32_t* const at = steps + i / kLaidOut * 9 * kLaidOut + i % kLaidOut;
    Corner a = place(eye, origin, at), b = place(eye, origin, at + 3 * kLaidOut),
           c = place(eye, origin, at + 6 * kLaidOut);
    const auto all = [&](const auto& is) { return hn::And(is(a), hn::And(is(b), is(c))); };
    const Mask is_beside =
        hn::Or(all([&](const Corner& p) { return hn::Lt(p.right, left * p.ahead); }),
               hn::Or(all([&](const Corner& p) { return hn::Gt(p.right, right * p.ahead); }),
                      all([&](const Corner& p) { return hn::Lt(p.ahead, value(0)); })));
    const Mask placed = all([](const Corner& p) { return is_placed(p); });
    const Mask facing = hn::AndNot(is_beside, hn::AndNot(faces_away(a, b, c), placed));
    seen.open |= bits_of(hn::Not(hn::Or(is_beside, placed))) << i;
    seen.facing |= bits_of(facing) << i;
    hn::Store(hn::Min(a.ahead, hn::Min(b.ahead, c.ahead)), kDoubles, &seen.nearest_m[i]);
    hn::Store(hn::Max(a.ahead, hn::Max(b.ahead, c.ahead)) * value(1 + kHorizonRounding), kDoubles,
              &seen.farthest_m[i]);
    order(a, b), order(b, c), order(a, b);
    hn::Store(a.across, kDoubles, &seen.across0[i]);
    hn::Store(b.across, kDoubles, &seen.across1[i]);
    hn::Store(c.across, kDoubles, &seen.across2[i]);
    hn::Store(a.up, kDoubles, &seen.up0[i]);
    hn::Store(b.up, kDoubles, &seen.up1[i]);
    hn::Store(c.up, kDoubles, &seen.up2[i]);
    set_up_edge(a, c, &seen.slope[i], nullptr);
    set_up_edge(a, b, &seen.slope01[i], &seen.up01[i]);
    set_up_edge(b, c, &seen.slope12[i], &seen.up12[i]);
    const Vector margin = value(kHorizonRounding) * (hn::Abs(a.up) + hn::Abs(b.up) + hn::Abs(c.up));
    hn::Store(margin, kDoubles, &seen.margin[i]);
    hn::Store(hn::Max(a.up, hn::Max(b.up, c.up)) + margin, kDoubles, &seen.top[i]);
    const Vector least = a.across + value(kHorizonRounding);
    const Vector most = c.across - value(kHorizonRounding);
    const Vector parts = value(HorizonBins::kBins), last_part = value(HorizonBins::kBins - 1.0);
    const auto part_of = [&](Vector across) {
      return hn::Floor(clamped((across - left) / width, last_part));
    };
    hn::Store(part_of(a.across - value(kHorizonRounding)), kDoubles, &seen.first[i]);
    hn::Store(part_of(c.across + value(kHorizonRounding)), kDoubles, &seen.last[i]);
    const Vector from = hn::Ceil(clamped((least - left) / width, parts));
    const Vector to = hn::Floor(clamped((most - left) / width, parts));
    hn::Store(from, kDoubles, &seen.from[i]);
    hn::Store(to, kDoubles, &seen.to[i]);
    const Mask wide = hn::And(hn::Lt(from, to), hn::Ge(most - least, value(kLeastEdge)));
    seen.spanning |= bits_of(hn::And(hn::AndNot(is_beside, placed), wide)) << i;
  }
}

bool is_under_now(const HorizonBins& bins, const SeenTriangles& seen, std::size_t t) {
  const std::size_t lanes = hn::Lanes(kDoubles);
  const auto last = static_cast<std::size_t>(seen.last[t]);
  const Vector top = value(seen.top[t]), nearest = value(seen.nearest_m[t]);
  for (auto bin = static_cast<std::size_t>(seen.first[t]); bin <= last; bin += lanes) {
    const Mask asked = hn::FirstN(kDoubles, last + 1 - bin);
    const Mask hides = hn::And(hn::Lt(top, hn::LoadU(kDoubles, &bins.up[bin])),
                               hn::Le(hn::LoadU(kDoubles, &bins.farthest_m[bin]), nearest));
    if (!hn::AllFalse(kDoubles, hn::AndNot(hides, asked))) return false;
  }
  return true;
}

/// RisingHorizon::raise_by.
HWY_INLINE void raise_by(const SeenTriangles& seen, std::size_t t, HorizonBins& bins) {
  const std::size_t lanes = hn::Lanes(kDoubles);
  const auto to = static_cast<std::size_t>(seen.to[t]);
  const Vector x0 = value(seen.across0[t]), x1 = value(seen.across1[t]);
  const Vector up0 = value(seen.up0[t]), up01 = value(seen.up01[t]), up12 = value(seen.up12[t]);
  const Vector slope = value(seen.slope[t]), slope01 = value(seen.slope01[t]),
               slope12 = value(seen.slope12[t]);
  const Vector top = value(seen.top[t]);
  const Vector margin = value(seen.margin[t]), farthest = value(seen.farthest_m[t]);
  const Vector left = value(bins.left), width = value(bins.width);
  const auto top_at = [&](Vector border) {
    const Vector across = left + border * width;
    const Mask is_before = hn::Lt(across, x1);
    const Vector bent =
        hn::IfThenElse(is_before, up01, up12) +
        (across - hn::IfThenElse(is_before, x0, x1)) * hn::IfThenElse(is_before, slope01, slope12);
    return hn::Max(up0 + (across - x0) * slope, bent);
  };
  for (auto bin = static_cast<std::size_t>(seen.from[t]); bin < to; bin += lanes) {
    const Mask asked = hn::FirstN(kDoubles, to - bin);
    const Vector was = hn::LoadU(kDoubles, &bins.up[bin]);
    if (hn::AllFalse(kDoubles, hn::And(asked, hn::Lt(was, top)))) continue;  // most of them
    const Vector border = hn::Iota(kDoubles, static_cast<double>(bin));
    const Vector up = hn::Min(top_at(border), top_at(border + value(1))) - margin;
    const Mask raises = hn::And(asked, hn::Gt(up, was));
    const Vector was_m = hn::LoadU(kDoubles, &bins.farthest_m[bin]);
    hn::StoreU(hn::IfThenElse(raises, up, was), kDoubles, &bins.up[bin]);
    hn::StoreU(hn::IfThenElse(raises, farthest, was_m), kDoubles, &bins.farthest_m[bin]);
  }
}

void raise_now(const SeenTriangles& seen, HorizonBins& bins) {
  for (std::uint64_t left = seen.spanning; left != 0; left &= left - 1)
    raise_by(seen, static_cast<std::size_t>(std::countr_zero(left)), bins);
}

}  // namespace HWY_NAMESPACE
}  // namespace scarp
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace scarp {

HWY_EXPORT(set_up_now);
HWY_EXPORT(is_under_now);
HWY_EXPORT(raise_now);

void set_up(const HorizonEye& eye, const HorizonBins& bins, const Position& origin,
            const std::int32_t* steps, std::size_t count, SeenTriangles& seen) {
  HWY_DYNAMIC_DISPATCH(set_up_now)(eye, bins, origin, steps, count, seen);
}

bool is_under(const HorizonBins& bins, const SeenTriangles& seen, std::size_t triangle) {
  return HWY_DYNAMIC_DISPATCH(is_under_now)(bins, seen, triangle);
}

void raise(const SeenTriangles& seen, HorizonBins& bins) {
  HWY_DYNAMIC_DISPATCH(raise_now)(seen, bins);
}

}  // namespace scarp
#endif  // HWY_ONCE
