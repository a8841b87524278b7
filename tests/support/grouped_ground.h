#pragma once

#include <cstdint>
#include <span>

#include "core/culling/camera.h"
#include "core/culling/group_batches.h"
#include "core/raster/rasterise.h"

namespace scarp::test {

/// A surface in square groups, for methods that need no regions.
struct GroupedGround {
  Tin tin;
  Groups groups;
};

GroupedGround grouped_by_squares(Tin tin, std::uint32_t group_triangles);

/// Steep hills of 40 x 40 samples in groups of 24 triangles.
GroupedGround grouped_hills(std::uint32_t seed);

/// Some groups and the orphans as a picture of `scale` times the shot's size.
Target picture_of(const GroupBatches& batches, std::span<const GroupIndex> groups, const Shot& shot,
                  int scale = 1);

}  // namespace scarp::test
