#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/horizon/certified/fan.h"
#include "core/horizon/certified/ridges.h"
#include "core/horizon/certified/wall.h"
#include "core/occlusion/certified/group_edges.h"
#include "core/occlusion/certified/piece_targets.h"
#include "core/occlusion/certified/reached_cells.h"

namespace scarp {

/// A piece is halved this often at most: its border edge, or its rays.
inline constexpr std::size_t kMostHalvings = 8;

/// Rays are looked at along a line that leaves the middle of a fan by so much at most, in the mean
/// unit of all groups. Guides the search.
inline constexpr double kMostDrift = 4;

/// What looks at groups have in common.
struct LookSettings {
  const RidgeEdges& ridge_edges;
  std::span<const SectorBorders> borders;
  float sagitta;        ///< by how much an arc of a sector is farther out than its chord, relative
  double piece;         ///< greatest length of a piece of border, in units of its group
  int fan_halvings;     ///< of a piece's rays
  double most_drift_m;  ///< kMostDrift of them
};

/// The crests and borders of a group, by the numbers of their corners.
struct NumberedGroup {
  std::vector<VertexIndex> corners;
  std::vector<FanCrests::Ends> crests, borders;

  NumberedGroup() = default;
  NumberedGroup(std::span<const GroupEdges::Edge> crests,
                std::span<const GroupEdges::Edge> borders);
};

/// A group as looks see it.
struct LookedGroup {
  FanPlace centre;             ///< of its circle, at its height
  double radius_m, height_m;   ///< of the circle; the greatest of the group
  double unit_m;               ///< mean distance between its vertices
  float* bounds;               ///< [kRings * sectors], lowered
  const std::uint16_t* hints;  ///< [kRings * sectors]: no bound under this is of use
};

/// Bounds groups for the rays of a fan, one after another in the same memory (HidingBounds says
/// what bounds are).
class GroupLook {
 public:
  explicit GroupLook(const LookSettings& settings) : settings_(settings) {}

  /// Lowers the bounds of cells by what rays of a fan can see of a group.
  void look(const FanView& view, const Ridges& ridges, const RingTable& rings, const Turns& turns,
            const NumberedGroup& numbered, const LookedGroup& group);

 private:
  class RidgeWalk;

  /// A ridge that rises above all before it, and the slope of the sight lines that touch it.
  struct Sighted {
    std::uint32_t edge;
    double slope;
    float rise;  // of its line over the group's height at the centre, in radii
    std::size_t strip;
    std::ptrdiff_t crossing;
    bool is_tried = false, is_walled = false;
  };

  ReachedCells& reached() { return reached_by_depth_[depth_]; }

  void place_group(const NumberedGroup& numbered);
  void find_behind(const FanEdge& edge);
  bool is_passed(const ExitPiece& piece) const;
  std::size_t reach_from(const ExitPiece& piece);
  CellPlane in_cells(const SkyPlane& plane) const;
  std::size_t ring_beyond(std::size_t lane, double u_m, std::size_t first) const;
  bool raise(const Sighted& sighted, const PieceTargets& targets, std::size_t lane);
  bool raise_before(std::size_t end, const PieceTargets& targets, std::size_t lane);
  void raise_walls(const ExitPiece& piece, const PieceTargets& targets, std::size_t lane);
  void look_from_piece(const ExitPiece& piece, std::span<const std::uint32_t> candidates);

  const LookSettings& settings_;

  // What is looked at.
  const FanView* view_ = nullptr;
  const Ridges* ridges_ = nullptr;
  const RingTable* rings_ = nullptr;
  const Turns* turns_ = nullptr;
  LookedGroup group_{};
  ReachedCells::Known known_{};

  // The group in the fan's frame.
  FanCrests crests_;
  std::vector<double> low_u_m_, low_v_m_, high_v_m_;  // of crests
  std::vector<FanEdge> exits_;                        // all that rays can leave over
  std::vector<std::uint64_t> wanted_;                 // marks of cells

  // The piece that is looked at.
  std::size_t depth_ = 0;  // of halving
  std::vector<std::uint32_t> candidates_;
  std::array<PieceTargets, kMostHalvings + 1> targets_;
  std::array<ReachedCells, kMostHalvings + 1> reached_by_depth_;
  std::vector<Sighted> sighted_;
  std::size_t ring_ = 0;  // all before have what walls can give them
  int failures_ = 0;      // of ridges to carry a wall
  std::vector<CellPlane> planes_;
  Wall wall_;
};

}  // namespace scarp
