#include "cli/scratch_memory.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "core/error/error.h"
#include "tiles/store/open_file.h"

namespace scarp {
namespace {

[[noreturn]] void fail(const std::string& folder, std::size_t bytes, int reason) {
  throw Error(ErrorCode::kResource,
              fmt::format("'{}': no room for {:.1f} GiB of scratch ({}); free space there, write "
                          "the output elsewhere, or raise --memory",
                          folder, static_cast<double>(bytes) / 0x1p30, std::strerror(reason)));
}

/// A file without a name.
OpenFile scratch_file(const std::string& folder, std::size_t bytes) {
  const int nameless = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (nameless >= 0) return OpenFile(nameless);
  // Not every file system has them: then one that loses its name at once.
  std::string name = folder + "/.scarp-scratch-XXXXXX";
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named < 0) fail(folder, bytes, errno);
  ::unlink(name.c_str());
  return OpenFile(named);
}

}  // namespace

std::uint64_t resident_now_bytes() {
  const OpenFile file(::open("/proc/self/statm", O_RDONLY | O_CLOEXEC));
  std::array<char, 128> text{};
  if (!file || ::read(file.descriptor(), text.data(), text.size() - 1) <= 0) return 0;
  char* rest = nullptr;
  std::strtoull(text.data(), &rest, 10);  // the size of all that is mapped
  return std::strtoull(rest, nullptr, 10) * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

ScratchMemory::ScratchMemory(std::string folder, std::uint64_t resident_bytes)
    : folder_(std::move(folder)), resident_bytes_(resident_bytes) {
  use_large_memory(this);
}

ScratchMemory::~ScratchMemory() {
  use_large_memory(nullptr);
}

void* ScratchMemory::allocate(std::size_t bytes) {
  const OpenFile file = scratch_file(folder_, bytes);
  // All of it now: a mapped page that has no room on the disk would end the process.
  if (const int reason = ::posix_fallocate(file.descriptor(), 0, static_cast<off_t>(bytes)))
    fail(folder_, bytes, reason);
  void* start = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file.descriptor(), 0);
  if (start == MAP_FAILED) fail(folder_, bytes, errno);
  const std::scoped_lock lock(mutex_);
  mappings_.push_back({start, bytes});
  return start;
}

void ScratchMemory::release(void* memory, std::size_t bytes) {
  {
    const std::scoped_lock lock(mutex_);
    std::erase_if(mappings_, [&](const Mapping& m) { return m.start == memory; });
  }
  ::munmap(memory, bytes);
}

void ScratchMemory::relieve() {
  if (resident_now_bytes() <= resident_bytes_) return;
  const std::scoped_lock lock(mutex_);
  for (const Mapping& m : mappings_) ::madvise(m.start, m.bytes, MADV_DONTNEED);
}

}  // namespace scarp
