#include "cli/accuracy.h"

#include "core/occlusion/certified/hiding_bounds.h"

namespace scarp {

const char* name_of(Accuracy accuracy) {
  switch (accuracy) {
    case Accuracy::kHigh:
      return "high";
    case Accuracy::kFast:
      return "fast";
    default:
      return "exact";
  }
}

BuildAccuracy build_accuracy(Accuracy accuracy) {
  const int fans = HidingOptions{}.fans;
  switch (accuracy) {
    case Accuracy::kHigh:
      return {0.25, fans / 2};
    case Accuracy::kFast:
      return {1, fans / 4};
    default:
      return {0.1, fans};
  }
}

HorizonAccuracy horizon_accuracy(Accuracy accuracy) {
  switch (accuracy) {
    case Accuracy::kHigh:
      return {1, true};
    case Accuracy::kFast:
      return {3, false};
    default:
      return {0.3, true};
  }
}

}  // namespace scarp
