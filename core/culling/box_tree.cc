#include "core/culling/box_tree.h"

#include <algorithm>
#include <numeric>

namespace scarp {

BoxTree::BoxTree(const GroupBatches& batches) : groups_(batches.groups()) {
  std::iota(groups_.begin(), groups_.end(), 0U);
  if (!groups_.empty()) split(batches, 0, batches.groups());
}

std::uint32_t BoxTree::split(const GroupBatches& batches, std::uint32_t first,
                             std::uint32_t count) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  Node node{batches.box(groups_[first]), first, count, 0, kNone, kNone};
  for (std::uint32_t i = first; i < first + count; ++i) {
    const Bounds& box = batches.box(groups_[i]);
    for (double Position::*c : {&Position::x_m, &Position::y_m, &Position::z_m}) {
      node.box.low.*c = std::min(node.box.low.*c, box.low.*c);
      node.box.high.*c = std::max(node.box.high.*c, box.high.*c);
    }
    node.triangles += static_cast<std::uint32_t>(batches.triangles(groups_[i]).size());
  }
  nodes_.push_back(node);
  if (count == 1) return index;
  double Position::*const axis =
      node.box.high.x_m - node.box.low.x_m > node.box.high.y_m - node.box.low.y_m ? &Position::x_m
                                                                                  : &Position::y_m;
  const auto middle = [&](GroupIndex g) {
    return batches.box(g).low.*axis + batches.box(g).high.*axis;
  };
  const auto begin = groups_.begin() + first;
  std::nth_element(begin, begin + count / 2, begin + count, [&](GroupIndex a, GroupIndex b) {
    return std::pair(middle(a), a) < std::pair(middle(b), b);
  });
  const std::uint32_t left = split(batches, first, count / 2);
  const std::uint32_t right = split(batches, first + count / 2, count - count / 2);
  nodes_[index].left = left;
  nodes_[index].right = right;
  return index;
}

double square_distance_m2(const Position& eye, const Bounds& box) {
  const auto outside = [](double at, double low, double high) {
    return std::max({low - at, 0.0, at - high});
  };
  const double x = outside(eye.x_m, box.low.x_m, box.high.x_m);
  const double y = outside(eye.y_m, box.low.y_m, box.high.y_m);
  const double z = outside(eye.z_m, box.low.z_m, box.high.z_m);
  return x * x + y * y + z * z;
}

}  // namespace scarp
