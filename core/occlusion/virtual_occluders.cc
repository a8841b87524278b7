#include "core/occlusion/virtual_occluders.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/sight/line_of_sight.h"
#include "core/terrain/edge_collapse.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Sections run in these directions: along them lattice places are exactly on one line.
struct Heading {
  int x, y;
};
constexpr std::array<Heading, 8> kHeadings = {
    {{1, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 1}, {-1, 2}, {-1, 1}, {-2, 1}}};

/// Depths under the ground that are tried for a section until it is under it all along: corners are
/// moved to the lattice, which shows where the ground is steep.
constexpr std::array<double, 3> kSectionDepthsM = {0x1p-8, 0x1p-4, 1};

/// A roof or a ridge falls off on one side at least four times as far as it rises on the other.
constexpr double kMostRiseShare = 0.25;

/// An edge of the mesh with lower ground beside it.
struct Ridge {
  double worth_m2;  ///< length times how far it stands out
  TriangleIndex triangle;
  std::size_t corner;
};

std::vector<Ridge> find_ridges(const Tin& tin) {
  std::vector<Ridge> ridges;
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      const TriangleIndex other = tin.neighbours[t][i];
      if (other == kNone || other < t || !bends_downwards(tin, t, i)) continue;
      const auto& across = tin.neighbours[other];
      const auto back =
          static_cast<std::size_t>(std::find(across.begin(), across.end(), t) - across.begin());
      const Position &a = tin.vertices[tin.triangles[t][(i + 1) % 3]],
                     &b = tin.vertices[tin.triangles[t][(i + 2) % 3]];
      const double one_m = tin.vertices[tin.triangles[t][i]].z_m;
      const double other_m = tin.vertices[tin.triangles[other][back]].z_m;
      const double middle_m = (a.z_m + b.z_m) / 2;
      const double fall_m = middle_m - std::min(one_m, other_m);
      if (std::max(one_m, other_m) - middle_m > kMostRiseShare * fall_m) continue;
      const double stands_out_m = middle_m - (one_m + other_m) / 2;
      if (stands_out_m > 0)
        ridges.push_back({std::hypot(b.x_m - a.x_m, b.y_m - a.y_m) * stands_out_m, t, i});
    }
  }
  std::sort(ridges.begin(), ridges.end(), [](const Ridge& a, const Ridge& b) {
    return std::tuple(-a.worth_m2, a.triangle, a.corner) <
           std::tuple(-b.worth_m2, b.triangle, b.corner);
  });
  return ridges;
}

/// A place of a section: steps of the heading from its begin, and the ground's height.
struct ProfilePoint {
  double steps;
  double z_m;
};

/// What is lost below the profile where a corner is left out, or nothing where ground would rise.
std::optional<double> loss_without(const std::vector<ProfilePoint>& profile, std::size_t i) {
  if (i == 0 || i + 1 == profile.size()) {
    const ProfilePoint &end = profile[i], &next = i == 0 ? profile[1] : profile[i - 1];
    const double floor_m = std::min(end.z_m, next.z_m);
    // An end is worth what stands on it up to the next corner, as seen from the lower one, and the
    // length itself: a section is cut short last.
    return std::abs(next.steps - end.steps) * ((end.z_m + next.z_m) / 2 - floor_m + 1);
  }
  const ProfilePoint &a = profile[i - 1], &p = profile[i], &b = profile[i + 1];
  const double share = (p.steps - a.steps) / (b.steps - a.steps);
  const double above_m = p.z_m - (a.z_m + share * (b.z_m - a.z_m));
  if (above_m < 0) return std::nullopt;
  return above_m * (b.steps - a.steps) / 2;
}

/// Leaves corners out, the cheapest first, so that the profile only falls.
void simplify_under(std::vector<ProfilePoint>& profile, std::size_t most_corners) {
  while (profile.size() > most_corners) {
    std::size_t cheapest = 0;
    double least = HUGE_VAL;
    for (std::size_t i = 0; i < profile.size(); ++i) {
      const auto loss = loss_without(profile, i);
      if (loss && *loss < least) least = *loss, cheapest = i;
    }
    profile.erase(profile.begin() + static_cast<std::ptrdiff_t>(cheapest));
  }
}

/// The ground along a heading through a place, as far as there is ground to both sides.
struct Section {
  Position begin;
  Heading heading;
  std::vector<ProfilePoint> profile;

  Position place(const ProfilePoint& point, double depth_m) const {
    const double steps = std::round(point.steps) * kLatticeStepM;
    return {begin.x_m + steps * heading.x, begin.y_m + steps * heading.y,
            std::floor((point.z_m - depth_m) / kLatticeStepM) * kLatticeStepM};
  }
};

Heading heading_along(double x_m, double y_m) {
  Heading best = kHeadings[0];
  double most = -1;
  for (const Heading& h : kHeadings) {
    const double along = std::abs(x_m * h.x + y_m * h.y) / std::hypot(h.x, h.y);
    if (along > most) most = along, best = h;
  }
  return best;
}

Section section_through(const TinIndex& index, const Bounds& bounds, const Position& a,
                        const Position& b, double reach) {
  const double length_m = std::hypot(b.x_m - a.x_m, b.y_m - a.y_m);
  Section section{{}, heading_along(b.x_m - a.x_m, b.y_m - a.y_m), {}};
  const auto& [dx, dy] = section.heading;
  const double half_m = reach * length_m + length_m / 2;
  const double half_steps = std::ceil(half_m / std::hypot(dx, dy) / kLatticeStepM);
  const Position middle = round_to_lattice(
      Position{(a.x_m + b.x_m) / 2, (a.y_m + b.y_m) / 2, std::floor(bounds.low.z_m) - 1});
  section.begin = middle;
  section.begin.x_m -= half_steps * kLatticeStepM * dx;
  section.begin.y_m -= half_steps * kLatticeStepM * dy;
  Position end = middle;
  end.x_m += half_steps * kLatticeStepM * dx;
  end.y_m += half_steps * kLatticeStepM * dy;
  // The piece without void around the middle.
  const GroundAlong along = ground_along(index, section.begin, end);
  for (const GroundCrossing& crossing : along.crossings) {
    const double steps = to_double(crossing.at) * 2 * half_steps;
    if (crossing.void_before) {
      if (steps > half_steps) break;
      section.profile.clear();
    }
    if (section.profile.empty() || std::round(section.profile.back().steps) < std::round(steps))
      section.profile.push_back({steps, crossing.ground_z_m});
    else
      section.profile.back().z_m = std::min(section.profile.back().z_m, crossing.ground_z_m);
  }
  return section;
}

/// Nothing where there is too little ground, or none of the depths is enough.
std::optional<UprightOccluder> occluder_from(const TinIndex& index, Section section,
                                             std::size_t most_corners) {
  if (section.profile.size() < 2) return std::nullopt;
  simplify_under(section.profile, most_corners);
  for (const double depth_m : kSectionDepthsM) {
    std::vector<Position> top;
    for (const ProfilePoint& point : section.profile) top.push_back(section.place(point, depth_m));
    if (is_under_ground(index, top)) return UprightOccluder(std::move(top));
  }
  return std::nullopt;
}

/// Whether a section runs so near to a ridge's middle, and so high there, that another one through
/// it would hide little more.
bool serves(const UprightOccluder& section, const Position& middle, double length_m,
            double near_m) {
  const Position &from = section.top().front(), &to = section.top().back();
  const double dx_m = to.x_m - from.x_m, dy_m = to.y_m - from.y_m;
  const double long_m = std::hypot(dx_m, dy_m);
  const double x_m = middle.x_m - from.x_m, y_m = middle.y_m - from.y_m;
  const double along_m = (x_m * dx_m + y_m * dy_m) / long_m;
  const double beside_m = std::abs(x_m * dy_m - y_m * dx_m) / long_m;
  if (beside_m > length_m || along_m < length_m || along_m > long_m - length_m) return false;
  for (std::size_t i = 0; i + 1 < section.top().size(); ++i) {
    const Position &a = section.top()[i], &b = section.top()[i + 1];
    const double piece_m = std::hypot(b.x_m - a.x_m, b.y_m - a.y_m);
    const double within_m = along_m - std::hypot(a.x_m - from.x_m, a.y_m - from.y_m);
    if (within_m < 0 || within_m > piece_m) continue;
    return a.z_m + within_m / piece_m * (b.z_m - a.z_m) > middle.z_m - near_m;
  }
  return false;
}

}  // namespace

bool is_under_ground(const TinIndex& index, const std::vector<Position>& polyline) {
  for (const Position& p : polyline)
    if (index.above_ground(p) != -1) return false;
  for (std::size_t i = 0; i + 1 < polyline.size(); ++i) {
    const GroundAlong along = ground_along(index, polyline[i], polyline[i + 1]);
    if (along.void_at_end) return false;
    for (const GroundCrossing& crossing : along.crossings)
      if (!crossing.blocks || crossing.void_before) return false;
  }
  return true;
}

Occluder simplified_under(const Tin& tin, const VirtualOccluderOptions& options) {
  const Bounds bounds = bounds_of(tin.vertices);
  CollapseOptions collapses;
  collapses.cost = CollapseCost::kVolume;
  collapses.most_above_m = options.most_raised_share * (bounds.high.z_m - bounds.low.z_m);
  collapses.may_shrink = true;
  collapses.triangles_left =
      static_cast<std::size_t>(options.triangle_share * static_cast<double>(tin.triangles.size()));
  std::vector<std::int64_t> vertex_of;
  const Tin coarse = simplified(tin, collapse_edges(tin, collapses), &vertex_of);
  return lower_under(coarse, vertex_of, tin);
}

VirtualOccluders find_virtual_occluders(const Tin& tin, const VirtualOccluderOptions& options) {
  VirtualOccluders found{simplified_under(tin, options), {}};
  const Tin& mesh = found.mesh.tin;
  if (mesh.triangles.empty()) return found;
  std::vector<Ridge> ridges = find_ridges(mesh);
  if (ridges.size() > options.most_sections) ridges.resize(options.most_sections);
  const TinIndex index(mesh);
  const Bounds bounds = bounds_of(mesh.vertices);
  std::vector<std::optional<UprightOccluder>> sections(ridges.size());
  parallel_for(ridges.size(), [&](std::size_t i) {
    const auto& corners = mesh.triangles[ridges[i].triangle];
    const Position &a = mesh.vertices[corners[(ridges[i].corner + 1) % 3]],
                   &b = mesh.vertices[corners[(ridges[i].corner + 2) % 3]];
    sections[i] = occluder_from(index, section_through(index, bounds, a, b, options.reach),
                                options.most_corners);
  });
  const double near_m = options.near_share * (bounds.high.z_m - bounds.low.z_m);
  for (std::size_t i = 0; i < ridges.size(); ++i) {
    if (!sections[i]) continue;
    const auto& corners = mesh.triangles[ridges[i].triangle];
    const Position &a = mesh.vertices[corners[(ridges[i].corner + 1) % 3]],
                   &b = mesh.vertices[corners[(ridges[i].corner + 2) % 3]];
    const Position middle{(a.x_m + b.x_m) / 2, (a.y_m + b.y_m) / 2, (a.z_m + b.z_m) / 2};
    const double length_m = std::hypot(b.x_m - a.x_m, b.y_m - a.y_m);
    const bool is_served = std::any_of(
        found.sections.begin(), found.sections.end(), [&](const UprightOccluder& earlier) {
          const Position &from = earlier.top().front(), &to = earlier.top().back();
          const Heading same = heading_along(to.x_m - from.x_m, to.y_m - from.y_m);
          const Heading own = heading_along(b.x_m - a.x_m, b.y_m - a.y_m);
          return same.x == own.x && same.y == own.y && serves(earlier, middle, length_m, near_m);
        });
    if (!is_served) found.sections.push_back(std::move(*sections[i]));
  }
  return found;
}

}  // namespace scarp
