#include <algorithm>
#include <cmath>
#include <variant>

#include "core/memory/large_array.h"
#include "core/viewshed/sweep_run.h"

namespace scarp {

/// Calls body(block, index in the run, count, u, du, v, dv) for the pieces of a run of samples of a
/// line, block by block.
template <typename Body>
void SweepRun::for_blocks(std::int32_t line, std::int32_t first, std::size_t count,
                          const Body& body) const {
  const auto& blocks = std::get<BlockPlacement>(grid_.placement());
  const double step = 2.0 / blocks.side;
  for (std::size_t k = 0; k < count;) {
    const std::int32_t i = first + static_cast<std::int32_t>(k);
    const std::int32_t column = over_columns_ ? line : i, row = over_columns_ ? i : line;
    const std::size_t length =
        std::min(count - k, static_cast<std::size_t>(blocks.side - i % blocks.side));
    body(blocks.block_of(column, row), k, length, blocks.local(column), over_columns_ ? 0 : step,
         blocks.local(row), over_columns_ ? step : 0);
    k += length;
  }
}

/// t and s of samples of a line, from first on, at heights z_m.
void SweepRun::take_pictures(const Line& line, const double* z_m, float* t, float* s) {
  const std::size_t count = line.z_m.size();
  const double eye_z_m = sight_.eye().z_m;
  const std::uint8_t* is_void = line.has_void ? line.is_void.data() : nullptr;
  if (!ground_.across_of_column.empty()) {
    const auto& along = over_columns_ ? ground_.down_of_row : ground_.across_of_column;
    const auto& outwards = over_columns_ ? ground_.across_of_column : ground_.down_of_row;
    const double forwards = outwards_ * outwards[static_cast<std::size_t>(line.number)];
    if (!(forwards > kNearCells / 2)) bounds_hold_ = false;
    take_level_picture(count, forwards, &along[static_cast<std::size_t>(line.first)], z_m, is_void,
                       eye_z_m, low_tangent_, bins_per_tangent(), t, s);
    return;
  }
  across_.resize(count);
  down_.resize(count);
  if (std::holds_alternative<BlockPlacement>(grid_.placement())) {
    for_blocks(line.number, line.first, count,
               [&](const BlockPlacement::Block& block, std::size_t k, std::size_t length, double u,
                   double du, double v, double dv) {
                 place_run(block, u, du, v, dv, length, z_m + k, frame_, &across_[k], &down_[k]);
               });
  } else {
    for (std::size_t k = 0; k < count; ++k) {
      const Position p = position(line.number, line.first + static_cast<std::int32_t>(k));
      across_[k] = frame_.across(p.x_m, p.y_m);
      down_[k] = frame_.down(p.x_m, p.y_m);
    }
  }
  std::vector<double>& forwards = over_columns_ ? across_ : down_;
  if (outwards_ < 0)
    for (double& f : forwards) f = -f;
  if (!take_picture(count, forwards.data(), over_columns_ ? down_.data() : across_.data(), z_m,
                    is_void, eye_z_m, low_tangent_, bins_per_tangent(), kNearCells / 2, t, s))
    bounds_hold_ = false;
}

/// The picture of samples [first, last] of a line.
void SweepRun::take_samples(Line& to, std::int32_t first, std::int32_t last) {
  const auto count = static_cast<std::size_t>(last - first + 1);
  to.first = first;
  to.t.resize(count);
  to.s.resize(count);
  to.z_m.resize(count);
  to.is_void.resize(count);
  // Each sample of a column may bring a page of its own into memory, and its neighbours.
  constexpr std::size_t kSamplesAtOnce = 128;
  const std::size_t at_once = over_columns_ ? kSamplesAtOnce : count;
  const std::size_t stride = over_columns_ ? grid_.stride() : 1;
  const std::int32_t* steps =
      over_columns_ ? grid_.row_steps(first) + to.number : grid_.row_steps(to.number) + first;
  to.has_void = false;
  for (std::size_t k = 0; k < count; k += at_once) {
    if (load_heights(steps + k * stride, stride, std::min(at_once, count - k), &to.z_m[k],
                     &to.is_void[k]))
      to.has_void = true;
    relieve_large_memory();
  }
  take_pictures(to, to.z_m.data(), to.t.data(), to.s.data());
}

/// The picture of a line, kBeyondStrip samples more than the strip to both sides where the grid has
/// them, because the segments between lines run sideways.
void SweepRun::fill(Line& to, std::int32_t line) {
  to.number = line;
  const double run = std::abs(line - eye_line_);
  const auto within = [&](double at) {
    return static_cast<std::int32_t>(std::clamp(at, 0.0, samples_ - 1.0));
  };
  const auto first_edge = static_cast<float>(strip_.first_bin);
  const auto last_edge = static_cast<float>(strip_.end_bin);
  const double low = low_tangent_ + strip_.first_bin / bins_per_tangent();
  const double high = low_tangent_ + strip_.end_bin / bins_per_tangent();
  // Where the lines bend, the guess is made good and remembered for the next line.
  for (;;) {
    const std::int32_t first =
        within(std::floor(eye_sample_ + low * run) + strip_.low_bend - kBeyondStrip);
    const std::int32_t last =
        within(std::ceil(eye_sample_ + high * run) + strip_.high_bend + kBeyondStrip);
    take_samples(to, first, std::max(first, last));
    const auto n = to.t.size();
    const std::size_t inner = std::min<std::size_t>(kBeyondStrip - 1, n - 1);
    const bool short_low = to.first > 0 && to.t[inner] >= first_edge;
    const bool short_high = to.first + to.count() < samples_ && to.t[n - 1 - inner] <= last_edge;
    if (!short_low && !short_high) break;
    if (short_low) strip_.low_bend -= kBeyondStrip;
    if (short_high) strip_.high_bend += kBeyondStrip;
  }
  constexpr auto kSpare = static_cast<std::size_t>(3 * kBeyondStrip);
  if (to.t.size() > kSpare && to.t[kSpare] < first_edge) strip_.low_bend += kBeyondStrip;
  if (to.t.size() > kSpare && to.t[to.t.size() - 1 - kSpare] > last_edge)
    strip_.high_bend -= kBeyondStrip;
  const auto n = to.t.size();
  to.steep.resize(n);
  rises_.resize(n);
  if (!take_rises(n, to.t.data(), to.s.data(), to.has_void ? to.is_void.data() : nullptr,
                  kLeastSpacingBins, rises_.data(), to.steep.data()))
    bounds_hold_ = false;
  to.is_whole = bounds_hold_ && !to.has_void && n > 4 && to.t[1] < first_edge - slack() &&
                to.t[n - 2] > last_edge + slack();
  if (to.is_whole) find_edges(to);
}

/// Where the edges between bins fall among the samples of a whole line.
void SweepRun::find_edges(Line& to) const {
  const auto edges = static_cast<std::size_t>(strip_.end_bin - strip_.first_bin) + 1;
  to.place_of_edge.resize(edges);
  if (!ground_.across_of_column.empty()) {
    const std::size_t n = to.t.size();
    const double spacing =
        (static_cast<double>(to.t[n - 1]) - to.t[0]) / static_cast<double>(n - 1);
    const auto per_bin = static_cast<float>(1 / spacing);
    const auto begin =
        static_cast<float>((strip_.first_bin - static_cast<double>(to.t[0])) / spacing);
    even_places(edges, per_bin, begin, to.place_of_edge.data());
    return;
  }
  if (near_even_places(strip_.first_bin, edges, to.t.size(), to.t.data(), to.place_of_edge.data()))
    return;
  std::size_t j = 0;
  for (std::size_t e = 0; e < edges; ++e) {
    const auto edge = static_cast<float>(strip_.first_bin + static_cast<std::int32_t>(e));
    while (to.t[j + 1] <= edge) ++j;
    to.place_of_edge[e] = static_cast<float>(static_cast<std::int32_t>(j)) +
                          (edge - to.t[j]) / (to.t[j + 1] - to.t[j]);
  }
}

/// t and s of the targets of a line.
void SweepRun::take_targets(const Line& line) {
  const std::size_t count = line.t.size();
  target_t_.resize(count);
  target_s_.resize(count);
  raised_m_.resize(count);
  if (ground_.apart) {
    for (std::size_t k = 0; k < count; ++k)
      raised_m_[k] =
          line.is_void[k] ? 0 : target(line.number, line.first + static_cast<std::int32_t>(k)).z_m;
  } else if (std::holds_alternative<BlockPlacement>(grid_.placement())) {
    for_blocks(line.number, line.first, count,
               [&](const BlockPlacement::Block& block, std::size_t k, std::size_t length, double u,
                   double du, double v, double dv) {
                 raise_run(block, u, du, v, dv, length, &line.z_m[k], ground_.target_height_m,
                           &raised_m_[k]);
               });
  } else {
    for (std::size_t k = 0; k < count; ++k)
      raised_m_[k] = round_to_lattice(line.z_m[k] + ground_.target_height_m);
  }
  take_pictures(line, raised_m_.data(), target_t_.data(), target_s_.data());
}

/// On its way from the line before, can a line of sight to sample i cross a segment that joins the
}  // namespace scarp
