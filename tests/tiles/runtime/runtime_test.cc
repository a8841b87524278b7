// The run-time header against the certified regions that its file is made of, the exact judge, and
// its twins: the same header compiled otherwise, and the one in JavaScript.

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <numbers>
#include <random>
#include <set>

#include "core/sight/line_of_sight.h"
#include "core/sight/triangle_sight.h"
#include "tests/support/shared_data.h"
#include "tests/support/temp_folder.h"
#include "tests/tiles/culling_scene.h"
#include "tiles/runtime/scarp_runtime.h"

namespace scarp {
namespace {

using runtime::Culling;
using runtime::Status;
using test::CullingScene;

/// The scenes that all tests share: small steps, an Earth with refraction, and a wide one.
const CullingScene& scene_of(int kind) {
  static const auto flat = test::hills_scene(3);
  static const auto round = [] {
    const EcefPoint centre{4'200'000, 600'000, 4'740'000};
    return test::hills_scene(5, Flattening(centre, 0.13, {0, 0, -30'000}), 90);
  }();
  static const auto wide = test::hills_scene(7, {}, 4'000);
  return kind == 0 ? *flat : kind == 1 ? *round : *wide;
}
constexpr int kScenes = 3;

/// Cameras in and around the ground, most of them near it.
class Eyes {
 public:
  Eyes(const Tin& tin, std::uint64_t seed) : bounds_(bounds_of(tin.vertices)), random_(seed) {}

  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53;
  }
  Position next() {
    const double wide_m = bounds_.high.x_m - bounds_.low.x_m;
    const double high_m = bounds_.high.z_m - bounds_.low.z_m;
    const double beyond_m = random_() % 4 == 0 ? wide_m : wide_m * 0.05;
    const double up_m = random_() % 4 == 0 ? 2 * high_m : 0;
    return {between(bounds_.low.x_m - beyond_m, bounds_.high.x_m + beyond_m),
            between(bounds_.low.y_m - beyond_m, bounds_.high.y_m + beyond_m),
            between(bounds_.low.z_m - high_m / 4, bounds_.high.z_m + up_m)};
  }
  /// On the lattice, as the judge wants it.
  Position next_on_lattice() { return round_to_lattice(next()); }

 private:
  Bounds bounds_;
  std::mt19937_64 random_;
};

std::set<std::uint32_t> hidden_by(const Culling& culling, const runtime::Camera& camera) {
  std::vector<std::uint32_t> visible(culling.groups());
  visible.resize(culling.visible(camera, nullptr, visible.data()));
  std::set<std::uint32_t> hidden;
  for (std::uint32_t g = 0; g < culling.groups(); ++g) hidden.insert(g);
  for (const std::uint32_t g : visible) EXPECT_EQ(hidden.erase(g), 1U);
  return hidden;
}

/// Whether certified regions hide a group from a place, or would from one beside it, by what cells
/// overlap: where the two look the camera up in different cells, both are right.
bool is_certified(const CertifiedRegions& regions, std::uint32_t group, const Position& eye) {
  if (hides_group(regions, group, eye)) return true;
  const CertifiedGroup& g = regions.groups[group];
  const double dx = eye.x_m - g.centre_x_m, dy = eye.y_m - g.centre_y_m;
  const double by = 0x1p-14;
  for (int turn = -2; turn <= 2; ++turn)
    for (int stretch = -2; stretch <= 2; ++stretch) {
      const double a = turn * by / 2, s = 1 + stretch * by / 2;
      const Position beside{g.centre_x_m + s * (dx - a * dy), g.centre_y_m + s * (dy + a * dx),
                            eye.z_m - std::abs(eye.z_m - g.height_m) * 2 * by - 0.01};
      if (hides_group(regions, group, beside)) return true;
    }
  return false;
}

TEST(Runtime, HidesWhatCertifiedRegionsHideAndNothingElse) {
  for (int kind = 0; kind < kScenes; ++kind) {
    const CullingScene& scene = scene_of(kind);
    Culling culling;
    ASSERT_EQ(culling.open(scene.file.data(), scene.file.size()), Status::kOk);
    ASSERT_EQ(culling.groups(), scene.groups.leaf_count);
    const CertifiedRegions& regions = scene.groups.certified;
    Eyes eyes(scene.tin, 11);
    std::size_t certified = 0, hidden = 0, both = 0;
    for (int i = 0; i < 700; ++i) {
      const Position eye = eyes.next();
      const auto by_runtime =
          hidden_by(culling, culling.camera_in_frame(eye.x_m, eye.y_m, eye.z_m));
      for (std::uint32_t g = 0; g < regions.groups.size(); ++g) {
        const bool is_hidden = by_runtime.count(g) != 0, is_sure = hides_group(regions, g, eye);
        certified += is_sure, hidden += is_hidden, both += is_sure && is_hidden;
        if (!is_hidden || is_sure) continue;
        ASSERT_TRUE(is_certified(regions, g, eye)) << "scene " << kind << ", group " << g;
      }
    }
    EXPECT_GT(certified, 5'000U) << kind;
    EXPECT_GT(static_cast<double>(both), 0.99 * static_cast<double>(certified)) << kind;
    EXPECT_LT(static_cast<double>(hidden - both), 0.002 * static_cast<double>(hidden)) << kind;
  }
}

TEST(Runtime, HidesNothingThatTheJudgeSees) {
  for (int kind = 0; kind < kScenes; ++kind) {
    const CullingScene& scene = scene_of(kind);
    Culling culling;
    ASSERT_EQ(culling.open(scene.file.data(), scene.file.size()), Status::kOk);
    Eyes eyes(scene.tin, 23);
    std::size_t judged = 0;
    for (int i = 0; i < 60; ++i) {
      const Position eye = eyes.next_on_lattice();
      const auto hidden = hidden_by(culling, culling.camera_in_frame(eye.x_m, eye.y_m, eye.z_m));
      const auto sight = judge_all(*scene.index, eye);
      for (std::size_t t = 0; t < sight.size(); ++t) {
        if (hidden.count(scene.groups.group_of_triangle[t]) == 0) continue;
        ++judged;
        ASSERT_EQ(sight[t], TriangleSight::kHidden) << "scene " << kind << ", triangle " << t;
      }
    }
    EXPECT_GT(judged, 5'000U);
  }
}

TEST(Runtime, OneGroupIsAnsweredAsAll) {
  for (int kind = 0; kind < kScenes; ++kind) {
    const CullingScene& scene = scene_of(kind);
    Culling culling;
    ASSERT_EQ(culling.open(scene.file.data(), scene.file.size()), Status::kOk);
    Eyes eyes(scene.tin, 5);
    for (int i = 0; i < 300; ++i) {
      const Position eye = eyes.next();
      const auto camera = culling.camera_in_frame(eye.x_m, eye.y_m, eye.z_m);
      const auto hidden = hidden_by(culling, camera);
      for (std::uint32_t g = 0; g < culling.groups(); ++g)
        ASSERT_EQ(culling.hides(camera, g), hidden.count(culling.id(g)) != 0);
    }
  }
}

/// A path whose steps are small next to the groups, with a turn now and then.
TEST(Runtime, AMovingViewAnswersAsIfItStood) {
  for (int kind = 0; kind < kScenes; ++kind) {
    const CullingScene& scene = scene_of(kind);
    Culling culling;
    ASSERT_EQ(culling.open(scene.file.data(), scene.file.size()), Status::kOk);
    std::vector<runtime::MovingView::Kept> kept(culling.groups());
    std::vector<double> units(culling.tiles());
    runtime::MovingView moving(culling, kept.data(), units.data());
    Eyes eyes(scene.tin, 31);
    std::size_t looked_at = 0, frames = 0;
    for (int leg = 0; leg < 12; ++leg) {
      const Position from = eyes.next(), to = eyes.next();
      for (int i = 0; i < 400; ++i, ++frames) {
        const double part = i * 0.0005;
        const auto camera = culling.camera_in_frame(from.x_m + part * (to.x_m - from.x_m),
                                                    from.y_m + part * (to.y_m - from.y_m),
                                                    from.z_m + part * (to.z_m - from.z_m));
        std::vector<std::uint32_t> standing(culling.groups()), going(culling.groups());
        standing.resize(culling.visible(camera, nullptr, standing.data()));
        going.resize(moving.visible(camera, nullptr, going.data()));
        ASSERT_EQ(standing, going) << "scene " << kind << ", frame " << frames;
        looked_at += moving.looked_at();
      }
    }
    EXPECT_LT(looked_at, frames * culling.groups() / 3) << kind;
  }
}

/// A frustum of four planes through the eye, in the coordinates of a flat scene.
std::vector<double> planes_of(const Position& eye, double azimuth_rad, double half_rad) {
  std::vector<double> planes;
  const auto add = [&](double a, double b, double c) {
    planes.insert(planes.end(), {a, b, c, -(a * eye.x_m + b * eye.y_m + c * eye.z_m)});
  };
  add(std::sin(half_rad - azimuth_rad), std::cos(half_rad - azimuth_rad), 0);
  add(std::sin(half_rad + azimuth_rad), -std::cos(half_rad + azimuth_rad), 0);
  add(std::cos(azimuth_rad) * 0.4, std::sin(azimuth_rad) * 0.4, 1);
  add(std::cos(azimuth_rad) * 0.4, std::sin(azimuth_rad) * 0.4, -1);
  return planes;
}

TEST(Runtime, AFrustumLeavesOutOnlyWhatIsBeside) {
  const CullingScene& scene = scene_of(0);
  Culling culling;
  ASSERT_EQ(culling.open(scene.file.data(), scene.file.size()), Status::kOk);
  Eyes eyes(scene.tin, 41);
  std::size_t left_out = 0, shown = 0;
  for (int i = 0; i < 500; ++i) {
    const Position eye = eyes.next();
    const auto planes = planes_of(eye, eyes.between(-3, 3), eyes.between(0.1, 1.2));
    const auto camera = culling.camera_in_frame(eye.x_m, eye.y_m, eye.z_m);
    const auto frustum = culling.frustum(camera, planes.data(), 4);
    ASSERT_EQ(frustum.count, 4);
    std::vector<std::uint32_t> visible(culling.groups());
    visible.resize(culling.visible(camera, &frustum, visible.data()));
    std::set<std::uint32_t> may_show(visible.begin(), visible.end());
    for (const std::uint32_t g : hidden_by(culling, camera)) may_show.insert(g);
    shown += visible.size();
    left_out += culling.groups() - may_show.size();
    for (std::size_t t = 0; t < scene.tin.triangles.size(); ++t) {
      if (may_show.count(scene.groups.group_of_triangle[t]) != 0) continue;
      for (const VertexIndex v : scene.tin.triangles[t]) {
        const Position& p = scene.tin.vertices[v];
        bool is_inside = true;
        for (std::size_t k = 0; k < planes.size(); k += 4)
          is_inside &=
              planes[k] * p.x_m + planes[k + 1] * p.y_m + planes[k + 2] * p.z_m + planes[k + 3] >=
              0;
        ASSERT_FALSE(is_inside);
      }
    }
  }
  EXPECT_GT(shown, 1'000U);
  EXPECT_GT(left_out, 10'000U);
}

/// What is near the camera on the Earth is where ECEF says.
TEST(Runtime, CamerasOnTheEarthAreThoseOfTheFrame) {
  const CullingScene& scene = scene_of(1);
  Culling culling;
  ASSERT_EQ(culling.open(scene.file.data(), scene.file.size()), Status::kOk);
  Eyes eyes(scene.tin, 2);
  for (int i = 0; i < 1000; ++i) {
    const Position eye = eyes.next();
    const EcefPoint at = scene.source.frame->unflatten(eye);
    const auto camera = culling.camera(at.x_m, at.y_m, at.z_m);
    ASSERT_TRUE(camera.is_valid);
    const double unit_m = culling.unit_m();
    EXPECT_NEAR(camera.x * unit_m, eye.x_m, 0.51 * unit_m);
    EXPECT_NEAR(camera.y * unit_m, eye.y_m, 0.51 * unit_m);
    EXPECT_GT(camera.z * unit_m, eye.z_m);
    EXPECT_LT(camera.z * unit_m, eye.z_m + 2.1 * unit_m);
    // A plane through the camera and the Earth's own up: the sides that points lie on.
    const double plane[] = {0.6, -0.8, 0.1, -(0.6 * at.x_m - 0.8 * at.y_m + 0.1 * at.z_m)};
    const auto frustum = culling.frustum(camera, plane, 1);
    std::vector<std::uint32_t> visible(culling.groups());
    visible.resize(culling.visible(camera, &frustum, visible.data()));
    std::set<std::uint32_t> may_show(visible.begin(), visible.end());
    for (const std::uint32_t g : hidden_by(culling, camera)) may_show.insert(g);
    for (std::size_t t = 0; t < scene.tin.triangles.size(); ++t) {
      if (may_show.count(scene.groups.group_of_triangle[t]) != 0) continue;
      for (const VertexIndex v : scene.tin.triangles[t]) {
        // Where the picture shows it: without refraction.
        Position p = scene.tin.vertices[v];
        const double s = (p.x_m * p.x_m + p.y_m * p.y_m) /
                         (scene.source.frame->scale_m() * scene.source.frame->scale_m());
        p.z_m -= scene.source.frame->bend_m() * s / (std::sqrt(1 + s) + 1);
        const double u = p.x_m / scene.source.frame->scale_m();
        const double w = p.y_m / scene.source.frame->scale_m();
        const double h =
            scene.source.frame->scale_m() / (1 - p.z_m / scene.source.frame->scale_m());
        const auto& f = *scene.source.frame;
        const double x = f.origin().x_m + h * (u * f.east().x_m + w * f.north().x_m + f.up().x_m);
        const double y = f.origin().y_m + h * (u * f.east().y_m + w * f.north().y_m + f.up().y_m);
        const double z = f.origin().z_m + h * (u * f.east().z_m + w * f.north().z_m + f.up().z_m);
        ASSERT_LT(plane[0] * x + plane[1] * y + plane[2] * z + plane[3], 0);
      }
    }
  }
}

/// Boxes that stand on the ground and fly over it: every sight line to places of a hidden one is
/// blocked, judged exactly.
TEST(Runtime, HidesNoBoxThatAnythingIsSeenOf) {
  for (int kind = 0; kind < kScenes; ++kind) {
    const CullingScene& scene = scene_of(kind);
    Culling culling;
    ASSERT_EQ(culling.open(scene.file.data(), scene.file.size()), Status::kOk);
    const Bounds bounds = bounds_of(scene.tin.vertices);
    const double cell_m = (bounds.high.x_m - bounds.low.x_m) / 35;
    Eyes eyes(scene.tin, 17);
    int hidden = 0, seen = 0;
    for (int i = 0; i < 6000; ++i) {
      Position eye = eyes.next_on_lattice();
      const Position at = eyes.next_on_lattice();
      const auto ground_m = scene.index->ground_height_m(at.x_m, at.y_m);
      if (!ground_m) continue;
      const double half_m = eyes.between(0.01, 0.5) * cell_m;
      const double top_m = *ground_m + eyes.between(0, 2) * cell_m;
      const auto camera = culling.camera_in_frame(eye.x_m, eye.y_m, eye.z_m);
      const auto box = culling.box_in_frame(at.x_m - half_m, at.y_m - half_m, at.x_m + half_m,
                                            at.y_m + half_m, top_m);
      ASSERT_TRUE(box.is_valid);
      if (culling.box_visible(camera, box)) {
        ++seen;
        continue;
      }
      ++hidden;
      for (int k = 0; k < 9; ++k) {
        const Position p =
            round_to_lattice({at.x_m + (k % 3 - 1) * half_m, at.y_m + (k / 3 - 1) * half_m, top_m});
        ASSERT_TRUE(is_blocked(*scene.index, eye, p)) << "scene " << kind << ", box " << i;
      }
    }
    EXPECT_GT(hidden, 300) << kind;
    EXPECT_GT(seen, 300) << kind;
  }
}

/// The same from all cameras of a cell.
TEST(Runtime, HidesNoBoxThatAnyCameraOfACellSees) {
  for (int kind = 0; kind < kScenes; ++kind) {
    const CullingScene& scene = scene_of(kind);
    Culling culling;
    ASSERT_EQ(culling.open(scene.file.data(), scene.file.size()), Status::kOk);
    const Bounds bounds = bounds_of(scene.tin.vertices);
    const double cell_m = (bounds.high.x_m - bounds.low.x_m) / 35;
    Eyes eyes(scene.tin, 19);
    int hidden = 0;
    for (int i = 0; i < 6000; ++i) {
      const Position from = eyes.next_on_lattice(), at = eyes.next_on_lattice();
      const auto ground_m = scene.index->ground_height_m(at.x_m, at.y_m);
      if (!ground_m) continue;
      const double half_m = eyes.between(0.01, 0.5) * cell_m, from_m = eyes.between(0, 1) * cell_m;
      const double top_m = *ground_m + eyes.between(0, 1) * cell_m;
      const auto cell = culling.box_in_frame(from.x_m - from_m, from.y_m - from_m,
                                             from.x_m + from_m, from.y_m + from_m, from.z_m);
      const auto box = culling.box_in_frame(at.x_m - half_m, at.y_m - half_m, at.x_m + half_m,
                                            at.y_m + half_m, top_m);
      if (culling.box_visible(cell, box)) continue;
      ++hidden;
      for (int k = 0; k < 8; ++k) {
        const Position eye = round_to_lattice({from.x_m + eyes.between(-from_m, from_m),
                                               from.y_m + eyes.between(-from_m, from_m),
                                               from.z_m - (k % 2) * eyes.between(0, cell_m)});
        const Position p =
            round_to_lattice({at.x_m + (k % 3 - 1) * half_m, at.y_m + (k / 3 - 1) * half_m, top_m});
        ASSERT_TRUE(is_blocked(*scene.index, eye, p)) << "scene " << kind << ", box " << i;
      }
    }
    EXPECT_GT(hidden, 200) << kind;
  }
}

/// Behind a plateau 100 m high that begins 290 m from the camera, a mast 990 m away is seen from
/// 220.7 m on: answers turn over just below.
TEST(Runtime, AMastBehindAPlateauIsSeenFromItsHeightOn) {
  std::vector<double> profile_m(120, 0);
  std::fill(profile_m.begin() + 30, profile_m.begin() + 61, 100);
  const auto scene = test::culling_scene(
      test::triangulated(test::extruded_profile(profile_m, 10, 24)), 40, 16, 16);
  Culling culling;
  ASSERT_EQ(culling.open(scene->file.data(), scene->file.size()), Status::kOk);
  const auto camera = culling.camera_in_frame(10, 120, 50);
  const auto is_visible = [&](double top_m) {
    return culling.box_visible(camera, culling.box_in_frame(1000, 119, 1002, 121, top_m));
  };
  EXPECT_FALSE(is_visible(10));
  EXPECT_FALSE(is_visible(205));
  EXPECT_TRUE(is_visible(221));
}

TEST(Runtime, TilesAreAnsweredAsTheJudgeSeesThem) {
  // A wall before a low plain, which is the tile.
  const Tin tin = test::triangulated(
      test::extruded_profile({0, 0, 400, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0}, 50, 24), 0);
  const auto scene = test::culling_scene(tin, 12, 64, 64);
  Culling culling;
  ASSERT_EQ(culling.open(scene->file.data(), scene->file.size()), Status::kOk);
  Eyes eyes(tin, 3);
  int answers[3] = {};
  for (int i = 0; i < 2000; ++i) {
    const Position eye = eyes.next_on_lattice();
    const auto answer = culling.tile_answer(culling.camera_in_frame(eye.x_m, eye.y_m, eye.z_m), 0);
    ++answers[static_cast<int>(answer)];
    if (answer == runtime::TileAnswer::kUnknown || i % 10 != 0) continue;
    const auto sight = judge_all(*scene->index, eye);
    const bool is_seen = std::count(sight.begin(), sight.end(), TriangleSight::kVisible) > 0;
    EXPECT_EQ(is_seen, answer == runtime::TileAnswer::kNotOccluded);
  }
  EXPECT_GT(answers[static_cast<int>(runtime::TileAnswer::kUnknown)], 0);
  EXPECT_GT(answers[static_cast<int>(runtime::TileAnswer::kNotOccluded)], 0);
}

TEST(Runtime, WhatIsOutOfReachSeesEverything) {
  const CullingScene& scene = scene_of(0);
  Culling culling;
  ASSERT_EQ(culling.open(scene.file.data(), scene.file.size()), Status::kOk);
  for (const double far_m : {1e9, 1e300, std::nan(""), -HUGE_VAL}) {
    const auto camera = culling.camera_in_frame(far_m, 0, 0);
    EXPECT_FALSE(camera.is_valid);
    EXPECT_TRUE(hidden_by(culling, camera).empty());
    EXPECT_EQ(culling.tile_answer(camera, 0), runtime::TileAnswer::kUnknown);
    EXPECT_FALSE(culling.box_in_frame(0, 0, far_m, 1, 1).is_valid);
  }
}

TEST(Runtime, EveryTruncationIsRefused) {
  const CullingScene& scene = scene_of(0);
  const std::size_t stride = std::max<std::size_t>(1, scene.file.size() / 4000);
  for (std::size_t size = 0; size < scene.file.size(); size += size < 1024 ? 1 : stride) {
    const std::unique_ptr<std::byte[]> exact(new std::byte[size]);
    std::memcpy(exact.get(), scene.file.data(), size);
    Culling culling;
    ASSERT_NE(culling.open(exact.get(), size), Status::kOk) << size;
  }
}

/// Runs a command line and gives what it prints; nothing where it fails.
std::optional<std::string> output_of(const std::string& command) {
  FILE* pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) return {};
  std::string text;
  char piece[4096];
  for (std::size_t got; (got = std::fread(piece, 1, sizeof piece, pipe)) > 0;)
    text.append(piece, got);
  return ::pclose(pipe) == 0 ? std::optional(text) : std::nullopt;
}

/// Cameras and what is asked of them: see tests/runtime/answers.cc.
void write_questions(const CullingScene& scene, const std::string& path, int count) {
  Eyes eyes(scene.tin, 99);
  std::ofstream out(path, std::ios::binary);
  const auto put = [&](double value) {
    out.write(reinterpret_cast<const char*>(&value), sizeof value);
  };
  Position eye = eyes.next();
  for (int i = 0; i < count; ++i) {
    // Now and then somewhere else, otherwise a step on; some out of reach.
    const Position there = eyes.next();
    const double part = i % 8 == 0 ? 1 : 0.002;
    eye.x_m += part * (there.x_m - eye.x_m), eye.y_m += part * (there.y_m - eye.y_m);
    eye.z_m += part * (there.z_m - eye.z_m);
    const bool is_in_frame = i % 2 == 1 || !scene.source.frame;
    Position at = eye;
    if (!is_in_frame) {
      const EcefPoint p = scene.source.frame->unflatten(eye);
      at = {p.x_m, p.y_m, p.z_m};
    }
    if (i % 97 == 0) at.x_m *= 1e7;
    put(is_in_frame), put(at.x_m), put(at.y_m), put(at.z_m);
    const double a = eyes.between(-1, 1), b = eyes.between(-1, 1), c = eyes.between(-1, 1);
    put(a), put(b), put(c), put(-(a * at.x_m + b * at.y_m + c * at.z_m) + eyes.between(-9, 9));
    put(there.x_m), put(there.y_m), put(eyes.between(0, 100));
  }
}

void expect_same_answers(const std::string& twin) {
  for (int kind = 0; kind < kScenes; ++kind) {
    const test::TempFolder folder;
    const CullingScene& scene = scene_of(kind);
    const std::string file = folder.path("groups.scarp"), questions = folder.path("questions");
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(scene.file.data()),
               static_cast<std::streamsize>(scene.file.size()));
    constexpr int kQuestions = 3000;
    write_questions(scene, questions, kQuestions);
    const auto here = output_of(SCARP_RUNTIME_ANSWERS " '" + file + "' '" + questions + "'");
    ASSERT_TRUE(here);
    EXPECT_EQ(std::count(here->begin(), here->end(), '\n'), kQuestions);
    EXPECT_EQ(here->find("DIFFERS"), std::string::npos);
    const auto there = output_of(twin + " '" + file + "' '" + questions + "'");
    ASSERT_TRUE(there) << twin;
    EXPECT_EQ(*here, *there) << "scene " << kind;
  }
}

TEST(Runtime, ContractionAndWiderInstructionsChangeNothing) {
  expect_same_answers(SCARP_RUNTIME_ANSWERS_FAST);
}

TEST(Runtime, JavaScriptAnswersWithTheSameBits) {
  if (!output_of("node --version 2>/dev/null")) GTEST_SKIP() << "left out, node is not installed";
  expect_same_answers("node " SCARP_SOURCE_DIR "/tests/runtime/answers.mjs");
}

TEST(Runtime, JavaScriptRefusesDamage) {
  if (!output_of("node --version 2>/dev/null")) GTEST_SKIP() << "left out, node is not installed";
  const test::TempFolder folder;
  ASSERT_TRUE(output_of(SCARP_RUNTIME_SEED " '" + folder.folder().string() + "'"));
  for (const char* name : {"0.scarp", "1.scarp", "2.scarp"})
    EXPECT_TRUE(output_of("node " SCARP_SOURCE_DIR "/tests/runtime/corruptions.mjs '" +
                          folder.path(name) + "' 2000 7"))
        << name;
}

}  // namespace
}  // namespace scarp
