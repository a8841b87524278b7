#include "core/horizon/radix_sort.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <vector>

namespace scarp {
namespace {

void expect_stable_order(std::vector<KeyedIndex> items) {
  std::vector<KeyedIndex> expected = items, scratch;
  std::stable_sort(expected.begin(), expected.end(),
                   [](const KeyedIndex& x, const KeyedIndex& y) { return x.key < y.key; });
  sort_by_key(items, scratch);
  ASSERT_EQ(items.size(), expected.size());
  for (std::size_t i = 0; i < items.size(); ++i) {
    ASSERT_EQ(items[i].key, expected[i].key) << i;
    ASSERT_EQ(items[i].index, expected[i].index) << i;
  }
}

TEST(RadixSort, AgreesWithStableSortAtEveryWidth) {
  std::mt19937_64 random(1);
  for (int bits = 0; bits < 64; ++bits) {
    std::vector<KeyedIndex> items;
    for (std::uint32_t i = 0; i < 300; ++i)
      items.push_back({static_cast<std::int64_t>(random()) >> bits, i});
    expect_stable_order(std::move(items));
  }
}

TEST(RadixSort, EmptyOneAndExtremes) {
  expect_stable_order({});
  expect_stable_order({{5, 0}});
  expect_stable_order({{std::numeric_limits<std::int64_t>::max(), 0},
                       {std::numeric_limits<std::int64_t>::min(), 1},
                       {0, 2},
                       {std::numeric_limits<std::int64_t>::max(), 3}});
}

}  // namespace
}  // namespace scarp
