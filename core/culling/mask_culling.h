#pragma once

#include <functional>
#include <future>
#include <optional>
#include <vector>

#include "core/culling/box_tree.h"
#include "core/culling/culling_method.h"
#include "core/raster/coverage_pyramid.h"
#include "core/raster/occlusion_map.h"

namespace scarp {

/// How the mask is drawn before it is eroded.
enum class MaskDrawing {
  kConservatively,  ///< pixels that are covered whole, eroded by the margin
  kByCentres,       ///< as pictures are, eroded by the margin and a pixel, as published
};

/// The steps that a mask is made in, and its end; figure 10 of the paper is what each takes.
enum class MaskStep { kChoose, kDraw, kErode, kPyramid, kMarkNodes, kDone };

struct MaskOptions {
  int width_px = 320;                         ///< of the mask; its height follows from the camera's
  int margin_px = 6;                          ///< by which it is eroded
  double least_distance_m = 100;              ///< no occluder is nearer
  std::uint32_t occluder_triangles = 15'000;  ///< about so many are drawn
  std::uint32_t leaf_groups = 2;  ///< nodes with fewer are not looked into once partly visible
  double sharp_turn_rad = 0.1;    ///< after which the mask is made anew
  int block = 2;                  ///< pixels a side that become one of the pyramid's next level
  MaskDrawing drawing = MaskDrawing::kConservatively;
  /// When half of what the margin pays for is used up, the next mask is made by a second thread,
  /// and taken at the frame after: no frame waits for one but those that come as a surprise.
  bool in_background = false;
  /// Called as each step begins; from the second thread where one is used.
  std::function<void(MaskStep)> on_step = {};
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
/// the eye has travelled so far. Critical is a frame at which a stamp runs out, the view has turned
/// sharply, or an occluder was taken away. Groups that come back have no stamp until the next mask.
/// Occluders are nodes of the kd-tree with the least product of distance and coverage of what they
/// are before. Wang, Agarwal and Har-Peled 2001.
///
/// Side: drawn conservatively, at critical frames, what is left out is hidden in every picture from
/// this camera. Between them not for certain: an eroded union is not the union of eroded occluders,
/// and gaps that open between two of them are overlooked. Drawn by centres never for certain.
/// Requires Camera::shot. Keeps references; one thread at a time.
class MaskCulling : public CullingMethod {
 public:
  MaskCulling(const Tin& tin, const GroupBatches& batches, const BoxTree& tree,
              const MaskOptions& options = {});

  std::string_view name() const override {
    return options_.drawing == MaskDrawing::kByCentres ? "mask-plain" : "mask";
  }
  CullingAnswer visible(const Camera& camera) override;
  bool may_show(const Bounds& box) override;
  bool set_present(std::span<const std::uint8_t> is_present) override;

  /// Frames whose camera a mask was made for.
  std::uint64_t critical_frames() const { return critical_frames_; }
  /// Whether the last answer is of a mask made for its very camera.
  bool is_fresh() const { return is_fresh_; }

 private:
  /// A mask and what it says of the tree's nodes.
  struct Mask {
    Camera camera;
    double travelled_m = 0;  ///< when it was asked for
    double until_m = 0;      ///< travelled, when its margin is used up
    Projection projection;
    CoveragePyramid pyramid;
    std::vector<double> stamp_m;            ///< [nodes] hidden until so much has been travelled
    std::vector<std::uint8_t> is_occluder;  ///< [groups] that were drawn
  };

  bool is_there(GroupIndex group) const { return is_present_.empty() || is_present_[group]; }
  std::vector<TriangleIndex> choose_occluders(Mask& mask) const;
  void draw(const std::vector<TriangleIndex>& occluders, const Mask& mask, OcclusionMap& map);
  void mark(Mask& mask, std::uint32_t node) const;
  Mask make_mask(const Camera& camera, double travelled_m);
  void take(Mask mask);
  void take_awaited();
  void unstamp(GroupIndex group);

  const GroupBatches& batches_;
  const BoxTree& tree_;
  const MaskOptions options_;
  OcclusionMapper mapper_;
  std::vector<std::uint32_t> place_;  // [groups] in the order of the tree
  std::vector<std::uint8_t> is_present_;
  std::optional<Mask> mask_;
  std::future<Mask> awaited_;
  std::optional<Camera> last_;
  bool is_awaited_void_ = false;  // the scene has changed since it was asked for
  bool is_fresh_ = false;
  double travelled_m_ = 0;
  std::uint64_t critical_frames_ = 0;
};

}  // namespace scarp
