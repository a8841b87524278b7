#pragma once

#include <functional>

namespace scarp {

/// Told by long work how much of it is done, in [0, 1], rising; called from one thread at a time.
/// An empty function is allowed: work without an audience.
using Progress = std::function<void(double done)>;

}  // namespace scarp
