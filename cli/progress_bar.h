#pragma once

#include <chrono>
#include <string>

#include "core/threads/progress.h"

namespace scarp {

/// One line on a terminal that shows how far a stage is; silent in a pipe. The line is wiped when
/// the stage ends, so that results stand alone.
class ProgressBar {
 public:
  /// @param enabled  false keeps it silent on a terminal too
  explicit ProgressBar(bool enabled);
  ~ProgressBar();

  /// Begins a stage, for example "mesh"; the function returned draws it.
  Progress stage(const std::string& name);
  void clear();

 private:
  void draw(double done);

  bool enabled_;
  bool drawn_ = false;
  std::string name_;
  std::chrono::steady_clock::time_point begun_, last_;
};

}  // namespace scarp
