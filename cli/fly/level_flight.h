#pragma once

#include <array>
#include <optional>
#include <vector>

#include "cli/fly/flight.h"
#include "core/culling/coarse_batches.h"
#include "core/culling/selective_refinement.h"

namespace scarp {

/// How answers are drawn with levels of detail, besides whole.
struct LevelPlan {
  double refine_px = 0;      ///< refined until no place is off by more; 0: not
  std::uint64_t budget = 0;  ///< triangles a frame that levels of groups stay within; 0: none
};

/// Levels of groups that are drawn: the finest and the next two.
inline constexpr std::size_t kDrawnLevels = 3;

/// What a method's answers came to with levels, summed over the frames.
struct LevelSum {
  std::uint64_t refined = 0;       ///< triangles in the picture over groups that may be seen
  std::uint64_t over_outline = 0;  ///< of those, not under the outline of nearer ones
  std::uint64_t other_px = 0;      ///< pixels with another triangle than refined without culling
  double refine_ms = 0;            ///< of the processor, to refine and to find the outline
  std::uint64_t in_budget = 0;     ///< triangles drawn at the levels that the budget allows
  std::array<std::uint64_t, kDrawnLevels> level_px{};  ///< pixels by the level of what they show
};

/// Draws the same answers with levels: refined to a screen error (Law and Tan 1999), and at levels
/// of groups within a budget (Grundhöfer et al. 2006). Movers are left out. Keeps references; one
/// thread at a time.
class LevelFlight {
 public:
  /// @param coarse  levels of kQueryShares; needed where the plan has a budget
  LevelFlight(const Tin& tin, const Groups& groups, const GroupBatches& batches,
              const CoarseBatches* coarse, const LevelPlan& plan, std::size_t contenders);

  /// @param groups  in the picture, as the contender answers
  void see(const Shot& shot, std::size_t contender, std::span<const GroupIndex> groups);

  const LevelPlan& plan() const { return plan_; }
  const std::vector<LevelSum>& sums() const { return sums_; }
  /// Triangles of all frames that are refined without culling.
  std::uint64_t refined_whole() const { return refined_whole_; }

 private:
  void refine(const Shot& shot, std::span<const GroupIndex> groups, LevelSum& sum);
  void draw_in_budget(const Shot& shot, std::span<const GroupIndex> groups, LevelSum& sum) const;
  Target picture_of(const SelectiveRefinement::Drawing& drawing, const Shot& shot) const;

  const Tin& tin_;
  const GroupBatches& batches_;
  const CoarseBatches* coarse_;
  const LevelPlan plan_;
  std::optional<SelectiveRefinement> refinement_;
  std::vector<LevelSum> sums_;  // [contenders]
  Target whole_;                // of the frame, refined without culling
  std::uint64_t refined_whole_ = 0;
};

}  // namespace scarp
