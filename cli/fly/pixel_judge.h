#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/culling/group_batches.h"
#include "core/raster/rasterise.h"
#include "core/sight/tin_index.h"

namespace scarp {

/// Decides whether a pixel that differs between two pictures differs in truth: pictures round, and
/// a difference of a hair at the edge of a ridge is nobody's fault.
///
/// The ray through the pixel's centre is followed to what the whole picture shows there. Its end is
/// that place on the lattice, of ground the least step on or above it (0.24 mm); whether ground
/// stands before it is exact.
class PixelJudge {
 public:
  /// The index must outlive it. Any number of threads may ask it.
  explicit PixelJudge(const TinIndex& index) : whole_(index), index_(&index) {}

  /// From now on the ground has holes.
  /// @param is_there  [triangles] of the index
  void set_present(std::span<const std::uint8_t> is_there);

  /// Whether ground that was left out is seen at a pixel.
  ///
  /// @param eye         of the picture; on the lattice
  /// @param projection  of the picture
  /// @param triangle    that the whole picture shows at the pixel
  /// @param is_drawn    [triangles] whether the other picture had it
  bool is_wrong(const Position& eye, const Projection& projection, const Target& target, int x_px,
                int y_px, TriangleIndex triangle, std::span<const std::uint8_t> is_drawn) const;

  /// Whether a box that was left out is seen at a pixel.
  bool is_box_wrong(const Position& eye, const Projection& projection, const Target& target,
                    int x_px, int y_px, const Bounds& box) const;

 private:
  /// Ground of which triangles are missing.
  struct Rest {
    Tin tin;
    std::vector<TriangleIndex> number;  // [triangles of tin] in the whole
    std::unique_ptr<TinIndex> index;
  };

  const TinIndex& whole_;
  Rest rest_;
  const TinIndex* index_;
};

}  // namespace scarp
