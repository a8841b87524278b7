#include "tests/bench/embree_horizons.h"

#ifdef SCARP_HAS_EMBREE

#include <embree3/rtcore.h>

#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include "cli/stopwatch.h"
#include "core/threads/parallel_for.h"
#include "core/viewshed/view_limits.h"

namespace scarp::test {
namespace {

constexpr int kBisections = 14;  ///< of 180 degrees: 0.01 degree
constexpr float kLiftM = 0.01F;  ///< an eye on its own triangle would hit that

/// Embree's scene in floats around the square's first sample.
class EmbreeGround {
 public:
  explicit EmbreeGround(const ComparedGround& ground)
      : origin_(ground.samples.positions.front()),
        device_(rtcNewDevice(nullptr)),
        scene_(rtcNewScene(device_)) {
    const SampleGrid& grid = ground.samples;
    RTCGeometry mesh = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* places = static_cast<float*>(rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                               grid.positions.size()));
    for (const Position& p : grid.positions) {
      *places++ = static_cast<float>(p.x_m - origin_.x_m);
      *places++ = static_cast<float>(p.y_m - origin_.y_m);
      *places++ = static_cast<float>(p.z_m - origin_.z_m);
    }
    const std::vector<std::uint32_t> corners = ground.cell_corners();
    auto* to = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(unsigned), corners.size() / 3));
    std::copy(corners.begin(), corners.end(), to);
    rtcCommitGeometry(mesh);
    rtcAttachGeometry(scene_, mesh);
    rtcReleaseGeometry(mesh);
    rtcCommitScene(scene_);
  }
  ~EmbreeGround() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  EmbreeGround(const EmbreeGround&) = delete;
  EmbreeGround& operator=(const EmbreeGround&) = delete;

  /// Where a ray hits, as a position; nothing where it passes.
  std::optional<Position> hit(const Position& eye, double dx, double dy, double dz) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit ray{};
    ray.ray.org_x = static_cast<float>(eye.x_m - origin_.x_m);
    ray.ray.org_y = static_cast<float>(eye.y_m - origin_.y_m);
    ray.ray.org_z = static_cast<float>(eye.z_m - origin_.z_m) + kLiftM;
    ray.ray.dir_x = static_cast<float>(dx);
    ray.ray.dir_y = static_cast<float>(dy);
    ray.ray.dir_z = static_cast<float>(dz);
    ray.ray.tfar = std::numeric_limits<float>::infinity();
    ray.ray.mask = ~0U;
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene_, &context, &ray);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
    const double t = ray.ray.tfar;
    return Position{eye.x_m + t * dx, eye.y_m + t * dy, eye.z_m + t * dz};
  }

 private:
  Position origin_;
  RTCDevice device_;
  RTCScene scene_;
};

}  // namespace

std::optional<HorizonPeer> embree_horizons(const ComparedGround& ground) {
  const auto scene = std::make_shared<EmbreeGround>(ground);
  return HorizonPeer{
      "Embree", "14 rays", "", 0,
      [scene, &ground](std::span<const ComparedGround::Eye> places,
                       std::span<double> elevation_deg) {
        const auto look = [&] {
          parallel_for(elevation_deg.size(), [&](std::size_t i) {
            const ComparedGround::Eye& at = places[i / kComparedAzimuths];
            const Position eye = ground.grid.at(at.column, at.row);
            const EyeBearings bearings(eye, ground.earth);
            const double direction = bearings.plane_direction_rad(
                2 * std::numbers::pi * static_cast<double>(i % kComparedAzimuths) /
                kComparedAzimuths);
            double low = -std::numbers::pi / 2, high = std::numbers::pi / 2;
            std::optional<Position> last;
            for (int k = 0; k < kBisections; ++k) {
              const double middle = (low + high) / 2;
              const auto hit = scene->hit(eye, std::cos(direction) * std::cos(middle),
                                          std::sin(direction) * std::cos(middle), std::sin(middle));
              (hit ? low : high) = middle;
              if (hit) last = hit;
            }
            elevation_deg[i] = last ? bearings.to(*last).pitch_rad * 180 / std::numbers::pi
                                    : std::numeric_limits<double>::quiet_NaN();
          });
        };
        std::vector<double> seconds;
        for (int run = 0; run < kComparedRuns; ++run) {
          const Stopwatch watch;
          look();
          seconds.push_back(watch.seconds());
        }
        return seconds;
      }};
}

}  // namespace scarp::test

#else

namespace scarp::test {

std::optional<HorizonPeer> embree_horizons(const ComparedGround&) {
  return {};
}

}  // namespace scarp::test

#endif
