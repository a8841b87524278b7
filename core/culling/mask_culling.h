#pragma once

#include <optional>
#include <vector>

#include "core/culling/box_tree.h"
#include "core/culling/culling_method.h"
#include "core/raster/coverage_pyramid.h"
#include "core/raster/occlusion_map.h"

namespace scarp {

struct MaskOptions {
  int width_px = 320;                         ///< of the mask; its height follows from the camera's
  int margin_px = 6;                          ///< by which it is eroded
  double least_distance_m = 100;              ///< no occluder is nearer
  std::uint32_t occluder_triangles = 15'000;  ///< about so many are drawn
  std::uint32_t leaf_groups = 2;  ///< nodes with fewer are not looked into once partly visible
  double sharp_turn_rad = 0.1;    ///< after which the mask is made anew
};

/// How far an eye may move, in any direction, before what lies at a depth of distance_m or more
/// moves by more than margin_px in a picture: all across it, not only at its middle.
///
/// @param half_angle_rad  half the angle that the picture's size takes
/// Side: never too far. Source: own, in place of equation (1) of Wang et al. 2001, which divides
///   by the tangent where it has to multiply.
double ball_of_margin_m(double margin_px, double distance_m, double half_angle_rad, double size_px);

/// Every pixel takes the farthest of those within margin_px of it, and is uncovered where one of
/// them is. What lies beyond the picture counts as covered: it is not seen.
/// Cost: O(pixels).
void erode(OcclusionMap& map, int margin_px);

/// Method mask: at critical frames chosen occluders are drawn to a mask, which is eroded by a
/// margin; what it hides is stamped with the distance that the margin pays for, and left out until
/// the eye has travelled so far. Critical is a frame at which a stamp runs out, or the view has
/// turned sharply. Occluders are nodes of the kd-tree with the least product of distance and
/// coverage of what they are before. Wang, Agarwal and Har-Peled 2001.
///
/// Side: at critical frames, what is left out is hidden in every picture from this camera. Between
/// them not for certain: an eroded union is not the union of eroded occluders, and gaps that open
/// between two of them are overlooked.
/// Requires Camera::shot. Keeps references; one thread at a time.
class MaskCulling : public CullingMethod {
 public:
  MaskCulling(const Tin& tin, const GroupBatches& batches, const BoxTree& tree,
              const MaskOptions& options = {});

  std::string_view name() const override { return "mask"; }
  CullingAnswer visible(const Camera& camera) override;

  /// Frames at which a mask was made.
  std::uint64_t critical_frames() const { return critical_frames_; }

 private:
  void choose_occluders(const Projection& projection, const Position& eye);
  void mark(const Projection& projection, std::uint32_t node, double stamp_m);
  void make_mask(const Camera& camera, const Projection& projection);

  const GroupBatches& batches_;
  const BoxTree& tree_;
  const MaskOptions options_;
  OcclusionMapper mapper_;
  OcclusionMap map_;
  CoveragePyramid pyramid_;
  std::vector<TriangleIndex> occluders_;
  std::vector<double> stamp_m_;  // [nodes] hidden until so much has been travelled
  std::optional<Camera> last_, critical_;
  double travelled_m_ = 0, critical_until_m_ = 0;
  std::uint64_t critical_frames_ = 0;
};

}  // namespace scarp
