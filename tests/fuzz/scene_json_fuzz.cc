#include <string>

#include "core/error/error.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/tiles/small_scene.h"
#include "tiles/store/scene_description.h"

/// scene.json: any text is read or refused with Error{kCorrupt}, and what is read can be written.
namespace scarp {
namespace {

/// The text with a checksum that fits, where it has a place for one.
std::string resealed(const std::string& text) {
  constexpr std::size_t kEndSize = 4, kDigits = 32;
  if (text.size() < kEndSize + kDigits) return text;
  const std::string before = text.substr(0, text.size() - kEndSize - kDigits);
  const std::string after = text.substr(text.size() - kEndSize);
  const std::string both = before + after;
  return before + to_hex(checksum_of(std::as_bytes(std::span(both)))) + after;
}

void read_or_refuse(const std::string& text) {
  try {
    const SceneDescription scene = scene_from_json(text, "input");
    if (scene_from_json(scene_to_json(scene), "rewritten") != scene)
      throw std::logic_error("what was read is not what is read again");
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kCorrupt) throw;
  }
}

}  // namespace
}  // namespace scarp

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  scarp::read_or_refuse(text);
  scarp::read_or_refuse(scarp::resealed(text));
  return 0;
}

std::vector<std::vector<std::uint8_t>> fuzz_seeds() {
  using namespace scarp;
  SceneDescription full = test::small_description();
  full.tiles = {{"0/0/0",
                 {{"tiles/0/0/0.tin", "tin", 700, checksum_of({})},
                  {"tiles/0/0/0.groups", "groups", 900, checksum_of({})}}},
                {"1/0/1", {}}};
  full.layers = {{"layers/visible.tif", "cog", 1, {}}};
  std::vector<std::vector<std::uint8_t>> seeds;
  for (const SceneDescription& scene : {test::small_description(), full}) {
    const std::string text = scene_to_json(scene);
    seeds.emplace_back(text.begin(), text.end());
  }
  return seeds;
}
