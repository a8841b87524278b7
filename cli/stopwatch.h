#pragma once

#include <chrono>
#include <ctime>

namespace scarp {

/// Wall time since it was made.
class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(Clock::now() - begun_).count(); }
  double ms() const { return 1000 * seconds(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point begun_ = Clock::now();
};

/// Processor time since it was made, of all threads of the program: what work costs, whatever else
/// the machine does meanwhile. With one thread, the wall time of an idle machine.
class ProcessorStopwatch {
 public:
  double seconds() const { return now_s() - begun_s_; }
  double ms() const { return 1000 * seconds(); }

 private:
  static double now_s() {
    std::timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  }

  double begun_s_ = now_s();
};

}  // namespace scarp
