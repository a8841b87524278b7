#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace scarp {

/// What a stage of the pipeline took.
struct StageCost {
  std::string name;
  double seconds = 0;
  std::uint64_t peak_bytes = 0;  ///< peak resident memory of the process while it ran
};

/// Times stages that follow each other. Peak memory is the kernel's high-water mark, set back at
/// the start of each stage where the kernel allows it (otherwise it only rises). Several clocks may
/// run at once, each on a thread of its own; what they say of memory is the process's.
class StageClock {
 public:
  void begin(const std::string& name);
  void end();
  const std::vector<StageCost>& costs() const { return costs_; }

 private:
  std::vector<StageCost> costs_;
  std::chrono::steady_clock::time_point begun_;
  std::size_t first_mark_ = 0;
};

/// Peak resident memory of the process since it began, in stages and between them.
std::uint64_t peak_memory_bytes();

/// Physical memory of the machine, bytes.
std::uint64_t machine_memory_bytes();

}  // namespace scarp
