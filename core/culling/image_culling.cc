#include "core/culling/image_culling.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>

#include "core/culling/box_tree.h"
#include "core/raster/raster_kernels.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Boxes are this much larger on the screen and nearer than they are: rounding, and corners that
/// are drawn up to half a subpixel of the finest picture aside.
constexpr double kBoxMarginPx = kEdgeMarginPx;
constexpr double kBoxDepthMargin = 0x1p-18;  // relative

int height_for(const Shot& shot, int width_px) {
  return std::max(1, width_px * shot.height_px / shot.width_px);
}

/// The pixels that a box may show in, clipped to the picture, and its nearest depth.
/// @return whether it lies beyond the near plane
bool pixels_of(const Bounds& box, const Projection& projection, const CoveragePyramid& pyramid,
               PixelBox& pixels, float& nearest) {
  ScreenBox on_screen;
  if (!place_on_screen(projection, box, pyramid.width_px(), pyramid.height_px(), on_screen))
    return false;
  const auto pixel = [](double px, int size) {
    return static_cast<int>(std::clamp(std::floor(px), 0.0, static_cast<double>(size - 1)));
  };
  pixels = {pixel(on_screen.left - kBoxMarginPx, pyramid.width_px()),
            pixel(on_screen.top - kBoxMarginPx, pyramid.height_px()),
            pixel(on_screen.right + kBoxMarginPx, pyramid.width_px()),
            pixel(on_screen.bottom + kBoxMarginPx, pyramid.height_px())};
  nearest = static_cast<float>(on_screen.nearest * (1 + kBoxDepthMargin));
  return true;
}

/// Groups that one thread tests at a time.
constexpr std::size_t kTestChunk = 64;

bool is_there(std::span<const std::uint8_t> present, GroupIndex group) {
  return present.empty() || present[group] != 0;
}

/// Boxes that are scanned in one pass, a bit of a pixel each.
constexpr std::size_t kPassBoxes = 32;

}  // namespace

bool is_covered(const CoveragePyramid& pyramid, const Projection& projection, const Bounds& box,
                float opacity) {
  PixelBox pixels;
  float nearest;
  return pixels_of(box, projection, pyramid, pixels, nearest) &&
         pyramid.covers(pixels, nearest, opacity);
}

void NearGroups::find(const GroupBatches& batches, const Frustum& frustum, const Position& eye,
                      std::uint32_t occluder_triangles, double occluder_share,
                      std::span<const std::uint8_t> present) {
  by_distance_.clear();
  for (GroupIndex g = 0; g < batches.groups(); ++g)
    if (is_there(present, g) && frustum.may_show(batches.box(g)))
      by_distance_.emplace_back(square_distance_m2(eye, batches.box(g)), g);
  std::sort(by_distance_.begin(), by_distance_.end());
  groups_.clear();
  // Orphans are few and fill the gaps between the groups.
  const auto orphans = batches.triangles(batches.groups());
  occluders_.assign(orphans.begin(), orphans.end());
  occluder_groups_ = 0;
  double most = 0;
  for (const auto& [distance, group] : by_distance_)
    most += static_cast<double>(batches.triangles(group).size());
  most = std::min(occluder_share * most, static_cast<double>(occluder_triangles));
  std::size_t drawn = 0;
  bool is_full = false;
  for (const auto& [distance, group] : by_distance_) {
    groups_.push_back(group);
    const auto triangles = batches.triangles(group);
    is_full |= static_cast<double>(drawn + triangles.size()) > most;
    if (is_full) continue;
    drawn += triangles.size();
    ++occluder_groups_;
    occluders_.insert(occluders_.end(), triangles.begin(), triangles.end());
  }
}

// ---- what they share

CullingAnswer ImageCulling::visible(const Camera& camera) {
  assert(camera.shot);
  // Ratios of the map and of the picture differ by its rounded height: the projection is the
  // picture's, so that the map covers exactly what is seen.
  projection_ = look_at(camera.shot->view, camera.shot->width_px, camera.shot->height_px);
  height_px_ = height_for(*camera.shot, options_.width_px);
  eye_ = camera.eye;
  near_.find(batches_, Frustum(projection_), camera.eye, options_.occluder_triangles,
             options_.occluder_share, is_present_);
  draw_occluders();
  // Occluders are tested as all others: a box is nearer than what it holds, so that nothing is left
  // out for what it hides itself.
  is_covered_.assign(near_.all().size(), 0);
  test(near_.all(), is_covered_);
  CullingAnswer answer;
  for (std::size_t i = 0; i < is_covered_.size(); ++i)
    if (!is_covered_[i]) answer.visible_groups.push_back(near_.all()[i]);
  std::sort(answer.visible_groups.begin(), answer.visible_groups.end());
  answer.nodes_tested = is_covered_.size();
  return answer;
}

bool ImageCulling::may_show(const Bounds& box) {
  return Frustum(projection_).may_show(box) && !covered(box);
}

bool ImageCulling::set_present(std::span<const std::uint8_t> is_present) {
  is_present_.assign(is_present.begin(), is_present.end());
  return true;
}

void ImageCulling::test(std::span<const GroupIndex> groups,
                        std::span<std::uint8_t> is_covered) const {
  parallel_for((groups.size() + kTestChunk - 1) / kTestChunk, [&](std::size_t chunk) {
    const std::size_t end = std::min(groups.size(), (chunk + 1) * kTestChunk);
    for (std::size_t i = chunk * kTestChunk; i < end; ++i)
      is_covered[i] = covered(batches_.box(groups[i]));
  });
}

Target ImageCulling::draw_plainly(GroupBatches::Drawing& drawing,
                                  std::vector<ClipPosition>& clip) const {
  drawing.vertices.clear();
  drawing.triangles.clear();
  drawing.objects.clear();
  for (std::size_t i = 0; i < near_.occluder_groups(); ++i)
    batches_.add_to(near_.all()[i], drawing);
  batches_.add_to(batches_.groups(), drawing);
  Target target = empty_depth_target(options_.width_px, height_px_);
  clip = project_all(projection_, drawing.vertices);
  rasterise(target, clip, drawing.triangles);
  return target;
}

// ---- hzb

void HzbCulling::draw_occluders() {
  map_.width_px = options().width_px;
  map_.height_px = height_px();
  mapper_.draw(projection(), near().occluders(), map_);
  pyramid_.build(map_.width_px, map_.height_px, map_.depth, options().block);
}

bool HzbCulling::covered(const Bounds& box) const {
  return is_covered(pyramid_, projection(), box, 1);
}

// ---- hom and hybrid

void HomCulling::draw_occluders() {
  const Target target = draw_plainly(drawing_, clip_);
  pyramid_.build(target.width_px, target.height_px, target.depth, options().block);
  if (depth_ == DepthTest::kEstimate) estimate_depths(clip_);
}

void HomCulling::estimate_depths(std::span<const ClipPosition> clip) {
  cell_columns_ = (options().width_px + kEstimateCellPx - 1) / kEstimateCellPx;
  cell_rows_ = (height_px() + kEstimateCellPx - 1) / kEstimateCellPx;
  farthest_.assign(static_cast<std::size_t>(cell_columns_ * cell_rows_), HUGE_VALF);
  for (const auto& triangle : drawing_.triangles) {
    float depth = HUGE_VALF;
    double left = HUGE_VAL, right = -HUGE_VAL, top = HUGE_VAL, bottom = -HUGE_VAL;
    bool is_whole = true;
    for (const VertexIndex v : triangle) {
      const ClipPosition& p = clip[v];
      if (!(p.w > 0) || p.z > p.w) {
        is_whole = false;  // cut by the near plane: it may reach anywhere
        continue;
      }
      depth = std::min(depth, static_cast<float>(p.z / p.w));
      const double x = (p.x / p.w + 1) * options().width_px / 2 / kEstimateCellPx;
      const double y = (1 - p.y / p.w) * height_px() / 2 / kEstimateCellPx;
      left = std::min(left, x), right = std::max(right, x);
      top = std::min(top, y), bottom = std::max(bottom, y);
    }
    if (depth == HUGE_VALF) continue;
    const auto cell = [&](double at, int size, int otherwise) {
      return is_whole ? static_cast<int>(std::clamp(at, -1.0, static_cast<double>(size)))
                      : otherwise;
    };
    const int last_x = std::min(cell(right, cell_columns_, cell_columns_), cell_columns_ - 1);
    const int last_y = std::min(cell(bottom, cell_rows_, cell_rows_), cell_rows_ - 1);
    for (int y = std::max(0, cell(top, cell_rows_, 0)); y <= last_y; ++y)
      for (int x = std::max(0, cell(left, cell_columns_, 0)); x <= last_x; ++x) {
        float& there = farthest_[static_cast<std::size_t>(y * cell_columns_ + x)];
        there = std::min(there, depth);
      }
  }
}

bool HomCulling::covered(const Bounds& box) const {
  if (depth_ == DepthTest::kPyramid)
    return is_covered(pyramid_, projection(), box, options().opacity);
  PixelBox pixels;
  float nearest;
  if (!pixels_of(box, projection(), pyramid_, pixels, nearest)) return false;
  if (!pyramid_.overlaps(pixels, options().opacity)) return false;
  for (int y = pixels.top / kEstimateCellPx; y <= pixels.bottom / kEstimateCellPx; ++y)
    for (int x = pixels.left / kEstimateCellPx; x <= pixels.right / kEstimateCellPx; ++x)
      if (farthest_[static_cast<std::size_t>(y * cell_columns_ + x)] <= nearest) return false;
  return true;
}

// ---- volume-scan

void VolumeScanCulling::draw_occluders() {
  target_ = draw_plainly(drawing_, clip_);
}

bool VolumeScanCulling::covered(const Bounds& box) const {
  std::uint32_t shown_px = 0;
  scan({&box, 1}, {&shown_px, 1});
  return shown_px < options().threshold_px;
}

void VolumeScanCulling::test(std::span<const GroupIndex> groups,
                             std::span<std::uint8_t> is_covered) const {
  parallel_for((groups.size() + kPassBoxes - 1) / kPassBoxes, [&](std::size_t pass) {
    const auto some =
        groups.subspan(pass * kPassBoxes, std::min(kPassBoxes, groups.size() - pass * kPassBoxes));
    std::array<Bounds, kPassBoxes> boxes;
    std::array<std::uint32_t, kPassBoxes> shown_px{};
    for (std::size_t i = 0; i < some.size(); ++i) boxes[i] = batches().box(some[i]);
    scan(std::span(boxes).first(some.size()), shown_px);
    for (std::size_t i = 0; i < some.size(); ++i)
      is_covered[pass * kPassBoxes + i] = shown_px[i] < options().threshold_px;
  });
}

void VolumeScanCulling::scan(std::span<const Bounds> boxes,
                             std::span<std::uint32_t> shown_px) const {
  constexpr std::uint32_t kMany = 1U << 30;
  // Corners by bits: 1 for high x, 2 for high y, 4 for high z; faces with their outward side.
  constexpr std::size_t kFaces[6][4] = {{0, 2, 6, 4}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                        {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 5, 7, 6}};
  const ScreenMap map(target_.width_px, target_.height_px);
  const PixelTile all{0,
                      0,
                      target_.width_px,
                      target_.height_px,
                      static_cast<std::size_t>(target_.width_px),
                      nullptr,
                      nullptr};
  std::vector<std::uint32_t> bits(target_.depth.size(), 0);
  int first_row = target_.height_px, end_row = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Bounds& box = boxes[i];
    std::array<ScreenCorner, 8> corners;
    bool is_cut = false;
    for (std::size_t c = 0; c < 8 && !is_cut; ++c) {
      const ClipPosition p = projection().project({(c & 1) != 0 ? box.high.x_m : box.low.x_m,
                                                   (c & 2) != 0 ? box.high.y_m : box.low.y_m,
                                                   (c & 4) != 0 ? box.high.z_m : box.low.z_m});
      is_cut = !(p.w > 0) || p.z > p.w || std::abs(p.x) > map.guard_x * p.w ||
               std::abs(p.y) > map.guard_y * p.w;
      if (!is_cut) corners[c] = place_corner(map, p);
    }
    if (is_cut) {
      shown_px[i] = kMany;
      continue;
    }
    const bool is_front[6] = {eye().x_m<box.low.x_m, eye().x_m> box.high.x_m,
                              eye().y_m<box.low.y_m, eye().y_m> box.high.y_m,
                              eye().z_m<box.low.z_m, eye().z_m> box.high.z_m};
    for (std::size_t f = 0; f < 6; ++f) {
      if (!is_front[f]) continue;
      for (const std::size_t k : {std::size_t{1}, std::size_t{2}}) {
        ScreenTriangle t;
        if (!set_up(corners[kFaces[f][0]], corners[kFaces[f][k]], corners[kFaces[f][k + 1]], 0, t))
          continue;
        RowWalk walk(t, all);
        for (int row, begin, end; walk.next(row, begin, end);) {
          first_row = std::min(first_row, row);
          end_row = std::max(end_row, row + 1);
          for (int x = begin; x < end; ++x) {
            const std::size_t at = target_.index(x, row);
            if (t.depth_at(x, row) * (1 + static_cast<float>(kBoxDepthMargin)) >= target_.depth[at])
              bits[at] |= 1U << i;
          }
        }
      }
    }
  }
  for (int y = first_row; y < end_row; ++y)
    for (std::size_t at = target_.index(0, y); at < target_.index(0, y + 1); ++at)
      for (std::uint32_t left = bits[at]; left != 0; left &= left - 1)
        ++shown_px[static_cast<std::size_t>(std::countr_zero(left))];
}

}  // namespace scarp
