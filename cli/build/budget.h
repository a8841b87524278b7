#pragma once

#include <cstdint>

#include "cli/build/certified_settings.h"
#include "core/occlusion/groups.h"
#include "core/threads/progress.h"

namespace scarp {

/// What certifying costs by the number of fans, wall seconds with the threads of this run.
struct CertifyCost {
  double base_s = 0;
  double fan_s = 0;       ///< for each fan
  double measured_s = 0;  ///< that finding out took

  double at(int fans) const { return base_s + fan_s * fans; }
};

/// Measures by certifying few of the groups with few fans: cost is a sum of what the surface takes,
/// once and for each fan, and of what each group takes, once and for each fan.
/// Accuracy: about a fifth, on a machine that does nothing else; less where there are few groups.
/// Cost: about what 10 fans take for all groups, and 250 fans for none.
CertifyCost measure_certify_cost(const Tin& tin, const Groups& groups,
                                 const CertifiedSettings& settings, const Progress& progress);

/// The most fans whose cost stays within `seconds`, what was spent on measuring included; the
/// fewest where none does. A multiple of 8, from kFewestFans to kMostFansOfBudget.
int fans_within(double seconds, const CertifyCost& cost);

/// Fewer are so wide that each costs more, and the sum no less.
inline constexpr int kFewestFans = 32;
/// More find hardly more.
inline constexpr int kMostFansOfBudget = 1024;

/// Part of a budget that is planned with: the rest is for what measuring gets wrong.
inline constexpr double kPlannedShare = 0.85;

}  // namespace scarp
