#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

namespace scarp {

/// The loops over a group's cells in a row, written once in vectors of any length (Highway),
/// compiled for several instruction sets of which the processor chooses one. Nothing is rounded
/// here, so all give the same bits.

/// A slope in 16 bits, about: the upper half of a float.
inline std::uint16_t slope_hint(float slope) {
  return static_cast<std::uint16_t>(std::bit_cast<std::uint32_t>(slope) >> 16);
}
inline float slope_of_hint(std::uint16_t hint) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(hint) << 16);
}

/// Kernels read so many hints beyond the last one at most.
inline constexpr std::size_t kHintsBeyond = 32;

/// Cells that follow one another.
struct CellRun {
  std::uint32_t begin, count;
};

/// Marks the cells whose bounds are over their hints, others not.
/// @param run        of whole multiples of kCellsMarked cells
/// @param bits[out]  a bit a cell, from cell 0 on
inline constexpr std::uint32_t kCellsMarked = 64;
void mark_wanted(const float* bounds, const std::uint16_t* hints, const CellRun& run,
                 std::uint64_t* bits);

/// Lowers bounds that are not over their hints, to the best of their run.
/// @param best  [count], of each run
void lower_useless(const CellRun* runs, const float* best, std::size_t count,
                   const std::uint16_t* hints, float* bounds);

}  // namespace scarp
