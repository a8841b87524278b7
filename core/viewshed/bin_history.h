#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace scarp {

/// What each swept line reaches at most in each bin, so that a target left open is compared with
/// the few lines that might block it. Two coarser levels, of eight and of 64 lines, let a search
/// pass over the others.
class BinHistory {
 public:
  /// Begins a line. @return [bins] to be filled with upper bounds before the next call
  float* begin_line(std::int32_t line, std::int32_t bins);
  /// Ends it.
  void end_line();

  /// Calls blocks(line) for the lines whose upper bound in a bin is at least s, latest first, until
  /// one returns true.
  /// @param bins  in which the bin is counted
  /// @param s     read anew for each line, so that blocks may raise it
  template <typename Blocks>
  bool any_line(std::int32_t bin, std::int32_t bins, const float& s, const Blocks& blocks) const {
    for (std::size_t i = groups_.size(); i-- > 0;) {
      const Group& group = groups_[i];
      const auto b = static_cast<std::size_t>(bin) / static_cast<std::size_t>(bins / group.bins);
      if (reach_[group.reach + b] < s) continue;
      for (std::size_t block = (group.lines + kLinesInBlock - 1) / kLinesInBlock; block-- > 0;) {
        const auto width = static_cast<std::size_t>(group.bins);
        if (reach_[group.reach + (1 + block) * width + b] < s) continue;
        const std::size_t first = block * kLinesInBlock;
        const std::size_t end =
            first + kLinesInBlock < group.lines ? first + kLinesInBlock : group.lines;
        for (std::size_t k = end; k-- > first;)
          if (group.values[k * width + b] >= s && blocks(numbers_[group.first + k])) return true;
      }
    }
    return false;
  }

 private:
  static constexpr std::size_t kLinesInBlock = 8, kBlocksInGroup = 8;

  /// Up to 64 lines with equal bins.
  struct Group {
    std::int32_t bins;
    std::size_t first, lines;         ///< in numbers_
    std::unique_ptr<float[]> values;  ///< [64 lines * bins]
    std::size_t reach;                ///< in reach_: of the group, then of each block
  };

  std::vector<Group> groups_;
  std::vector<std::int32_t> numbers_;
  std::vector<float> reach_;
};

}  // namespace scarp
