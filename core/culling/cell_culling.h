#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/culling/culling_method.h"
#include "core/culling/ground_heights.h"
#include "core/culling/joint_walk.h"
#include "core/culling/node_hiding.h"

namespace scarp {

/// Where eyes may be, and how that is divided.
struct CellSpace {
  Bounds box;
  double least_m;  ///< cells are not divided below this width
  /// Where given, a quadtree of squares of this ground and the air over it; otherwise an octree.
  std::shared_ptr<const GroundHeights> ground = nullptr;
  double air_m = 0;  ///< height of eyes above the highest ground of a square
};

/// A tree of view cells, each with the nodes that are hidden from all of it: those of its parent
/// are not repeated, so that the sets from the root to the cell that holds the eye make up what it
/// does not see. Cells are divided when an eye first comes into them, or all at once. Keeps a
/// reference to the hiding. Source: Law and Tan 1999, 5.1, 5.2.
class CellTree {
 public:
  CellTree(const NodeHiding& hiding, const CellSpace& space);

  /// Divides what the eye comes into.
  /// @param hidden  ascending: the sets down to the smallest cell that holds the eye
  /// @return that cell, kNone outside of the space
  std::uint32_t hidden_from(const Position& eye, std::vector<NodeIndex>& hidden);

  /// Whether a cell is as small as they get.
  bool is_smallest(std::uint32_t cell) const;

  /// Divides every cell down to the least width. Cost: as many cells as the space then has.
  void divide_all();

  std::size_t size() const { return cells_.size(); }
  std::uint64_t bytes() const;

 private:
  struct Cell {
    Bounds box;
    std::vector<NodeIndex> hidden;  // from all of it, and not from all of its parent; ascending
    std::uint32_t parent;
    std::uint32_t first_child;  // kNone where it was not divided
  };

  unsigned children() const { return space_.ground ? 4 : 8; }
  Bounds part_of(const Bounds& box, unsigned child) const;
  void divide(std::uint32_t cell);
  void collect(std::uint32_t cell, std::vector<NodeIndex>& hidden) const;

  const NodeHiding& hiding_;
  CellSpace space_;
  std::vector<Cell> cells_;
};

/// Culling by view cells: the sets of the cells that hold the eye, walked together with the active
/// list of the frame before. An eye low over ground takes the cells over the ground, any other
/// those of the air; one outside of both sees everything.
///
/// Side: as the hiding. One thread at a time. Cost of a new cell: find_hidden; of a frame in a
/// known one: as walk_jointly, or nothing in the cell of the frame before.
class CellCulling : public CullingMethod {
 public:
  /// @param hiding  to be kept by the method
  CellCulling(std::string name, std::unique_ptr<NodeHiding> hiding,
              const std::vector<CellSpace>& spaces);

  std::string_view name() const override { return name_; }
  CullingAnswer visible(const Camera& camera) override;

  std::vector<CellTree>& trees() { return trees_; }
  /// Memory of the sets.
  std::uint64_t bytes() const;

 private:
  std::string name_;
  std::unique_ptr<NodeHiding> hiding_;
  std::vector<CellTree> trees_;
  std::vector<ActiveNode> active_;
  std::vector<NodeIndex> hidden_, hidden_before_;
  CullingAnswer answer_;
};

/// Cells over the ground up to 10 m above it, and in the air from there to as far above the highest
/// place as that is above the lowest. They keep a reference to the ground.
/// @param least_m  width of the smallest cells
std::vector<CellSpace> walk_and_flight(const Tin& ground, double least_m);

}  // namespace scarp
