#include "cli/fly/pixel_judge.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/grouped_ground.h"

namespace scarp {
namespace {

/// Where a ray first meets the ground, by trying every triangle.
TriangleIndex first_met(const Tin& tin, const Position& eye, const Position& ray) {
  TriangleIndex first = kNone;
  double nearest = HUGE_VAL;
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
    const auto& [i, j, k] = tin.triangles[t];
    const Position &a = tin.vertices[i], &b = tin.vertices[j], &c = tin.vertices[k];
    const auto volume = [&](const Position& p, const Position& q) {
      const double px = p.x_m - eye.x_m, py = p.y_m - eye.y_m, pz = p.z_m - eye.z_m;
      const double qx = q.x_m - eye.x_m, qy = q.y_m - eye.y_m, qz = q.z_m - eye.z_m;
      return ray.x_m * (py * qz - pz * qy) + ray.y_m * (pz * qx - px * qz) +
             ray.z_m * (px * qy - py * qx);
    };
    const double u = volume(b, c), v = volume(c, a), w = volume(a, b);
    if (!((u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0)) || u + v + w == 0) continue;
    const double x_m = (u * a.x_m + v * b.x_m + w * c.x_m) / (u + v + w) - eye.x_m;
    const double y_m = (u * a.y_m + v * b.y_m + w * c.y_m) / (u + v + w) - eye.y_m;
    const double far = (x_m * ray.x_m + y_m * ray.y_m) / (ray.x_m * ray.x_m + ray.y_m * ray.y_m);
    if (far <= 0 || far >= nearest) continue;
    nearest = far;
    first = t;
  }
  return first;
}

class PixelJudgeOnHills : public testing::Test {
 protected:
  PixelJudgeOnHills() {
    for (GroupIndex g = 0; g < batches_.groups(); ++g) all_.push_back(g);
    shot_.width_px = 96;
    shot_.height_px = 54;
    shot_.view.eye = {200, 20, 90};
    shot_.view.target = {205, 120, 70};
    whole_ = test::picture_of(batches_, all_, shot_);
    projection_ = look_at(shot_.view, shot_.width_px, shot_.height_px);
  }
  Position ray_at(int x, int y) const {
    return ray_through(projection_, (2 * x + 1.0) / shot_.width_px - 1,
                       1 - (2 * y + 1.0) / shot_.height_px);
  }

  test::GroupedGround scene_ = test::grouped_hills(5);
  TinIndex index_{scene_.tin};
  GroupBatches batches_{scene_.tin, scene_.groups};
  PixelJudge judge_{index_};
  std::vector<GroupIndex> all_;
  Shot shot_;
  Target whole_;
  Projection projection_;
};

TEST_F(PixelJudgeOnHills, ConfirmsWhatIsTrulySeenAndWasLeftOut) {
  // Nothing was drawn: every pixel of ground differs, and is confirmed.
  const std::vector<std::uint8_t> none(scene_.tin.triangles.size(), 0);
  std::size_t differing = 0, confirmed = 0, refuted = 0;
  for (int y = 0; y < whole_.height_px; ++y)
    for (int x = 0; x < whole_.width_px; ++x) {
      const std::uint32_t shown = whole_.object[whole_.index(x, y)];
      if (shown == kNone) continue;
      ++differing;
      const bool is_wrong = judge_.is_wrong(shot_.view.eye, projection_, whole_, x, y, shown, none);
      confirmed += is_wrong;
      refuted += !is_wrong && first_met(scene_.tin, shot_.view.eye, ray_at(x, y)) == shown;
    }
  EXPECT_GT(differing, 1000U);
  EXPECT_GE(confirmed, differing * 99 / 100);
  EXPECT_EQ(refuted, 0U) << "where every triangle was tried, the ray meets it first";
}

TEST_F(PixelJudgeOnHills, RefutesWhatStandsBehindOtherGround) {
  const std::vector<std::uint8_t> none(scene_.tin.triangles.size(), 0);
  std::size_t asked = 0, wrong = 0;
  for (int y = 0; y < whole_.height_px; y += 3)
    for (int x = 0; x < whole_.width_px; x += 3) {
      const std::uint32_t shown = whole_.object[whole_.index(x, y)];
      if (shown == kNone) continue;
      // What would be seen there if the nearest ground and all before it were away.
      for (TriangleIndex t = 0; t < scene_.tin.triangles.size(); t += 7) {
        Tin one = {scene_.tin.vertices, {scene_.tin.triangles[t]}, {{kNone, kNone, kNone}}};
        if (t == shown || first_met(one, shot_.view.eye, ray_at(x, y)) == kNone) continue;
        if (first_met(scene_.tin, shot_.view.eye, ray_at(x, y)) == t) continue;
        ++asked;
        wrong += judge_.is_wrong(shot_.view.eye, projection_, whole_, x, y, t, none);
      }
    }
  EXPECT_GT(asked, 10U);
  EXPECT_EQ(wrong, 0U);
}

TEST_F(PixelJudgeOnHills, WhatWasDrawnIsNotWrong) {
  const std::vector<std::uint8_t> all(scene_.tin.triangles.size(), 1);
  for (int x = 0; x < whole_.width_px; ++x) {
    const std::uint32_t shown = whole_.object[whole_.index(x, 50)];
    if (shown == kNone) continue;
    EXPECT_FALSE(judge_.is_wrong(shot_.view.eye, projection_, whole_, x, 50, shown, all));
  }
}

}  // namespace
}  // namespace scarp
