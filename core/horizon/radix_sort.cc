#include "core/horizon/radix_sort.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

namespace scarp {

void sort_by_key(std::vector<KeyedIndex>& items, std::vector<KeyedIndex>& scratch) {
  constexpr int kDigitBits = 11;  // counts of 2048 digits stay in the first-level cache
  if (items.size() < 2) return;
  const auto [low, high] =
      std::minmax_element(items.begin(), items.end(),
                          [](const KeyedIndex& x, const KeyedIndex& y) { return x.key < y.key; });
  const std::int64_t least = low->key;
  const auto digit = [&](const KeyedIndex& item, int shift) {
    const auto offset = static_cast<std::uint64_t>(item.key) - static_cast<std::uint64_t>(least);
    return static_cast<std::size_t>((offset >> shift) & ((1U << kDigitBits) - 1));
  };
  const std::uint64_t range =
      static_cast<std::uint64_t>(high->key) - static_cast<std::uint64_t>(least);
  scratch.resize(items.size());
  for (int shift = 0; shift < 64 && (range >> shift) != 0; shift += kDigitBits) {
    std::array<std::size_t, std::size_t{1} << kDigitBits> place{};
    for (const KeyedIndex& item : items) ++place[digit(item, shift)];
    std::size_t before = 0;
    for (std::size_t& p : place) before += std::exchange(p, before);
    for (const KeyedIndex& item : items) scratch[place[digit(item, shift)]++] = item;
    items.swap(scratch);
  }
}

}  // namespace scarp
