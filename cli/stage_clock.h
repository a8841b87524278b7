#pragma once

#include <chrono>
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
/// the start of each stage where the kernel allows it (otherwise it only rises).
class StageClock {
 public:
  void begin(const std::string& name);
  void end();
  const std::vector<StageCost>& costs() const { return costs_; }

 private:
  std::vector<StageCost> costs_;
  std::chrono::steady_clock::time_point begun_;
};

/// Physical memory of the machine, bytes.
std::uint64_t machine_memory_bytes();

}  // namespace scarp
