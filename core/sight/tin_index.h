#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/geodesy/position.h"
#include "core/terrain/tin.h"

namespace scarp {

/// An edge of the mesh, once. Its first triangle lies on the left of from -> to.
struct MeshEdge {
  VertexIndex from;
  VertexIndex to;
  TriangleIndex left;
  TriangleIndex right;  ///< kNone: a border edge, void on the right

  bool is_border() const { return right == kNone; }
};

/// Height that sight lines from one eye to a set of targets nowhere fall short of, as a function
/// of the place in plan: what lies lower cannot block any of them. Only for leaving work out.
///
/// Side: never above the lines. Accuracy: kHeightFloorMarginM covers the rounding, because the
/// floor is not used where it is steeper than kSteepestFloor: run and rise are exact to 2^-22 m,
/// so their product errs by less than 2^-11 m.
class HeightFloor {
 public:
  /// A floor that leaves nothing out.
  HeightFloor() = default;

  /// @param eye      where the lines begin
  /// @param targets  the corners of the convex set where they end, at least one
  HeightFloor(const Position& eye, std::span<const Position> targets);

  /// Whether all ground no higher than highest_m over the box stays under every line.
  bool clears(double centre_x_m, double centre_y_m, double half_m, double highest_m) const;

 private:
  bool active_ = false;
  Position eye_;
  double axis_x_ = 0, axis_y_ = 0;               // unit vector in plan
  double least_run_m_ = 0, greatest_run_m_ = 0;  // targets along the axis
  double rise_m_ = 0;                            // lowest target above the eye
};

inline constexpr double kHeightFloorMarginM = 0x1p-8;
inline constexpr double kSteepestFloor = 0x1p10;

/// Finds the triangles and edges of a TIN by place: a uniform grid of square bins over the plan,
/// each with the triangles and edges that may touch it.
///
/// Keeps a reference to the TIN, which must outlive it unchanged and hold what check_tin checks.
/// Immutable after construction: any number of threads may read it.
/// Cost: O(n) to build for n triangles of similar size; about 100 bytes per triangle.
class TinIndex {
 public:
  explicit TinIndex(const Tin& tin);

  const Tin& tin() const { return tin_; }
  std::span<const MeshEdge> edges() const { return edges_; }
  /// Border edges around voids that ground encloses.
  std::span<const std::uint32_t> hole_edges() const { return hole_edges_; }

  /// Triangle that holds the lattice place (x_m, y_m), its border included; the lowest index where
  /// several do, kNone over void. Exact.
  TriangleIndex triangle_at(double x_m, double y_m) const;

  /// -1 p strictly under ground, 0 on it, +1 above it; nothing over void. Exact.
  std::optional<int> above_ground(const Position& p) const;

  /// Height of the ground at a place, or nothing over void. Rounded: for display and for eyes, not
  /// for decisions. Error below 2^-20 m on slopes up to 100.
  std::optional<double> ground_height_m(double x_m, double y_m) const;

  /// Whether a void place is enclosed by ground, as opposed to outside the data. Exact.
  /// Cost: O(edges of holes).
  bool is_in_hole(double x_m, double y_m) const;

  /// Calls visit(triangle) for each triangle whose closed plan holds the place, by rising index.
  template <class Visit>
  void visit_triangles_at(double x_m, double y_m, Visit visit) const;

  /// Calls visit(edge index) for every edge that meets the convex hull of `corners` in plan, except
  /// where ground in its bins is cleared by the floor; others and repeats are possible. Goes
  /// outwards from the first corner, column by column, and ends early where visit returns true.
  /// @return whether visit ended it
  template <class Visit>
  bool visit_edges(std::span<const Position> corners, const HeightFloor& floor, Visit visit) const;

  /// The same for triangles along the plan of a segment, without a floor.
  template <class Visit>
  void visit_triangles_along(const Position& a, const Position& b, Visit visit) const;

  /// Calls visit(edge) for every border edge that meets the plan of a segment; others and repeats
  /// are possible.
  template <class Visit>
  void visit_border_edges_along(const Position& a, const Position& b, Visit visit) const;

 private:
  struct RowRange {
    std::int32_t first = 1;
    std::int32_t last = 0;
  };

  std::int32_t column_of(double x_m) const;
  std::int32_t row_of(double y_m) const;
  RowRange columns_over(std::span<const Position> corners) const;
  RowRange rows_over(std::span<const Position> corners, std::int32_t column) const;
  std::size_t bin(std::int32_t column, std::int32_t row) const {
    return static_cast<std::size_t>(column) * static_cast<std::size_t>(rows_) +
           static_cast<std::size_t>(row);
  }
  template <class Visit>
  bool visit_bins(std::span<const Position> corners, Visit visit) const;
  bool contains(TriangleIndex triangle, const Position& p) const;

  void list_edges();
  void lay_out_bins();
  void fill_bins();
  void find_hole_edges();

  const Tin& tin_;
  std::vector<MeshEdge> edges_;
  std::vector<std::uint32_t> hole_edges_;
  double low_x_m_ = 0, low_y_m_ = 0, bin_m_ = 1;
  std::int32_t columns_ = 0, rows_ = 0;
  std::vector<std::uint32_t> first_triangle_, bin_triangles_;  // by bin, column by column
  std::vector<std::uint32_t> first_edge_, bin_edges_;
  std::vector<double> bin_highest_m_;  // of the edges in the bin, over their whole length
  std::vector<std::uint8_t> bin_has_border_;
};

template <class Visit>
bool TinIndex::visit_bins(std::span<const Position> corners, Visit visit) const {
  const RowRange columns = columns_over(corners);
  const bool rising = corners.front().x_m <= corners.back().x_m;
  for (std::int32_t i = columns.first; i <= columns.last; ++i) {
    const std::int32_t column = rising ? i : columns.last - (i - columns.first);
    const RowRange rows = rows_over(corners, column);
    for (std::int32_t row = rows.first; row <= rows.last; ++row)
      if (visit(column, row)) return true;
  }
  return false;
}

template <class Visit>
bool TinIndex::visit_edges(std::span<const Position> corners, const HeightFloor& floor,
                           Visit visit) const {
  return visit_bins(corners, [&](std::int32_t column, std::int32_t row) {
    const std::size_t b = bin(column, row);
    if (first_edge_[b] == first_edge_[b + 1]) return false;
    if (floor.clears(low_x_m_ + (column + 0.5) * bin_m_, low_y_m_ + (row + 0.5) * bin_m_,
                     0.5 * bin_m_, bin_highest_m_[b]))
      return false;
    for (std::uint32_t i = first_edge_[b]; i < first_edge_[b + 1]; ++i)
      if (visit(bin_edges_[i])) return true;
    return false;
  });
}

template <class Visit>
void TinIndex::visit_triangles_at(double x_m, double y_m, Visit visit) const {
  const std::int32_t column = column_of(x_m), row = row_of(y_m);
  if (column < 0 || column >= columns_ || row < 0 || row >= rows_) return;
  const std::size_t b = bin(column, row);
  for (std::uint32_t i = first_triangle_[b]; i < first_triangle_[b + 1]; ++i)
    if (contains(bin_triangles_[i], {x_m, y_m, 0})) visit(bin_triangles_[i]);
}

template <class Visit>
void TinIndex::visit_triangles_along(const Position& a, const Position& b, Visit visit) const {
  const std::array<Position, 2> ends{a, b};
  visit_bins(ends, [&](std::int32_t column, std::int32_t row) {
    const std::size_t at = bin(column, row);
    for (std::uint32_t i = first_triangle_[at]; i < first_triangle_[at + 1]; ++i)
      visit(bin_triangles_[i]);
    return false;
  });
}

template <class Visit>
void TinIndex::visit_border_edges_along(const Position& a, const Position& b, Visit visit) const {
  const std::array<Position, 2> ends{a, b};
  visit_bins(ends, [&](std::int32_t column, std::int32_t row) {
    const std::size_t at = bin(column, row);
    if (!bin_has_border_[at]) return false;
    for (std::uint32_t i = first_edge_[at]; i < first_edge_[at + 1]; ++i)
      if (edges_[bin_edges_[i]].is_border()) visit(edges_[bin_edges_[i]]);
    return false;
  });
}

}  // namespace scarp
