#include "tiles/cells/sets_file.h"

#include <fmt/format.h>

namespace scarp {
namespace {

constexpr FileKind kSetsKind = {'S', 'E', 'T', 'S'};
constexpr std::uint32_t kSetsVersion = 1;

}  // namespace

SectionFileWriter sets_writer(const HiddenSets& sets) {
  SectionFileWriter writer(kSetsKind, kSetsVersion);
  writer.add<std::uint32_t>("parent", std::span(sets.parent));
  writer.add<std::uint32_t>("first", std::span(sets.first));
  writer.add<std::uint32_t>("added", std::span(sets.added));
  return writer;
}

void write_sets(const std::string& path, const HiddenSets& sets) {
  sets_writer(sets).write(path, Existing::kRefuse);
}

HiddenSets read_sets(const SectionFile& file) {
  file.require(kSetsKind, kSetsVersion);
  HiddenSets sets;
  sets.parent = file.copy<std::uint32_t, std::uint32_t>("parent");
  sets.first = file.copy<std::uint32_t, std::uint32_t>("first");
  sets.added = file.copy<std::uint32_t, GroupIndex>("added");
  const std::size_t count = sets.parent.size();
  if (count == 0 || sets.first.size() != count + 1)
    file.fail(fmt::format("{} starts of sets for {} sets", sets.first.size(), count));
  if (sets.parent[0] != 0 || sets.first[0] != 0 || sets.first[1] != 0 ||
      sets.first[count] != sets.added.size())
    file.fail("the first set is not empty, or members are left over");
  for (std::size_t i = 1; i < count; ++i)
    if (sets.parent[i] >= i || sets.first[i + 1] < sets.first[i])
      file.fail(fmt::format("set {} follows a later one, or has a negative length", i));
  return sets;
}

}  // namespace scarp
