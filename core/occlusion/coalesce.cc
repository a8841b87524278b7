#include <algorithm>
#include <bit>
#include <numeric>
#include <queue>

#include "core/occlusion/growth_ground.h"

namespace scarp {
namespace {

struct Crystal {
  std::uint32_t triangles = 1;
  std::uint32_t seen = 0;     // eyes
  std::uint32_t version = 0;  // of its size, so that older unions are known
  GrowthPlace place;          // mean
};

/// Two neighbours that could coalesce, as they were when the loss was worked out.
struct Union {
  double loss;
  std::uint32_t a, b;
  std::uint32_t version_a, version_b;

  /// The heap's top is the largest: what loses least, the lowest indices on ties.
  friend bool operator<(const Union& x, const Union& y) {
    if (x.loss != y.loss) return x.loss > y.loss;
    return x.a != y.a ? x.a > y.a : x.b > y.b;
  }
};

class Coalescence {
 public:
  Coalescence(const GrowthGround& ground, std::uint32_t min_group_triangles)
      : ground_(ground),
        min_triangles_(min_group_triangles),
        bits_(ground.seen.bits),
        crystals_(ground.places.size()),
        into_(crystals_.size()),
        links_(crystals_.size()),
        visited_(crystals_.size(), kNone),
        count_(static_cast<std::uint32_t>(crystals_.size())) {
    std::iota(into_.begin(), into_.end(), 0U);
    for (std::uint32_t t = 0; t < crystals_.size(); ++t) {
      crystals_[t].place = ground.places[t];
      crystals_[t].seen = seen_by_both(t, t);
      const auto neighbours = ground.neighbours_of(t);
      links_[t].assign(neighbours.begin(), neighbours.end());
    }
    small_ = min_triangles_ > 1 ? count_ : 0;
    for (std::uint32_t t = 0; t < crystals_.size(); ++t)
      for (const std::uint32_t n : links_[t])
        if (n > t) offer(t, n);
  }

  /// Ends early where few enough crystals are large and the small ones are to join others.
  void run(std::uint32_t groups, bool leave_small) {
    while (count_ > groups && !unions_.empty()) {
      if (leave_small && count_ <= groups + groups / 2 && count_ - small_ <= groups) return;
      const Union next = unions_.top();
      unions_.pop();
      if (is_current(next.a, next.version_a) && is_current(next.b, next.version_b))
        unite(next.a, next.b);
    }
  }

  void join_small() {
    std::vector<std::uint32_t> open;
    for (std::uint32_t c = 0; c < crystals_.size(); ++c)
      if (into_[c] == c && crystals_[c].triangles < min_triangles_) open.push_back(c);
    std::stable_sort(open.begin(), open.end(), [&](std::uint32_t a, std::uint32_t b) {
      return crystals_[a].triangles < crystals_[b].triangles;
    });
    for (std::uint32_t c : open) {
      while (into_[c] == c && crystals_[c].triangles < min_triangles_) {
        const std::vector<std::uint32_t> near = links_of(c);
        if (near.empty()) break;
        const std::uint32_t best = *std::min_element(
            near.begin(), near.end(),
            [&](std::uint32_t a, std::uint32_t b) { return loss_of(c, a) < loss_of(c, b); });
        unite(c, best);
      }
    }
  }

  Partition take() {
    Partition partition{std::vector<GroupIndex>(crystals_.size()), 0};
    std::vector<GroupIndex> number(crystals_.size(), kNone);
    for (std::uint32_t t = 0; t < crystals_.size(); ++t) {
      GroupIndex& group = number[root_of(t)];
      if (group == kNone) group = partition.count++;
      partition.group_of_triangle[t] = group;
    }
    return partition;
  }

 private:
  bool is_current(std::uint32_t c, std::uint32_t version) const {
    return into_[c] == c && crystals_[c].version == version;
  }

  std::uint32_t root_of(std::uint32_t c) {
    while (into_[c] != c) c = into_[c] = into_[into_[c]];
    return c;
  }

  std::uint32_t seen_by_both(std::uint32_t a, std::uint32_t b) const {
    const std::size_t words = ground_.seen.words;
    const std::uint64_t* of_a = bits_.data() + a * words;
    const std::uint64_t* of_b = bits_.data() + b * words;
    int seen = 0;
    for (std::size_t i = 0; i < words; ++i) seen += std::popcount(of_a[i] | of_b[i]);
    return static_cast<std::uint32_t>(seen);
  }

  double loss_of(std::uint32_t a, std::uint32_t b) const {
    const Crystal &x = crystals_[a], &y = crystals_[b];
    const double of_x = x.triangles, of_y = y.triangles;
    const double spread = x.place.weight * y.place.weight / (x.place.weight + y.place.weight) *
                          squared_distance_m2(x.place, y.place);
    return (of_x + of_y) * seen_by_both(a, b) - of_x * x.seen - of_y * y.seen +
           ground_.spread_price * spread;
  }

  void offer(std::uint32_t a, std::uint32_t b) {
    if (a > b) std::swap(a, b);
    unions_.push({loss_of(a, b), a, b, crystals_[a].version, crystals_[b].version});
  }

  /// Neighbours of a crystal, each once, and short from now on.
  std::vector<std::uint32_t> links_of(std::uint32_t c) {
    std::vector<std::uint32_t> links;
    visited_[c] = c;
    for (const std::uint32_t link : links_[c]) {
      const std::uint32_t other = root_of(link);
      if (visited_[other] == c) continue;
      visited_[other] = c;
      links.push_back(other);
    }
    visited_[c] = kNone;
    for (const std::uint32_t link : links) visited_[link] = kNone;
    links_[c] = links;
    return links;
  }

  void unite(std::uint32_t a, std::uint32_t b) {
    // The one with more links stays, so that few of them are copied.
    if (links_[a].size() < links_[b].size()) std::swap(a, b);
    Crystal &stays = crystals_[a], &goes = crystals_[b];
    for (const Crystal* c : {&stays, &goes}) small_ -= c->triangles < min_triangles_ ? 1 : 0;
    const GrowthPlace &here = stays.place, &there = goes.place;
    const double weight = here.weight + there.weight;
    stays.place = {(here.weight * here.x_m + there.weight * there.x_m) / weight,
                   (here.weight * here.y_m + there.weight * there.y_m) / weight, weight};
    stays.triangles += goes.triangles;
    stays.seen = seen_by_both(a, b);
    ++stays.version;
    small_ += stays.triangles < min_triangles_ ? 1 : 0;
    const std::size_t words = ground_.seen.words;
    for (std::size_t i = 0; i < words; ++i) bits_[a * words + i] |= bits_[b * words + i];
    into_[b] = a;
    --count_;
    links_[a].insert(links_[a].end(), links_[b].begin(), links_[b].end());
    links_[b] = {};
    for (const std::uint32_t other : links_of(a)) offer(a, other);
  }

  const GrowthGround& ground_;
  std::uint32_t min_triangles_;
  std::vector<std::uint64_t> bits_;  // of the crystal, in the row of its root
  std::vector<Crystal> crystals_;
  std::vector<std::uint32_t> into_;  // a forest: the root is its own
  std::vector<std::vector<std::uint32_t>> links_;
  std::vector<std::uint32_t> visited_;
  std::priority_queue<Union> unions_;
  std::uint32_t count_, small_ = 0;
};

}  // namespace

Partition coalesce(const GrowthGround& ground, std::uint32_t groups,
                   std::uint32_t min_group_triangles) {
  Coalescence coalescence(ground, min_group_triangles);
  coalescence.run(groups, true);
  coalescence.join_small();
  coalescence.run(groups, false);
  return coalescence.take();
}

}  // namespace scarp
