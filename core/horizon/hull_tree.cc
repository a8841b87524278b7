#include "core/horizon/hull_tree.h"

#include <algorithm>
#include <bit>
#include <cassert>

namespace scarp {
namespace {

/// Room that a hull starts with: most never need more.
constexpr std::uint32_t kFirstCapacity = 8;

std::size_t lowest_bit(std::size_t value) {
  return value & (~value + 1);
}

/// Whether q lies strictly above the line through p and r; p.u < r.u, q anywhere.
bool strictly_above(const PlanePoint& p, const PlanePoint& r, const PlanePoint& q) {
  return static_cast<__int128>(q.z - p.z) * (r.u - p.u) >
         static_cast<__int128>(r.z - p.z) * (q.u - p.u);
}

void look_at(const PlanePoint& q, std::int64_t u, std::int64_t z, Steepest& best) {
  const Slope slope{q.z - z, q.u - u};
  if (best.vertex != kNone) {
    const __int128 left = static_cast<__int128>(slope.rise) * best.slope.run;
    const __int128 right = static_cast<__int128>(best.slope.rise) * slope.run;
    if (left < right) return;
    if (left == right &&
        (slope.run > best.slope.run || (slope.run == best.slope.run && q.vertex > best.vertex)))
      return;
  }
  best = {slope, q.vertex};
}

}  // namespace

void HullTree::reset(std::span<const PlanePoint> by_rank) {
  const std::size_t blocks = (by_rank.size() + kBlock - 1) / kBlock;
  by_rank_ = by_rank;
  inserted_.assign(blocks, 0);
  hulls_.assign(blocks + 1, Hull{});
  arena_.resize(blocks * kFirstCapacity);
  for (std::size_t i = 1; i <= blocks; ++i) {
    hulls_[i].first = (i - 1) * kFirstCapacity;
    hulls_[i].capacity = kFirstCapacity;
  }
}

void HullTree::insert(std::size_t rank) {
  assert(rank < by_rank_.size() && !is_inserted(rank));
  inserted_[rank / kBlock] |= BlockMask{1} << (rank % kBlock);
  // Each hull on the way covers the one before it: what lies under one lies under all that follow.
  for (std::size_t i = rank / kBlock + 1; i < hulls_.size(); i += lowest_bit(i))
    if (!insert_in_hull(hulls_[i], by_rank_[rank])) return;
}

/// @return whether the point is now on the hull; false where it lies on or under it already.
/// A point in the middle of a hull's edge is never wanted: seen along the edge, its near end is
/// nearer.
bool HullTree::insert_in_hull(Hull& hull, const PlanePoint& point) {
  const PlanePoint* points = arena_.data() + hull.first;
  const std::size_t size = hull.size;
  std::size_t from = static_cast<std::size_t>(
      std::partition_point(points, points + size,
                           [&](const PlanePoint& q) { return q.u < point.u; }) -
      points);
  std::size_t to = from;
  if (to < size && points[to].u == point.u) {
    const PlanePoint& same = points[to];
    if (point.z < same.z || (point.z == same.z && point.vertex >= same.vertex)) return false;
    ++to;
  } else if (from > 0 && to < size && !strictly_above(points[from - 1], points[to], point)) {
    return false;
  }
  while (from >= 2 && !strictly_above(points[from - 2], point, points[from - 1])) --from;
  while (to + 2 <= size && !strictly_above(point, points[to + 1], points[to])) ++to;
  replace(hull, from, to, point);
  return true;
}

/// Puts one point in the place of the hull's points [from, to).
void HullTree::replace(Hull& hull, std::size_t from, std::size_t to, const PlanePoint& point) {
  const std::size_t size = hull.size + 1 - (to - from);
  if (size > hull.capacity) {
    const std::size_t old = hull.first;
    hull.first = arena_.size();
    hull.capacity *= 2;
    arena_.resize(hull.first + hull.capacity);
    std::copy_n(arena_.begin() + static_cast<std::ptrdiff_t>(old), hull.size,
                arena_.begin() + static_cast<std::ptrdiff_t>(hull.first));
  }
  PlanePoint* points = arena_.data() + hull.first;
  if (to == from)
    std::copy_backward(points + to, points + hull.size, points + size);
  else if (to > from + 1)
    std::copy(points + to, points + hull.size, points + from + 1);
  points[from] = point;
  hull.top_z = hull.size == 0 ? point.z : std::max(hull.top_z, point.z);
  hull.size = static_cast<std::uint32_t>(size);
  hull.low_u = points[0].u;
  hull.high_u = points[size - 1].u;
}

Steepest HullTree::steepest(std::size_t end, std::int64_t u, std::int64_t z) const {
  assert(end <= by_rank_.size());
  Steepest best;
  const std::size_t block = end / kBlock;
  for (std::size_t i = block; i > 0; i -= lowest_bit(i)) {
    const Hull& hull = hulls_[i];
    if (hull.size == 0) continue;
    if (hull.low_u > u) {
      look_at_hull(hull, u, z, best);
    } else {
      // A point that is not to the right may have taken others off the hull that are wanted.
      for (std::size_t k = i - lowest_bit(i); k < i; ++k) look_at_block(k, kBlock, u, z, best);
    }
  }
  look_at_block(block, end % kBlock, u, z, best);
  return best;
}

/// Requires hull.low_u > u. Slopes to the points of a hull first rise, then fall.
void HullTree::look_at_hull(const Hull& hull, std::int64_t u, std::int64_t z,
                            Steepest& best) const {
  if (best.vertex != kNone) {
    const std::int64_t rise = hull.top_z - z;
    const Slope bound{rise, (rise > 0 ? hull.low_u : hull.high_u) - u};
    if (compare_slopes(bound, best.slope) < 0) return;
  }
  const PlanePoint* points = arena_.data() + hull.first;
  const PlanePoint from{u, z, kNone};
  std::size_t low = 0, high = hull.size - 1;
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (strictly_above(from, points[middle], points[middle + 1]))
      low = middle + 1;
    else
      high = middle;
  }
  look_at(points[low], u, z, best);
}

/// Looks at the inserted ones of the first `count` ranks of a block.
void HullTree::look_at_block(std::size_t block, std::size_t count, std::int64_t u, std::int64_t z,
                             Steepest& best) const {
  if (count == 0) return;
  const PlanePoint* points = by_rank_.data() + block * kBlock;
  BlockMask left = inserted_[block] & (~BlockMask{0} >> (kBlock - count));
  for (; left != 0; left &= left - 1) {
    const PlanePoint& q = points[std::countr_zero(left)];
    if (q.u > u) look_at(q, u, z, best);
  }
}

std::optional<std::string> HullTree::check() const {
  for (std::size_t i = 1; i < hulls_.size(); ++i) {
    const std::size_t begin = (i - lowest_bit(i)) * kBlock;
    const std::size_t end = std::min(i * kBlock, by_rank_.size());
    if (auto broken = check_hull(hulls_[i], begin, end))
      return "hull " + std::to_string(i) + ": " + *broken;
  }
  return {};
}

std::optional<std::string> HullTree::check_hull(const Hull& hull, std::size_t begin,
                                                std::size_t end) const {
  const std::span<const PlanePoint> points(arena_.data() + hull.first, hull.size);
  if (hull.size > hull.capacity) return "more points than room";
  for (std::size_t k = 0; k + 1 < points.size(); ++k)
    if (points[k].u >= points[k + 1].u) return "u does not rise";
  for (std::size_t k = 0; k + 2 < points.size(); ++k)
    if (!strictly_above(points[k], points[k + 2], points[k + 1])) return "not strictly concave";
  if (!points.empty()) {
    std::int64_t top = points[0].z;
    for (const PlanePoint& q : points) top = std::max(top, q.z);
    if (hull.low_u != points.front().u || hull.high_u != points.back().u || hull.top_z != top)
      return "wrong bounds";
  }
  for (std::size_t rank = begin; rank < end; ++rank) {
    if (!is_inserted(rank)) continue;
    const PlanePoint& q = by_rank_[rank];
    const auto next = std::partition_point(points.begin(), points.end(),
                                           [&](const PlanePoint& h) { return h.u < q.u; });
    if (next == points.end() || (next->u != q.u && next == points.begin()))
      return "an inserted point lies beside the hull";
    if (next->u == q.u ? q.z > next->z : strictly_above(*(next - 1), *next, q))
      return "an inserted point lies above the hull";
  }
  return {};
}

}  // namespace scarp
