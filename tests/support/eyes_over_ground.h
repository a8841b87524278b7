#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/occlusion/splitmix64.h"
#include "core/terrain/tin.h"

namespace scarp::test {

/// Heights above ground that culling is measured from.
inline constexpr std::array<double, 4> kEyeHeightsM = {2, 50, 300, 1000};

/// Not the seed that groups are grown with.
inline constexpr std::uint64_t kEyeSeed = 7;

/// Calls visit(index of the height, eye) for eyes above vertices drawn at random, the same at each
/// height and each time.
template <class Visit>
void for_each_eye(const Tin& tin, int eyes, Visit visit) {
  for (std::size_t h = 0; h < kEyeHeightsM.size(); ++h) {
    SplitMix64 random(kEyeSeed);
    for (int i = 0; i < eyes; ++i) {
      Position eye = tin.vertices[random.below(tin.vertices.size())];
      eye.z_m += kEyeHeightsM[h];
      visit(h, eye);
    }
  }
}

}  // namespace scarp::test
