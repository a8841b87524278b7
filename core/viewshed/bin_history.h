#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace scarp {

/// What each swept line reaches at most in each bin, so that a target left open is compared with
/// the few lines that might block it. Lines come in slabs; coarser levels, of eight lines, of a
/// slab and of eight slabs, let a search pass over the others. Memory is written only where lines
/// are.
class BinHistory {
 public:
  static constexpr std::size_t kLinesInBlock = 8;

  /// Begins a slab of lines first, first + step, and so on, `lines` of them.
  void begin_slab(std::int32_t first, std::int32_t step, std::int32_t lines, std::int32_t bins);
  /// Upper bounds of a line of the slab, by its place in it. @return [bins], to be filled from one
  /// bin to another; elsewhere the line is taken to reach nothing
  float* line(std::int32_t place);
  /// Takes the filled bins into account. Of one bin, lines are filled in their order.
  void end_line(std::int32_t place, std::int32_t first_bin, std::int32_t end_bin);

  /// Calls blocks(line) for the lines whose upper bound in a bin is at least s, latest first, until
  /// one returns true.
  /// @param place  of the last slab only lines before this place
  /// @param bins   in which the bin is counted
  /// @param s      read anew for each line, so that blocks may raise it
  template <typename Blocks>
  bool any_line(std::int32_t place, std::int32_t bin, std::int32_t bins, const float& s,
                const Blocks& blocks) const {
    for (std::size_t a = ages_.size(); a-- > 0;) {
      const Age& age = ages_[a];
      const auto b = static_cast<std::size_t>(bin) / static_cast<std::size_t>(bins / age.bins);
      if (age.reach[b] < s) continue;
      for (std::size_t i = age.end_slab; i-- > age.first_slab;) {
        const Slab& slab = slabs_[i];
        if (slab.reach[b] < s) continue;
        const std::size_t lines =
            i + 1 == slabs_.size() ? static_cast<std::size_t>(place) : slab.lines;
        if (any_in_slab(slab, static_cast<std::size_t>(age.bins), lines, b, s, blocks)) return true;
      }
    }
    return false;
  }

 private:
  static constexpr std::size_t kSlabsInAge = 8;

  struct Slab {
    std::int32_t first, step;
    std::size_t lines;
    std::vector<float> reach;         ///< [bins] of the slab, then of each block
    std::unique_ptr<float[]> values;  ///< [lines * bins]
  };
  /// Slabs with bins of one width.
  struct Age {
    std::int32_t bins;
    std::size_t first_slab, end_slab;
    std::vector<float> reach;
  };

  template <typename Blocks>
  static bool any_in_slab(const Slab& slab, std::size_t bins, std::size_t lines, std::size_t bin,
                          const float& s, const Blocks& blocks) {
    for (std::size_t block = (lines + kLinesInBlock - 1) / kLinesInBlock; block-- > 0;) {
      if (slab.reach[(1 + block) * bins + bin] < s) continue;
      const std::size_t begin = block * kLinesInBlock;
      const std::size_t end = begin + kLinesInBlock < lines ? begin + kLinesInBlock : lines;
      for (std::size_t k = end; k-- > begin;)
        if (slab.values[k * bins + bin] >= s &&
            blocks(slab.first + slab.step * static_cast<std::int32_t>(k)))
          return true;
    }
    return false;
  }

  std::vector<Slab> slabs_;
  std::vector<Age> ages_;
};

}  // namespace scarp
