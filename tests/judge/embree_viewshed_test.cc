// Built where Embree is installed; see tests/CMakeLists.txt.
#if defined(SCARP_HAS_EMBREE)

#include <embree3/rtcore.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/viewshed/tin_viewshed.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

/// Embree's answers over the same triangles, in float.
class EmbreeScene {
 public:
  explicit EmbreeScene(const Tin& tin)
      : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* corners = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                3 * sizeof(float), tin.vertices.size()));
    for (const Position& p : tin.vertices) {
      *corners++ = static_cast<float>(p.x_m);
      *corners++ = static_cast<float>(p.y_m);
      *corners++ = static_cast<float>(p.z_m);
    }
    auto* triangles = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(unsigned), tin.triangles.size()));
    for (const auto& triangle : tin.triangles)
      for (const VertexIndex v : triangle) *triangles++ = v;
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
  }
  ~EmbreeScene() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  bool is_blocked(const Position& from, const Position& to) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay ray{};
    ray.org_x = static_cast<float>(from.x_m);
    ray.org_y = static_cast<float>(from.y_m);
    ray.org_z = static_cast<float>(from.z_m);
    ray.dir_x = static_cast<float>(to.x_m - from.x_m);
    ray.dir_y = static_cast<float>(to.y_m - from.y_m);
    ray.dir_z = static_cast<float>(to.z_m - from.z_m);
    ray.tnear = 0;
    ray.tfar = 1;
    ray.mask = ~0U;
    rtcOccluded1(scene_, &context, &ray);
    return ray.tfar < 0;
  }

 private:
  RTCDevice device_;
  RTCScene scene_;
};

/// Rays in float may err by the rounding of their ends and of the crossing: a millimetre of
/// height on terrains of some kilometres. Where they differ from us, a target that much higher or
/// lower is decided the other way.
TEST(Embree, AgreesButWhereALineGrazesTheGround) {
  constexpr double kGrazingM = 0.002, kTargetM = 1.5;
  constexpr double kMostThatDiffer = 1e-3;
  std::size_t judged = 0, hidden = 0, differ = 0;
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const SampleGrid samples = test::random_hills(90, 80, 30, seed, 200, 1 / 16.0);
    const Tin tin = test::triangulated(samples, seed);
    const TinIndex index(tin);
    GroundGrid grid(samples);
    stand_on(index, grid);
    const EmbreeScene embree(tin);
    std::vector<Seen> seen(samples.positions.size()), lower = seen, higher = seen;
    for (const auto& [column, row] : {std::pair(10, 12), std::pair(45, 40), std::pair(80, 30)}) {
      const Position eye = grid.raised(column, row, 2);
      const SampleWindow all = whole_window(grid);
      tin_viewshed(index, grid, eye, kTargetM, all, seen);
      tin_viewshed(index, grid, eye, kTargetM - kGrazingM, all, lower);
      tin_viewshed(index, grid, eye, kTargetM + kGrazingM, all, higher);
      for (std::int32_t r = 0; r < grid.rows(); ++r) {
        for (std::int32_t c = 0; c < grid.columns(); ++c) {
          const std::size_t i = samples.index(c, r);
          ++judged;
          hidden += seen[i] == Seen::kHidden;
          if (embree.is_blocked(eye, grid.raised(c, r, kTargetM)) == (seen[i] == Seen::kHidden))
            continue;
          ++differ;
          EXPECT_NE(lower[i], higher[i]) << "seed " << seed << " column " << c << " row " << r;
        }
      }
    }
  }
  EXPECT_GT(hidden, judged / 4);
  EXPECT_LE(static_cast<double>(differ), kMostThatDiffer * static_cast<double>(judged));
}

}  // namespace
}  // namespace scarp

#endif
