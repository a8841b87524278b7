#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

/// What the loops of line_kernels give for drawn arrays of many lengths, byte after byte: the
/// library's own, compiled plain, and for one instruction set each. Empty where this compiler
/// knows no instruction sets.
std::vector<std::uint8_t> kernel_results_of_library(std::uint32_t seed);
std::vector<std::uint8_t> kernel_results_plain(std::uint32_t seed);
std::vector<std::uint8_t> kernel_results_v3(std::uint32_t seed);
std::vector<std::uint8_t> kernel_results_v4(std::uint32_t seed);
