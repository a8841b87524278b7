#pragma once

#include <cstdint>
#include <optional>

#include "core/terrain/ground_grid.h"
#include "core/viewshed/plan_frame.h"

namespace scarp {

/// The ground's slope along the ray from an eye to one sample, at grid lines on the way, in double.
/// It measures; what blocks is decided by GridSight.
///
/// Requires known ground wherever the ray passes near the lines, and lines in front of the eye by
/// kLeastLines and more, where a ray surely crosses each line once.
/// Accuracy: kClimbErrorM in height at the sample. Places and `beside` err by some 2^-51 of
/// themselves, so a crossing at f of F lines errs by 2^-49 f samples along the ground and by what
/// the ground rises over that; at the sample it is F / f times as much. With rises of 1000 m from
/// sample to sample and 2^16 lines that is 10^-7 m. A ray over a sample takes one of the two
/// segments beside it, which agree there.
/// Cost: about five samples a line, O(1) memory. Thread-safe.
class RayClimb {
 public:
  static constexpr double kLeastLines = 4;

  /// @param forwards, sideways  of the sample in the wedge, sideways growing with the samples of a
  ///                            line
  RayClimb(const GroundGrid& grid, const PlanFrame& frame, double eye_z_m, bool over_columns,
           int outwards, double forwards, double sideways);

  /// Greatest rise over forwards of the ground where the ray crosses a line and the segments that
  /// lead to it from the line before it. Nothing where the ray passes by the end of a line, because
  /// measuring does not tell whether it meets the last sample.
  std::optional<double> slope_at(std::int32_t line) const;

 private:
  struct Seen2d {
    double forwards, rise_m;
    double beside;  ///< of the ray, growing with the samples of a line
  };

  Seen2d look(std::int32_t line, std::int32_t i) const;
  std::int32_t last_before(std::int32_t line, Seen2d& before, Seen2d& after) const;

  const GroundGrid& grid_;
  const PlanFrame& frame_;
  double eye_z_m_;
  bool over_columns_;
  int outwards_;
  std::int32_t samples_;
  double forwards_, sideways_, eye_line_, eye_sample_, samples_per_line_;
};

/// Heights that RayClimb leads to are this near to the true ones, metres.
inline constexpr double kClimbErrorM = 1e-6;

}  // namespace scarp
