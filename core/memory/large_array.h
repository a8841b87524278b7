#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>

namespace scarp {

/// Uninitialised memory for a large array, in the system's large pages where it has them: fewer
/// faults when it is touched first, and columns of a raster stay within reach of the processor's
/// address cache. Throws std::bad_alloc.
void* allocate_large(std::size_t bytes);
void free_large(void* memory);

/// An array of plain values of fixed size. Uninitialised until written.
template <typename Value>
class LargeArray {
  static_assert(std::is_trivially_copyable_v<Value>);

 public:
  LargeArray() = default;
  explicit LargeArray(std::size_t size)
      : values_(static_cast<Value*>(allocate_large(size * sizeof(Value)))), size_(size) {}
  LargeArray(LargeArray&& other) noexcept
      : values_(std::exchange(other.values_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  LargeArray& operator=(LargeArray&& other) noexcept {
    std::swap(values_, other.values_);
    std::swap(size_, other.size_);
    return *this;
  }
  ~LargeArray() { free_large(values_); }

  std::size_t size() const { return size_; }
  Value& operator[](std::size_t i) { return values_[i]; }
  const Value& operator[](std::size_t i) const { return values_[i]; }
  std::span<Value> span() { return {values_, size_}; }
  std::span<const Value> span() const { return {values_, size_}; }

 private:
  Value* values_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace scarp
