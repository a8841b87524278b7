#pragma once

namespace scarp {

/// How a command trades accuracy for time, where its own options leave that open. Points of the
/// fronts that `scarp compare` charts; docs/accuracy.md says what each costs and errs.
enum class Accuracy {
  kExact,  ///< the default of everything
  kHigh,   ///< errs seldom and little
  kFast,   ///< for a first look; marks its output
};

const char* name_of(Accuracy accuracy);

/// Culling stays certified at each: a coarser mesh is other ground, and fewer fans leave more
/// undecided, which is drawn.
struct BuildAccuracy {
  double error_cells;  ///< of the mesh, in cell sizes
  int fans;            ///< of certified regions
};
BuildAccuracy build_accuracy(Accuracy accuracy);

/// Horizons of all points.
struct HorizonAccuracy {
  double tolerance_deg;  ///< by which bounds may differ
  bool has_bounds;
};
HorizonAccuracy horizon_accuracy(Accuracy accuracy);

}  // namespace scarp
