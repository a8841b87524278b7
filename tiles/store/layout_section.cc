#include "tiles/store/layout_section.h"

#include <fmt/format.h>

namespace scarp {

void add_layout(SectionFileWriter& writer, const SectorLayout& layout) {
  static_assert(sizeof(SectorLayout) == 2 * sizeof(std::int32_t));
  writer.add<std::int32_t>("layout", std::span(&layout, 1));
}

SectorLayout read_layout(const SectionFile& file) {
  const auto values = file.section<std::int32_t>("layout", 2);
  if (values.size() != 2 || values[0] < 4 || values[0] > kMostSectors || values[1] < 1 ||
      values[1] > kMostSubsectors)
    file.fail(
        fmt::format("section \"layout\" does not hold one pair of 4 to {} sectors and 1 to {} "
                    "subsectors",
                    kMostSectors, kMostSubsectors));
  return {values[0], values[1]};
}

}  // namespace scarp
