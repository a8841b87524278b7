// Answers of scarp_runtime.h to cameras of a file, a line each, for comparison with answers.mjs.
//   answers FILE QUESTIONS
// QUESTIONS: doubles, 11 a camera: 0 ECEF or 1 frame, x, y, z, a plane (a, b, c, d), and the
// middle and half width of a box around x and y in the frame. Compiled without exceptions, RTTI
// or anything else of Scarp.

#include <cinttypes>
#include <cstdio>
#include <memory>

#include "tiles/runtime/scarp_runtime.h"

namespace {

using namespace scarp::runtime;

class Hash {
 public:
  void add(std::uint32_t value) {
    for (int i = 0; i < 4; ++i, value >>= 8) hash_ = (hash_ ^ (value & 255)) * 16777619U;
  }
  std::uint32_t value() const { return hash_; }

 private:
  std::uint32_t hash_ = 2166136261U;
};

std::uint32_t hash_of(const std::uint32_t* groups, std::uint32_t count) {
  Hash hash;
  for (std::uint32_t i = 0; i < count; ++i) hash.add(groups[i]);
  return hash.value();
}

}  // namespace

int main(int argc, char** argv) {
  Culling culling;
  if (argc != 3 || culling.open(argv[1]) != Status::kOk) return 2;
  FILE* questions = std::fopen(argv[2], "rb");
  if (questions == nullptr) return 2;
  const std::unique_ptr<std::uint32_t[]> groups(new std::uint32_t[culling.groups() + 1]);
  const std::unique_ptr<MovingView::Kept[]> kept(new MovingView::Kept[culling.groups() + 1]);
  const std::unique_ptr<double[]> units(new double[culling.tiles() + 1]);
  MovingView moving(culling, kept.get(), units.get());
  double q[11];
  while (std::fread(q, sizeof q, 1, questions) == 1) {
    const Camera camera =
        q[0] == 0 ? culling.camera(q[1], q[2], q[3]) : culling.camera_in_frame(q[1], q[2], q[3]);
    const Frustum frustum = culling.frustum(camera, q + 4, 1);
    const std::uint32_t all = culling.visible(camera, nullptr, groups.get());
    const std::uint32_t all_hash = hash_of(groups.get(), all);
    const std::uint32_t moved = moving.visible(camera, nullptr, groups.get());
    const bool is_same = moved == all && hash_of(groups.get(), moved) == all_hash;
    const std::uint32_t some = culling.visible(camera, &frustum, groups.get());
    Hash tiles;
    for (std::uint32_t t = 0; t < culling.tiles(); ++t)
      tiles.add(static_cast<std::uint32_t>(culling.tile_answer(camera, t)));
    const double half = q[10];
    const Box box = culling.box_in_frame(q[8] - half, q[9] - half, q[8] + half, q[9] + half, q[3]);
    const double corners[] = {q[1], q[2], q[3], q[1] + half, q[2] + half, q[3] + half};
    const Box hull = culling.box(corners, 2);
    std::printf("%u %08x %u %08x %08x %d %d %d %d %d %d %s\n", all, all_hash, some,
                hash_of(groups.get(), some), tiles.value(), culling.box_visible(camera, box),
                culling.box_visible(camera, hull), culling.box_visible(hull, box), hull.low_x,
                hull.high_y, hull.top, is_same ? "same" : "DIFFERS");
  }
  std::fclose(questions);
  return 0;
}
