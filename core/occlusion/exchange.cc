#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "core/occlusion/growth_ground.h"

namespace scarp {
namespace {

/// Softened counts are whole multiples of 1 / kSoftUnit, so that sums do not drift.
constexpr double kSoftUnit = 65536;
/// From here on one more seen triangle makes no difference.
constexpr std::size_t kManySeen = 1024;

class Exchange {
 public:
  Exchange(const GrowthGround& ground, std::uint32_t min_group_triangles, Partition& partition)
      : ground_(ground),
        min_triangles_(min_group_triangles),
        group_of_(partition.group_of_triangle),
        groups_(partition.count),
        seen_(partition.count * std::size_t{ground.seen.eyes}, 0) {
    for (TriangleIndex t = 0; t < group_of_.size(); ++t) {
      Group& group = groups_[group_of_[t]];
      ++group.triangles;
      group.add(ground.places[t], 1);
      std::uint32_t* counts = counts_of(group_of_[t]);
      for_each_eye(t, [&](std::size_t eye) { ++counts[eye]; });
    }
  }

  void run(const ExchangeRound& round) {
    for (std::size_t c = 0; c < soft_.size(); ++c)
      soft_[c] =
          c == 0 ? 0
                 : static_cast<std::int64_t>(std::round(kSoftUnit * static_cast<double>(c) /
                                                        (static_cast<double>(c) + round.softness)));
    for (GroupIndex g = 0; g < groups_.size(); ++g) {
      groups_[g].seen = 0;
      for (std::size_t eye = 0; eye < ground_.seen.eyes; ++eye)
        groups_[g].seen += soft(counts_of(g)[eye]);
    }
    for (std::uint32_t sweep = 0; sweep < round.sweeps; ++sweep) {
      bool moved = false;
      for (TriangleIndex t = 0; t < group_of_.size(); ++t) moved |= try_to_move(t);
      if (!moved) break;
    }
  }

 private:
  struct Group {
    std::uint32_t triangles = 0;
    std::int64_t seen = 0;  // softened eyes that see it, in units
    double x = 0, y = 0;    // sums of its triangles' places by weight
    double weight = 0;

    void add(const GrowthPlace& place, double sign) {
      x += sign * place.weight * place.x_m;
      y += sign * place.weight * place.y_m;
      weight += sign * place.weight;
    }
    GrowthPlace mean() const { return {x / weight, y / weight, weight}; }
  };

  std::uint32_t* counts_of(GroupIndex group) {
    return seen_.data() + group * std::size_t{ground_.seen.eyes};
  }

  std::int64_t soft(std::uint32_t count) const {
    return soft_[std::min<std::size_t>(count, kManySeen)];
  }

  template <class Visit>
  void for_each_eye(TriangleIndex t, Visit visit) const {
    const auto words = ground_.seen.of(t);
    for (std::size_t i = 0; i < words.size(); ++i)
      for (std::uint64_t rest = words[i]; rest != 0; rest &= rest - 1)
        visit(i * 64 + static_cast<std::size_t>(std::countr_zero(rest)));
  }

  bool try_to_move(TriangleIndex t) {
    const GroupIndex from = group_of_[t];
    const auto neighbours = ground_.neighbours_of(t);
    if (std::all_of(neighbours.begin(), neighbours.end(),
                    [&](TriangleIndex n) { return group_of_[n] == from; }))
      return false;
    if (groups_[from].triangles <= min_triangles_ || groups_[from].triangles <= 1) return false;
    const std::int64_t seen_less = seen_without(t, from);
    const double kept = loss_left(t, from, seen_less);
    double best = 0;
    std::int64_t best_more = 0;
    GroupIndex to = kNone;
    for (const TriangleIndex n : neighbours) {
      const GroupIndex other = group_of_[n];
      if (other == from || other == to) continue;
      const std::int64_t seen_more = seen_with(t, other);
      const double gain = kept - loss_added(t, other, seen_more);
      if (gain <= best) continue;
      best = gain;
      best_more = seen_more;
      to = other;
    }
    if (to == kNone || !holds_together_without(t)) return false;
    move(t, from, to);
    groups_[from].seen -= seen_less;
    groups_[to].seen += best_more;
    return true;
  }

  std::int64_t seen_without(TriangleIndex t, GroupIndex group) {
    std::int64_t less = 0;
    const std::uint32_t* counts = counts_of(group);
    for_each_eye(t, [&](std::size_t eye) { less += soft(counts[eye]) - soft(counts[eye] - 1); });
    return less;
  }

  std::int64_t seen_with(TriangleIndex t, GroupIndex group) {
    std::int64_t more = 0;
    const std::uint32_t* counts = counts_of(group);
    for_each_eye(t, [&](std::size_t eye) { more += soft(counts[eye] + 1) - soft(counts[eye]); });
    return more;
  }

  /// What the loss of the group falls by when the triangle leaves.
  double loss_left(TriangleIndex t, GroupIndex group, std::int64_t seen_less) const {
    const Group& g = groups_[group];
    const double all = g.triangles;
    const double seen =
        all * static_cast<double>(g.seen) - (all - 1) * static_cast<double>(g.seen - seen_less);
    const GrowthPlace& place = ground_.places[t];
    return seen / kSoftUnit + ground_.spread_price * place.weight * g.weight /
                                  (g.weight - place.weight) * squared_distance_m2(place, g.mean());
  }

  double loss_added(TriangleIndex t, GroupIndex group, std::int64_t seen_more) const {
    const Group& g = groups_[group];
    const double all = g.triangles;
    const double seen =
        (all + 1) * static_cast<double>(g.seen + seen_more) - all * static_cast<double>(g.seen);
    const GrowthPlace& place = ground_.places[t];
    return seen / kSoftUnit + ground_.spread_price * place.weight * g.weight /
                                  (g.weight + place.weight) * squared_distance_m2(place, g.mean());
  }

  void move(TriangleIndex t, GroupIndex from, GroupIndex to) {
    std::uint32_t *left = counts_of(from), *joined = counts_of(to);
    for_each_eye(t, [&](std::size_t eye) {
      --left[eye];
      ++joined[eye];
    });
    --groups_[from].triangles;
    ++groups_[to].triangles;
    groups_[from].add(ground_.places[t], -1);
    groups_[to].add(ground_.places[t], 1);
    group_of_[t] = to;
  }

  /// Whether the triangle's neighbours in its group reach each other without it.
  bool holds_together_without(TriangleIndex t) {
    const GroupIndex group = group_of_[t];
    open_.clear();
    std::size_t to_reach = 0;
    for (const TriangleIndex n : ground_.neighbours_of(t))
      if (group_of_[n] == group) {
        ++to_reach;
        if (open_.empty()) open_.push_back(n);
      }
    if (to_reach <= 1) return to_reach == 1;
    const auto neighbours = ground_.neighbours_of(t);
    std::size_t reached = 1;
    for (std::size_t next = 0; next < open_.size() && open_.size() < kLookAround; ++next)
      for (const TriangleIndex n : ground_.neighbours_of(open_[next])) {
        if (n == t || group_of_[n] != group ||
            std::find(open_.begin(), open_.end(), n) != open_.end())
          continue;
        open_.push_back(n);
        if (std::find(neighbours.begin(), neighbours.end(), n) != neighbours.end() &&
            ++reached == to_reach)
          return true;
      }
    return false;
  }

  const GrowthGround& ground_;
  std::uint32_t min_triangles_;
  std::vector<GroupIndex>& group_of_;
  std::vector<Group> groups_;
  std::vector<std::uint32_t> seen_;  // [groups * eyes] triangles that the eye sees
  std::array<std::int64_t, kManySeen + 1> soft_{};
  std::vector<TriangleIndex> open_;
};

}  // namespace

void exchange(const GrowthGround& ground, std::span<const ExchangeRound> rounds,
              std::uint32_t min_group_triangles, Partition& partition) {
  Exchange exchange(ground, min_group_triangles, partition);
  for (const ExchangeRound& round : rounds) exchange.run(round);
}

}  // namespace scarp
