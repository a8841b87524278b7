#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/terrain/tin.h"

namespace scarp {

/// From which of some sampled eyes each triangle is probably seen.
struct SeenSample {
  std::uint32_t eyes = 0;
  std::size_t words = 0;            ///< to a triangle
  std::vector<std::uint64_t> bits;  ///< [triangles * words], bit k of them: seen from eye k

  std::span<const std::uint64_t> of(TriangleIndex t) const {
    return {bits.data() + static_cast<std::size_t>(t) * words, words};
  }
};

/// Heights above ground of the sampled eyes: of somebody on the ground to an aircraft's.
inline constexpr std::array<double, 4> kSampledHeightsM = {2, 50, 300, 1000};

/// Estimates who sees what. Eye k stands kSampledHeightsM[k % 4] above a vertex drawn at random
/// from the k-th of `eyes` equal shares of the vertices. A triangle counts as seen from an eye on
/// the upper side of its plane where an estimated viewshed sees the ground near its centroid or
/// near one of its corners.
///
/// Side: none. For choosing groups, never for culling.
/// Requires (asserted): eyes a multiple of 64 and not 0.
/// Same bits for any thread count and on every machine.
/// Cost: O(eyes * triangles), about 20 ns of each; eyes / 8 bytes a triangle, and about 60 for each
/// thread meanwhile.
SeenSample sample_sight(const Tin& tin, std::uint64_t seed, std::uint32_t eyes);

}  // namespace scarp
