#include "tests/bench/certified_measure.h"

#include <fmt/core.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <numeric>

#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/splitmix64.h"
#include "core/occlusion/squares.h"
#include "core/sight/triangle_sight.h"
#include "tiles/store/groups_file.h"

namespace scarp::test {
namespace {

constexpr std::uint64_t kGroupSeed = 11;

/// Groups at most by which the cost of a mesh without its groups is measured.
constexpr int kOutermost = 16;

/// Orphans and sizes of all groups; then keeps the groups of some triangles, drawn at random.
void draw(std::uint32_t count, Partition& part) {
  std::vector<GroupIndex>& group_of = part.groups.group_of_triangle;
  part.all_groups = part.groups.count;
  std::vector<std::uint32_t> sizes(part.groups.count, 0);
  double orphans = 0;
  for (const GroupIndex g : group_of) {
    if (g == kNone)
      ++orphans;
    else
      ++sizes[g];
  }
  part.orphans = orphans / static_cast<double>(group_of.size());
  part.weight.assign(group_of.size(), 1);
  if (count < part.groups.count) {
    part.weight.assign(group_of.size(), 0);
    SplitMix64 random(kGroupSeed);
    std::vector<float> draws(part.groups.count, 0);
    std::vector<GroupIndex> number(part.groups.count, kNone);
    part.groups.count = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::size_t t = random.below(group_of.size());
      part.drawn.push_back(static_cast<TriangleIndex>(t));
      const GroupIndex g = group_of[t];
      if (g == kNone)
        ++part.weight[t];
      else if (++draws[g], number[g] == kNone)
        number[g] = part.groups.count++;
    }
    for (std::size_t t = 0; t < group_of.size(); ++t) {
      GroupIndex& g = group_of[t];
      if (g == kNone) continue;
      part.weight[t] = draws[g] / static_cast<float>(sizes[g]);
      g = number[g];
    }
  }
  std::sort(sizes.begin(), sizes.end());
  part.median_group = sizes[sizes.size() / 2];
}

bool is_whole(const Tin& tin, const CertifiedQuestion& question) {
  return tin.triangles.size() <= question.whole_triangles;
}

std::uint32_t groups_of(const Tin& tin, const CertifiedQuestion& question) {
  return is_whole(tin, question) ? UINT32_MAX : question.groups;
}

/// Whether a height counts for a partition.
bool counts_at(const SeenCounts& counts) {
  return counts.in_hidden >= kLeastInHiddenGroups * counts.triangles;
}

/// Whether bounds hide a group, before they are coded.
bool is_under(const HidingBounds& bounds, GroupIndex group, const Position& eye) {
  const Circle& circle = bounds.circle[group];
  const double x_m = eye.x_m - circle.x_m, y_m = eye.y_m - circle.y_m;
  const double distance_m = std::hypot(x_m, y_m);
  const double inner_m = circle.radius_m * kFirstRing;
  if (!(distance_m > inner_m)) return false;
  const std::int32_t ring =
      ring_of(bounds.layout, static_cast<float>(distance_m * distance_m / (inner_m * inner_m)));
  if (ring < 0) return false;
  const float slope =
      bounds.at(group, sector_of(bounds.layout, x_m, y_m))[static_cast<std::size_t>(ring)];
  return eye.z_m < bounds.height_m[group] + static_cast<double>(slope) * distance_m;
}

/// The outermost groups: ridges are looked for as far around them as around all.
std::vector<GroupIndex> outermost(const HidingBounds& bounds) {
  std::vector<GroupIndex> few;
  for (int i = 0; i < kOutermost; ++i) {
    const double azimuth_rad = 2 * std::numbers::pi * i / kOutermost;
    const double x = std::cos(azimuth_rad), y = std::sin(azimuth_rad);
    GroupIndex best = 0;
    for (GroupIndex g = 1; g < bounds.circle.size(); ++g)
      if (x * (bounds.circle[g].x_m - bounds.circle[best].x_m) +
              y * (bounds.circle[g].y_m - bounds.circle[best].y_m) >
          0)
        best = g;
    if (std::find(few.begin(), few.end(), best) == few.end()) few.push_back(best);
  }
  return few;
}

/// What all groups cost, from the cost of those drawn and of a few of them.
double predicted_s(const Tin& tin, const HidingOptions& options, const Partition& part,
                   double drawn_s) {
  const std::vector<GroupIndex> few = outermost(part.bounds);
  const auto others = static_cast<double>(part.groups.count) - static_cast<double>(few.size());
  const auto triangles = [](const std::vector<GroupIndex>& groups) {
    return static_cast<double>(groups.size()) -
           static_cast<double>(std::count(groups.begin(), groups.end(), kNone));
  };
  const double drawn = triangles(part.groups.group_of_triangle);
  const double all = static_cast<double>(tin.triangles.size()) * (1 - part.orphans);
  if (others < 1) return drawn_s / drawn * all;
  std::vector<GroupIndex> number(part.groups.count, kNone);
  for (std::size_t i = 0; i < few.size(); ++i) number[few[i]] = static_cast<GroupIndex>(i);
  std::vector<GroupIndex> group_of = part.groups.group_of_triangle;
  for (GroupIndex& g : group_of)
    if (g != kNone) g = number[g];
  const double begun_s = user_seconds();
  const HidingBounds bounds =
      bound_hiding(tin, group_of, static_cast<std::uint32_t>(few.size()), options);
  compress_bounds(bounds, LeastGround(tin));
  const double few_s = user_seconds() - begun_s;
  const double triangle_s = std::max(0.0, drawn_s - few_s) / (drawn - triangles(group_of));
  return drawn_s + triangle_s * (all - drawn);
}

}  // namespace

double user_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec);
}

double wall_seconds() {
  using Clock = std::chrono::steady_clock;
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

Partition crystals_of(const Tin& tin, const CertifiedQuestion& question) {
  Partition part;
  part.name = "crystals";
  HiddenTogetherOptions together;
  together.group_triangles = question.group_triangles;
  together.compactness = question.compactness;
  const double begun_s = user_seconds();
  part.groups = grow_hidden_together(tin, together);
  part.grow_user_s = user_seconds() - begun_s;
  draw(groups_of(tin, question), part);
  return part;
}

Partition squares_like(const Tin& tin, const Partition& crystals,
                       const CertifiedQuestion& question) {
  Partition part;
  part.name = "squares";
  part.groups =
      group_by_squares(tin, static_cast<std::uint32_t>(tin.triangles.size() / crystals.all_groups));
  draw(groups_of(tin, question), part);
  return part;
}

void certify(const Tin& tin, const CertifiedQuestion& question, Partition& part) {
  CertifiedSettings certified = question.certified;
  certified.sectors = question.sectors.value_or(
      sectors_within(question.bytes, tin.triangles.size(), part.all_groups));
  const HidingOptions options = hiding_options(certified);
  const double user_s = user_seconds(), wall_s = wall_seconds();
  part.bounds = bound_hiding(tin, part.groups.group_of_triangle, part.groups.count, options);
  part.regions = compress_bounds(part.bounds, LeastGround(tin));
  part.certify_user_s = user_seconds() - user_s;
  part.certify_wall_s = wall_seconds() - wall_s;
  if (const auto broken = check_certified(part.regions)) {
    fmt::print(stderr, "BROKEN: {}\n", *broken);
    std::exit(1);
  }
  const auto triangles = static_cast<double>(tin.triangles.size());
  part.bytes_per_triangle = static_cast<double>(kept_bytes(part.regions)) / part.groups.count *
                            part.all_groups / triangles;
  if (part.groups.count == part.all_groups) return;
  const double all_s = predicted_s(tin, options, part, part.certify_user_s);
  part.certify_wall_s *= all_s / std::max(part.certify_user_s, 1e-9);
  part.certify_user_s = all_s;
}

std::vector<JudgedEye> judge_eyes(const Tin& tin, const std::vector<const Partition*>& parts,
                                  int eyes) {
  std::vector<TriangleIndex> judged;
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t)
    if (std::any_of(parts.begin(), parts.end(),
                    [&](const Partition* p) { return p->weight[t] > 0; }))
      judged.push_back(t);
  std::vector<JudgedEye> all;
  const TinIndex index(tin);
  for_each_eye(tin, eyes, [&](std::size_t height, const Position& eye) {
    JudgedEye look{height, eye, std::vector<std::uint8_t>(tin.triangles.size(), 0)};
    const std::vector<TriangleSight> sight = judge_each(index, eye, judged);
    for (std::size_t i = 0; i < judged.size(); ++i)
      look.is_visible[judged[i]] = sight[i] == TriangleSight::kVisible;
    all.push_back(std::move(look));
  });
  return all;
}

int eyes_for(const Tin& tin, const CertifiedQuestion& question) {
  return question.eyes * (is_whole(tin, question) ? kEyesOfWhole : 1);
}

void count_eyes(const std::vector<JudgedEye>& eyes, Partition& part) {
  part.counts = {};
  for (auto& culled_eyes : part.culled_eyes) culled_eyes.assign(part.groups.count, 0);
  const auto& group_of = part.groups.group_of_triangle;
  for (const JudgedEye& look : eyes) {
    std::vector<std::uint8_t> seen(part.groups.count, 0), culled(part.groups.count),
        bound(part.groups.count);
    for (std::size_t t = 0; t < group_of.size(); ++t)
      if (look.is_visible[t] && group_of[t] != kNone) seen[group_of[t]] = 1;
    for (GroupIndex g = 0; g < part.groups.count; ++g) {
      culled[g] = hides_group(part.regions, g, look.eye);
      bound[g] = is_under(part.bounds, g, look.eye);
      part.culled_eyes[look.height][g] += culled[g];
    }
    SeenCounts& counts = part.counts[look.height];
    for (std::size_t t = 0; t < group_of.size(); ++t) {
      const auto weight = static_cast<double>(part.weight[t]);
      if (!(weight > 0)) continue;
      const GroupIndex g = group_of[t];
      const bool is_culled = g != kNone && culled[g], is_bound = g != kNone && bound[g];
      counts.triangles += weight;
      counts.hidden += look.is_visible[t] ? 0 : weight;
      counts.in_hidden += g != kNone && !seen[g] ? weight : 0;
      counts.culled += is_culled ? weight : 0;
      counts.bound += is_bound ? weight : 0;
      counts.falsely += (is_culled || is_bound) && look.is_visible[t];
    }
  }
}

std::optional<Advantage> advantage_of(const Partition& part, const Partition& over) {
  double culled = 0, culled_over = 0, hidden = 0, hidden_over = 0;
  for (std::size_t h = 0; h < part.counts.size(); ++h) {
    if (!counts_at(part.counts[h])) continue;
    culled += part.counts[h].culled, culled_over += over.counts[h].culled;
    hidden += part.counts[h].in_hidden, hidden_over += over.counts[h].in_hidden;
  }
  if (!(culled_over > 0)) return {};
  Advantage advantage{culled / culled_over, hidden / hidden_over, 0};
  const auto of_draw = [&](const Partition& p, TriangleIndex t) {
    double eyes = 0;
    for (std::size_t h = 0; h < part.counts.size(); ++h)
      if (counts_at(part.counts[h]) && p.groups.group_of_triangle[t] != kNone)
        eyes += p.culled_eyes[h][p.groups.group_of_triangle[t]];
    return eyes;
  };
  // Of a ratio of sums over the same draws (Cochran 1977, 2.11).
  double squares = 0;
  for (const TriangleIndex t : part.drawn) {
    const double off = of_draw(part, t) - advantage.culled * of_draw(over, t);
    squares += off * off;
  }
  const auto draws = static_cast<double>(part.drawn.size());
  if (draws > 1) advantage.error = std::sqrt(squares * draws / (draws - 1)) / culled_over;
  return advantage;
}

nlohmann::json row_of(const Tin& tin, const Partition& part) {
  const double triangles = static_cast<double>(tin.triangles.size());
  nlohmann::json row = {{"groups", part.all_groups},
                        {"groups_judged", part.groups.count},
                        {"median_group", part.median_group},
                        {"orphans", part.orphans},
                        {"sectors", part.regions.layout.sectors},
                        {"bytes_per_triangle", part.bytes_per_triangle},
                        {"certify_us_per_triangle", 1e6 * part.certify_user_s / triangles},
                        {"certify_wall_s", part.certify_wall_s}};
  double false_culls = 0;
  for (std::size_t h = 0; h < part.counts.size(); ++h) {
    const SeenCounts& c = part.counts[h];
    false_culls += c.falsely;
    const auto ratio = [](double part_of, double whole) {
      return whole > 0 ? nlohmann::json(part_of / whole) : nlohmann::json();
    };
    row["heights"].push_back({{"eye_height_m", kEyeHeightsM[h]},
                              {"hidden", ratio(c.hidden, c.triangles)},
                              {"in_hidden_groups", ratio(c.in_hidden, c.triangles)},
                              {"culled", ratio(c.culled, c.triangles)},
                              {"share", ratio(c.culled, c.in_hidden)},
                              {"raw", ratio(c.bound, c.in_hidden)},
                              {"of_hidden", ratio(c.culled, c.hidden)},
                              {"counts", counts_at(c)}});
  }
  row["false_culls"] = false_culls;
  return row;
}

}  // namespace scarp::test
