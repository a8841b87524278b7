#include "tiles/store/samples_file.h"

#include <fmt/format.h>

namespace scarp {
namespace {

constexpr std::uint32_t kSamplesVersion = 1;

static_assert(sizeof(Position) == 3 * sizeof(double));

}  // namespace

void write_samples(const std::string& path, const SampleGrid& samples, Existing existing) {
  SectionFileWriter writer(kSamplesKind, kSamplesVersion);
  writer.add_owned<std::int32_t>("layout",
                                 std::vector<std::int32_t>{samples.columns, samples.rows});
  writer.add_owned<double>(
      "cells", std::vector<double>{samples.cell_x_m, samples.cell_y_m, samples.bend_cells});
  writer.add<double>("position", std::span(samples.positions));
  writer.add<std::uint8_t>("known", std::span(samples.known));
  if (!samples.void_cells.empty())
    writer.add<std::uint8_t>("void_cell", std::span(samples.void_cells));
  writer.write(path, existing);
}

SampleGrid read_samples(const SectionFile& file) {
  file.require(kSamplesKind, kSamplesVersion);
  const std::span<const std::int32_t> layout = file.section<std::int32_t>("layout");
  const std::span<const double> cells = file.section<double>("cells");
  if (layout.size() != 2 || cells.size() != 3 || layout[0] < 1 || layout[1] < 1)
    file.fail("a grid of no size");
  SampleGrid samples;
  samples.columns = layout[0];
  samples.rows = layout[1];
  samples.cell_x_m = cells[0];
  samples.cell_y_m = cells[1];
  samples.bend_cells = cells[2];
  samples.positions = file.copy<double, Position>("position");
  samples.known = file.copy<std::uint8_t, std::uint8_t>("known");
  if (file.has("void_cell"))
    samples.void_cells = file.copy<std::uint8_t, std::uint8_t>("void_cell");
  const std::size_t count =
      static_cast<std::size_t>(layout[0]) * static_cast<std::size_t>(layout[1]);
  if (samples.positions.size() != count || samples.known.size() != count ||
      (!samples.void_cells.empty() && samples.void_cells.size() != count))
    file.fail(fmt::format("{} samples where {} x {} were expected", samples.positions.size(),
                          layout[0], layout[1]));
  return samples;
}

}  // namespace scarp
