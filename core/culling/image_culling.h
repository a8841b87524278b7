#pragma once

#include <vector>

#include "core/culling/culling_method.h"
#include "core/culling/group_batches.h"
#include "core/raster/coverage_pyramid.h"
#include "core/raster/occlusion_map.h"
#include "core/raster/rasterise.h"

namespace scarp {

/// How groups are tested against a picture of what is near.
struct ImageCullingOptions {
  int width_px = 320;  ///< of the picture; its height follows from the camera's
  std::uint32_t occluder_triangles = 30'000;  ///< the nearest groups are drawn, up to so many
  /// And no more than this share of the triangles in view: an estimate of depth hides only what is
  /// behind all occluders of a place.
  double occluder_share = 1;
  float opacity = 1;               ///< hom: the covered share of a texel from which it hides
  int block = 2;                   ///< pixels a side that become one of the pyramid's next level
  std::uint32_t threshold_px = 1;  ///< volume-scan: boxes that show fewer pixels are left out
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
  /// @param present  [groups] groups that are there; empty: all
  void find(const GroupBatches& batches, const Frustum& frustum, const Position& eye,
            std::uint32_t occluder_triangles, double occluder_share = 1,
            std::span<const std::uint8_t> present = {});

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

/// What methods that test boxes against a picture of what is near share.
class ImageCulling : public CullingMethod {
 public:
  ImageCulling(const GroupBatches& batches, const ImageCullingOptions& options)
      : batches_(batches), options_(options) {}

  CullingAnswer visible(const Camera& camera) override;
  bool may_show(const Bounds& box) override;
  bool set_present(std::span<const std::uint8_t> is_present) override;

 protected:
  /// Draws the occluders of near(); covered() is asked next, from several threads.
  virtual void draw_occluders() = 0;
  virtual bool covered(const Bounds& box) const = 0;
  /// Asks for many boxes; is_covered[i] of each of the groups.
  virtual void test(std::span<const GroupIndex> groups, std::span<std::uint8_t> is_covered) const;

  const GroupBatches& batches() const { return batches_; }
  const ImageCullingOptions& options() const { return options_; }
  const NearGroups& near() const { return near_; }
  const Projection& projection() const { return projection_; }
  const Position& eye() const { return eye_; }
  int height_px() const { return height_px_; }
  /// Draws the occluders as pictures are: depth by pixel centres.
  /// @param clip[out]  corners of drawing
  Target draw_plainly(GroupBatches::Drawing& drawing, std::vector<ClipPosition>& clip) const;

 private:
  const GroupBatches& batches_;
  const ImageCullingOptions options_;
  NearGroups near_;
  Projection projection_;
  Position eye_;
  int height_px_ = 1;
  std::vector<std::uint8_t> is_present_, is_covered_;
};

/// Method hzb: the nearest groups are drawn to a conservative occlusion map, and every other box
/// is tested against a pyramid of its depths. Baxter 2000, with depths of whole pixels.
///
/// Side: what is left out is hidden in every pixel of every picture from this camera, at any
/// resolution. Requires Camera::shot. Keeps references; one thread at a time.
class HzbCulling : public ImageCulling {
 public:
  HzbCulling(const Tin& tin, const GroupBatches& batches, const ImageCullingOptions& options = {})
      : ImageCulling(batches, options), mapper_(tin) {}

  std::string_view name() const override { return "hzb"; }

 protected:
  void draw_occluders() override;
  bool covered(const Bounds& box) const override;

 private:
  OcclusionMapper mapper_;
  OcclusionMap map_;
  CoveragePyramid pyramid_;
};

/// How far behind what covers a place lies, in hierarchical occlusion maps.
enum class DepthTest {
  kEstimate,  ///< hom: of cells of kEstimateCellPx, the farthest corner of triangles that meet one
  kPyramid,   ///< hybrid: the farthest covered pixel of a texel, from coarse to fine
};
inline constexpr int kEstimateCellPx = 8;

/// Methods hom and hybrid: hierarchical occlusion maps. The same occluders are drawn as pictures
/// are, by pixel centres; a box is left out where the opacity of the map is at least `opacity` from
/// coarse to fine, and what covers it is nearer. Zhang 1997 estimates depths coarsely; Baxter 2000
/// aims at a hybrid, opacity for overlap and a pyramid for depth.
///
/// Side: none; small gaps are overlooked where opacity is below 1, gaps below a pixel always.
/// Requires Camera::shot. Keeps references; one thread at a time.
class HomCulling : public ImageCulling {
 public:
  HomCulling(const GroupBatches& batches, DepthTest depth, const ImageCullingOptions& options)
      : ImageCulling(batches, options), depth_(depth) {}

  std::string_view name() const override {
    return depth_ == DepthTest::kPyramid ? "hybrid" : "hom";
  }

 protected:
  void draw_occluders() override;
  bool covered(const Bounds& box) const override;

 private:
  void estimate_depths(std::span<const ClipPosition> clip);

  const DepthTest depth_;
  GroupBatches::Drawing drawing_;
  std::vector<ClipPosition> clip_;
  CoveragePyramid pyramid_;
  int cell_columns_ = 0, cell_rows_ = 0;
  std::vector<float> farthest_;  // [cells], HUGE_VALF where nothing is
};

/// Method volume-scan: no pyramid; the front of each box itself is scanned at the finest level, not
/// the rectangle around it, and boxes that show fewer pixels than a threshold are left out. 32
/// boxes go in a pass, a bit of every pixel each, that is counted at its end. Baxter 2000.
///
/// Side: none: pixels are asked at their centres, and what is smaller than one falls between.
/// Requires Camera::shot. Keeps references; one thread at a time.
class VolumeScanCulling : public ImageCulling {
 public:
  VolumeScanCulling(const GroupBatches& batches, const ImageCullingOptions& options = {})
      : ImageCulling(batches, options) {}

  std::string_view name() const override { return "volume-scan"; }

 protected:
  void draw_occluders() override;
  bool covered(const Bounds& box) const override;
  void test(std::span<const GroupIndex> groups, std::span<std::uint8_t> is_covered) const override;

 private:
  void scan(std::span<const Bounds> boxes, std::span<std::uint32_t> shown_px) const;

  GroupBatches::Drawing drawing_;
  std::vector<ClipPosition> clip_;
  Target target_;
};

}  // namespace scarp
