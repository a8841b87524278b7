#include "core/memory/large_array.h"

#include <sys/mman.h>

#include <cstdlib>
#include <new>

namespace scarp {

void* allocate_large(std::size_t bytes) {
  if (bytes == 0) return nullptr;
  constexpr std::size_t kPage = std::size_t{2} << 20;
  const std::size_t alignment = bytes >= kPage ? kPage : 64;
  const std::size_t whole = (bytes + alignment - 1) / alignment * alignment;
  void* memory = std::aligned_alloc(alignment, whole);
  if (!memory) throw std::bad_alloc();
  // A wish: where the system does not grant it, small pages do as well.
  if (alignment == kPage) madvise(memory, whole, MADV_HUGEPAGE);
  return memory;
}

void free_large(void* memory) {
  std::free(memory);
}

}  // namespace scarp
