#pragma once

#include <functional>

namespace scarp {

/// Asked by long work now and then, from any of its threads: whether to stop. Cheap, as it is asked
/// before every piece of a loop. An empty function never stops.
using StopAsked = std::function<bool()>;

/// While it lives, every parallel_for that this thread calls passes over the pieces that are left
/// once a stop is asked for, and returns. What was being computed is then incomplete and must be
/// thrown away: whoever made the scope asks stop_asked() when the work is back.
/// Scopes of one thread lie within each other; the innermost counts.
class StopScope {
 public:
  explicit StopScope(const StopAsked& asked);
  ~StopScope();
  StopScope(const StopScope&) = delete;
  StopScope& operator=(const StopScope&) = delete;

 private:
  const StopAsked* outer_;
};

/// Whether a stop is asked for in the innermost scope of this thread; false outside of any.
bool stop_asked();

}  // namespace scarp
