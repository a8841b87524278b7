#pragma once

#include <string>
#include <vector>

#include "cli/progress_bar.h"
#include "cli/stage_clock.h"

namespace scarp {

/// The stages of a command, one after the other: each has its progress bar and its cost.
class Stages {
 public:
  explicit Stages(bool show_progress) : bar_(show_progress) {}

  /// Runs body(const Progress&) as the stage `name`.
  template <class Body>
  void run(const std::string& name, Body body) {
    const Progress progress = bar_.stage(name);
    clock_.begin(name);
    body(progress);
    clock_.end();
  }

  /// Wipes the bar: the last stage is done.
  void finish() { bar_.clear(); }

  const std::vector<StageCost>& costs() const { return clock_.costs(); }

 private:
  ProgressBar bar_;
  StageClock clock_;
};

}  // namespace scarp
