#include "core/viewshed/ray_climb.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace scarp {

RayClimb::RayClimb(const GroundGrid& grid, const PlanFrame& frame, double eye_z_m,
                   bool over_columns, int outwards, double forwards, double sideways)
    : grid_(grid),
      frame_(frame),
      eye_z_m_(eye_z_m),
      over_columns_(over_columns),
      outwards_(outwards),
      samples_(over_columns ? grid.rows() : grid.columns()),
      forwards_(forwards),
      sideways_(sideways),
      eye_line_(over_columns ? frame.eye_column : frame.eye_row),
      eye_sample_(over_columns ? frame.eye_row : frame.eye_column),
      samples_per_line_(outwards * sideways / forwards) {}

RayClimb::Seen2d RayClimb::look(std::int32_t line, std::int32_t i) const {
  const Position p = over_columns_ ? grid_.at(line, i) : grid_.at(i, line);
  const double across = frame_.across(p.x_m, p.y_m), down = frame_.down(p.x_m, p.y_m);
  const double forwards = outwards_ * (over_columns_ ? across : down);
  const double sideways = over_columns_ ? down : across;
  return {forwards, p.z_m - eye_z_m_, sideways * forwards_ - forwards * sideways_};
}

/// The last sample of a line that is not beyond the ray; -1 where all are.
std::int32_t RayClimb::last_before(std::int32_t line, Seen2d& before, Seen2d& after) const {
  const double guess = std::floor(eye_sample_ + (line - eye_line_) * samples_per_line_);
  auto i = static_cast<std::int32_t>(std::clamp(guess, 0.0, samples_ - 1.0));
  before = look(line, i);
  // Where lines bend, the first look tells how many samples the guess was off.
  const double off = std::floor(-before.beside / forwards_);
  if (std::abs(off) > 1) {
    i = static_cast<std::int32_t>(std::clamp(i + off, 0.0, samples_ - 1.0));
    before = look(line, i);
  }
  if (before.beside > 0) {
    do {
      after = before;
      if (--i < 0) return i;
      before = look(line, i);
    } while (before.beside > 0);
    return i;
  }
  for (; i + 1 < samples_; ++i, before = after) {
    after = look(line, i + 1);
    if (after.beside > 0) break;
  }
  return i;
}

std::optional<double> RayClimb::slope_at(std::int32_t line) const {
  const std::int32_t lead = line - outwards_;
  if (lead < 0 || lead >= (over_columns_ ? grid_.columns() : grid_.rows())) return {};
  const auto passes_by_end = [&](std::int32_t last) { return last < 1 || last + 2 >= samples_; };
  Seen2d before{}, after{}, lead_before{}, lead_after{};
  const std::int32_t here = last_before(line, before, after);
  if (passes_by_end(here)) return {};
  const std::int32_t there = last_before(lead, lead_before, lead_after);
  if (passes_by_end(there)) return {};
  double most = -std::numeric_limits<double>::infinity();
  const auto meet = [&](const Seen2d& u, const Seen2d& v) {
    const double share = u.beside / (u.beside - v.beside);
    const double forwards = u.forwards + share * (v.forwards - u.forwards);
    const double rise_m = u.rise_m + share * (v.rise_m - u.rise_m);
    most = std::max(most, rise_m / forwards);
  };
  meet(before, after);
  for (std::int32_t i = std::min(here, there) + 1; i <= std::max(here, there); ++i) {
    const Seen2d u = look(line, i), v = look(lead, i);
    if (u.beside != v.beside) meet(u, v);
  }
  return most;
}

}  // namespace scarp
