#include "core/sight/line_of_sight.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <vector>

#include "core/geodesy/predicates.h"
#include "core/sight/lattice_algebra.h"

namespace scarp {
namespace {

bool same_place(const Position& a, const Position& b) {
  return a.x_m == b.x_m && a.y_m == b.y_m;
}

/// The vertices of a triangle, counter-clockwise.
std::array<Position, 3> corners_of(const Tin& tin, TriangleIndex t) {
  const auto& [a, b, c] = tin.triangles[t];
  return {tin.vertices[a], tin.vertices[b], tin.vertices[c]};
}

/// Whether the segment, just after its end `from`, runs strictly under ground: `from` lies strictly
/// under a triangle that the direction to `to` stays over for a while. Only at the border of
/// the data does this differ from `from` being strictly under ground.
bool starts_under_ground(const TinIndex& index, const Position& from, const Position& to) {
  bool under = false;
  index.visit_triangles_at(from.x_m, from.y_m, [&](TriangleIndex t) {
    const auto [a, b, c] = corners_of(index.tin(), t);
    const auto leaves_over = [&](const Position& p, const Position& q) {
      return orient2d(p, q, from) == 0 && orient2d(p, q, to) < 0;
    };
    if (orient3d(a, b, c, from) < 0 && !leaves_over(a, b) && !leaves_over(b, c) &&
        !leaves_over(c, a))
      under = true;
  });
  return under;
}

/// Whether p, which is on the line through a and b in plan, lies strictly between them.
bool is_between(const Position& a, const Position& b, const Position& p) {
  const auto strictly = [](double low, double at, double high) {
    return low < at ? at < high : low > at && at > high;
  };
  return a.x_m != b.x_m ? strictly(a.x_m, p.x_m, b.x_m) : strictly(a.y_m, p.y_m, b.y_m);
}

/// A place along the line where an edge, or a vertex (from == to), crosses it in plan.
struct Meeting {
  VertexIndex from, to;
  bool above;  ///< strictly above the line
};

/// Calls found(meeting) where an edge, or an end of it, lies under or above the open segment a-b
/// (not vertical), until it returns true.
template <class Found>
bool visit_meetings_of(const TinIndex& index, const MeshEdge& edge, const Position& a,
                       const Position& b, Found found) {
  const std::vector<Position>& vertices = index.tin().vertices;
  const auto visit_vertex = [&](VertexIndex w) {
    const Position& p = vertices[w];
    return is_between(a, b, p) && found(Meeting{w, w, above_line(a, b, p) > 0});
  };
  const Position& u = vertices[edge.from];
  const Position& v = vertices[edge.to];
  const int u_side = orient2d(a, b, u), v_side = orient2d(a, b, v);
  if (u_side * v_side > 0) return false;
  if (u_side == 0 && visit_vertex(edge.from)) return true;
  if (v_side == 0 && visit_vertex(edge.to)) return true;
  if (u_side * v_side == 0 || orient2d(u, v, a) * orient2d(u, v, b) >= 0) return false;
  // Where v lies on the left, a-u-v is counter-clockwise, and the edge is above the line exactly
  // where b lies below their plane; where v lies on the right, the sign is the other one.
  return found(Meeting{edge.from, edge.to, orient3d(a, u, v, b) * v_side < 0});
}

/// Calls found(meeting) for each vertex and edge under or above the open segment a-b (not
/// vertical), until it returns true; those that the floor leaves out may be missing. An edge that
/// runs along the segment in plan counts by its vertices and by the triangles at the segment's
/// ends: the highest place over the line is at one of those.
template <class Found>
bool visit_meetings(const TinIndex& index, const Position& a, const Position& b,
                    const HeightFloor& floor, Found found) {
  const std::array<Position, 2> ends{a, b};
  return index.visit_edges(ends, floor, [&](std::uint32_t e) {
    return visit_meetings_of(index, index.edges()[e], a, b, found);
  });
}

Fraction place_of(const Tin& tin, const Position& a, const Position& b, const Meeting& meeting) {
  const Position& u = tin.vertices[meeting.from];
  return meeting.from == meeting.to ? place_in_plan(a, b, u)
                                    : crossing_in_plan(a, b, u, tin.vertices[meeting.to]);
}

/// Calls found(meeting) for each vertex and edge strictly above the open segment a-b.
template <class Found>
bool visit_obstacles(const TinIndex& index, const Position& a, const Position& b, Found found) {
  const HeightFloor floor(a, std::span(&b, 1));
  return visit_meetings(index, a, b, floor,
                        [&](const Meeting& meeting) { return meeting.above && found(meeting); });
}

/// The stretch of a-b in plan that lies over the closed triangle.
struct Stretch {
  Fraction first, last;
};
std::optional<Stretch> stretch_over(const Tin& tin, TriangleIndex t, const Position& a,
                                    const Position& b) {
  const std::array<Position, 3> corners = corners_of(tin, t);
  Stretch stretch{kFirstEnd, kLastEnd};
  for (std::size_t i = 0; i < 3; ++i) {
    const Position& u = corners[i];
    const Position& v = corners[(i + 1) % 3];
    const int a_side = orient2d(u, v, a), b_side = orient2d(u, v, b);
    if (a_side < 0 && b_side < 0) return {};
    if (a_side >= 0 && b_side >= 0) continue;
    const Fraction at = crossing_in_plan(a, b, u, v);
    if (a_side < 0 && compare(stretch.first, at) < 0) stretch.first = at;
    if (b_side < 0 && compare(at, stretch.last) < 0) stretch.last = at;
  }
  if (compare(stretch.first, stretch.last) > 0) return {};
  return stretch;
}

/// Where in plan a line meets the border of the ground.
struct BorderContacts {
  std::optional<Fraction> first_exit;  ///< to void, through the inside of an edge
  std::optional<Fraction> last_entry;  ///< from void, in the same way
  bool at_a = false;                   ///< an end lies on the border
  bool at_b = false;
  bool grazes = false;  ///< between its ends it passes over a vertex of the border or along an edge
};

BorderContacts border_contacts(const TinIndex& index, const Position& a, const Position& b) {
  BorderContacts contacts;
  index.visit_border_edges_along(a, b, [&](const MeshEdge& edge) {
    const Position& u = index.tin().vertices[edge.from];
    const Position& v = index.tin().vertices[edge.to];
    const int u_side = orient2d(a, b, u), v_side = orient2d(a, b, v);
    if (u_side * v_side > 0) return;
    const int a_side = orient2d(u, v, a), b_side = orient2d(u, v, b);
    if (a_side * b_side > 0) return;
    if (a_side == 0 && b_side == 0) {
      contacts.grazes = true;  // in one line; whether they overlap is for the full walk
    } else if (a_side == 0) {
      contacts.at_a = true;
    } else if (b_side == 0) {
      contacts.at_b = true;
    } else if (u_side * v_side == 0) {
      contacts.grazes = true;
    } else {
      const Fraction at = crossing_in_plan(a, b, u, v);
      std::optional<Fraction>& kept = a_side > 0 ? contacts.first_exit : contacts.last_entry;
      const bool earlier = kept && compare(at, *kept) < 0;
      if (!kept || earlier == (a_side > 0)) kept = at;  // ground lies on the left of an edge
    }
  });
  return contacts;
}

/// Whether in plan some place of a-b over void lies between two places of it over ground.
bool has_void_between_ground(const TinIndex& index, const Position& a, const Position& b) {
  const BorderContacts contacts = border_contacts(index, a, b);
  if (contacts.first_exit && contacts.last_entry &&
      compare(*contacts.first_exit, *contacts.last_entry) < 0)
    return true;
  // Without a crossing or touch between its ends a line is over ground or over void all along, and
  // between two places of ground only where both ends lie on the border.
  if (!contacts.grazes && !(contacts.at_a && contacts.at_b) &&
      !(contacts.first_exit && contacts.at_b) && !(contacts.at_a && contacts.last_entry))
    return false;
  std::vector<Stretch> stretches;
  index.visit_triangles_along(a, b, [&](TriangleIndex t) {
    if (const auto stretch = stretch_over(index.tin(), t, a, b)) stretches.push_back(*stretch);
  });
  std::sort(stretches.begin(), stretches.end(),
            [](const Stretch& s, const Stretch& t) { return compare(s.first, t.first) < 0; });
  for (std::size_t i = 1; i < stretches.size(); ++i) {
    Stretch& next = stretches[i];
    const Fraction& reached = stretches[i - 1].last;
    if (compare(reached, next.first) < 0) return true;
    if (compare(next.last, reached) < 0) next.last = reached;
  }
  return false;
}

bool is_over_enclosed_void(const TinIndex& index, const Position& p) {
  return index.triangle_at(p.x_m, p.y_m) == kNone && index.is_in_hole(p.x_m, p.y_m);
}

bool is_strictly_under(const TinIndex& index, const Position& p) {
  return index.above_ground(p).value_or(1) < 0;
}

}  // namespace

bool is_blocked(const TinIndex& index, const Position& a, const Position& b) {
  if (same_place(a, b)) return is_strictly_under(index, a.z_m < b.z_m ? a : b);
  return starts_under_ground(index, a, b) || starts_under_ground(index, b, a) ||
         visit_obstacles(index, a, b, [](const Meeting&) { return true; });
}

bool is_blocked_by(const TinIndex& index, const MeshEdge& edge, const Position& a,
                   const Position& b) {
  return visit_meetings_of(index, edge, a, b, [](const Meeting& meeting) { return meeting.above; });
}

Sight unblocked_sight(const TinIndex& index, const Position& a, const Position& b) {
  if (is_over_enclosed_void(index, a) || is_over_enclosed_void(index, b)) return Sight::kUnknown;
  if (!same_place(a, b) && has_void_between_ground(index, a, b)) return Sight::kUnknown;
  return Sight::kVisible;
}

Sight line_of_sight(const TinIndex& index, const Position& a, const Position& b) {
  return is_blocked(index, a, b) ? Sight::kHidden : unblocked_sight(index, a, b);
}

std::optional<Blocker> first_blocker(const TinIndex& index, const Position& a, const Position& b) {
  if (same_place(a, b)) {
    if (!is_blocked(index, a, b)) return {};
    return Blocker{a.z_m <= b.z_m ? 0.0 : 1.0, kNone, kNone};
  }
  if (starts_under_ground(index, a, b)) return Blocker{0, kNone, kNone};
  std::optional<Fraction> nearest;
  Meeting blocker{kNone, kNone, true};
  visit_obstacles(index, a, b, [&](const Meeting& meeting) {
    const Fraction at = place_of(index.tin(), a, b, meeting);
    if (nearest && compare(at, *nearest) >= 0) return false;
    nearest = at;
    blocker = meeting;
    return false;
  });
  if (nearest) return Blocker{to_double(*nearest), blocker.from, blocker.to};
  if (starts_under_ground(index, b, a)) return Blocker{1, kNone, kNone};
  return {};
}

GroundAlong ground_along(const TinIndex& index, const Position& a, const Position& b) {
  assert(!same_place(a, b));
  const Tin& tin = index.tin();
  GroundAlong along;
  visit_meetings(index, a, b, HeightFloor(), [&](const Meeting& meeting) {
    const Position& u = tin.vertices[meeting.from];
    const Position& v = tin.vertices[meeting.to];
    double z_m = u.z_m;
    if (meeting.from != meeting.to)
      z_m += to_double(crossing_in_plan(u, v, a, b)) * (v.z_m - u.z_m);
    along.crossings.push_back({place_of(tin, a, b, meeting), z_m, meeting.above, false});
    return false;
  });
  auto& crossings = along.crossings;
  const auto before = [](const GroundCrossing& c, const GroundCrossing& d) {
    return compare(c.at, d.at) < 0;
  };
  std::sort(crossings.begin(), crossings.end(), before);
  const auto same = [](const GroundCrossing& c, const GroundCrossing& d) {
    return compare(c.at, d.at) == 0;
  };
  crossings.erase(std::unique(crossings.begin(), crossings.end(), same), crossings.end());
  const bool from_hole = is_over_enclosed_void(index, a);
  for (std::size_t i = 0; i < crossings.size(); ++i) {
    const double from = i == 0 ? 0 : to_double(crossings[i - 1].at);
    const Position middle =
        round_to_lattice(place_between(a, b, (from + to_double(crossings[i].at)) / 2));
    crossings[i].void_before =
        i == 0 ? from_hole : index.triangle_at(middle.x_m, middle.y_m) == kNone;
  }
  along.void_at_end = is_over_enclosed_void(index, b);
  return along;
}

}  // namespace scarp
