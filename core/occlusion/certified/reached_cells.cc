#include "core/occlusion/certified/reached_cells.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/threads/for_each_target.h"

namespace scarp {
namespace {

constexpr float kNothing = -std::numeric_limits<float>::infinity();
constexpr float kEverything = std::numeric_limits<float>::infinity();

/// What the kernels read of cells.
struct CellColumns {
  const float *near_inverse, *far_inverse, *forward, *low_x, *low_y, *high_x, *high_y;
  const float *low_rad, *high_rad;
};

/// @param first_of_ring  [kRings + 1] cells
SCARP_FOR_EACH_TARGET
void raise_cells(const CellColumns& cells, const CellPlane* planes, std::size_t plane_count,
                 std::size_t first_ring, const std::uint32_t* first_of_ring, float* least,
                 float* best) {
  const std::size_t first = first_of_ring[first_ring], end = first_of_ring[kRings];
  for (std::size_t i = first; i < end; ++i) least[i] = kEverything;
  for (std::size_t p = 0; p < plane_count; ++p) {
    const CellPlane plane = planes[p];
    const std::size_t beyond = first_of_ring[plane.first_ring];
    for (std::size_t i = first; i < beyond; ++i) {
      const bool is_passed =
          (plane.high_rad < cells.low_rad[i]) | (plane.low_rad > cells.high_rad[i]);
      least[i] = is_passed ? least[i] : kNothing;
    }
    const float* inverse = plane.rise < 0 ? cells.near_inverse : cells.far_inverse;
    const float* line_inverse = plane.line_rise < 0 ? cells.near_inverse : cells.far_inverse;
    for (std::size_t i = beyond; i < end; ++i) {
      const float slope = plane.rise * inverse[i];
      const float at_low = plane.x * cells.low_x[i] + plane.y * cells.low_y[i];
      const float at_high = plane.x * cells.high_x[i] + plane.y * cells.high_y[i];
      const float gradient = (at_low < at_high ? at_low : at_high) - plane.slope_error;
      const float in_cell = slope - std::abs(slope) * kSlopeRounding + gradient;
      const float along =
          plane.line_rise * line_inverse[i] + (plane.rising * cells.forward[i] + plane.falling);
      const float bound = in_cell < along ? along : in_cell;
      const bool is_passed =
          (plane.high_rad < cells.low_rad[i]) | (plane.low_rad > cells.high_rad[i]);
      const float of_rays = is_passed ? kEverything : bound;
      least[i] = of_rays < least[i] ? of_rays : least[i];
    }
  }
  for (std::size_t i = first; i < end; ++i) best[i] = best[i] < least[i] ? least[i] : best[i];
}

/// Raises the bounds of rings from `first` on to the lowest of some planes along any ray.
SCARP_FOR_EACH_TARGET
void raise_rings(const RingTable& rings, const RingRow& forward, const CellPlane* planes,
                 std::size_t plane_count, std::size_t first, float* least, float* best) {
  for (std::size_t k = 0; k < kRings; ++k) least[k] = kEverything;
  for (std::size_t p = 0; p < plane_count; ++p) {
    const CellPlane plane = planes[p];
    const RingRow& inverse = plane.line_rise < 0 ? rings.near_inverse : rings.far_inverse;
    for (std::size_t k = 0; k < kRings; ++k) {
      const float along =
          plane.line_rise * inverse[k] + (plane.rising * forward[k] + plane.falling);
      least[k] = along < least[k] ? along : least[k];
    }
  }
  for (std::size_t k = first; k < kRings; ++k) best[k] = best[k] < least[k] ? least[k] : best[k];
}

SCARP_FOR_EACH_TARGET
bool is_any_raised(const float* best, const float* wanted, const float* inverse, float rise,
                   float slope, std::size_t count) {
  std::int32_t any = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::int32_t is_open = best[k] < wanted[k] ? 1 : 0;
    const std::int32_t is_over = rise * inverse[k] + slope > best[k] + kSlopeTolerance ? 1 : 0;
    any |= is_open & is_over;
  }
  return any != 0;
}

/// The runs of cells from one turn to another, ring by ring, up to the end of the row; then what
/// goes on from its beginning.
/// @return whether there is any of that
SCARP_FOR_EACH_TARGET
bool lay_runs(const std::int16_t* first_turn, const std::int16_t* last_turn, std::int32_t middle,
              std::int32_t sectors, CellRun* runs) {
  std::int32_t round = 0;
  for (std::int32_t k = 0; k < kRings; ++k) {
    const std::int32_t turns = last_turn[k] - first_turn[k] + 1, count = turns > 0 ? turns : 0;
    const std::int32_t turn = middle + first_turn[k];
    const std::int32_t sector = turn + (turn < 0 ? sectors : 0) - (turn >= sectors ? sectors : 0);
    const std::int32_t to_end = count < sectors - sector ? count : sectors - sector;
    const std::int32_t row = k * sectors;
    runs[k] = {static_cast<std::uint32_t>(row + sector), static_cast<std::uint32_t>(to_end)};
    runs[k + kRings] = {static_cast<std::uint32_t>(row),
                        static_cast<std::uint32_t>(count - to_end)};
    round |= count - to_end;
  }
  return round != 0;
}

}  // namespace

RingTable::RingTable(const PolarLayout& layout, const Fan& fan) {
  for (std::size_t k = 0; k < kRings; ++k) {
    const auto ring = static_cast<std::int32_t>(k);
    const double near = ring_start(layout, ring) * kFirstRing * (1 - kCellOverlap);
    const double far = ring + 1 == kRings
                           ? HUGE_VAL
                           : ring_start(layout, ring + 1) * kFirstRing * (1 + kCellOverlap);
    near_inverse[k] = static_cast<float>(1 / near * (1 + 0x1p-23));
    far_inverse[k] = static_cast<float>(1 / far * (1 - 0x1p-23));
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const double low = -1 + 2.0 * static_cast<double>(lane) / kLanes;
      const double high = low + 2.0 / kLanes;
      const double offset = std::max(std::abs(low), std::abs(high));
      const double least =
          std::sqrt(near * near - offset * offset) * fan.cos_half - offset * fan.sin_half;
      reach[lane][k] = least * (1 - 0x1p-40);
      forward[lane][k] = static_cast<float>(least / near);
      turn_low[lane][k] = std::asin(low / (low < 0 ? near : far)) - fan.half_rad - kCellOverlap;
      turn_high[lane][k] = std::asin(high / (high > 0 ? near : far)) + fan.half_rad + kCellOverlap;
    }
  }
}

std::vector<SectorBorders> borders_of(const PolarLayout& layout) {
  std::vector<SectorBorders> borders;
  for (std::int32_t s = 0; s < layout.sectors; ++s) {
    const double low_rad = azimuth_at(layout, s) - kCellOverlap;
    const double high_rad = azimuth_at(layout, s + 1) + kCellOverlap;
    borders.push_back({static_cast<float>(std::cos(low_rad)), static_cast<float>(std::sin(low_rad)),
                       static_cast<float>(std::cos(high_rad)),
                       static_cast<float>(std::sin(high_rad))});
  }
  return borders;
}

void Turns::turn_to(const PolarLayout& layout, const Fan& fan, const RingTable& rings) {
  const std::int32_t sectors = layout.sectors;
  const auto sector_at = [&](double azimuth_rad) {
    return sector_of(layout, std::cos(azimuth_rad), std::sin(azimuth_rad));
  };
  middle = sector_at(fan.middle_rad);
  half_rad = fan.half_rad;
  borders_rad.clear();
  for (std::int32_t turn = -sectors / 2; turn <= sectors - sectors / 2; ++turn) {
    const double about_rad = 2 * std::numbers::pi * turn / sectors;
    const double border_rad = azimuth_at(layout, (middle + turn + sectors) % sectors);
    // The same direction, on the way round from the middle.
    borders_rad.push_back(static_cast<float>(
        about_rad + std::remainder(border_rad - fan.middle_rad - about_rad, 2 * std::numbers::pi)));
  }
  const auto from_middle = [&](std::int32_t sector) {
    return static_cast<std::int16_t>((sector - middle + sectors + sectors / 2) % sectors -
                                     sectors / 2);
  };
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    for (std::size_t k = 0; k < kRings; ++k) {
      first[lane][k] = from_middle(sector_at(fan.middle_rad + rings.turn_low[lane][k]));
      last[lane][k] = from_middle(sector_at(fan.middle_rad + rings.turn_high[lane][k]));
    }
}

/// Calls visit(cell) for the cells of a run that are marked.
template <class Visit>
void visit_marked(const std::uint64_t* marks, const CellRun& run, Visit visit) {
  for (std::uint32_t begin = run.begin, end = run.begin + run.count; begin < end;) {
    const std::uint32_t word = begin / kCellsMarked;
    const std::uint32_t word_end = std::min(end, (word + 1) * kCellsMarked);
    std::uint64_t left = marks[word] >> (begin % kCellsMarked);
    if (word_end - begin < kCellsMarked) left &= (std::uint64_t{1} << (word_end - begin)) - 1;
    for (; left != 0; left &= left - 1)
      visit(begin + static_cast<std::uint32_t>(std::countr_zero(left)));
    begin = word_end;
  }
}

void ReachedCells::make_room(std::size_t size) {
  if (cell_.size() >= size) return;
  cell_.resize(size), ring_.resize(size), taken_.resize(size);
  for (auto* column :
       {&near_inverse_, &far_inverse_, &forward_, &low_x_, &low_y_, &high_x_, &high_y_,
        &low_border_rad_, &high_border_rad_, &low_rad_, &high_rad_, &best_, &wanted_, &least_})
    column->resize(size);
}

void ReachedCells::find_runs() {
  go_round_ = lay_runs(turns_->first[low_].data(), turns_->last[high_].data(), turns_->middle,
                       sectors_, runs_.data());
  has_runs_ = true;
}

void ReachedCells::mark(const Turns& turns, std::int32_t sectors, const Known& known,
                        std::uint64_t* wanted) {
  turns_ = &turns, low_ = 0, high_ = kLanes - 1, sectors_ = sectors;
  find_runs();
  for (std::size_t r = 0; r < run_count(); ++r) {
    const std::uint32_t begin = runs_[r].begin / kCellsMarked * kCellsMarked;
    const std::uint32_t end = runs_[r].begin + runs_[r].count;
    if (runs_[r].count > 0)
      mark_wanted(known.bounds, known.least,
                  {begin, (end - begin + kCellsMarked - 1) / kCellsMarked * kCellsMarked}, wanted);
  }
}

std::array<ReachedCells::InRing, kRings> ReachedCells::in_rings() const {
  std::array<InRing, kRings> in;
  const RingRow& forward_row = forward();
  // A camera's azimuth is that of the ray and the angle by which it passes the centre. Both are
  // widened by kCellOverlap in the table of rings.
  for (std::size_t k = 0; k < kRings; ++k)
    in[k] = {forward_row[k],
             static_cast<float>(rings_->turn_low[low_][k] + turns_->half_rad) - kAngleRounding,
             static_cast<float>(rings_->turn_high[high_][k] - turns_->half_rad) + kAngleRounding};
  return in;
}

void ReachedCells::reach(const RingTable& rings, const Turns& turns,
                         std::span<const SectorBorders> borders, std::size_t low, std::size_t high,
                         const Known& known) {
  rings_ = &rings, turns_ = &turns, low_ = low, high_ = high;
  sectors_ = static_cast<std::int32_t>(borders.size());
  hints_ = known.least;
  ring_best_.fill(kNothing);
  find_runs();
  std::size_t most = 0;
  for (std::size_t r = 0; r < run_count(); ++r) most += runs_[r].count;
  make_room(most);
  const std::array<InRing, kRings> in = in_rings();
  const float* borders_rad = turns.borders_rad.data() + sectors_ / 2;
  std::uint32_t wanted = 0;
  for (std::size_t k = 0; k < kRings; ++k) {
    first_[k] = wanted;
    std::int32_t turn = turns.first[low][k];
    for (std::size_t r = k; r < run_count(); r += kRings) {
      const CellRun run = runs_[r];
      visit_marked(known.wanted, run, [&](std::uint32_t cell) {
        const float bound = known.bounds[cell];
        if (!(bound > slope_of_hint(known.least[cell]))) return;
        const std::size_t i = wanted++;
        const SectorBorders& border = borders[cell - k * borders.size()];
        cell_[i] = cell, ring_[i] = static_cast<std::uint16_t>(k);
        const float* border_rad = borders_rad + turn + static_cast<std::int32_t>(cell - run.begin);
        low_border_rad_[i] = border_rad[0], high_border_rad_[i] = border_rad[1];
        low_rad_[i] = border_rad[0] - in[k].most_rad;
        high_rad_[i] = border_rad[1] - in[k].least_rad;
        near_inverse_[i] = rings.near_inverse[k], far_inverse_[i] = rings.far_inverse[k];
        forward_[i] = in[k].forward;
        low_x_[i] = border.low_x, low_y_[i] = border.low_y;
        high_x_[i] = border.high_x, high_y_[i] = border.high_y;
        best_[i] = kNothing;
        wanted_[i] = bound - kSlopeTolerance;
      });
      turn += static_cast<std::int32_t>(run.count);
    }
  }
  first_[kRings] = wanted;
  open_end_ = wanted;
}

void ReachedCells::reach_part(const ReachedCells& whole, std::size_t low, std::size_t high) {
  make_room(whole.size());
  rings_ = whole.rings_, turns_ = whole.turns_, low_ = low, high_ = high;
  sectors_ = whole.sectors_, hints_ = whole.hints_, ring_best_ = whole.ring_best_;
  has_runs_ = false;
  const std::array<InRing, kRings> in = in_rings();
  const auto half_rad = static_cast<float>(turns_->half_rad) + kAngleRounding;
  // Without branches: which cells are left follows no pattern.
  std::array<std::uint32_t, kRings> in_ring{};
  std::size_t size = 0;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    const std::size_t k = whole.ring_[i];
    taken_[size] = static_cast<std::uint32_t>(i);
    const float low_rad = whole.low_border_rad_[i] - in[k].most_rad;
    const float high_rad = whole.high_border_rad_[i] - in[k].least_rad;
    low_rad_[size] = low_rad, high_rad_[size] = high_rad;
    const unsigned is_taken = static_cast<unsigned>(low_rad <= half_rad) &
                              static_cast<unsigned>(high_rad >= -half_rad) &
                              static_cast<unsigned>(whole.best_[i] < whole.wanted_[i]);
    size += is_taken;
    in_ring[k] += is_taken;
  }
  for (std::size_t k = 0; k < kRings; ++k) first_[k + 1] = first_[k] + in_ring[k];
  for (std::size_t j = 0; j < size; ++j) {
    const std::size_t i = taken_[j], k = whole.ring_[i];
    cell_[j] = whole.cell_[i], ring_[j] = whole.ring_[i];
    low_border_rad_[j] = whole.low_border_rad_[i], high_border_rad_[j] = whole.high_border_rad_[i];
    near_inverse_[j] = whole.near_inverse_[i], far_inverse_[j] = whole.far_inverse_[i];
    forward_[j] = in[k].forward;
    low_x_[j] = whole.low_x_[i], low_y_[j] = whole.low_y_[i];
    high_x_[j] = whole.high_x_[i], high_y_[j] = whole.high_y_[i];
    best_[j] = whole.best_[i], wanted_[j] = whole.wanted_[i];
  }
  open_end_ = size;
}

void ReachedCells::raise(std::span<const CellPlane> planes) {
  std::size_t first = kRings, beyond = 0;
  for (const CellPlane& plane : planes) {
    first = std::min(first, plane.first_ring);
    beyond = std::max(beyond, plane.first_ring);
  }
  if (first >= kRings) return;
  raise_cells({near_inverse_.data(), far_inverse_.data(), forward_.data(), low_x_.data(),
               low_y_.data(), high_x_.data(), high_y_.data(), low_rad_.data(), high_rad_.data()},
              planes.data(), planes.size(), first, first_.data(), least_.data(), best_.data());
  raise_rings(*rings_, forward(), planes.data(), planes.size(), beyond, ring_least_.data(),
              ring_best_.data());
}

std::size_t ReachedCells::end_of_open() {
  while (open_end_ > 0 && !(best_[open_end_ - 1] < wanted_[open_end_ - 1])) --open_end_;
  return open_end_ > 0 ? ring_[open_end_ - 1] + std::size_t{1} : 0;
}

bool ReachedCells::is_promising(float rise, float slope, std::size_t first, std::size_t end) const {
  const std::size_t begin = first_[first];
  const float* inverse = (rise < 0 ? far_inverse_ : near_inverse_).data() + begin;
  return is_any_raised(best_.data() + begin, wanted_.data() + begin, inverse, rise, slope,
                       first_[end] - begin);
}

void ReachedCells::lower(float* bounds) {
  if (!has_runs_) find_runs();
  for (std::size_t i = 0; i < size(); ++i) bounds[cell_[i]] = std::min(bounds[cell_[i]], best_[i]);
  for (std::size_t r = 0; r < run_count(); r += kRings)
    lower_useless(runs_.data() + r, ring_best_.data(), kRings, hints_, bounds);
}

void ReachedCells::lower_closed(float* bounds) const {
  for (std::size_t i = 0; i < size(); ++i)
    if (best_[i] >= wanted_[i]) bounds[cell_[i]] = std::min(bounds[cell_[i]], best_[i]);
}

}  // namespace scarp
