// The loops of core/viewshed/line_kernels.cc, compiled for the plain processor, in a namespace of
// their own.
#include "tests/core/viewshed/kernels/kernel_results.h"

// The system's headers first: they stay in their own namespaces.
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <span>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "core/threads/for_each_target.h"

#undef SCARP_FOR_EACH_TARGET
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define SCARP_FOR_EACH_TARGET
#define SCARP_HAS_TARGET 1
#else
#define SCARP_FOR_EACH_TARGET
#define SCARP_HAS_TARGET 0
#endif
#define scarp scarp_plain
#include "core/viewshed/line_kernels.cc"
// After what it runs.
#include "tests/core/viewshed/kernels/run_kernels.h"

std::vector<std::uint8_t> kernel_results_plain(std::uint32_t seed) {
  return SCARP_HAS_TARGET ? scarp::KernelRun(seed).run() : std::vector<std::uint8_t>();
}
