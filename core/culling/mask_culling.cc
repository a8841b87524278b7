#include "core/culling/mask_culling.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <queue>

#include "core/culling/image_culling.h"
#include "core/raster/rasterise.h"

namespace scarp {
namespace {

/// Cells of the picture whose coverage guides the choice of occluders.
constexpr int kColumns = 32, kRows = 18;

/// Nodes of at most so many groups are taken as occluders whole.
constexpr std::uint32_t kOccluderGroups = 1;

double dot(const Position& a, const Position& b) {
  return a.x_m * b.x_m + a.y_m * b.y_m + a.z_m * b.z_m;
}

Position between(const Position& from, const Position& to) {
  return {to.x_m - from.x_m, to.y_m - from.y_m, to.z_m - from.z_m};
}

double angle_rad(const View& a, const View& b) {
  const Position u = between(a.eye, a.target), v = between(b.eye, b.target);
  return std::acos(std::clamp(dot(u, v) / std::sqrt(dot(u, u) * dot(v, v)), -1.0, 1.0));
}

/// Coverage of the cells of a picture by what has been chosen.
class CellCoverage {
 public:
  explicit CellCoverage(const Projection& projection) : projection_(projection) {}

  /// The least coverage of three cells: of the box's middle and the ends of a diagonal.
  double least(const Bounds& box) const {
    const Position middle{(box.low.x_m + box.high.x_m) / 2, (box.low.y_m + box.high.y_m) / 2,
                          (box.low.z_m + box.high.z_m) / 2};
    double least = HUGE_VAL;
    for (const Position& p : {middle, box.low, box.high})
      if (const auto cell = cell_of(p)) least = std::min(least, covered_[*cell]);
    return least == HUGE_VAL ? 1 : least;
  }

  void cover(const Bounds& box, std::uint32_t triangles) {
    ScreenBox at;
    if (!place_on_screen(projection_, box, kColumns, kRows, at)) return;
    const auto clamped = [](double px, int size) {
      return static_cast<std::size_t>(std::clamp(px, 0.0, size - 1.0));
    };
    const std::size_t left = clamped(at.left, kColumns), right = clamped(at.right, kColumns);
    const std::size_t top = clamped(at.top, kRows), bottom = clamped(at.bottom, kRows);
    const auto cells = static_cast<double>((right - left + 1) * (bottom - top + 1));
    for (std::size_t y = top; y <= bottom; ++y)
      for (std::size_t x = left; x <= right; ++x) covered_[y * kColumns + x] += triangles / cells;
  }

 private:
  std::optional<std::size_t> cell_of(const Position& p) const {
    const ClipPosition c = projection_.project(p);
    if (!(c.w > 0) || std::abs(c.x) >= c.w || std::abs(c.y) >= c.w) return {};
    return static_cast<std::size_t>((1 - c.y / c.w) * kRows / 2) * kColumns +
           static_cast<std::size_t>((c.x / c.w + 1) * kColumns / 2);
  }

  const Projection& projection_;
  // A cell that nothing covers does not outweigh every distance.
  std::array<double, kColumns* kRows> covered_ = [] {
    std::array<double, kColumns * kRows> ones;
    ones.fill(1);
    return ones;
  }();
};

/// The least of every run of 2 reach + 1 values, as if there were greater ones beyond both ends.
void least_around(const float* values, std::size_t count, std::size_t stride, int reach,
                  std::vector<float>& scratch, float* out) {
  const auto n = static_cast<int>(count);
  scratch.resize(count);
  for (int i = 0; i < n; ++i)
    scratch[static_cast<std::size_t>(i)] = values[static_cast<std::size_t>(i) * stride];
  for (int i = 0; i < n; ++i) {
    float least = HUGE_VALF;
    for (int k = std::max(0, i - reach); k <= std::min(n - 1, i + reach); ++k)
      least = std::min(least, scratch[static_cast<std::size_t>(k)]);
    out[static_cast<std::size_t>(i) * stride] = least;
  }
}

}  // namespace

double ball_of_margin_m(double margin_px, double distance_m, double half_angle_rad,
                        double size_px) {
  // A place at (x, z), z ahead, is drawn at f x / z. From an eye moved by (a, c) it is at
  // f (x - a) / (z - c), which is at most f d sqrt(1 + (x/z)^2) / (z - d) away for a move of d.
  const double tangent = std::tan(half_angle_rad);
  const double focal_px = size_px / (2 * tangent);
  return margin_px * distance_m / (focal_px * std::sqrt(1 + tangent * tangent) + margin_px);
}

void erode(OcclusionMap& map, int margin_px) {
  std::vector<float> scratch;
  const auto width = static_cast<std::size_t>(map.width_px);
  const auto height = static_cast<std::size_t>(map.height_px);
  for (std::size_t y = 0; y < height; ++y)
    least_around(&map.depth[y * width], width, 1, margin_px, scratch, &map.depth[y * width]);
  for (std::size_t x = 0; x < width; ++x)
    least_around(&map.depth[x], height, width, margin_px, scratch, &map.depth[x]);
}

MaskCulling::MaskCulling(const Tin& tin, const GroupBatches& batches, const BoxTree& tree,
                         const MaskOptions& options)
    : batches_(batches), tree_(tree), options_(options), mapper_(tin), place_(batches.groups()) {
  if (tree.nodes().empty()) return;
  const auto order = tree.groups_of(tree.nodes()[0]);
  for (std::uint32_t i = 0; i < order.size(); ++i) place_[order[i]] = i;
}

std::vector<TriangleIndex> MaskCulling::choose_occluders(Mask& mask) const {
  const auto orphans = batches_.triangles(batches_.groups());
  std::vector<TriangleIndex> occluders(orphans.begin(), orphans.end());
  mask.is_occluder.assign(batches_.groups(), 0);
  if (tree_.nodes().empty()) return occluders;
  const Position& eye = mask.camera.eye;
  const Frustum frustum(mask.projection);
  CellCoverage coverage(mask.projection);
  const double least_square_m2 = options_.least_distance_m * options_.least_distance_m;
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  const auto add = [&](std::uint32_t index) {
    const BoxTree::Node& node = tree_.nodes()[index];
    if (!frustum.may_show(node.box)) return;
    open.push({coverage.least(node.box) * std::sqrt(square_distance_m2(eye, node.box)), index});
  };
  add(0);
  std::size_t chosen = 0;
  while (!open.empty() && chosen < options_.occluder_triangles) {
    const auto [importance, index] = open.top();
    open.pop();
    const BoxTree::Node& node = tree_.nodes()[index];
    if (node.count > kOccluderGroups) {
      add(node.left);
      add(node.right);
      continue;
    }
    if (square_distance_m2(eye, node.box) < least_square_m2) continue;
    // Others may have come before it since it was added.
    const double now = coverage.least(node.box) * std::sqrt(square_distance_m2(eye, node.box));
    if (!open.empty() && now > open.top().first && now > importance) {
      open.push({now, index});
      continue;
    }
    for (const GroupIndex g : tree_.groups_of(node)) {
      if (!is_there(g)) continue;
      mask.is_occluder[g] = 1;
      const auto triangles = batches_.triangles(g);
      occluders.insert(occluders.end(), triangles.begin(), triangles.end());
    }
    chosen += node.triangles;
    coverage.cover(node.box, node.triangles);
  }
  return occluders;
}

void MaskCulling::draw(const std::vector<TriangleIndex>& occluders, const Mask& mask,
                       OcclusionMap& map) {
  if (options_.drawing == MaskDrawing::kConservatively)
    return mapper_.draw(mask.projection, occluders, map);
  GroupBatches::Drawing drawing;
  for (GroupIndex g = 0; g < batches_.groups(); ++g)
    if (mask.is_occluder[g]) batches_.add_to(g, drawing);
  batches_.add_to(batches_.groups(), drawing);
  Target target = empty_depth_target(map.width_px, map.height_px);
  rasterise(target, project_all(mask.projection, drawing.vertices), drawing.triangles);
  map.depth = std::move(target.depth);
}

void MaskCulling::mark(Mask& mask, std::uint32_t index) const {
  const BoxTree::Node& node = tree_.nodes()[index];
  const bool is_hidden = is_covered(mask.pyramid, mask.projection, node.box, 1);
  mask.stamp_m[index] = is_hidden ? mask.until_m : 0;
  if (is_hidden || node.count < options_.leaf_groups || node.left == kNone) return;
  mark(mask, node.left);
  mark(mask, node.right);
}

MaskCulling::Mask MaskCulling::make_mask(const Camera& camera, double travelled_m) {
  const auto begin = [&](MaskStep step) {
    if (options_.on_step) options_.on_step(step);
  };
  const Shot& shot = *camera.shot;
  Mask mask;
  mask.camera = camera;
  mask.travelled_m = travelled_m;
  mask.projection = look_at(shot.view, shot.width_px, shot.height_px);
  OcclusionMap map;
  map.width_px = options_.width_px;
  map.height_px = std::max(1, options_.width_px * shot.height_px / shot.width_px);
  begin(MaskStep::kChoose);
  const std::vector<TriangleIndex> occluders = choose_occluders(mask);
  begin(MaskStep::kDraw);
  draw(occluders, mask, map);
  begin(MaskStep::kErode);
  // What is drawn by centres is eroded a pixel more, for those that are covered in part.
  erode(map, options_.margin_px + (options_.drawing == MaskDrawing::kByCentres ? 1 : 0));
  begin(MaskStep::kPyramid);
  mask.pyramid.build(map.width_px, map.height_px, map.depth, options_.block);
  begin(MaskStep::kMarkNodes);
  // Off the axis a place at a distance is less deep: the corner of the picture has the least.
  const double tangent_y = std::tan(shot.view.vertical_field_of_view_rad / 2);
  const double tangent_x = tangent_y * shot.width_px / shot.height_px;
  const double tangent = std::sqrt(tangent_x * tangent_x + tangent_y * tangent_y);
  const double depth_m = options_.least_distance_m / std::sqrt(1 + tangent * tangent);
  const double ball_m =
      std::min(ball_of_margin_m(options_.margin_px, depth_m, std::atan(tangent_x), map.width_px),
               ball_of_margin_m(options_.margin_px, depth_m, std::atan(tangent_y), map.height_px));
  mask.until_m = travelled_m + ball_m;
  mask.stamp_m.assign(tree_.nodes().size(), 0);
  if (!tree_.nodes().empty()) mark(mask, 0);
  begin(MaskStep::kDone);
  return mask;
}

void MaskCulling::take(Mask mask) {
  mask_ = std::move(mask);
  ++critical_frames_;
}

void MaskCulling::take_awaited() {
  if (!awaited_.valid()) return;
  Mask mask = awaited_.get();
  if (!is_awaited_void_) take(std::move(mask));
  is_awaited_void_ = false;
}

/// Takes the stamps off a group and all above it; what else they held keeps them.
void MaskCulling::unstamp(GroupIndex group) {
  std::uint32_t index = 0;
  for (;;) {
    const BoxTree::Node& node = tree_.nodes()[index];
    const double stamp_m = mask_->stamp_m[index];
    mask_->stamp_m[index] = 0;
    if (node.left == kNone) return;
    for (const std::uint32_t child : {node.left, node.right})
      mask_->stamp_m[child] = std::max(mask_->stamp_m[child], stamp_m);
    const BoxTree::Node& left = tree_.nodes()[node.left];
    index = place_[group] < left.first + left.count ? node.left : node.right;
  }
}

bool MaskCulling::set_present(std::span<const std::uint8_t> is_present) {
  take_awaited();
  const std::vector<std::uint8_t> before = std::move(is_present_);
  is_present_.assign(is_present.begin(), is_present.end());
  for (GroupIndex g = 0; g < is_present_.size() && mask_; ++g) {
    const bool was_there = before.empty() || before[g];
    if (was_there && !is_present_[g] && mask_->is_occluder[g])
      mask_.reset();  // the next frame is critical
    else if (!was_there && is_present_[g])
      unstamp(g);
  }
  return true;
}

CullingAnswer MaskCulling::visible(const Camera& camera) {
  assert(camera.shot);
  const Shot& shot = *camera.shot;
  if (last_) {
    const Position move = between(last_->eye, camera.eye);
    travelled_m_ += std::sqrt(dot(move, move));
  }
  last_ = camera;
  take_awaited();
  const auto has_turned = [&] {
    return angle_rad(mask_->camera.shot->view, shot.view) > options_.sharp_turn_rad;
  };
  if (!mask_ || travelled_m_ >= mask_->until_m || has_turned())
    take(make_mask(camera, travelled_m_));
  else if (options_.in_background &&
           travelled_m_ - mask_->travelled_m >= (mask_->until_m - mask_->travelled_m) / 2)
    awaited_ = std::async(std::launch::async, [this, camera, travelled_m = travelled_m_] {
      return make_mask(camera, travelled_m);
    });
  is_fresh_ = mask_->travelled_m == travelled_m_ && mask_->camera.eye == camera.eye;

  CullingAnswer answer;
  const Frustum frustum(look_at(shot.view, shot.width_px, shot.height_px));
  const auto gather = [&](auto self, std::uint32_t index) -> void {
    const BoxTree::Node& node = tree_.nodes()[index];
    ++answer.nodes_tested;
    // A stamp at the very distance it was made for holds at least for the frame that made it.
    if (mask_->stamp_m[index] > 0 && travelled_m_ <= mask_->stamp_m[index]) return;
    if (!frustum.may_show(node.box)) return;
    if (node.left == kNone) {
      const GroupIndex group = tree_.groups_of(node)[0];
      if (is_there(group)) answer.visible_groups.push_back(group);
      return;
    }
    self(self, node.left);
    self(self, node.right);
  };
  if (!tree_.nodes().empty()) gather(gather, 0);
  std::sort(answer.visible_groups.begin(), answer.visible_groups.end());
  return answer;
}

bool MaskCulling::may_show(const Bounds& box) {
  // A box that moves has no stamp; the eroded mask holds for it as long as for all others.
  return !mask_ || !is_covered(mask_->pyramid, mask_->projection, box, 1);
}

}  // namespace scarp
