#pragma once

#include <span>
#include <vector>

#include "core/culling/coarse_batches.h"
#include "core/culling/culling_method.h"
#include "core/raster/rasterise.h"

namespace scarp {

struct QueryOptions {
  int width_px = 320;              ///< of the pictures that are asked
  std::uint32_t threshold_px = 1;  ///< objects with fewer visible pixels there are left out
  double near_sizes = 1;  ///< nearer than so many diagonals of its box, a group is drawn whole
  double far_sizes = 4;   ///< farther than so many, at the coarser level
};

/// What is asked of which picture.
enum class QueryUse {
  kSameFrame,  ///< coarse levels to depth, coarse levels counted, then what was seen: lod-query
  /// What the last frame's answers show is drawn, then all else coarsely, and then the boxes of all
  /// are counted for the next frame: multi-frame
  kNextFrame,
};

/// The levels of a query's scene: the finest and those of CoarseBatches. The two coarsest cull, the
/// three finest draw.
inline constexpr double kQueryShares[] = {0.5, 0.25, 0.0625};

/// Methods lod-query and multi-frame. The groups in view are drawn at the two coarsest levels, the
/// pixels that each shows are counted, and what shows fewer than the threshold is left out.
/// Grundhöfer et al. 2006. multi-frame saves the wait for the counts: it takes those of the last
/// frame, and draws what was not in view then; it counts boxes, because what has been drawn finely
/// may hide its own coarse levels.
///
/// Moving boxes are counted as they are, against the depths that the groups left.
/// Side: none: coarse levels gape and bulge, and small pictures miss what is thin.
/// Requires Camera::shot, and levels of kQueryShares. Keeps references; one thread at a time.
class QueryCulling : public CullingMethod {
 public:
  QueryCulling(const GroupBatches& batches, const CoarseBatches& coarse, QueryUse use,
               const QueryOptions& options = {});

  std::string_view name() const override {
    return use_ == QueryUse::kSameFrame ? "lod-query" : "multi-frame";
  }
  CullingAnswer visible(const Camera& camera) override;
  bool may_show(const Bounds& box) override;
  bool set_present(std::span<const std::uint8_t> is_present) override;

 private:
  void add_coarsely(GroupIndex group, const Position& eye);
  void count_pixels(const Camera& camera, std::span<const GroupIndex> groups);
  void count_boxes(const Camera& camera, std::span<const GroupIndex> groups,
                   std::span<const GroupIndex> drawn);

  const GroupBatches& batches_;
  const CoarseBatches& coarse_;
  const QueryUse use_;
  const QueryOptions options_;
  GroupBatches::Drawing drawing_;
  Target target_;
  Projection projection_;
  std::vector<std::uint8_t> is_present_;
  std::vector<std::uint32_t> pixels_;   // [groups] that each shows
  std::vector<std::uint8_t> is_known_;  // [groups] of the last picture
};

/// Method stop-and-wait: boxes are asked one after the other, nearest first, against what has been
/// drawn; a group whose box shows is drawn at its finest level before the next is asked. The
/// baseline of Grundhöfer et al. 2006.
///
/// Side: none, but only through gaps between the centres of pixels.
/// Requires Camera::shot. Keeps references; one thread at a time.
class StopAndWaitCulling : public CullingMethod {
 public:
  StopAndWaitCulling(const GroupBatches& batches, const QueryOptions& options = {});

  std::string_view name() const override { return "stop-and-wait"; }
  CullingAnswer visible(const Camera& camera) override;
  bool may_show(const Bounds& box) override;
  bool set_present(std::span<const std::uint8_t> is_present) override;

 private:
  const GroupBatches& batches_;
  const QueryOptions options_;
  Target target_;
  Projection projection_;
  std::vector<std::uint8_t> is_present_;
};

/// The finest levels that groups can be drawn at within a budget of triangles: all begin at the
/// coarsest of the levels that draw, and the largest on the screen are refined first.
///
/// @param groups  that are drawn
/// @param draw_levels  that may be drawn with, the finest first: 0 the group itself, i the level
///   i - 1 of CoarseBatches; at least one
/// @return [groups.size()] level of each; the coarsest for all where even that exceeds the budget
/// Cost: O(n log n). Source: Grundhöfer et al. 2006, a fixed number of triangles a frame.
std::vector<std::uint8_t> levels_within(const GroupBatches& batches, const CoarseBatches& coarse,
                                        const Position& eye, std::span<const GroupIndex> groups,
                                        std::size_t draw_levels, std::uint64_t budget_triangles);

}  // namespace scarp
