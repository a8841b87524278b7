#include "cli/fly/level_flight.h"

#include <algorithm>

#include "cli/stopwatch.h"
#include "core/culling/query_culling.h"

namespace scarp {

LevelFlight::LevelFlight(const Tin& tin, const Groups& groups, const GroupBatches& batches,
                         const CoarseBatches* coarse, const LevelPlan& plan, std::size_t contenders)
    : tin_(tin), batches_(batches), coarse_(coarse), plan_(plan), sums_(contenders) {
  if (plan.refine_px > 0) refinement_.emplace(tin, groups);
}

Target LevelFlight::picture_of(const SelectiveRefinement::Drawing& drawing,
                               const Shot& shot) const {
  Target target = empty_target(shot.width_px, shot.height_px);
  rasterise(target, project_all(look_at(shot.view, shot.width_px, shot.height_px), tin_.vertices),
            drawing.triangles, drawing.objects);
  return target;
}

void LevelFlight::see(const Shot& shot, std::size_t contender, std::span<const GroupIndex> groups) {
  if (refinement_ && contender == 0) {
    const auto whole = refinement_->draw(shot, plan_.refine_px, std::nullopt);
    refined_whole_ += whole.triangles.size();
    whole_ = picture_of(whole, shot);
  }
  if (refinement_) refine(shot, groups, sums_[contender]);
  if (plan_.budget > 0) draw_in_budget(shot, groups, sums_[contender]);
}

void LevelFlight::refine(const Shot& shot, std::span<const GroupIndex> groups, LevelSum& sum) {
  const ProcessorStopwatch watch;
  auto drawing = refinement_->draw(shot, plan_.refine_px, groups);
  sum.refined += drawing.triangles.size();
  refinement_->leave_out_hidden(shot, drawing);
  sum.refine_ms += watch.ms();
  sum.over_outline += drawing.triangles.size();
  const Target picture = picture_of(drawing, shot);
  for (std::size_t i = 0; i < picture.object.size(); ++i)
    sum.other_px += picture.object[i] != whole_.object[i];
}

void LevelFlight::draw_in_budget(const Shot& shot, std::span<const GroupIndex> groups,
                                 LevelSum& sum) const {
  // The orphans are drawn as they are, whatever the budget.
  const std::uint64_t orphans = batches_.triangles(batches_.groups()).size();
  const std::vector<std::uint8_t> levels =
      levels_within(batches_, *coarse_, shot.view.eye, groups, kDrawnLevels,
                    plan_.budget - std::min(plan_.budget, orphans));
  GroupBatches::Drawing drawing;
  std::vector<std::uint32_t> numbers;
  // Pixels are told apart by the level of what they show.
  const auto number = [&](std::uint8_t level) {
    const std::size_t added = drawing.triangles.size() - numbers.size();
    numbers.insert(numbers.end(), added, level);
  };
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (levels[i] == 0)
      batches_.add_to(groups[i], drawing);
    else
      coarse_->add_to(levels[i] - 1U, groups[i], drawing);
    number(levels[i]);
  }
  batches_.add_to(batches_.groups(), drawing);
  number(0);
  sum.in_budget += drawing.triangles.size();
  Target target = empty_target(shot.width_px, shot.height_px);
  rasterise(target,
            project_all(look_at(shot.view, shot.width_px, shot.height_px), drawing.vertices),
            drawing.triangles, numbers);
  for (const std::uint32_t level : target.object)
    if (level != kNone) ++sum.level_px[level];
}

}  // namespace scarp
