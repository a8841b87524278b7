#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "core/memory/large_array.h"

namespace scarp {

/// What the process has in memory now.
std::uint64_t resident_now_bytes();

/// Large arrays on the disk: while it lives, they are mapped from files without a name beside the
/// output, and their pages are let go of between pieces of work, as often as the process has more
/// of them in memory than it may. What is computed is the same.
///
/// Errors: kResource where the disk has no room, before anything is computed in the array.
/// Cost: pages that are needed again come back from the system's cache of files, or from the disk.
class ScratchMemory : public LargeMemory {
 public:
  /// @param folder          where the files go
  /// @param resident_bytes  of the whole process, beyond which pages are let go of
  ScratchMemory(std::string folder, std::uint64_t resident_bytes);
  ~ScratchMemory() override;
  ScratchMemory(const ScratchMemory&) = delete;
  ScratchMemory& operator=(const ScratchMemory&) = delete;

  void* allocate(std::size_t bytes) override;
  void release(void* memory, std::size_t bytes) override;
  void relieve() override;

 private:
  struct Mapping {
    void* start;
    std::size_t bytes;
  };

  std::string folder_;
  std::uint64_t resident_bytes_;
  std::mutex mutex_;
  std::vector<Mapping> mappings_;
};

}  // namespace scarp
