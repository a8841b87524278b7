#include "tiles/store/horizon_file.h"

#include <fmt/format.h>

#include <cassert>

#include "tiles/store/layout_section.h"

namespace scarp {
namespace {

constexpr std::uint32_t kHorizonVersion = 1;

}  // namespace

SectionFileWriter horizon_writer(const HorizonTable& table) {
  assert(table.layout.count >= 4 && table.layout.subsectors >= 1);
  SectionFileWriter writer(kHorizonKind, kHorizonVersion);
  add_layout(writer, table.layout);
  writer.add_rows<std::uint32_t>("horizon_vertex", std::span(table.horizon_vertex),
                                 static_cast<std::uint32_t>(table.layout.count));
  return writer;
}

void write_horizon(const std::string& path, const HorizonTable& table, Existing existing) {
  horizon_writer(table).write(path, existing);
}

HorizonTable read_horizon(const SectionFile& file) {
  file.require(kHorizonKind, kHorizonVersion);
  HorizonTable table;
  table.layout = read_layout(file);
  const auto sectors = static_cast<std::uint32_t>(table.layout.count);
  const auto entries = file.section<std::uint32_t>("horizon_vertex", sectors);
  const std::size_t vertices = entries.size() / sectors;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (entries[i] != kNone && entries[i] >= vertices)
      file.fail(fmt::format("vertex {} has its horizon at vertex {} of {}", i / sectors, entries[i],
                            vertices));
  }
  table.horizon_vertex.assign(entries.begin(), entries.end());
  return table;
}

}  // namespace scarp
