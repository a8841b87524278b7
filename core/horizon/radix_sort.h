#pragma once

#include <cstdint>
#include <vector>

namespace scarp {

struct KeyedIndex {
  std::int64_t key;
  std::uint32_t index;
};

/// Sorts by rising key, equal keys in the order they stand in. `scratch` is resized as needed; its
/// content before and after means nothing.
/// Cost: O(n) for each 11 bits by which the greatest key exceeds the least.
void sort_by_key(std::vector<KeyedIndex>& items, std::vector<KeyedIndex>& scratch);

}  // namespace scarp
