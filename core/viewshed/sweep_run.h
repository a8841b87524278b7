#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/viewshed/bin_history.h"
#include "core/viewshed/column_tile.h"
#include "core/viewshed/line_kernels.h"
#include "core/viewshed/part_sweep.h"
#include "core/viewshed/sweep_ground.h"

namespace scarp {

/// A part of the plane around an eye: directions of one of the four wedges, between two tangents.
struct SweepPart {
  enum Wedge : std::uint8_t { kEast, kSouth, kWest, kNorth };
  static constexpr std::int32_t kPartsInWedge = 16;

  Wedge wedge = kEast;
  std::int32_t number = 0;  ///< [0, kPartsInWedge), by rising tangent
};

/// Where a sweep's answers go: one of the two.
struct SweepOutput {
  std::span<Seen> result;              ///< [rows * columns]
  std::span<float> least_m;            ///< [rows * columns]
  LeastTops* least_tops = nullptr;     ///< with it only lower heights are wanted
  const HeightLimit* limit = nullptr;  ///< of those

  bool lowers() const { return least_tops != nullptr; }
};

/// The sweep of one part (part_sweep.h). Lines are swept in slabs, as many as lie in a row of tiles
/// and have bins of one width; in a slab the groups of bins that are not passed over are swept in
/// strips, each through all the lines of the slab.
///
/// The members are in sweep_run.cc (the march outwards), sweep_picture.cc (the picture of a line),
/// sweep_bounds.cc (what it does to the horizon), sweep_seen.cc and sweep_heights.cc (what targets
/// have of it).
class SweepRun {
 public:
  SweepRun(const SweepGround& ground, const SweepPart& part, const SweepOutput& output);

  /// Writes the part's known samples in the window, but those in tiles that are passed over: they
  /// are hidden, or cannot be lowered.
  SweepCounts run();

 private:
  struct Picture {
    double forwards, sideways, rise_m;
  };

  /// A run of bins [first_bin, end_bin) and, at its ends, by how many samples the lines miss their
  /// guess.
  struct Strip {
    std::int32_t first_bin = 0, end_bin = 0;
    std::int32_t low_bend = 0, high_bend = 0;
  };

  /// The picture of a grid line: its samples around the strip.
  struct Line {
    std::int32_t number = 0;
    std::int32_t place = 0;    ///< in the slab
    std::int32_t first = 0;    ///< sample that index 0 stands for
    std::vector<float> t;      ///< in bins, rising
    std::vector<float> s;      ///< of the ground; kNoGround where void
    std::vector<float> steep;  ///< greatest rise of the segment after a sample and its neighbours
    std::vector<float> place_of_edge;  ///< where the strip's edges of bins fall, in samples; if
                                       ///< is_whole
    std::vector<double> z_m;
    std::vector<std::uint8_t> is_void;
    bool has_void = false;
    bool is_whole = false;  ///< known ground all across the strip and a sample beyond

    std::int32_t count() const { return static_cast<std::int32_t>(t.size()); }
  };

  /// Where an edge between groups of bins meets a line.
  struct EdgePlace {
    double sample = 0;    ///< extrapolated outside the grid
    double forwards = 0;  ///< of a sample near it
  };

  Position position(std::int32_t line, std::int32_t i) const {
    return over_columns_ ? grid_.at(line, i) : grid_.at(i, line);
  }
  bool is_known(std::int32_t line, std::int32_t i) const {
    return over_columns_ ? grid_.is_known(line, i) : grid_.is_known(i, line);
  }
  bool is_target(std::int32_t line, std::int32_t i) const {
    return over_columns_ ? ground_.window.contains(line, i) : ground_.window.contains(i, line);
  }
  Position target(std::int32_t line, std::int32_t i) const {
    return over_columns_ ? ground_.stands.raised(line, i, ground_.target_height_m)
                         : ground_.stands.raised(i, line, ground_.target_height_m);
  }
  /// The ground that a target stands on.
  Position stand(std::int32_t line, std::int32_t i) const {
    return over_columns_ ? ground_.stands.at(line, i) : ground_.stands.at(i, line);
  }
  bool raised() const { return ground_.target_height_m != 0 || ground_.apart; }
  std::size_t result_index(std::int32_t line, std::int32_t i) const {
    const std::int32_t column = over_columns_ ? line : i, row = over_columns_ ? i : line;
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(grid_.columns()) +
           static_cast<std::size_t>(column);
  }

  Picture picture(const Position& p) const;
  bool owns(const Picture& p) const;

  double bins_per_tangent() const { return bins_ / (high_tangent_ - low_tangent_); }
  /// t of a sample in bins is below the number of bins, so its rounding to float is below 2^-24 of
  /// that; a sample and a target may miss each other by twice as much. 2^-22 is used, and what
  /// the samples lie off even spacing, at two bins a sample and more near the eye.
  float slack() const {
    return static_cast<float>(bins_) * 0x1p-22F +
           static_cast<float>(ground_.uneven_samples * bins_per_tangent());
  }
  /// Interpolating at a bin's edge, where both ends of a segment are off by slack and the edge by
  /// as much again, errs by at most 6 slack / kLeastSpacingBins of the segment's rise, or of its
  /// neighbours' where the edge is that close to a sample.
  float per_rise() const { return 16 * slack(); }

  void sweep_near(std::int32_t line, bool judge_targets);
  void add_near_segment(const Position& u, bool u_known, const Position& v, bool v_known,
                        bool along_line);
  void sweep_slab(std::int32_t first, std::int32_t count);
  void sweep_strip(const Strip& strip, std::int32_t first, std::int32_t count);
  void choose_strips(std::int32_t first, std::int32_t last);
  EdgePlace place_edge(std::int32_t line, std::int32_t bin, double& bend) const;
  bool is_passed_over(std::int32_t first_line, std::int32_t last_line, std::int32_t first_bin,
                      std::int32_t end_bin, std::int32_t first_sample, std::int32_t last_sample,
                      double least_forwards, double most_forwards) const;
  void halve_bins();

  void fill(Line& to, std::int32_t line);
  void take_samples(Line& to, std::int32_t first, std::int32_t last);
  template <typename Body>
  void for_blocks(std::int32_t line, std::int32_t first, std::size_t count, const Body& body) const;
  void take_pictures(const Line& line, const double* z_m, float* t, float* s);
  void find_edges(Line& to) const;
  void take_targets(const Line& line);

  void add(const Line& line, const Line* before);
  void add_whole(const Line& line, const Line* before);
  void add_in_pieces(const Line& line, const Line* before);
  void raise_segments(const Line& from, const Line& to, float* up);
  void raise_line(const Line& line, float* up);
  void mark_void(const Line& line);
  void mark_top(std::int32_t line, std::int32_t first_bin, std::int32_t end_bin, const float* up);

  std::pair<std::int32_t, std::int32_t> own_range(const Line& line) const;
  bool crosses_before(const Line& before, std::int32_t i, float t) const;
  bool is_in_strip(float t) const;
  bool stands_free(const Position& at, std::int32_t line, std::int32_t i) const;
  Seen judge(std::int32_t line, std::int32_t i);
  bool is_blocked_in_bin(const Line& line, std::int32_t i, const Position& at, std::size_t bin,
                         float s);
  void decide(const Line& line, const Line* before);
  Seen guess_seen(float t, float s, Decision decision) const;
  Seen decide_seen(const Line& line, const Line* before, std::int32_t k, Decision decision);

  bool stands_aside(std::int32_t line, std::int32_t i) const;
  std::pair<double, double> place_of(const Line& line, std::int32_t k) const;
  bool is_enough(double z_m, const Line& line, std::int32_t k, float enough_m) const;
  float climb_all(std::int32_t line, std::int32_t i);
  float climb_in_bin(const Line& line, std::int32_t k, std::size_t bin, float enough_m);
  float guess_height(const Line& line, std::int32_t k, std::size_t bin) const;
  float climb_to(const Line& line, const Line* before, std::int32_t k, float enough_m);
  void climb(const Line& line, const Line* before);
  void offer(std::int32_t line, std::int32_t i, float height_m);

  const SweepGround& ground_;
  const GridSight& sight_;
  const GroundGrid& grid_;  ///< what blocks
  const PlanFrame& frame_;
  const SweepOutput output_;
  SweepPart part_;

  bool over_columns_ = true;
  std::int32_t outwards_ = 1;
  std::int32_t lines_ = 0, samples_ = 0;
  double eye_line_ = 0, eye_sample_ = 0;
  double low_tangent_ = 0, high_tangent_ = 0;
  std::int32_t first_line_ = 0;  ///< that is not near

  /// Bounds of the horizon by bin.
  std::int32_t bins_;
  std::vector<float> low_, high_;
  std::vector<std::int32_t> top_;  ///< line that reaches highest so far; for heights only
  std::vector<std::uint8_t> some_void_, all_void_;
  BinHistory history_;
  bool bounds_hold_ = true;

  Strip strip_;
  std::vector<Strip> strips_;  ///< of the slab
  std::vector<double> bends_;  ///< at the edges of groups of bins, in samples
  Line kept_[2];
  Line* line_ = &kept_[0];
  Line* before_ = &kept_[1];

  // Room for one line.
  std::vector<double> across_, down_, raised_m_;
  std::vector<float> rises_;
  std::vector<float> place_before_, higher_, pairs_, target_t_, target_s_;
  std::vector<float> this_s_, next_s_, edge_low_, edge_high_, line_low_;
  std::vector<std::int32_t> edge_before_;
  std::vector<Decision> decisions_;
  std::optional<ColumnTile> tile_;
  SweepCounts counts_;
};

/// s of a sample is a double rounded to float (2^-24 of itself), compared with another such one;
/// 2^-20 leaves room for the arithmetic before.
inline constexpr float kSlopeMargin = 0x1p-20F;

/// Least spacing of the samples of a line, in bins, that the margins of SweepRun are derived for.
inline constexpr float kLeastSpacingBins = 0.5F;

/// Grid lines nearer to the eye than this are compared in double, ray by ray: seen from there the
/// picture of a line may be wider than float holds.
inline constexpr double kNearCells = 1.5;

/// Samples that a line's picture has beyond its strip, to each side.
inline constexpr std::int32_t kBeyondStrip = 4;

}  // namespace scarp
