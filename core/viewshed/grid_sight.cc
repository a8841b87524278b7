#include "core/viewshed/grid_sight.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/geodesy/predicates.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// kNone: they do not cross. kClear: over known ground, on or under the line.
enum class Meeting { kNone, kClear, kBlocked, kVoid };

bool same_plan(const Position& a, const Position& b) {
  return a.x_m == b.x_m && a.y_m == b.y_m;
}

/// Is p, known to lie on the line through a and b in the plane, strictly between them?
bool strictly_between(const Position& a, const Position& b, const Position& p) {
  const bool along_x = a.x_m != b.x_m;
  const double from = along_x ? a.x_m : a.y_m, to = along_x ? b.x_m : b.y_m;
  const double at = along_x ? p.x_m : p.y_m;
  return std::min(from, to) < at && at < std::max(from, to);
}

/// A sample against the open segment eye - target that passes exactly over or beside it.
/// @param side  orient2d(eye, target, sample)
Meeting meet_sample(const Position& eye, const Position& target, const Position& sample, int side,
                    bool known) {
  if (side != 0 || !strictly_between(eye, target, sample)) return Meeting::kNone;
  if (!known) return Meeting::kVoid;
  return above_line(eye, target, sample) > 0 ? Meeting::kBlocked : Meeting::kClear;
}

/// The inside of the grid segment u - v against the open segment eye - target.
Meeting meet_inside(const Position& eye, const Position& target, const Position& u, int u_side,
                    bool u_known, const Position& v, int v_side, bool v_known) {
  if (u_side * v_side >= 0) return Meeting::kNone;
  if (orient2d(u, v, eye) * orient2d(u, v, target) >= 0) return Meeting::kNone;
  if (!u_known || !v_known) return Meeting::kVoid;
  // Where the two cross, the ground is above the sight line when v lies above the plane through
  // the sight line and u.
  return orient3d(eye, target, u, v) * u_side > 0 ? Meeting::kBlocked : Meeting::kClear;
}

Seen worse(Seen sight, Meeting meeting) {
  if (meeting == Meeting::kBlocked) return Seen::kHidden;
  if (meeting == Meeting::kVoid && sight == Seen::kVisible) return Seen::kUnknown;
  return sight;
}

/// A vertical segment with its lower end at low, against the segment u - v, ends included.
Meeting meet_standing(const Position& low, const Position& u, bool u_known, const Position& v,
                      bool v_known) {
  for (const auto& [p, known] : {std::pair(u, u_known), std::pair(v, v_known)})
    if (same_plan(p, low))
      return !known ? Meeting::kVoid : p.z_m > low.z_m ? Meeting::kBlocked : Meeting::kNone;
  if (same_plan(u, v) || orient2d(u, v, low) != 0 || !strictly_between(u, v, low))
    return Meeting::kNone;
  if (!u_known || !v_known) return Meeting::kVoid;
  return above_line(u, v, low) < 0 ? Meeting::kBlocked : Meeting::kNone;
}

}  // namespace

/// A segment on its way over the grid lines that it crosses: columns or rows.
struct GridSight::Walk {
  const GridSight& sight;
  Position target;
  bool over_columns = true;
  std::int32_t lines = 0, samples = 0;  ///< grid lines, and samples on each
  int upper_side =
      1;  ///< side of the segment, as orient2d has it, where a line's first samples lie
  double eye_line = 0, target_line = 0;
  double eye_sample = 0, samples_per_line = 0;

  Position at(std::int32_t line, std::int32_t i) const {
    return over_columns ? sight.grid_.at(line, i) : sight.grid_.at(i, line);
  }
  bool is_known(std::int32_t line, std::int32_t i) const {
    return over_columns ? sight.grid_.is_known(line, i) : sight.grid_.is_known(i, line);
  }
  int side(const Position& p) const { return orient2d(sight.eye_, target, p); }

  std::int32_t guess(std::int32_t line) const {
    const double at = eye_sample + (line - eye_line) * samples_per_line;
    return static_cast<std::int32_t>(std::clamp(std::floor(at), -1.0, samples - 1.0));
  }
  /// The last sample of a line that is not beyond the segment; -1 where all are.
  std::int32_t last_before(std::int32_t line, std::int32_t from) const {
    std::int32_t i = std::clamp(from, -1, samples - 1);
    while (i + 1 < samples && upper_side * side(at(line, i + 1)) >= 0) ++i;
    while (i >= 0 && upper_side * side(at(line, i)) < 0) --i;
    return i;
  }
};

GridSight::GridSight(const GroundGrid& grid, const Position& eye)
    : grid_(grid), eye_(eye), frame_(plan_frame(grid, eye)) {}

bool GridSight::runs_across(const Position& target) const {
  return std::abs(frame_.across(target.x_m, target.y_m)) >=
         std::abs(frame_.down(target.x_m, target.y_m));
}

GridSight::Walk GridSight::start_walk(const Position& target, std::int32_t column, std::int32_t row,
                                      bool over_columns) const {
  const double across = frame_.across(target.x_m, target.y_m);
  const double down = frame_.down(target.x_m, target.y_m);
  Walk walk{*this, target};
  walk.over_columns = over_columns;
  walk.lines = walk.over_columns ? grid_.columns() : grid_.rows();
  walk.samples = walk.over_columns ? grid_.rows() : grid_.columns();
  // Looking east or north, the first samples of a line (north, west) are on the left.
  walk.upper_side = walk.over_columns ? (across > 0 ? 1 : -1) : (down < 0 ? 1 : -1);
  walk.eye_line = walk.over_columns ? frame_.eye_column : frame_.eye_row;
  walk.eye_sample = walk.over_columns ? frame_.eye_row : frame_.eye_column;
  walk.target_line = walk.over_columns ? column : row;
  const double target_sample = walk.over_columns ? row : column;
  const double run = walk.target_line - walk.eye_line;
  walk.samples_per_line = std::abs(run) > 0.5 ? (target_sample - walk.eye_sample) / run : 0;
  return walk;
}

/// Calls visit(u, u_known, v, v_known), until it returns false, for the segments between samples
/// that the walk may cross near the lines; where the walk passes over a sample, one has it as u.
template <typename Visit>
void GridSight::visit_lines(const Walk& walk, std::int32_t first_line, std::int32_t last_line,
                            const Visit& visit) const {
  const auto at = [&](std::int32_t line, std::int32_t i, std::int32_t to_line, std::int32_t to_i) {
    return visit(walk.at(line, i), walk.is_known(line, i), walk.at(to_line, to_i),
                 walk.is_known(to_line, to_i));
  };
  const std::int32_t step = first_line <= last_line ? 1 : -1;
  std::int32_t before = walk.last_before(first_line, walk.guess(first_line));
  for (std::int32_t line = first_line;; line += step) {
    // Beyond the last sample of a line the walk can only pass over that.
    const std::int32_t to = before + 1 < walk.samples ? before + 1 : before - 1;
    if (before >= 0 && !at(line, before, line, to)) return;
    if (line == last_line) return;
    const std::int32_t next = line + step;
    const std::int32_t after = walk.last_before(
        next, before + static_cast<std::int32_t>(std::lround(step * walk.samples_per_line)));
    for (std::int32_t i = std::min(before, after) + 1; i <= std::max(before, after); ++i)
      if (!at(line, i, next, i)) return;
    before = after;
  }
}

Seen GridSight::walk_lines(const Walk& walk, std::int32_t first_line,
                           std::int32_t last_line) const {
  Seen sight = Seen::kVisible;
  visit_lines(walk, first_line, last_line,
              [&](const Position& u, bool u_known, const Position& v, bool v_known) {
                const int u_side = walk.side(u);
                sight = worse(sight, u_side == 0 ? meet_sample(eye_, walk.target, u, 0, u_known)
                                                 : meet_inside(eye_, walk.target, u, u_side,
                                                               u_known, v, walk.side(v), v_known));
                return sight != Seen::kHidden;
              });
  return sight;
}

/// As walk_lines, but tells how high the walk's end must be for the ground not to block it.
double GridSight::climb_lines_m(const Walk& walk, std::int32_t first_line, std::int32_t last_line,
                                bool& over_void) const {
  double least_m = -std::numeric_limits<double>::infinity();
  const Position& target = walk.target;
  const double run_x = target.x_m - eye_.x_m, run_y = target.y_m - eye_.y_m;
  const double run2 = run_x * run_x + run_y * run_y;
  visit_lines(walk, first_line, last_line,
              [&](const Position& u, bool u_known, const Position& v, bool v_known) {
                const int u_side = walk.side(u);
                // Blocked or not, the segment meets the ground: a sunken target tells.
                const Position sunken{target.x_m, target.y_m, -kLatticeReachM};
                const Meeting meeting = u_side == 0 ? meet_sample(eye_, sunken, u, 0, u_known)
                                                    : meet_inside(eye_, sunken, u, u_side, u_known,
                                                                  v, walk.side(v), v_known);
                if (meeting == Meeting::kVoid) over_void = true;
                if (meeting != Meeting::kBlocked) return true;
                double x = u.x_m - eye_.x_m, y = u.y_m - eye_.y_m, z = u.z_m - eye_.z_m;
                if (u_side != 0) {
                  const double from = run_x * y - run_y * x;
                  const double to = run_x * (v.y_m - eye_.y_m) - run_y * (v.x_m - eye_.x_m);
                  const double f = from / (from - to);
                  x += f * (v.x_m - u.x_m);
                  y += f * (v.y_m - u.y_m);
                  z += f * (v.z_m - u.z_m);
                }
                const double reach = (x * run_x + y * run_y) / run2;
                const double rise_m = z / reach;
                constexpr double kRounding = 1e-12;
                least_m = std::max(
                    least_m, eye_.z_m + rise_m + kRounding * (std::abs(rise_m) + std::sqrt(run2)));
                return true;
              });
  return least_m;
}

/// The lines between the eye and the walk's end, from there on. Lines that the segment does not
/// reach do no harm: each meeting is tested by itself. Two more to each side hold for an eye that
/// is only estimated, and for a target off its line.
std::pair<std::int32_t, std::int32_t> GridSight::all_lines(const Walk& walk) const {
  constexpr double kMore = 2;
  const auto line = [&](double at) {
    return static_cast<std::int32_t>(std::clamp(at, 0.0, walk.lines - 1.0));
  };
  const std::int32_t low = line(std::floor(std::min(walk.eye_line, walk.target_line)) - kMore);
  const std::int32_t high = line(std::ceil(std::max(walk.eye_line, walk.target_line)) + kMore);
  return walk.target_line > walk.eye_line ? std::pair(high, low) : std::pair(low, high);
}

double GridSight::least_z_m(const Position& sample, std::int32_t column, std::int32_t row,
                            bool& over_void) const {
  if (same_plan(eye_, sample)) return eye_.z_m < sample.z_m ? kLatticeReachM : sample.z_m;
  const Walk walk = start_walk(sample, column, row, runs_across(sample));
  const auto [first, last] = all_lines(walk);
  return climb_lines_m(walk, first, last, over_void);
}

double GridSight::least_z_between_m(const Position& sample, std::int32_t column, std::int32_t row,
                                    bool over_columns, std::int32_t first_line,
                                    std::int32_t last_line) const {
  const Walk walk = start_walk(sample, column, row, over_columns);
  bool over_void = false;
  return climb_lines_m(walk, std::clamp(first_line, 0, walk.lines - 1),
                       std::clamp(last_line, 0, walk.lines - 1), over_void);
}

Seen GridSight::judge(const Position& target, std::int32_t column, std::int32_t row) const {
  if (same_plan(eye_, target)) return judge_vertical(target);
  const Walk walk = start_walk(target, column, row, runs_across(target));
  const auto [first, last] = all_lines(walk);
  return walk_lines(walk, first, last);
}

std::pair<std::int32_t, std::int32_t> GridSight::nearest_sample(const Position& target) const {
  const PlanFrame at = plan_frame(grid_, target);
  constexpr double kFarthest = 1e9;  // beyond any grid, within 32 bits
  return {static_cast<std::int32_t>(std::clamp(std::round(at.eye_column), -kFarthest, kFarthest)),
          static_cast<std::int32_t>(std::clamp(std::round(at.eye_row), -kFarthest, kFarthest))};
}

Seen GridSight::judge(const Position& target) const {
  const auto [column, row] = nearest_sample(target);
  return judge(target, column, row);
}

GroundAlong GridSight::ground_along(const Position& target) const {
  assert(!same_plan(eye_, target));
  const auto [column, row] = nearest_sample(target);
  const Walk walk = start_walk(target, column, row, runs_across(target));
  struct Found {
    GroundCrossing crossing;
    bool is_void;
  };
  std::vector<Found> found;
  const auto [first, last] = all_lines(walk);
  visit_lines(
      walk, first, last, [&](const Position& u, bool u_known, const Position& v, bool v_known) {
        const int u_side = walk.side(u);
        const Meeting meeting =
            u_side == 0 ? meet_sample(eye_, target, u, 0, u_known)
                        : meet_inside(eye_, target, u, u_side, u_known, v, walk.side(v), v_known);
        if (meeting == Meeting::kNone) return true;
        GroundCrossing crossing;
        crossing.at =
            u_side == 0 ? place_in_plan(eye_, target, u) : crossing_in_plan(eye_, target, u, v);
        crossing.ground_z_m = u.z_m;
        if (u_side != 0)
          crossing.ground_z_m += to_double(crossing_in_plan(u, v, eye_, target)) * (v.z_m - u.z_m);
        crossing.blocks = meeting == Meeting::kBlocked;
        found.push_back({crossing, meeting == Meeting::kVoid});
        return true;
      });
  std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) {
    return compare(a.crossing.at, b.crossing.at) < 0;
  });
  // A sample is met on its line, and again as the end of segments to the next.
  const auto same = [](const Found& a, const Found& b) {
    return compare(a.crossing.at, b.crossing.at) == 0;
  };
  found.erase(std::unique(found.begin(), found.end(), same), found.end());
  GroundAlong along;
  for (Found& f : found) {
    if (!f.is_void) {
      f.crossing.void_before = along.void_at_end;
      along.crossings.push_back(f.crossing);
    }
    along.void_at_end = f.is_void;
  }
  return along;
}

bool GridSight::is_blocked_between(const Position& target, std::int32_t column, std::int32_t row,
                                   bool over_columns, std::int32_t first_line,
                                   std::int32_t last_line) const {
  if (same_plan(eye_, target)) return judge_vertical(target) == Seen::kHidden;
  const Walk walk = start_walk(target, column, row, over_columns);
  return walk_lines(walk, std::clamp(first_line, 0, walk.lines - 1),
                    std::clamp(last_line, 0, walk.lines - 1)) == Seen::kHidden;
}

Seen GridSight::judge_vertical(const Position& target) const {
  const Position& low = eye_.z_m < target.z_m ? eye_ : target;
  Seen sight = Seen::kVisible;
  constexpr double kMore = 2;
  const auto within = [](double at, std::int32_t count) {
    return static_cast<std::int32_t>(std::clamp(at, 0.0, count - 1.0));
  };
  const std::int32_t west = within(frame_.eye_column - kMore, grid_.columns());
  const std::int32_t east = within(frame_.eye_column + kMore, grid_.columns());
  const std::int32_t north = within(frame_.eye_row - kMore, grid_.rows());
  const std::int32_t south = within(frame_.eye_row + kMore, grid_.rows());
  const auto meet = [&](std::int32_t c, std::int32_t r, std::int32_t to_c, std::int32_t to_r) {
    sight = worse(sight, meet_standing(low, grid_.at(c, r), grid_.is_known(c, r),
                                       grid_.at(to_c, to_r), grid_.is_known(to_c, to_r)));
  };
  for (std::int32_t r = north; r <= south; ++r) {
    for (std::int32_t c = west; c <= east; ++c) {
      if (c < east) meet(c, r, c + 1, r);
      if (r < south) meet(c, r, c, r + 1);
    }
  }
  return sight;
}

Seen sight_by_every_segment(const GroundGrid& grid, const Position& eye, const Position& target) {
  Seen sight = Seen::kVisible;
  const bool vertical = same_plan(eye, target);
  const Position& low = eye.z_m < target.z_m ? eye : target;
  const auto meet = [&](std::int32_t c, std::int32_t r, std::int32_t to_c, std::int32_t to_r) {
    if (to_c >= grid.columns() || to_r >= grid.rows()) return;
    const Position u = grid.at(c, r), v = grid.at(to_c, to_r);
    const bool u_known = grid.is_known(c, r), v_known = grid.is_known(to_c, to_r);
    if (vertical) {
      sight = worse(sight, meet_standing(low, u, u_known, v, v_known));
      return;
    }
    const int u_side = orient2d(eye, target, u), v_side = orient2d(eye, target, v);
    sight = worse(sight, meet_sample(eye, target, u, u_side, u_known));
    sight = worse(sight, meet_sample(eye, target, v, v_side, v_known));
    sight = worse(sight, meet_inside(eye, target, u, u_side, u_known, v, v_side, v_known));
  };
  for (std::int32_t r = 0; r < grid.rows(); ++r) {
    for (std::int32_t c = 0; c < grid.columns(); ++c) {
      meet(c, r, c + 1, r);
      meet(c, r, c, r + 1);
    }
  }
  return sight;
}

void exhaustive_viewshed(const GroundGrid& grid, const Position& eye, double target_height_m,
                         std::span<Seen> sight) {
  const auto columns = static_cast<std::size_t>(grid.columns());
  assert(sight.size() == columns * static_cast<std::size_t>(grid.rows()));
  const GridSight judge(grid, eye);
  parallel_for(static_cast<std::size_t>(grid.rows()), [&](std::size_t r) {
    const auto row = static_cast<std::int32_t>(r);
    for (std::size_t c = 0; c < columns; ++c) {
      const auto column = static_cast<std::int32_t>(c);
      sight[r * columns + c] =
          grid.is_known(column, row)
              ? judge.judge(grid.raised(column, row, target_height_m), column, row)
              : Seen::kUnknown;
    }
  });
}

}  // namespace scarp
