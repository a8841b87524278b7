#include "cli/build/budget.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <vector>

#include "core/occlusion/certified/certify_groups.h"

namespace scarp {
namespace {

/// Every so many-th group is certified by a probe.
constexpr std::array<std::uint32_t, 2> kStrides = {64, 12};
constexpr std::array<int, 2> kProbeFans = {kFewestFans, 3 * kFewestFans};

double seconds_now() {
  using Clock = std::chrono::steady_clock;
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

struct Probe {
  double seconds = 0;
  double share = 0;  // of the groups
};

Probe probe(const Tin& tin, const Groups& groups, CertifiedSettings settings, int fans,
            std::uint32_t stride) {
  std::vector<GroupIndex> group_of(groups.group_of_triangle);
  for (GroupIndex& g : group_of)
    if (g != kNone) g = g % stride == 0 ? g / stride : kNone;
  const std::uint32_t count = (groups.leaf_count + stride - 1) / stride;
  settings.fans = fans;
  const double begun_s = seconds_now();
  certify_groups(tin, group_of, count, hiding_options(settings));
  return {seconds_now() - begun_s,
          static_cast<double>(count) / static_cast<double>(groups.leaf_count)};
}

}  // namespace

CertifyCost measure_certify_cost(const Tin& tin, const Groups& groups,
                                 const CertifiedSettings& settings, const Progress& progress) {
  CertifyCost cost;
  if (groups.leaf_count == 0) return cost;
  const double begun_s = seconds_now();
  std::array<double, 2> whole_s{};  // by number of fans, for all groups
  for (std::size_t f = 0; f < kProbeFans.size(); ++f) {
    const Probe few = probe(tin, groups, settings, kProbeFans[f], kStrides[0]);
    const Probe more = probe(tin, groups, settings, kProbeFans[f], kStrides[1]);
    // A surface of one group has no two shares to tell it from its groups.
    const double of_groups_s =
        more.share > few.share
            ? std::max(0.0, (more.seconds - few.seconds) / (more.share - few.share))
            : 0;
    whole_s[f] = more.seconds + (1 - more.share) * of_groups_s;
    if (progress) progress(static_cast<double>(f + 1) / kProbeFans.size());
  }
  cost.fan_s = std::max(0.0, (whole_s[1] - whole_s[0]) / (kProbeFans[1] - kProbeFans[0]));
  cost.base_s = std::max(0.0, whole_s[0] - cost.fan_s * kProbeFans[0]);
  cost.measured_s = seconds_now() - begun_s;
  return cost;
}

int fans_within(double seconds, const CertifyCost& cost) {
  const double left_s = kPlannedShare * seconds - cost.measured_s - cost.base_s;
  if (left_s >= cost.fan_s * kMostFansOfBudget) return kMostFansOfBudget;
  const auto eighths = static_cast<int>(std::floor(left_s / cost.fan_s / 8));
  return std::max(kFewestFans, 8 * eighths);
}

}  // namespace scarp
