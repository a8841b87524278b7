#include "cli/stage_clock.h"

#include <unistd.h>

#include <fstream>
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

}  // namespace

void StageClock::begin(const std::string& name) {
  std::ofstream("/proc/self/clear_refs") << "5";
  costs_.push_back({name, 0, 0});
  begun_ = std::chrono::steady_clock::now();
}

void StageClock::end() {
  costs_.back().seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begun_).count();
  costs_.back().peak_bytes = peak_resident_bytes();
}

std::uint64_t machine_memory_bytes() {
  return static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) *
         static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace scarp
