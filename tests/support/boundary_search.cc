#include "tests/support/boundary_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/occlusion/splitmix64.h"
#include "core/sight/triangle_sight.h"
#include "core/threads/parallel_for.h"

namespace scarp::test {
namespace {

constexpr double kNoSlack = std::numeric_limits<double>::infinity();

/// A place where nothing is hidden is drawn again, this often at most.
constexpr int kMostDraws = 16;

/// The climbs around one group.
class Climber {
 public:
  Climber(const TinIndex& index, const CertifiedRegions& regions, GroupIndex group,
          std::span<const TriangleIndex> members, std::uint64_t seed)
      : index_(index), regions_(regions), group_(group), members_(members), random_(seed) {
    const Bounds bounds = bounds_of(index.tin().vertices);
    reach_m_ = std::hypot(bounds.high.x_m - bounds.low.x_m, bounds.high.y_m - bounds.low.y_m);
    // Lower cameras than that are hidden wherever higher ones are; higher ones see all of the data.
    const double relief_m = bounds.high.z_m - bounds.low.z_m + 1;
    low_m_ = bounds.low.z_m - 4 * relief_m;
    high_m_ = bounds.high.z_m + 16 * relief_m;
    finding_.least_slack_m = kNoSlack;
  }

  const BoundaryFinding& run(const BoundarySearch& search) {
    for (int i = 0; i < search.starts; ++i) climb(search.steps);
    return finding_;
  }

 private:
  /// Distances are drawn evenly in their logarithm: near a group its region changes quickest.
  void climb(int steps) {
    const CertifiedGroup& group = regions_.groups[group_];
    const auto nearest_m = static_cast<double>(group.radius_m);
    const double octaves = std::log2(std::max(2.0, 1.5 * reach_m_ / nearest_m));
    double azimuth_rad = 0, distance_m = 0, slack_m = kNoSlack;
    for (int draw = 0; draw < kMostDraws && slack_m == kNoSlack; ++draw) {
      azimuth_rad = 2 * std::numbers::pi * random_.unit();
      distance_m = nearest_m * std::exp2(octaves * random_.unit());
      slack_m = look_from(azimuth_rad, distance_m, high_m_ - low_m_);
    }
    for (int step = 0; step < steps; ++step) {
      // From a sector's width down to the lattice.
      const double share = 0.1 * std::exp2(-14.0 * step / steps);
      const double next_rad = azimuth_rad + share * (2 * random_.unit() - 1);
      const double next_m =
          std::max(nearest_m, distance_m * (1 + 2 * share * (2 * random_.unit() - 1)));
      const double found_m = look_from(next_rad, next_m, std::min(slack_m, high_m_ - low_m_));
      if (found_m > slack_m) continue;
      azimuth_rad = next_rad, distance_m = next_m, slack_m = found_m;
    }
    finding_.least_slack_m = std::min(finding_.least_slack_m, slack_m);
  }

  /// Judges just inside the boundary at a place.
  /// @return how far above it the group is seen; kNoSlack where that is not under worst_m
  double look_from(double azimuth_rad, double distance_m, double worst_m) {
    const CertifiedGroup& group = regions_.groups[group_];
    Position eye =
        round_to_lattice(Position{group.centre_x_m + distance_m * std::cos(azimuth_rad),
                                  group.centre_y_m + distance_m * std::sin(azimuth_rad), 0});
    const auto inside_m = greatest_hidden_z(regions_, group_, eye, low_m_, high_m_);
    if (!inside_m) return kNoSlack;
    ++finding_.judged;
    if (is_seen_from(eye, *inside_m)) {
      if (finding_.false_culls++ == 0) {
        finding_.group = group_;
        finding_.eye = {eye.x_m, eye.y_m, *inside_m};
      }
      return 0;
    }
    if (!is_seen_from(eye, *inside_m + worst_m)) return kNoSlack;
    double hidden_m = 0, seen_m = worst_m;
    while (seen_m - hidden_m > std::max(kLatticeStepM, seen_m / 8)) {
      const double middle_m = hidden_m + (seen_m - hidden_m) / 2;
      (is_seen_from(eye, *inside_m + middle_m) ? seen_m : hidden_m) = middle_m;
    }
    return seen_m;
  }

  bool is_seen_from(Position place, double z_m) const {
    place.z_m = round_to_lattice(z_m);
    return is_any_seen(index_, place, members_);
  }

  const TinIndex& index_;
  const CertifiedRegions& regions_;
  const GroupIndex group_;
  const std::span<const TriangleIndex> members_;
  SplitMix64 random_;
  double reach_m_ = 0, low_m_ = 0, high_m_ = 0;
  BoundaryFinding finding_;
};

}  // namespace

std::vector<std::vector<TriangleIndex>> triangles_of_groups(
    std::span<const GroupIndex> group_of_triangle, std::uint32_t groups) {
  std::vector<std::vector<TriangleIndex>> members(groups);
  for (TriangleIndex t = 0; t < group_of_triangle.size(); ++t)
    if (group_of_triangle[t] != kNone) members[group_of_triangle[t]].push_back(t);
  return members;
}

bool is_any_seen(const TinIndex& index, const Position& eye,
                 std::span<const TriangleIndex> triangles) {
  return std::any_of(triangles.begin(), triangles.end(), [&](TriangleIndex t) {
    return judge_triangle(index, eye, t) == TriangleSight::kVisible;
  });
}

std::optional<double> greatest_hidden_z(const CertifiedRegions& regions, GroupIndex group,
                                        Position place, double low_m, double high_m) {
  const auto is_hidden_from = [&](double z_m) {
    place.z_m = z_m;
    return hides_group(regions, group, place);
  };
  low_m = round_to_lattice(low_m), high_m = round_to_lattice(high_m);
  if (!is_hidden_from(low_m)) return {};
  if (is_hidden_from(high_m)) return high_m;
  while (high_m - low_m > kLatticeStepM) {
    const double middle_m = round_to_lattice(low_m + (high_m - low_m) / 2);
    (is_hidden_from(middle_m) ? low_m : high_m) = middle_m;
  }
  return low_m;
}

BoundaryFinding search_boundaries(const TinIndex& index, const CertifiedRegions& regions,
                                  const std::vector<std::vector<TriangleIndex>>& members,
                                  const BoundarySearch& search) {
  std::vector<BoundaryFinding> findings(std::min(members.size(), search.most_groups));
  parallel_for(findings.size(), [&](std::size_t i) {
    const std::size_t g = i * members.size() / findings.size();
    const auto group = static_cast<GroupIndex>(g);
    // Groups must not climb the same random path.
    SplitMix64 seeds(search.seed);
    const std::uint64_t seed = seeds.next() ^ (g * 0x9E3779B97F4A7C15U);
    findings[i] = Climber(index, regions, group, members[g], seed).run(search);
  });
  BoundaryFinding all;
  all.least_slack_m = kNoSlack;
  for (const BoundaryFinding& found : findings) {
    if (all.false_culls == 0 && found.false_culls > 0) all.group = found.group, all.eye = found.eye;
    all.judged += found.judged;
    all.false_culls += found.false_culls;
    all.least_slack_m = std::min(all.least_slack_m, found.least_slack_m);
  }
  return all;
}

}  // namespace scarp::test
