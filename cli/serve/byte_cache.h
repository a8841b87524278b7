#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>

namespace scarp {

/// Values by name, of which the least recently used ones leave when the bytes of all exceed a
/// bound. From any thread.
template <typename Value>
class ByteCache {
 public:
  explicit ByteCache(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// Null where it is not there.
  std::shared_ptr<const Value> find(const std::string& name) {
    const std::scoped_lock lock(mutex_);
    const auto found = places_.find(name);
    if (found == places_.end()) {
      ++misses_;
      return {};
    }
    ++hits_;
    entries_.splice(entries_.begin(), entries_, found->second);
    return entries_.front().value;
  }

  /// @param bytes  that the value takes; one larger than the bound is not kept
  void put(const std::string& name, std::shared_ptr<const Value> value, std::size_t bytes) {
    const std::scoped_lock lock(mutex_);
    const auto found = places_.find(name);
    if (found != places_.end()) remove(found->second);
    const std::size_t all = bytes + name.size() + sizeof(Entry);
    if (all > most_bytes_) return;
    while (bytes_ + all > most_bytes_) remove(std::prev(entries_.end()));
    entries_.push_front({name, std::move(value), all});
    places_[name] = entries_.begin();
    bytes_ += all;
  }

  struct Counts {
    std::size_t entries = 0, bytes = 0;
    std::uint64_t hits = 0, misses = 0;
  };
  Counts counts() const {
    const std::scoped_lock lock(mutex_);
    return {entries_.size(), bytes_, hits_, misses_};
  }

 private:
  struct Entry {
    std::string name;
    std::shared_ptr<const Value> value;
    std::size_t bytes;
  };

  void remove(typename std::list<Entry>::iterator entry) {
    bytes_ -= entry->bytes;
    places_.erase(entry->name);
    entries_.erase(entry);
  }

  const std::size_t most_bytes_;
  mutable std::mutex mutex_;
  std::list<Entry> entries_;  // the most recently used first
  std::unordered_map<std::string, typename std::list<Entry>::iterator> places_;
  std::size_t bytes_ = 0;
  std::uint64_t hits_ = 0, misses_ = 0;
};

}  // namespace scarp
