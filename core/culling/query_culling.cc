#include "core/culling/query_culling.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/culling/box_tree.h"
#include "core/culling/image_culling.h"

namespace scarp {
namespace {

/// A small picture of what a shot shows, with pixels of nearly the same shape.
Target small_target(const Shot& shot, int width_px, bool with_objects) {
  const int height_px = std::max(1, width_px * shot.height_px / shot.width_px);
  return with_objects ? empty_target(width_px, height_px) : empty_depth_target(width_px, height_px);
}

bool is_there(std::span<const std::uint8_t> present, GroupIndex group) {
  return present.empty() || present[group] != 0;
}

double diagonal_m(const Bounds& box) {
  return std::sqrt(square_distance_m2(box.low, {box.high, box.high}));
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
  assert(coarse.levels() == std::size(kQueryShares));
}

void QueryCulling::add_coarsely(GroupIndex g, const Position& eye) {
  const Bounds& box = batches_.box(g);
  const double distance_m = std::sqrt(square_distance_m2(eye, box));
  const double size_m = diagonal_m(box);
  if (distance_m < options_.near_sizes * size_m) {
    batches_.add_to(g, drawing_);
    std::fill(drawing_.objects.end() - static_cast<std::ptrdiff_t>(batches_.triangles(g).size()),
              drawing_.objects.end(), g);
  } else {
    const std::size_t coarsest = coarse_.levels() - 1;
    coarse_.add_to(distance_m < options_.far_sizes * size_m ? coarsest - 1 : coarsest, g, drawing_);
  }
}

void QueryCulling::count_pixels(const Camera& camera, std::span<const GroupIndex> groups) {
  drawing_ = {};
  for (const GroupIndex g : groups) add_coarsely(g, camera.eye);
  target_ = small_target(*camera.shot, options_.width_px, true);
  rasterise(target_, project_all(projection_, drawing_.vertices), drawing_.triangles,
            drawing_.objects);
  for (const std::uint32_t object : target_.object)
    if (object != kNone) ++pixels_[object];
}

void QueryCulling::count_boxes(const Camera& camera, std::span<const GroupIndex> groups,
                               std::span<const GroupIndex> drawn) {
  drawing_ = {};
  auto next = drawn.begin();
  for (const GroupIndex g : groups) {
    if (next != drawn.end() && *next == g) {
      batches_.add_to(g, drawing_);
      ++next;
    } else {
      add_coarsely(g, camera.eye);
    }
  }
  batches_.add_to(batches_.groups(), drawing_);
  target_ = small_target(*camera.shot, options_.width_px, false);
  rasterise(target_, project_all(projection_, drawing_.vertices), drawing_.triangles);
  for (const GroupIndex g : groups)
    pixels_[g] = shown_pixels(target_, projection_, batches_.box(g));
}

CullingAnswer QueryCulling::visible(const Camera& camera) {
  assert(camera.shot);
  const Shot& shot = *camera.shot;
  projection_ = look_at(shot.view, shot.width_px, shot.height_px);
  const Frustum frustum(projection_);
  std::vector<GroupIndex> in_view;
  for (GroupIndex g = 0; g < batches_.groups(); ++g)
    if (is_there(is_present_, g) && frustum.may_show(batches_.box(g))) in_view.push_back(g);
  CullingAnswer answer;
  answer.nodes_tested = batches_.groups();
  const auto take_seen = [&] {
    for (const GroupIndex g : in_view)
      if (!is_known_[g] || pixels_[g] >= options_.threshold_px) answer.visible_groups.push_back(g);
  };
  const auto forget = [&] {
    std::fill(pixels_.begin(), pixels_.end(), 0);
    std::fill(is_known_.begin(), is_known_.end(), 0);
  };
  const auto remember = [&] {
    for (const GroupIndex g : in_view) is_known_[g] = 1;
  };
  if (use_ == QueryUse::kSameFrame) {
    forget();
    count_pixels(camera, in_view);
    remember();
    take_seen();
  } else {
    take_seen();
    forget();
    count_boxes(camera, in_view, answer.visible_groups);
    remember();
  }
  return answer;
}

bool QueryCulling::may_show(const Bounds& box) {
  return Frustum(projection_).may_show(box) &&
         shown_pixels(target_, projection_, box) >= options_.threshold_px;
}

bool QueryCulling::set_present(std::span<const std::uint8_t> is_present) {
  is_present_.assign(is_present.begin(), is_present.end());
  return true;
}

StopAndWaitCulling::StopAndWaitCulling(const GroupBatches& batches, const QueryOptions& options)
    : batches_(batches), options_(options) {}

CullingAnswer StopAndWaitCulling::visible(const Camera& camera) {
  assert(camera.shot);
  const Shot& shot = *camera.shot;
  projection_ = look_at(shot.view, shot.width_px, shot.height_px);
  NearGroups near;
  near.find(batches_, Frustum(projection_), camera.eye, 0, 0, is_present_);
  target_ = small_target(shot, options_.width_px, false);
  CullingAnswer answer;
  GroupBatches::Drawing drawing;
  for (const GroupIndex g : near.all()) {
    ++answer.nodes_tested;
    if (shown_pixels(target_, projection_, batches_.box(g)) < options_.threshold_px) continue;
    answer.visible_groups.push_back(g);
    drawing = {};
    batches_.add_to(g, drawing);
    rasterise(target_, project_all(projection_, drawing.vertices), drawing.triangles);
  }
  std::sort(answer.visible_groups.begin(), answer.visible_groups.end());
  return answer;
}

bool StopAndWaitCulling::may_show(const Bounds& box) {
  return Frustum(projection_).may_show(box) &&
         shown_pixels(target_, projection_, box) >= options_.threshold_px;
}

bool StopAndWaitCulling::set_present(std::span<const std::uint8_t> is_present) {
  is_present_.assign(is_present.begin(), is_present.end());
  return true;
}

std::vector<std::uint8_t> levels_within(const GroupBatches& batches, const CoarseBatches& coarse,
                                        const Position& eye, std::span<const GroupIndex> groups,
                                        std::size_t draw_levels, std::uint64_t budget_triangles) {
  assert(draw_levels >= 1 && draw_levels <= coarse.levels() + 1);
  const auto triangles_at = [&](std::size_t level, GroupIndex g) -> std::uint64_t {
    return level == 0 ? batches.triangles(g).size() : coarse.triangles(level - 1, g);
  };
  std::vector<std::uint8_t> levels(groups.size(), static_cast<std::uint8_t>(draw_levels - 1));
  std::uint64_t total = 0;
  // Size on the screen; a group that holds the eye is larger than any other.
  std::vector<std::pair<double, std::size_t>> by_size;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const Bounds& box = batches.box(groups[i]);
    by_size.emplace_back(-diagonal_m(box) / std::sqrt(square_distance_m2(eye, box)), i);
    total += triangles_at(draw_levels - 1, groups[i]);
  }
  std::sort(by_size.begin(), by_size.end());
  // A level at a time, so that no group is two levels finer than a larger one.
  for (std::size_t level = draw_levels - 1; level-- > 0;)
    for (const auto& [size, i] : by_size) {
      if (levels[i] != level + 1) continue;
      const std::uint64_t before = triangles_at(level + 1, groups[i]);
      const std::uint64_t after = triangles_at(level, groups[i]);
      if (total + after > budget_triangles + before) return levels;
      total = total + after - before;
      levels[i] = static_cast<std::uint8_t>(level);
    }
  return levels;
}

}  // namespace scarp
