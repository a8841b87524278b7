#include "core/culling/image_culling.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/culling/box_tree.h"
#include "core/raster/rasterise.h"

namespace scarp {
namespace {

/// Boxes are this much larger on the screen and nearer than they are: rounding, and corners that
/// are drawn up to half a subpixel of the finest picture aside.
constexpr double kBoxMarginPx = kEdgeMarginPx;
constexpr double kBoxDepthMargin = 0x1p-18;  // relative

int height_for(const Shot& shot, int width_px) {
  return std::max(1, width_px * shot.height_px / shot.width_px);
}

/// What the pyramid does not cover, in ascending order. Occluders are tested as all others: a box
/// is nearer than what it holds, so that nothing is left out for what it hides itself.
CullingAnswer test_all(const GroupBatches& batches, std::span<const GroupIndex> groups,
                       const CoveragePyramid& pyramid, const Projection& projection,
                       float opacity) {
  CullingAnswer answer;
  for (const GroupIndex g : groups)
    if (!is_covered(pyramid, projection, batches.box(g), opacity))
      answer.visible_groups.push_back(g);
  std::sort(answer.visible_groups.begin(), answer.visible_groups.end());
  answer.nodes_tested = groups.size();
  return answer;
}

}  // namespace

bool is_covered(const CoveragePyramid& pyramid, const Projection& projection, const Bounds& box,
                float opacity) {
  ScreenBox on_screen;
  if (!place_on_screen(projection, box, pyramid.width_px(), pyramid.height_px(), on_screen))
    return false;
  const auto pixel = [](double px, int size) {
    return static_cast<int>(std::clamp(std::floor(px), 0.0, static_cast<double>(size - 1)));
  };
  const PixelBox pixels{pixel(on_screen.left - kBoxMarginPx, pyramid.width_px()),
                        pixel(on_screen.top - kBoxMarginPx, pyramid.height_px()),
                        pixel(on_screen.right + kBoxMarginPx, pyramid.width_px()),
                        pixel(on_screen.bottom + kBoxMarginPx, pyramid.height_px())};
  const auto nearest = static_cast<float>(on_screen.nearest * (1 + kBoxDepthMargin));
  return pyramid.covers(pixels, nearest, opacity);
}

void NearGroups::find(const GroupBatches& batches, const Frustum& frustum, const Position& eye,
                      std::uint32_t occluder_triangles) {
  by_distance_.clear();
  for (GroupIndex g = 0; g < batches.groups(); ++g)
    if (frustum.may_show(batches.box(g)))
      by_distance_.emplace_back(square_distance_m2(eye, batches.box(g)), g);
  std::sort(by_distance_.begin(), by_distance_.end());
  groups_.clear();
  // Orphans are few and fill the gaps between the groups.
  const auto orphans = batches.triangles(batches.groups());
  occluders_.assign(orphans.begin(), orphans.end());
  occluder_groups_ = 0;
  std::size_t drawn = 0;
  bool is_full = false;
  for (const auto& [distance, group] : by_distance_) {
    groups_.push_back(group);
    const auto triangles = batches.triangles(group);
    is_full |= drawn + triangles.size() > occluder_triangles;
    if (is_full) continue;
    drawn += triangles.size();
    ++occluder_groups_;
    occluders_.insert(occluders_.end(), triangles.begin(), triangles.end());
  }
}

HzbCulling::HzbCulling(const Tin& tin, const GroupBatches& batches,
                       const ImageCullingOptions& options)
    : batches_(batches), options_(options), mapper_(tin) {}

CullingAnswer HzbCulling::visible(const Camera& camera) {
  assert(camera.shot);
  // Ratios of the map and of the picture differ by its rounded height: the projection is the
  // picture's, so that the map covers exactly what is seen.
  const Projection projection =
      look_at(camera.shot->view, camera.shot->width_px, camera.shot->height_px);
  near_.find(batches_, Frustum(projection), camera.eye, options_.occluder_triangles);
  map_.width_px = options_.width_px;
  map_.height_px = height_for(*camera.shot, options_.width_px);
  mapper_.draw(projection, near_.occluders(), map_);
  pyramid_.build(map_.width_px, map_.height_px, map_.depth);
  return test_all(batches_, near_.all(), pyramid_, projection, 1);
}

HomCulling::HomCulling(const GroupBatches& batches, const ImageCullingOptions& options)
    : batches_(batches), options_(options) {}

CullingAnswer HomCulling::visible(const Camera& camera) {
  assert(camera.shot);
  const Projection projection =
      look_at(camera.shot->view, camera.shot->width_px, camera.shot->height_px);
  near_.find(batches_, Frustum(projection), camera.eye, options_.occluder_triangles);
  drawing_.vertices.clear();
  drawing_.triangles.clear();
  drawing_.objects.clear();
  for (std::size_t i = 0; i < near_.occluder_groups(); ++i)
    batches_.add_to(near_.all()[i], drawing_);
  batches_.add_to(batches_.groups(), drawing_);
  Target target =
      empty_depth_target(options_.width_px, height_for(*camera.shot, options_.width_px));
  rasterise(target, project_all(projection, drawing_.vertices), drawing_.triangles);
  pyramid_.build(target.width_px, target.height_px, target.depth);
  return test_all(batches_, near_.all(), pyramid_, projection, options_.opacity);
}

}  // namespace scarp
