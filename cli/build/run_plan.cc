#include "cli/build/run_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <mutex>

#include "cli/build/step_run.h"
#include "core/error/error.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Steps of one kind that follow each other in the plan.
struct Stretch {
  std::size_t first = 0, end = 0;
};

std::vector<Stretch> stretches_of(const BuildPlan& plan) {
  std::vector<Stretch> stretches;
  for (std::size_t i = 0; i < plan.steps.size(); ++i) {
    // Coarser levels wait for the level under them.
    const auto same = [&](std::size_t a) {
      return plan.steps[a].kind == plan.steps[i].kind &&
             (!plan.steps[a].tile || plan.steps[a].tile->level == plan.steps[i].tile->level);
    };
    if (stretches.empty() || !same(stretches.back().first)) stretches.push_back({i, i});
    stretches.back().end = i + 1;
  }
  return stretches;
}

/// How far a stretch of steps is, by their costs. Told from several threads.
class StretchProgress {
 public:
  StretchProgress(const BuildPlan& plan, const std::vector<std::size_t>& steps, Progress progress)
      : plan_(plan), progress_(std::move(progress)) {
    for (const std::size_t step : steps) whole_s_ += plan.steps[step].cost_s;
  }

  void tell(std::size_t step, double done) {
    const std::scoped_lock lock(mutex_);
    double& part = part_[step];
    part = std::max(part, done);
    double done_s = 0;
    for (const auto& [index, share] : part_) done_s += share * plan_.steps[index].cost_s;
    if (progress_) progress_(done_s / whole_s_);
  }

 private:
  const BuildPlan& plan_;
  Progress progress_;
  std::mutex mutex_;
  double whole_s_ = 0;
  std::map<std::size_t, double> part_;
};

/// Meshes are made by one thread each, so several are made at once; other steps use all threads.
std::size_t steps_at_once(const BuildPlan& plan, const Stretch& stretch) {
  const PlanStep& step = plan.steps[stretch.first];
  if (step.kind != StepKind::kMesh && step.kind != StepKind::kLevel) return 1;
  std::uint64_t bytes = 0;
  for (std::size_t i = stretch.first; i < stretch.end; ++i)
    bytes = std::max(bytes, plan.steps[i].memory_bytes);
  const std::uint64_t allowed = plan.options.common.memory_budget_bytes;
  const auto fitting = static_cast<std::size_t>(allowed > 0 ? allowed / bytes : 1);
  return std::clamp(fitting, std::size_t{1}, static_cast<std::size_t>(thread_count()));
}

/// GDAL's share of the memory: some rows of blocks of a large file. The last step goes over layers
/// once, tile by tile.
void limit_cache(const BuildPlan& plan, StepKind kind) {
  constexpr std::uint64_t kLeast = 16U << 20;
  const std::uint64_t most = std::uint64_t{kind == StepKind::kFinish ? 64U : 256U} << 20;
  limit_raster_cache(std::clamp(plan.options.common.memory_budget_bytes / 8, kLeast, most));
}

void run_stretch(Workspace& work, const Stretch& stretch, ProgressBar& bar) {
  const BuildPlan& plan = work.plan();
  std::vector<std::size_t> steps;
  for (std::size_t i = stretch.first; i < stretch.end; ++i)
    if (!work.is_done(i)) steps.push_back(i);
  if (steps.empty()) return;
  limit_cache(plan, plan.steps[stretch.first].kind);
  if (steps.size() == 1) {  // its parts have bars of their own
    run_step(work, steps.front(), [&](const std::string& part) { return bar.stage(part); });
    return;
  }
  StretchProgress progress(plan, steps, bar.stage(name_of(plan.steps[stretch.first].kind)));
  const std::size_t at_once = steps_at_once(plan, stretch);
  for (std::size_t first = 0; first < steps.size(); first += at_once) {
    parallel_for(std::min(at_once, steps.size() - first), [&](std::size_t k) {
      const std::size_t step = steps[first + k];
      run_step(work, step, [&, step](const std::string&) {
        return [&, step](double done) { progress.tell(step, done); };
      });
      progress.tell(step, 1);
    });
  }
}

}  // namespace

void run_plan(Workspace& work, ProgressBar& bar) {
  for (const Stretch& stretch : stretches_of(work.plan())) run_stretch(work, stretch, bar);
}

bool run_one_step(Workspace& work, std::size_t step, ProgressBar& bar) {
  const BuildPlan& plan = work.plan();
  if (step >= plan.steps.size())
    throw Error(ErrorCode::kUsage,
                fmt::format("--step {}: the plan has steps 0 to {}", step, plan.steps.size() - 1));
  if (work.is_done(step)) return false;
  const auto missing = [&](std::size_t before) {
    if (work.is_done(before)) return;
    throw Error(ErrorCode::kUsage,
                fmt::format("--step {}: '{}' wants step {}, '{}', done before; do that first", step,
                            plan.steps[step].name(), before, plan.steps[before].name()));
  };
  std::ranges::for_each(plan.steps[step].after, missing);
  limit_cache(plan, plan.steps[step].kind);
  run_step(work, step, [&](const std::string& part) { return bar.stage(part); });
  return true;
}

}  // namespace scarp
