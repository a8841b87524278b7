#include "cli/stage_clock.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <mutex>
#include <string>

namespace scarp {
namespace {

std::uint64_t peak_resident_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (word != "VmHWM:") continue;
    std::uint64_t kilobytes = 0;
    status >> kilobytes;
    return kilobytes * 1024;
  }
  return 0;
}

/// The kernel's high-water marks at the moments when they were set back. Clocks run side by side
/// where steps do, so what one sets back is kept for the others.
class HighWaterMarks {
 public:
  /// @return of what is asked for with since()
  std::size_t set_back() {
    const std::scoped_lock lock(mutex_);
    bytes_.push_back(peak_resident_bytes());
    std::ofstream("/proc/self/clear_refs") << "5";
    return bytes_.size();
  }

  std::uint64_t since(std::size_t first) {
    const std::scoped_lock lock(mutex_);
    std::uint64_t most = peak_resident_bytes();
    for (std::size_t i = first; i < bytes_.size(); ++i) most = std::max(most, bytes_[i]);
    return most;
  }

 private:
  std::mutex mutex_;
  std::vector<std::uint64_t> bytes_;
};

HighWaterMarks& marks() {
  static HighWaterMarks marks;
  return marks;
}

}  // namespace

void StageClock::begin(const std::string& name) {
  first_mark_ = marks().set_back();
  costs_.push_back({name, 0, 0});
  begun_ = std::chrono::steady_clock::now();
}

void StageClock::end() {
  costs_.back().seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begun_).count();
  costs_.back().peak_bytes = marks().since(first_mark_);
}

std::uint64_t peak_memory_bytes() {
  return marks().since(0);
}

std::uint64_t machine_memory_bytes() {
  return static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) *
         static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace scarp
