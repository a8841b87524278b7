#include <gtest/gtest.h>

#include "core/viewshed/line_kernels.h"
#include "tests/core/viewshed/kernels/kernel_results.h"
#include "tests/core/viewshed/kernels/run_kernels.h"

std::vector<std::uint8_t> kernel_results_of_library(std::uint32_t seed) {
  return scarp::KernelRun(seed).run();
}

namespace {

constexpr std::uint32_t kSeeds[] = {1, 2, 3, 4, 5, 6, 7, 8};

TEST(KernelTargets, LibraryGivesTheBitsOfPlainLoops) {
  for (const std::uint32_t seed : kSeeds) {
    const auto plain = kernel_results_plain(seed);
    if (plain.empty()) GTEST_SKIP() << "left out, this compiler makes one version of each loop";
    EXPECT_GT(plain.size(), 100'000U);
    EXPECT_TRUE(kernel_results_of_library(seed) == plain) << "seed " << seed;
  }
}

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)

TEST(KernelTargets, Avx2GivesTheBitsOfPlainLoops) {
  if (!__builtin_cpu_supports("x86-64-v3")) GTEST_SKIP() << "left out, no AVX2 on this processor";
  for (const std::uint32_t seed : kSeeds)
    EXPECT_TRUE(kernel_results_v3(seed) == kernel_results_plain(seed)) << "seed " << seed;
}

TEST(KernelTargets, Avx512GivesTheBitsOfPlainLoops) {
  if (!__builtin_cpu_supports("x86-64-v4"))
    GTEST_SKIP() << "left out, no AVX-512 on this processor";
  for (const std::uint32_t seed : kSeeds)
    EXPECT_TRUE(kernel_results_v4(seed) == kernel_results_plain(seed)) << "seed " << seed;
}

#endif

}  // namespace
