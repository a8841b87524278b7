#include "tests/support/adversarial_check.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/occlusion/splitmix64.h"
#include "core/sight/triangle_sight.h"
#include "core/threads/parallel_for.h"

namespace scarp::test {
namespace {

/// A group's triangles and a circle around them.
struct GroupPlace {
  std::vector<TriangleIndex> triangles;
  double x_m = 0, y_m = 0, radius_m = 0;
};

std::vector<GroupPlace> places_of(const Tin& tin, std::span<const GroupIndex> group_of_triangle,
                                  std::uint32_t groups) {
  std::vector<GroupPlace> places(groups);
  for (TriangleIndex t = 0; t < group_of_triangle.size(); ++t)
    if (group_of_triangle[t] != kNone) places[group_of_triangle[t]].triangles.push_back(t);
  for (GroupPlace& place : places) {
    std::vector<Position> corners;
    for (const TriangleIndex t : place.triangles)
      for (const VertexIndex v : tin.triangles[t]) corners.push_back(tin.vertices[v]);
    if (corners.empty()) continue;
    const Bounds bounds = bounds_of(corners);
    place.x_m = bounds.low.x_m + (bounds.high.x_m - bounds.low.x_m) / 2;
    place.y_m = bounds.low.y_m + (bounds.high.y_m - bounds.low.y_m) / 2;
    for (const Position& p : corners)
      place.radius_m = std::max(place.radius_m, std::hypot(p.x_m - place.x_m, p.y_m - place.y_m));
  }
  return places;
}

/// One search: its own random numbers, group and findings.
class Search {
 public:
  Search(const TinIndex& index, const std::vector<GroupPlace>& places, const Bounds& bounds,
         const HidesGroup& hides, std::uint64_t seed)
      : index_(index), bounds_(bounds), hides_(hides), random_(seed) {
    group_ = static_cast<GroupIndex>(random_.below(places.size()));
    place_ = &places[group_];
    relief_m_ = bounds.high.z_m - bounds.low.z_m + 1;
    size_m_ = std::hypot(bounds.high.x_m - bounds.low.x_m, bounds.high.y_m - bounds.low.y_m) + 1e-3;
  }

  AdversarialReport run() {
    if (place_->triangles.empty()) return report_;
    Spot best{};
    bool found = false;
    for (int step = 0; step < kProbes + kClimbSteps; ++step) {
      const bool climbs = found && step >= kProbes;
      const Spot spot = climbs                  ? near(best)
                        : random_.below(3) == 0 ? anywhere()
                                                : beyond_a_vertex();
      if (look(spot)) best = spot, found = true;
    }
    return report_;
  }

 private:
  /// A place in the plane around the group.
  struct Spot {
    double azimuth_rad, distance_m;
  };

  Spot anywhere() {
    const double least_m = place_->radius_m, greatest_m = size_m_ * (random_.below(8) ? 1 : 30);
    return {2 * std::numbers::pi * random_.unit(),
            least_m * std::pow(std::max(greatest_m / least_m, 1.01), random_.unit())};
  }

  /// On the line from a corner of the group through a vertex, beyond it: what the vertex hides, or
  /// the gap beside it shows, begins there.
  Spot beyond_a_vertex() {
    const Tin& tin = index_.tin();
    const auto& corners = tin.triangles[place_->triangles[random_.below(place_->triangles.size())]];
    const Position& from = tin.vertices[corners[random_.below(3)]];
    const Position& over = tin.vertices[random_.below(tin.vertices.size())];
    const double share = std::pow(8.0, random_.unit());
    const double x_m = from.x_m + share * (over.x_m - from.x_m) - place_->x_m;
    const double y_m = from.y_m + share * (over.y_m - from.y_m) - place_->y_m;
    return near({std::atan2(y_m, x_m), std::hypot(x_m, y_m)});
  }

  Spot near(const Spot& spot) {
    const double turn = std::ldexp(2 * random_.unit() - 1, -static_cast<int>(random_.below(14)));
    const double stretch = std::ldexp(2 * random_.unit() - 1, -static_cast<int>(random_.below(10)));
    return {spot.azimuth_rad + turn, spot.distance_m * std::exp(stretch)};
  }

  bool sees(const Position& eye) {
    for (std::size_t i = 0; i < place_->triangles.size(); ++i)
      if (judge_triangle(index_, eye, place_->triangles[i]) == TriangleSight::kVisible) return true;
    return false;
  }

  /// Judges the highest hidden camera at a spot.
  /// @return whether it is nearer to being wrong than all before it
  bool look(const Spot& spot) {
    const double distance_m = std::clamp(spot.distance_m, place_->radius_m, 40 * size_m_);
    Position eye =
        round_to_lattice(Position{place_->x_m + std::cos(spot.azimuth_rad) * distance_m,
                                  place_->y_m + std::sin(spot.azimuth_rad) * distance_m, 0});
    const double reach_m = 20 * relief_m_ + distance_m;
    const auto hidden_at = [&](double z_m) {
      eye.z_m = z_m;
      return hides_(group_, eye);
    };
    const auto flip_m =
        highest(bounds_.low.z_m - reach_m, bounds_.high.z_m + reach_m, kLatticeStepM, hidden_at);
    if (!flip_m) return false;
    ++report_.cameras;
    const auto unseen_at = [&](double z_m) {
      eye.z_m = z_m;
      return !sees(eye);
    };
    if (!unseen_at(*flip_m)) {
      ++report_.false_culls;
      const double low_m = bounds_.low.z_m - reach_m;
      const double true_m = highest(low_m, *flip_m, kLatticeStepM, unseen_at).value_or(low_m);
      return keep({group_, {eye.x_m, eye.y_m, *flip_m}, (true_m - *flip_m) / distance_m});
    }
    // One question tells most places that are no better from those that are.
    const double room_m =
        std::min(report_.worst ? report_.worst->margin * distance_m : reach_m, reach_m);
    if (!(room_m > 0) || (report_.worst && unseen_at(round_to_lattice(*flip_m + room_m))))
      return false;
    return keep({group_, {eye.x_m, eye.y_m, *flip_m}, least_rise_m(room_m, [&](double rise_m) {
                                                        return !unseen_at(
                                                            round_to_lattice(*flip_m + rise_m));
                                                      }) / distance_m});
  }

  /// Least rise from which the group is seen, to a twentieth and never too small.
  /// @param greatest_m  a rise from which it is, or one that is as good as never
  template <class Seen>
  static double least_rise_m(double greatest_m, Seen seen_from) {
    double least_m = kLatticeStepM / 2;
    while (greatest_m > 1.05 * least_m && greatest_m > kLatticeStepM) {
      const double middle_m = std::sqrt(least_m * greatest_m);
      (seen_from(middle_m) ? greatest_m : least_m) = middle_m;
    }
    return greatest_m;
  }

  bool keep(const BorderCamera& camera) {
    if (report_.worst && report_.worst->margin <= camera.margin) return false;
    report_.worst = camera;
    return true;
  }

  /// Highest z where `holds`, which holds below it and not above, or nothing where it does not at
  /// low_m; high_m where it does there. To within step_m.
  template <class Holds>
  static std::optional<double> highest(double low_m, double high_m, double step_m, Holds holds) {
    low_m = round_to_lattice(low_m), high_m = round_to_lattice(high_m);
    if (!holds(low_m)) return {};
    if (holds(high_m)) return high_m;
    while (high_m - low_m > step_m) {
      const double middle_m = round_to_lattice(low_m + (high_m - low_m) / 2);
      if (middle_m <= low_m || middle_m >= high_m) break;
      (holds(middle_m) ? low_m : high_m) = middle_m;
    }
    return low_m;
  }

  const TinIndex& index_;
  const Bounds& bounds_;
  const HidesGroup& hides_;
  SplitMix64 random_;
  GroupIndex group_ = 0;
  const GroupPlace* place_ = nullptr;
  double relief_m_ = 0, size_m_ = 0;
  AdversarialReport report_;
};

}  // namespace

AdversarialReport adversarial_check(const TinIndex& index,
                                    std::span<const GroupIndex> group_of_triangle,
                                    std::uint32_t groups, const HidesGroup& hides,
                                    std::uint64_t seed, std::size_t searches) {
  const Tin& tin = index.tin();
  assert(group_of_triangle.size() == tin.triangles.size());
  if (groups == 0 || tin.triangles.empty()) return {};
  const std::vector<GroupPlace> places = places_of(tin, group_of_triangle, groups);
  const Bounds bounds = bounds_of(tin.vertices);
  std::vector<AdversarialReport> reports(searches);
  parallel_for(searches, [&](std::size_t i) {
    // SplitMix64 hashes its state, so that neighbouring seeds have nothing in common.
    reports[i] = Search(index, places, bounds, hides, SplitMix64(seed).next() + i).run();
  });
  AdversarialReport all;
  for (const AdversarialReport& report : reports) {
    all.cameras += report.cameras;
    all.false_culls += report.false_culls;
    if (report.worst && (!all.worst || report.worst->margin < all.worst->margin))
      all.worst = report.worst;
  }
  return all;
}

AdversarialReport adversarial_check(const Tin& tin, std::span<const GroupIndex> group_of_triangle,
                                    const CertifiedRegions& regions, std::uint64_t seed,
                                    std::size_t searches) {
  const TinIndex index(tin);
  return adversarial_check(
      index, group_of_triangle, static_cast<std::uint32_t>(regions.groups.size()),
      [&](GroupIndex group, const Position& eye) { return hides_group(regions, group, eye); }, seed,
      searches);
}

}  // namespace scarp::test
