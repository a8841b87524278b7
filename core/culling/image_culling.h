#pragma once

#include <vector>

#include "core/culling/culling_method.h"
#include "core/culling/group_batches.h"
#include "core/raster/coverage_pyramid.h"
#include "core/raster/occlusion_map.h"

namespace scarp {

/// How groups are tested against a picture of what is near.
struct ImageCullingOptions {
  int width_px = 320;  ///< of the picture; its height follows from the camera's
  std::uint32_t occluder_triangles = 30'000;  ///< the nearest groups are drawn, up to so many
  float opacity = 1;  ///< hom: the covered share of a texel from which it hides
};

/// Whether a box is beyond the near plane and covered in the picture of a pyramid.
/// Side: with opacity 1 and a conservative map, what the box holds is hidden in every picture.
bool is_covered(const CoveragePyramid& pyramid, const Projection& projection, const Bounds& box,
                float opacity);

/// The groups of a picture, nearest boxes first, and those of them that are drawn to hide others.
class NearGroups {
 public:
  /// @param eye      of the picture
  /// @param frustum  groups beside it are left out
  void find(const GroupBatches& batches, const Frustum& frustum, const Position& eye,
            std::uint32_t occluder_triangles);

  std::span<const GroupIndex> all() const { return groups_; }
  /// With the orphans.
  std::span<const TriangleIndex> occluders() const { return occluders_; }
  std::size_t occluder_groups() const { return occluder_groups_; }

 private:
  std::vector<std::pair<double, GroupIndex>> by_distance_;
  std::vector<GroupIndex> groups_;
  std::vector<TriangleIndex> occluders_;
  std::size_t occluder_groups_ = 0;
};

/// Method hzb: the nearest groups are drawn to a conservative occlusion map, and every other box
/// is tested against a pyramid of its depths. Baxter 2000, with depths of whole pixels.
///
/// Side: what is left out is hidden in every pixel of every picture from this camera, at any
/// resolution. Requires Camera::shot. Keeps references; one thread at a time.
class HzbCulling : public CullingMethod {
 public:
  HzbCulling(const Tin& tin, const GroupBatches& batches, const ImageCullingOptions& options = {});

  std::string_view name() const override { return "hzb"; }
  CullingAnswer visible(const Camera& camera) override;

 private:
  const GroupBatches& batches_;
  const ImageCullingOptions options_;
  OcclusionMapper mapper_;
  NearGroups near_;
  OcclusionMap map_;
  CoveragePyramid pyramid_;
};

/// Method hom: hierarchical occlusion maps. The same occluders are drawn as pictures are, by pixel
/// centres; a box is left out where the opacity of the map is at least `opacity` from coarse to
/// fine, and what covers it is nearer. Baxter 2000 (after Zhang 1998); the estimate of depth is
/// the farthest occluder of a texel.
///
/// Side: none; small gaps are overlooked where opacity is below 1, gaps below a pixel always.
/// Requires Camera::shot. Keeps references; one thread at a time.
class HomCulling : public CullingMethod {
 public:
  HomCulling(const GroupBatches& batches, const ImageCullingOptions& options);

  std::string_view name() const override { return "hom"; }
  CullingAnswer visible(const Camera& camera) override;

 private:
  const GroupBatches& batches_;
  const ImageCullingOptions options_;
  NearGroups near_;
  GroupBatches::Drawing drawing_;
  CoveragePyramid pyramid_;
};

}  // namespace scarp
