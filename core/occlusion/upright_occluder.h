#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/geodesy/position.h"
#include "core/terrain/tin.h"

namespace scarp {

/// What an occluder says of a box of eyes and a box of targets.
enum class FullOcclusion : std::uint8_t {
  kHidden,  ///< no eye of the one sees any place of the other
  kOpen,    ///< not known; parts of the boxes may be hidden from each other
  kNever,   ///< nothing is known of any part of the target either
};

/// A flat occluder: the part of an upright plane that lies below a polyline and between its ends.
/// Where the polyline runs strictly under ground, so does all of that, and hides what is behind it.
///
/// What it hides is decided by supporting planes, one for each edge and pair of corners of the
/// boxes, joined by the expression for occluders that are not convex: an edge of the hull counts by
/// itself, edges of a pocket by "or", edges of a bulge within a pocket by "and", and so on. Each
/// edge occurs once, and nothing is negated: so what holds for all pairs edge by edge holds for
/// each pair, and the answer is safe for boxes as for points.
/// Source: Law and Tan 1999, 5.3; the expression is the convex deficiency tree of Dobkin et al.
/// 1993.
class UprightOccluder {
 public:
  /// @param top  at least two lattice places on one straight line of the plane (exactly), in order
  explicit UprightOccluder(std::vector<Position> top);

  /// Side: never kHidden where some eye of the box sees some place of the target box, or a place on
  /// the border of either, given that the polyline is strictly under ground. Exact; kOpen and
  /// kNever may be said of what is hidden by less than rounding.
  /// Requires lattice boxes. Cost: about 0.1 us, 16 exact signs an edge where all else is right.
  FullOcclusion judge(const Bounds& eyes, const Bounds& targets) const;

  /// The same for the convex hull of some lattice places, such as a triangle's corners.
  FullOcclusion judge(const Bounds& eyes, std::span<const Position> targets) const;

  /// judge(...) == kHidden, at less cost where it is not.
  bool hides(const Bounds& eyes, std::span<const Position> targets) const;

  const std::vector<Position>& top() const { return top_; }
  std::uint64_t bytes() const {
    return sizeof(*this) + top_.size() * (sizeof(Position) + sizeof(double)) +
           terms_.size() * sizeof(Term);
  }

  /// "F0 & (F1 | F2)": the expression over the edges of the polyline, for people and tests.
  std::string expression() const { return text_of(0); }

 private:
  struct Term {
    enum Kind : std::uint8_t { kEdge, kAll, kAny } kind;
    std::uint32_t first = 0;  // edge, or first of the terms joined
    std::uint32_t count = 0;
  };

  double along(double x_m, double y_m) const;
  bool may_hide(const Position& eye, const Position& target) const;
  void grow(std::uint32_t term, std::uint32_t from, std::uint32_t to, bool is_upper);
  FullOcclusion judge(const Bounds& eyes, std::span<const Position> targets, double lowest_m) const;
  bool holds(const Term& term, int eye_side, std::span<const Position> eyes,
             std::span<const Position> targets) const;
  std::string text_of(std::uint32_t term) const;

  std::vector<Position> top_;
  std::vector<double> along_;  // [corners] of the polyline, 0 at its begin, 1 at its end
  double highest_m_;
  std::vector<Term> terms_;  // the whole is the first
};

}  // namespace scarp
