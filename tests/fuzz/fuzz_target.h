#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

/// A fuzz target is these two. The entry point has the name that compilers' fuzzers call, so that a
/// target can be linked with one of them in place of fuzz_main.cc.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

/// Small valid inputs to damage.
std::vector<std::vector<std::uint8_t>> fuzz_seeds();
