#pragma once

#include <cstddef>
#include <cstdint>

namespace scarp {

/// A run of pixels in one row of one triangle: depth of its first pixel, what each further pixel
/// adds, and whose it is.
struct Span {
  float depth;
  float depth_step;
  std::uint32_t object;
};

/// Writes the span's depth wherever it is nearer (greater) than what is there; pixel i has the
/// depth `depth + depth_step * float(i)`, rounded twice. The definition that a vector twin equals.
inline void fill_span_depth(const Span& span, std::size_t count, float* depth) {
  for (std::size_t i = 0; i < count; ++i) {
    const float z = span.depth + span.depth_step * static_cast<float>(static_cast<int>(i));
    depth[i] = z > depth[i] ? z : depth[i];
  }
}

/// The same with object numbers: of equal depths the lowest object number stays.
inline void fill_span(const Span& span, std::size_t count, float* depth, std::uint32_t* object) {
  for (std::size_t i = 0; i < count; ++i) {
    const float z = span.depth + span.depth_step * static_cast<float>(static_cast<int>(i));
    const float there = depth[i];
    const std::uint32_t owner = object[i];
    // Without short cuts, so that the compiler may take several pixels at a time.
    const bool nearer = (z > there) | ((z == there) & (span.object < owner));
    depth[i] = nearer ? z : there;
    object[i] = nearer ? span.object : owner;
  }
}

}  // namespace scarp
