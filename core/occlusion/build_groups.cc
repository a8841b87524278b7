#include "core/occlusion/build_groups.h"

#include <algorithm>
#include <utility>

#include "core/occlusion/group_tree.h"

namespace scarp {
namespace {

/// Share of the time that goes into growing crystals: progress only.
constexpr double kGrowthShare = 0.5;

template <class Grow>
Groups build(const Tin& tin, const HorizonTable& horizon, const Progress& progress,
             GroupingReport* report, Grow grow) {
  Progress growth, tree;
  if (progress) {
    growth = [&](double done) { progress(kGrowthShare * done); };
    tree = [&](double done) { progress(kGrowthShare + (1 - kGrowthShare) * done); };
  }
  LeafGroups leaves = grow(growth);
  if (report) {
    const auto& groups = leaves.group_of_triangle;
    report->passes = leaves.passes;
    report->orphans =
        static_cast<std::uint32_t>(std::count(groups.begin(), groups.end(), GroupIndex{kNone}));
  }
  return build_group_tree(tin, horizon, std::move(leaves), tree);
}

}  // namespace

Groups build_groups(const Tin& tin, const HorizonTable& horizon,
                    const HiddenTogetherOptions& options, const Progress& progress,
                    GroupingReport* report) {
  return build(tin, horizon, progress, report,
               [&](const Progress& growth) { return grow_hidden_together(tin, options, growth); });
}

Groups build_groups(const Tin& tin, const HorizonTable& horizon, const CrystalOptions& options,
                    const Progress& progress, GroupingReport* report) {
  return build(tin, horizon, progress, report, [&](const Progress& growth) {
    return grow_crystals(tin, horizon, options, growth);
  });
}

}  // namespace scarp
