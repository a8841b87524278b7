#include "core/memory/large_array.h"

#include <sys/mman.h>

#include <cstdlib>
#include <new>

namespace scarp {
namespace {

class OrdinaryMemory : public LargeMemory {
 public:
  void* allocate(std::size_t bytes) override {
    constexpr std::size_t kPage = std::size_t{2} << 20;
    const std::size_t alignment = bytes >= kPage ? kPage : 64;
    const std::size_t whole = (bytes + alignment - 1) / alignment * alignment;
    void* memory = std::aligned_alloc(alignment, whole);
    if (!memory) throw std::bad_alloc();
    // A wish: where the system does not grant it, small pages do as well.
    if (alignment == kPage) madvise(memory, whole, MADV_HUGEPAGE);
    return memory;
  }
  void release(void* memory, std::size_t) override { std::free(memory); }
  void relieve() override {}
};

OrdinaryMemory ordinary;
LargeMemory* in_use = &ordinary;

}  // namespace

void use_large_memory(LargeMemory* memory) {
  in_use = memory ? memory : &ordinary;
}

LargeMemory& large_memory() {
  return *in_use;
}

void relieve_large_memory() {
  if (in_use != &ordinary) in_use->relieve();
}

}  // namespace scarp
