#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/occlusion/certified/cell_kernels.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once more for each instruction set.
#include <hwy/highway.h>

#include "core/occlusion/certified/cell_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace scarp {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using Hints = hn::Rebind<std::uint16_t, Floats>;
constexpr Floats kFloats;
constexpr Hints kHints;

HWY_INLINE hn::Vec<Floats> slopes_of(hn::Vec<Hints> hints) {
  const hn::RebindToUnsigned<Floats> wide;
  return hn::BitCast(kFloats, hn::ShiftLeft<16>(hn::PromoteTo(wide, hints)));
}

void mark_wanted_now(const float* bounds, const std::uint16_t* hints, const CellRun& run,
                     std::uint64_t* bits) {
  const std::size_t lanes = hn::Lanes(kFloats);
  for (std::size_t word = run.begin; word < run.begin + run.count; word += kCellsMarked) {
    std::uint64_t marks = 0;
    for (std::size_t i = 0; i < kCellsMarked; i += lanes) {
      const auto slopes = slopes_of(hn::LoadU(kHints, hints + word + i));
      std::uint64_t some = 0;
      hn::StoreMaskBits(kFloats, hn::Gt(hn::LoadU(kFloats, bounds + word + i), slopes),
                        reinterpret_cast<std::uint8_t*>(&some));
      marks |= some << i;
    }
    bits[word / kCellsMarked] = marks;
  }
}

/// Elsewhere masked loads and stores touch whole vectors, where other threads may write, and want
/// them aligned.
constexpr bool kMasksMemory =
    HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL;

void lower_useless_now(const CellRun* runs, const float* best, std::size_t count,
                       const std::uint16_t* hints, float* bounds) {
  const std::size_t lanes = hn::Lanes(kFloats);
  for (std::size_t r = 0; r < count; ++r) {
    if constexpr (!kMasksMemory) {
      for (std::size_t at = runs[r].begin; at < runs[r].begin + runs[r].count; ++at)
        if (!(bounds[at] > slope_of_hint(hints[at])) && best[r] < bounds[at]) bounds[at] = best[r];
      continue;
    }
    const auto least = hn::Set(kFloats, best[r]);
    for (std::size_t i = 0; i < runs[r].count; i += lanes) {
      const std::size_t at = runs[r].begin + i;
      const auto within = hn::FirstN(kFloats, runs[r].count - i);
      const auto bound = hn::MaskedLoad(within, kFloats, bounds + at);
      const auto slopes = slopes_of(hn::LoadU(kHints, hints + at));
      const auto lower =
          hn::And(within, hn::And(hn::Not(hn::Gt(bound, slopes)), hn::Lt(least, bound)));
      hn::BlendedStore(least, lower, kFloats, bounds + at);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace scarp
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace scarp {

HWY_EXPORT(mark_wanted_now);
HWY_EXPORT(lower_useless_now);

void mark_wanted(const float* bounds, const std::uint16_t* hints, const CellRun& run,
                 std::uint64_t* bits) {
  HWY_DYNAMIC_DISPATCH(mark_wanted_now)(bounds, hints, run, bits);
}

void lower_useless(const CellRun* runs, const float* best, std::size_t count,
                   const std::uint16_t* hints, float* bounds) {
  HWY_DYNAMIC_DISPATCH(lower_useless_now)(runs, best, count, hints, bounds);
}

}  // namespace scarp
#endif  // HWY_ONCE
