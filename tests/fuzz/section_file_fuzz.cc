#include <cstring>

#include "core/culling/certified_culling.h"
#include "core/error/error.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/tiles/reseal.h"
#include "tests/tiles/small_scene.h"
#include "tiles/cells/sets_file.h"
#include "tiles/store/groups_file.h"
#include "tiles/store/horizon_file.h"
#include "tiles/store/tin_file.h"
#include "tiles/store/tree_file.h"

/// Tile files: any bytes are read or refused with Error{kCorrupt}.
namespace scarp {
namespace {

std::vector<std::byte> as_file(const std::uint8_t* data, std::size_t size) {
  std::vector<std::byte> bytes(size);
  if (size > 0) std::memcpy(bytes.data(), data, size);
  return bytes;
}

/// Any other exception goes up to the driver, which counts it as a failure.
template <class Read>
void read_or_refuse(const std::vector<std::byte>& bytes, Verify verify, Read read) {
  try {
    read(SectionFile::from_memory(bytes, "input", verify));
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kCorrupt) throw;
  }
}

void read_as_every_kind(const std::vector<std::byte>& bytes, Verify verify) {
  read_or_refuse(bytes, verify, [](const SectionFile& file) {
    const SampledTin mesh = read_sampled_tin(file);
    (void)check_tin(mesh.tin);
  });
  read_or_refuse(bytes, verify, read_horizon);
  read_or_refuse(bytes, verify, [](const SectionFile& file) {
    (void)hidden_tiles(read_tree(file), {30, 70, 2});
  });
  read_or_refuse(bytes, verify, [](const SectionFile& file) {
    const HiddenSets sets = read_sets(file);
    (void)groups_of(sets, static_cast<std::uint32_t>(sets.size() - 1));
  });
  read_or_refuse(bytes, verify, [](const SectionFile& file) {
    const Groups groups = read_groups(file);
    if (groups.has_certified()) (void)CertifiedCulling(groups.certified).visible({{30, 70, 2}, {}});
  });
}

}  // namespace
}  // namespace scarp

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace scarp;
  std::vector<std::byte> bytes = as_file(data, size);
  read_as_every_kind(bytes, Verify::kEverything);
  read_as_every_kind(bytes, Verify::kStructure);
  test::reseal(bytes);  // on to what lies behind the checksums
  read_as_every_kind(bytes, Verify::kEverything);
  return 0;
}

std::vector<std::vector<std::uint8_t>> fuzz_seeds() {
  using namespace scarp;
  const Tin tin = test::grid_tin(3, 3);
  const std::vector<std::int64_t> samples = {0, 1, 2, 3, -1, 5, 6, 7, 8};
  std::vector<std::vector<std::uint8_t>> seeds;
  for (const std::vector<std::byte>& bytes :
       {tin_writer(tin, samples).to_bytes(), tin_writer(Tin{}).to_bytes(),
        compact_tin_writer(tin, {{0, 1, 2, 3, 4, 5, 6, 7, 8}}, 3).to_bytes(),
        horizon_writer(test::small_horizons(tin)).to_bytes(),
        tree_writer(test::small_tree()).to_bytes(),
        sets_writer({{0, 0, 1, 1}, {0, 0, 2, 3, 5}, {4, 7, 5, 1, 2}}).to_bytes(),
        groups_writer(test::small_groups(tin)).to_bytes(),
        groups_writer(test::small_certified_groups(tin)).to_bytes(),
        groups_writer(Groups{}).to_bytes()}) {
    std::vector<std::uint8_t> seed(bytes.size());
    std::memcpy(seed.data(), bytes.data(), bytes.size());
    seeds.push_back(std::move(seed));
  }
  return seeds;
}
