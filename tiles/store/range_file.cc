#include "tiles/store/range_file.h"

#include <fmt/format.h>

#include <cmath>

namespace scarp {
namespace {

constexpr std::uint32_t kRangeVersion = 1;

static_assert(sizeof(HeightRange) == 2 * sizeof(float));

}  // namespace

void write_ranges(const std::string& path, const TileRanges& ranges, Existing existing) {
  SectionFileWriter writer(kRangeKind, kRangeVersion);
  writer.add_owned<std::int32_t>(
      "layout", std::vector<std::int32_t>{ranges.block_cells, ranges.columns, ranges.rows});
  writer.add<float>("range", std::span(ranges.blocks));
  writer.write(path, existing);
}

TileRanges read_ranges(const SectionFile& file) {
  file.require(kRangeKind, kRangeVersion);
  const std::span<const std::int32_t> layout = file.section<std::int32_t>("layout");
  if (layout.size() != 3 || layout[0] < 1 || layout[1] < 1 || layout[2] < 1)
    file.fail("ranges of no size");
  TileRanges ranges;
  ranges.block_cells = layout[0];
  ranges.columns = layout[1];
  ranges.rows = layout[2];
  ranges.blocks = file.copy<float, HeightRange>("range");
  if (ranges.blocks.size() !=
      static_cast<std::size_t>(layout[1]) * static_cast<std::size_t>(layout[2]))
    file.fail(fmt::format("{} ranges where {} x {} were expected", ranges.blocks.size(), layout[1],
                          layout[2]));
  for (const HeightRange& range : ranges.blocks)
    if (std::isnan(range.low_m) || std::isnan(range.high_m)) file.fail("a range that is no number");
  return ranges;
}

}  // namespace scarp
