#include "core/culling/query_culling.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/culling/box_tree.h"
#include "core/culling/image_culling.h"

namespace scarp {
namespace {

/// The projection of a small picture of what a shot shows, with pixels of nearly the same shape.
Target small_target(const Shot& shot, int width_px, bool with_objects) {
  const int height_px = std::max(1, width_px * shot.height_px / shot.width_px);
  return with_objects ? empty_target(width_px, height_px) : empty_depth_target(width_px, height_px);
}

/// Pixels of a box's rectangle that nothing hides from its nearest depth.
std::uint32_t shown_pixels(const Target& target, const Projection& projection, const Bounds& box) {
  constexpr std::uint32_t kMany = 1U << 30;
  ScreenBox at;
  if (!place_on_screen(projection, box, target.width_px, target.height_px, at)) return kMany;
  const auto pixel = [](double px, int size) {
    return static_cast<int>(std::clamp(px, 0.0, static_cast<double>(size - 1)));
  };
  std::uint32_t shown = 0;
  for (int y = pixel(at.top, target.height_px); y <= pixel(at.bottom, target.height_px); ++y)
    for (int x = pixel(at.left, target.width_px); x <= pixel(at.right, target.width_px); ++x)
      shown += static_cast<double>(target.depth[target.index(x, y)]) <= at.nearest;
  return shown;
}

}  // namespace

QueryCulling::QueryCulling(const GroupBatches& batches, const CoarseBatches& coarse, QueryUse use,
                           const QueryOptions& options)
    : batches_(batches),
      coarse_(coarse),
      use_(use),
      options_(options),
      pixels_(batches.groups(), 0),
      is_known_(batches.groups(), 0) {
  assert(coarse.levels() == 2);
}

void QueryCulling::count_pixels(const Camera& camera, std::span<const GroupIndex> groups) {
  const Shot& shot = *camera.shot;
  drawing_ = {};
  for (const GroupIndex g : groups) {
    const Bounds& box = batches_.box(g);
    const double distance_m = std::sqrt(square_distance_m2(camera.eye, box));
    const double size_m = std::sqrt(square_distance_m2(box.low, {box.high, box.high}));
    if (distance_m < options_.near_sizes * size_m) {
      batches_.add_to(g, drawing_);
      std::fill(drawing_.objects.end() - static_cast<std::ptrdiff_t>(batches_.triangles(g).size()),
                drawing_.objects.end(), g);
    } else {
      coarse_.add_to(distance_m < options_.far_sizes * size_m ? 0 : 1, g, drawing_);
    }
  }
  Target target = small_target(shot, options_.width_px, true);
  rasterise(target,
            project_all(look_at(shot.view, shot.width_px, shot.height_px), drawing_.vertices),
            drawing_.triangles, drawing_.objects);
  std::fill(pixels_.begin(), pixels_.end(), 0);
  std::fill(is_known_.begin(), is_known_.end(), 0);
  for (const std::uint32_t object : target.object)
    if (object != kNone) ++pixels_[object];
  for (const GroupIndex g : groups) is_known_[g] = 1;
}

CullingAnswer QueryCulling::visible(const Camera& camera) {
  assert(camera.shot);
  const Shot& shot = *camera.shot;
  const Frustum frustum(look_at(shot.view, shot.width_px, shot.height_px));
  std::vector<GroupIndex> in_view;
  for (GroupIndex g = 0; g < batches_.groups(); ++g)
    if (frustum.may_show(batches_.box(g))) in_view.push_back(g);
  CullingAnswer answer;
  answer.nodes_tested = batches_.groups();
  const auto take_seen = [&] {
    for (const GroupIndex g : in_view)
      if (!is_known_[g] || pixels_[g] >= options_.threshold_px) answer.visible_groups.push_back(g);
  };
  if (use_ == QueryUse::kNextFrame) take_seen();
  count_pixels(camera, in_view);
  if (use_ == QueryUse::kSameFrame) take_seen();
  return answer;
}

StopAndWaitCulling::StopAndWaitCulling(const GroupBatches& batches, const QueryOptions& options)
    : batches_(batches), options_(options) {}

CullingAnswer StopAndWaitCulling::visible(const Camera& camera) {
  assert(camera.shot);
  const Shot& shot = *camera.shot;
  const Projection projection = look_at(shot.view, shot.width_px, shot.height_px);
  NearGroups near;
  near.find(batches_, Frustum(projection), camera.eye, 0);
  Target target = small_target(shot, options_.width_px, false);
  CullingAnswer answer;
  GroupBatches::Drawing drawing;
  for (const GroupIndex g : near.all()) {
    ++answer.nodes_tested;
    if (shown_pixels(target, projection, batches_.box(g)) < options_.threshold_px) continue;
    answer.visible_groups.push_back(g);
    drawing = {};
    batches_.add_to(g, drawing);
    rasterise(target, project_all(projection, drawing.vertices), drawing.triangles);
  }
  std::sort(answer.visible_groups.begin(), answer.visible_groups.end());
  return answer;
}

}  // namespace scarp
