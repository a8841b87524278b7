#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>

namespace scarp {

/// Where large arrays live.
class LargeMemory {
 public:
  virtual ~LargeMemory() = default;
  /// Uninitialised, aligned to 64 bytes. Requires bytes > 0.
  virtual void* allocate(std::size_t bytes) = 0;
  virtual void release(void* memory, std::size_t bytes) = 0;
  /// Called from any thread between pieces of work: the moment to let go of what is not in use.
  virtual void relieve() = 0;
};

/// Every later large array lives there; null for ordinary memory, in the system's large pages where
/// it has them: fewer faults when it is touched first, and columns of a raster stay within reach of
/// the processor's address cache. Arrays keep the memory that they were made in, which must outlive
/// them. Requires that no other thread makes one meanwhile.
void use_large_memory(LargeMemory* memory);
LargeMemory& large_memory();

/// Between pieces of work that touch large arrays; costs nothing in ordinary memory.
void relieve_large_memory();

/// An array of plain values of fixed size. Uninitialised until written. Throws std::bad_alloc.
template <typename Value>
class LargeArray {
  static_assert(std::is_trivially_copyable_v<Value>);

 public:
  LargeArray() = default;
  explicit LargeArray(std::size_t size)
      : memory_(&large_memory()),
        values_(size == 0 ? nullptr : static_cast<Value*>(memory_->allocate(size * sizeof(Value)))),
        size_(size) {}
  LargeArray(LargeArray&& other) noexcept
      : memory_(other.memory_),
        values_(std::exchange(other.values_, nullptr)),
        size_(std::exchange(other.size_, 0)) {}
  LargeArray& operator=(LargeArray&& other) noexcept {
    std::swap(memory_, other.memory_);
    std::swap(values_, other.values_);
    std::swap(size_, other.size_);
    return *this;
  }
  ~LargeArray() {
    if (values_) memory_->release(values_, size_ * sizeof(Value));
  }

  std::size_t size() const { return size_; }
  Value& operator[](std::size_t i) { return values_[i]; }
  const Value& operator[](std::size_t i) const { return values_[i]; }
  std::span<Value> span() { return {values_, size_}; }
  std::span<const Value> span() const { return {values_, size_}; }

 private:
  LargeMemory* memory_ = nullptr;
  Value* values_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace scarp
