#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <string>
#include <vector>

#include "tests/tiles/small_scene.h"
#include "tests/tiles/temporary_folder.h"
#include "tiles/layers/geotiff.h"
#include "tiles/layers/outline.h"
#include "tiles/store/tin_file.h"

/// What the scene on disk costs: a TIN of SIDE x SIDE vertices (1000) written, opened, checked and
/// read, its outlines in groups of 128 triangles, and a byte layer of SIDE x SIDE.
namespace scarp {
namespace {

template <class Step>
void measure(const char* name, std::size_t bytes, Step step) {
  const auto start = std::chrono::steady_clock::now();
  step();
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
  fmt::print("{:<28} {:10.3f} ms", name, 1e3 * time.count());
  if (bytes > 0) fmt::print(" {:10.0f} MB/s", 1e-6 * static_cast<double>(bytes) / time.count());
  fmt::print("\n");
}

/// Groups of 8 x 8 cells.
std::vector<GroupIndex> block_groups(std::uint32_t side) {
  std::vector<GroupIndex> group_of;
  const std::uint32_t blocks = (side + 6) / 8;
  for (std::uint32_t row = 0; row + 1 < side; ++row) {
    for (std::uint32_t column = 0; column + 1 < side; ++column)
      group_of.insert(group_of.end(), 2, row / 8 * blocks + column / 8);
  }
  return group_of;
}

void run(std::uint32_t side) {
  const test::TemporaryFolder folder;
  const Tin tin = test::grid_tin(side, side);
  const std::string path = folder / "a.tin";
  const std::size_t size = tin_writer(tin).to_bytes().size();
  fmt::print("TIN of {} vertices, {} triangles, {:.1f} MB\n", tin.vertices.size(),
             tin.triangles.size(), 1e-6 * static_cast<double>(size));
  measure("write, flush, rename", size, [&] { write_tin(path, tin, {}, Existing::kRefuse); });
  measure("open, structure", 0, [&] { SectionFile::open(path); });
  measure("open, every checksum", size, [&] { SectionFile::open(path, Verify::kEverything); });
  measure("read_tin", size, [&] { read_tin(SectionFile::open(path)); });
  const std::vector<GroupIndex> group_of = block_groups(side);
  measure("trace_groups", 0, [&] { trace_groups(tin, group_of); });
  std::vector<std::uint8_t> visible(std::size_t{side} * side);
  for (std::size_t i = 0; i < visible.size(); ++i) visible[i] = (i / 97 + i / side) % 3 == 0;
  RasterLayer layer;
  layer.columns = layer.rows = static_cast<std::int32_t>(side);
  layer.samples = std::span<const std::uint8_t>(visible);
  measure("write_geotiff_cog, byte", visible.size(),
          [&] { write_geotiff_cog(folder / "a.tif", layer, Existing::kRefuse); });
}

}  // namespace
}  // namespace scarp

int main(int count, char** arguments) {
  scarp::run(count > 1 ? static_cast<std::uint32_t>(std::max(2, std::atoi(arguments[1]))) : 1000);
  return 0;
}
