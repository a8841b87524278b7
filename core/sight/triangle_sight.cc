#include "core/sight/triangle_sight.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <numeric>

#include "core/geodesy/predicates.h"
#include "core/sight/lattice_algebra.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Blockers of earlier triangles that are tried first: neighbours are mostly hidden by the same.
constexpr std::size_t kRecentBlockers = 8;

/// Triangles that share one list of recent blockers; long enough to profit from it, short enough
/// to be balanced over threads.
constexpr std::size_t kTrianglesPerTask = 128;

/// An edge as seen from the eye: its ends as vectors from the eye, `right` before `left` counter-
/// clockwise, less than half a turn apart.
struct SeenEdge {
  LatticeVector right, left;
};

/// Part of a far edge, from its right end (0) to its left end (1).
struct Span {
  Fraction low, high;
  bool low_open, high_open;
};

bool is_empty(const Span& s) {
  const int order = compare(s.low, s.high);
  return order > 0 || (order == 0 && (s.low_open || s.high_open));
}

/// Takes `hidden` away from every gap.
void subtract(std::vector<Span>& gaps, const Span& hidden, std::vector<Span>& spare) {
  spare.clear();
  for (const Span& gap : gaps) {
    Span right_part = gap, left_part = gap;
    const int high_order = compare(hidden.low, gap.high);
    if (high_order < 0) right_part.high = hidden.low, right_part.high_open = !hidden.low_open;
    if (high_order == 0) right_part.high_open |= !hidden.low_open;
    const int low_order = compare(gap.low, hidden.high);
    if (low_order < 0) left_part.low = hidden.high, left_part.low_open = !hidden.high_open;
    if (low_order == 0) left_part.low_open |= !hidden.high_open;
    // Where `hidden` misses the gap, one part is the whole gap and the other is empty.
    if (!is_empty(right_part)) spare.push_back(right_part);
    if (!is_empty(left_part)) spare.push_back(left_part);
  }
  gaps.swap(spare);
}

/// What of a far edge is still in sight.
struct Target {
  SeenEdge edge;
  std::vector<Span> gaps;
};

/// The sign of c against the line a -> b in plan, for vectors from one origin.
int side(const LatticeVector& a, const LatticeVector& b, const LatticeVector& c) {
  const Int128 area = cross_in_plan(b - a, c - a);
  return (area > 0) - (area < 0);
}

/// Whether e lies nearer to the eye than f, for two edges that some directions share and that do
/// not cross in plan.
bool is_before(const SeenEdge& e, const SeenEdge& f) {
  const int right_side = side(f.right, f.left, e.right), left_side = side(f.right, f.left, e.left);
  if (right_side >= 0 && left_side >= 0) return right_side > 0 || left_side > 0;
  return side(e.right, e.left, f.right) <= 0 && side(e.right, e.left, f.left) <= 0;
}

/// Where the direction of w meets f, or nothing where it does not.
std::optional<Fraction> place_along(const SeenEdge& f, const LatticeVector& w) {
  const Int128 before = cross_in_plan(f.right, w), after = cross_in_plan(w, f.left);
  if (before < 0 || after < 0) return {};
  return Fraction{before, after};
}

/// The part of f that lies in directions of e; nothing where that is a single direction or none.
std::optional<Span> shared_directions(const SeenEdge& e, const SeenEdge& f) {
  const std::optional<Fraction> right = place_along(f, e.right), left = place_along(f, e.left);
  if (!right && !place_along(e, f.right)) return {};
  if (!left && !place_along(e, f.left)) return {};
  const Span shared{right.value_or(kFirstEnd), left.value_or(kLastEnd), false, false};
  if (compare(shared.low, shared.high) >= 0) return {};
  return shared;
}

/// The part of f that e, which lies before it, hides. Strictly: where e is above the sight line to
/// f; otherwise also where it touches it.
std::optional<Span> hidden_part(const SeenEdge& e, const SeenEdge& f, bool strictly) {
  std::optional<Span> hidden = shared_directions(e, f);
  if (!hidden || !is_before(e, f)) return {};
  const Int128 right_height = volume(e.right, e.left, f.right);
  const Int128 left_height = volume(e.right, e.left, f.left);
  const auto is_under = [&](const Int128& height) { return strictly ? height < 0 : height <= 0; };
  const bool right_under = is_under(right_height), left_under = is_under(left_height);
  if (!right_under && !left_under) return {};
  if (right_under && left_under) return hidden;
  const Fraction turn{right_height < 0 ? -right_height : right_height,
                      left_height < 0 ? -left_height : left_height};
  Fraction& end = right_under ? hidden->high : hidden->low;
  bool& is_open = right_under ? hidden->high_open : hidden->low_open;
  const int order = right_under ? compare(turn, end) : compare(end, turn);
  if (order < 0) end = turn;
  if (order <= 0) is_open = strictly;
  if (compare(hidden->low, hidden->high) >= 0) return {};
  return hidden;
}

/// Judges triangles from one eye, one after the other. Remembers what hid the last ones, which
/// makes it faster but never changes an answer.
class TriangleJudge {
 public:
  TriangleJudge(const TinIndex& index, const Position& eye) : index_(index), eye_(eye) {
    index_.visit_triangles_at(eye.x_m, eye.y_m, [&](TriangleIndex t) { add_roof(t); });
  }

  TriangleSight judge(TriangleIndex triangle) {
    const auto& [a, b, c] = index_.tin().triangles[triangle];
    const Tin& tin = index_.tin();
    const int eye_above = orient3d(tin.vertices[a], tin.vertices[b], tin.vertices[c], eye_);
    if (eye_above < 0) return TriangleSight::kHidden;
    if (!aim(triangle, eye_above == 0)) return TriangleSight::kVisible;
    return is_covered(triangle) ? TriangleSight::kHidden : TriangleSight::kVisible;
  }

 private:
  /// An eye strictly under a triangle sees nothing beyond it: the edges that the lines would leave
  /// it by hide everything.
  void add_roof(TriangleIndex t) {
    const Tin& tin = index_.tin();
    const auto& corners = tin.triangles[t];
    if (orient3d(tin.vertices[corners[0]], tin.vertices[corners[1]], tin.vertices[corners[2]],
                 eye_) >= 0)
      return;
    for (std::size_t i = 0; i < 3; ++i) {
      const SeenEdge edge{seen(corners[i]), seen(corners[(i + 1) % 3])};
      if (cross_in_plan(edge.right, edge.left) > 0) roofs_.push_back(edge);
    }
  }

  LatticeVector seen(VertexIndex v) const { return vector_from(eye_, index_.tin().vertices[v]); }

  /// Sets up what is to be covered. @return false where the eye is over the closed triangle
  bool aim(TriangleIndex triangle, bool in_plane) {
    const auto& corners = index_.tin().triangles[triangle];
    std::array<SeenEdge, 2> far_edges, near_edges;
    std::size_t far_count = 0, near_count = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const LatticeVector from = seen(corners[i]), to = seen(corners[(i + 1) % 3]);
      const Int128 turn = cross_in_plan(from, to);
      if (turn > 0 && far_count < 2) far_edges[far_count++] = {from, to};
      if (turn < 0 && near_count < 2) near_edges[near_count++] = {to, from};
    }
    if (near_count == 0) return false;
    strictly_ = in_plane;
    target_count_ = 0;
    const auto add_target = [&](const SeenEdge& edge) {
      targets_[target_count_].edge = edge;
      targets_[target_count_].gaps.assign(1, Span{kFirstEnd, kLastEnd, true, true});
      ++target_count_;
    };
    // In the plane one edge stands for the triangle: the one that spans all its directions.
    if (in_plane && far_count == 2) {
      add_target(near_edges[0]);
    } else {
      for (std::size_t i = 0; i < far_count; ++i) add_target(far_edges[i]);
    }
    return true;
  }

  /// Takes from the targets what the edge hides. @return whether that was anything
  bool cover(const SeenEdge& edge, bool is_roof) {
    bool changed = false;
    for (std::size_t i = 0; i < target_count_; ++i) {
      Target& target = targets_[i];
      if (target.gaps.empty()) continue;
      const std::optional<Span> hidden = is_roof ? shared_directions(edge, target.edge)
                                                 : hidden_part(edge, target.edge, strictly_);
      if (!hidden) continue;
      subtract(target.gaps, *hidden, spare_);
      changed = true;
    }
    return changed;
  }

  bool nothing_left() const {
    for (std::size_t i = 0; i < target_count_; ++i)
      if (!targets_[i].gaps.empty()) return false;
    return true;
  }

  /// Covers the targets with a mesh edge. @return whether the edge hid anything
  bool cover_with(std::uint32_t e) {
    SeenEdge edge{seen(index_.edges()[e].from), seen(index_.edges()[e].to)};
    const Int128 turn = cross_in_plan(edge.right, edge.left);
    // An edge along one direction adds nothing to the edges that meet it at its ends.
    if (turn == 0) return false;
    if (turn < 0) std::swap(edge.right, edge.left);
    return cover(edge, false);
  }

  bool is_covered(TriangleIndex triangle) {
    for (const SeenEdge& roof : roofs_) cover(roof, true);
    for (const std::uint32_t e : recent_) cover_with(e);
    if (nothing_left()) return true;

    const Tin& tin = index_.tin();
    const auto& corners = tin.triangles[triangle];
    const std::array<Position, 4> reach{eye_, tin.vertices[corners[0]], tin.vertices[corners[1]],
                                        tin.vertices[corners[2]]};
    const HeightFloor floor(eye_, std::span(reach).last(3));
    used_.clear();
    const bool covered = index_.visit_edges(reach, floor, [&](std::uint32_t e) {
      if (!cover_with(e)) return false;
      used_.push_back(e);
      return nothing_left();
    });
    if (covered) remember();
    return covered;
  }

  /// Puts the edges that hid this triangle, the last ones first, before those of earlier ones.
  void remember() {
    std::reverse(used_.begin(), used_.end());
    for (const std::uint32_t e : recent_)
      if (std::find(used_.begin(), used_.end(), e) == used_.end()) used_.push_back(e);
    used_.resize(std::min(used_.size(), kRecentBlockers));
    recent_ = used_;
  }

  const TinIndex& index_;
  const Position eye_;
  std::vector<SeenEdge> roofs_;
  bool strictly_ = false;
  std::array<Target, 2> targets_;
  std::size_t target_count_ = 0;
  std::vector<Span> spare_;
  std::vector<std::uint32_t> recent_, used_;
};

}  // namespace

TriangleSight judge_triangle(const TinIndex& index, const Position& eye, TriangleIndex triangle) {
  assert(triangle < index.tin().triangles.size());
  return TriangleJudge(index, eye).judge(triangle);
}

std::vector<TriangleSight> judge_each(const TinIndex& index, const Position& eye,
                                      std::span<const TriangleIndex> triangles) {
  std::vector<TriangleSight> sights(triangles.size());
  parallel_for((triangles.size() + kTrianglesPerTask - 1) / kTrianglesPerTask,
               [&](std::size_t task) {
                 TriangleJudge judge(index, eye);
                 const std::size_t end = std::min(triangles.size(), (task + 1) * kTrianglesPerTask);
                 for (std::size_t i = task * kTrianglesPerTask; i < end; ++i)
                   sights[i] = judge.judge(triangles[i]);
               });
  return sights;
}

std::vector<TriangleSight> judge_all(const TinIndex& index, const Position& eye) {
  std::vector<TriangleIndex> all(index.tin().triangles.size());
  std::iota(all.begin(), all.end(), TriangleIndex{0});
  return judge_each(index, eye, all);
}

}  // namespace scarp
