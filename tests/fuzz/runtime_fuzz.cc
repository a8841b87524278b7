#include <algorithm>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <vector>

#include "tests/fuzz/fuzz_target.h"
#include "tests/tiles/runtime_bytes.h"
#include "tiles/runtime/scarp_runtime.h"

/// Culling files: any change is refused, and what is behind the checksums crashes nothing.
namespace scarp {
namespace {

using runtime::Culling;

/// Asks everything that there is to ask, of cameras near and far.
void ask(const Culling& culling) {
  constexpr double kPlaces[][3] = {{30, 70, 2}, {-4000, 55, 300}, {1e5, -2e5, 1e4}, {0, 0, -50}};
  constexpr double kPlane[] = {0.6, -0.8, 0.1, 3};
  const std::size_t groups = culling.groups(), tiles = culling.tiles();
  std::vector<std::uint32_t> visible(groups + 1);
  std::vector<runtime::MovingView::Kept> kept(groups + 1);
  std::vector<double> units(tiles + 1);
  runtime::MovingView moving(culling, kept.data(), units.data());
  for (const auto& p : kPlaces)
    for (const bool is_on_earth : {false, true}) {
      const auto camera = is_on_earth ? culling.camera(p[0] + 6.4e6, p[1], p[2])
                                      : culling.camera_in_frame(p[0], p[1], p[2]);
      const auto frustum = culling.frustum(camera, kPlane, 1);
      const std::uint32_t standing = culling.visible(camera, &frustum, visible.data());
      if (moving.visible(camera, &frustum, visible.data()) > groups || standing > groups)
        throw std::runtime_error("more groups are visible than there are");
      for (std::uint32_t t = 0; t < std::min<std::size_t>(tiles, 8); ++t)
        (void)culling.tile_answer(camera, t);
      (void)culling.box_visible(camera, culling.box_in_frame(p[1], p[0], p[1] + 5, p[0] + 9, 4));
    }
}

const std::vector<std::vector<std::uint8_t>>& seeds() {
  static const auto made = test::small_culling_files();
  return made;
}

void open_and_ask(const std::uint8_t* data, std::size_t size, bool may_be_wrong) {
  Culling culling;
  if (culling.open(data, size, runtime::Check::kStructure) == runtime::Status::kOk) ask(culling);
  if (culling.open(data, size) != runtime::Status::kOk) return;
  const bool is_seed = std::any_of(seeds().begin(), seeds().end(), [&](const auto& seed) {
    return seed.size() == size && std::memcmp(seed.data(), data, size) == 0;
  });
  if (!is_seed && !may_be_wrong) throw std::runtime_error("a damaged file was opened");
  ask(culling);
}

}  // namespace
}  // namespace scarp

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace scarp;
  open_and_ask(data, size, false);
  const auto resealed = std::make_unique<std::uint8_t[]>(size);
  std::copy(data, data + size, resealed.get());
  test::reseal_culling_file(resealed.get(), size);
  open_and_ask(resealed.get(), size, true);
  return 0;
}

std::vector<std::vector<std::uint8_t>> fuzz_seeds() {
  return scarp::seeds();
}
