#include "cli/fly/contenders.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/scene_culling.h"
#include "cli/stopwatch.h"
#include "core/culling/cell_culling.h"
#include "core/culling/certified_hiding.h"
#include "core/culling/image_culling.h"
#include "core/culling/joint_hiding.h"
#include "core/culling/mask_culling.h"
#include "core/culling/occluder_hiding.h"
#include "core/culling/query_culling.h"
#include "core/culling/swept_culling.h"
#include "core/culling/visible_groups.h"
#include "core/error/error.h"
#include "core/occlusion/virtual_occluders.h"

namespace scarp {
namespace {

/// Everything in the picture: what a scene without culling draws.
class EverythingInView : public CullingMethod {
 public:
  explicit EverythingInView(std::uint32_t groups) {
    for (GroupIndex g = 0; g < groups; ++g) all_.visible_groups.push_back(g);
  }
  std::string_view name() const override { return "frustum"; }
  CullingAnswer visible(const Camera&) override { return all_; }
  bool set_present(std::span<const std::uint8_t> is_present) override {
    all_.visible_groups.clear();
    for (GroupIndex g = 0; g < is_present.size(); ++g)
      if (is_present[g]) all_.visible_groups.push_back(g);
    return true;
  }

 private:
  CullingAnswer all_;
};

constexpr float kSmallGapOpacity = 0.7F;

/// Of the triangles in view that hom draws as occluders.
constexpr double kEstimateShare = 0.25;

/// Cells of view, the smallest an eighth as wide as the mean group is.
std::vector<CellSpace> cells_of_view(const FlownGround& flown) {
  const Bounds ground = bounds_of(flown.tin.vertices);
  const double area_m2 = (ground.high.x_m - ground.low.x_m) * (ground.high.y_m - ground.low.y_m);
  return walk_and_flight(flown.tin, std::sqrt(area_m2 / std::max(1U, flown.groups.leaf_count)) / 8);
}

/// Virtual occluders, where a method that asks for them flies.
struct SectionsOfScene {
  std::vector<UprightOccluder> sections;
  double prepare_s = 0;

  SectionsOfScene(const Tin& tin, bool are_wanted) {
    if (!are_wanted) return;
    const ProcessorStopwatch watch;
    sections = find_virtual_occluders(tin, {}).sections;
    prepare_s = watch.seconds();
  }

  std::uint64_t bytes() const {
    std::uint64_t bytes = 0;
    for (const UprightOccluder& section : sections) bytes += section.bytes();
    return bytes;
  }
};

}  // namespace

bool is_wanted(const std::vector<std::string>& wanted, const std::string& method) {
  return wanted.empty() || std::find(wanted.begin(), wanted.end(), method) != wanted.end();
}

Prepared::Prepared(const FlownGround& flown, const std::vector<std::string>& wanted)
    : batches(flown.tin, flown.groups), tree(batches) {
  const bool with_coarse = is_wanted(wanted, "lod-query") || is_wanted(wanted, "multi-frame");
  const ProcessorStopwatch watch;
  if (with_coarse || is_wanted(wanted, "stop-and-wait")) {
    tiles = cut_into_tiles(flown.tin, flown.groups);
    tile_batches.emplace(flown.tin, tiles.tiles);
  }
  tiles_s = watch.seconds();
  if (with_coarse) coarse.emplace(*tile_batches, query_shares());
  coarse_s = watch.seconds();
}

std::vector<double> Prepared::query_shares() {
  return {std::begin(kQueryShares), std::end(kQueryShares)};
}

std::vector<Contender> contenders_of(const FlownGround& flown, const Prepared& prepared,
                                     const std::vector<std::string>& wanted) {
  const GroupBatches& batches = prepared.batches;
  std::vector<Contender> all;
  const auto add = [&](const std::string& label, bool is_conservative, double prepare_s,
                       std::uint64_t bytes, auto make) {
    if (is_wanted(wanted, label)) all.push_back({label, is_conservative, prepare_s, bytes, make()});
  };
  add("frustum", true, 0, 0,
      [&] { return std::make_unique<EverythingInView>(flown.groups.leaf_count); });
  for (const char* method : {"thesis", "certified"}) {
    const bool is_certified = std::string(method) == "certified";
    if (is_certified ? flown.groups.has_certified() : flown.has_horizons)
      add(method, is_certified, NAN, region_bytes(flown.groups, method),
          [&, is_certified]() -> std::unique_ptr<CullingMethod> {
            if (is_certified) return std::make_unique<CertifiedCulling>(flown.groups.certified);
            return std::make_unique<ThesisCulling>(flown.groups);
          });
  }
  if (flown.groups.has_certified() && is_wanted(wanted, "swept")) {
    auto swept = std::make_unique<SweptCulling>(flown.groups.certified, batches);
    const std::size_t bytes = region_bytes(flown.groups, "certified") + swept->bytes();
    add("swept", true, NAN, bytes, [&] { return std::move(swept); });
  }
  add("hzb", true, 0, 0, [&] { return std::make_unique<HzbCulling>(flown.tin, batches); });
  add("mask", false, 0, 0,
      [&] { return std::make_unique<MaskCulling>(flown.tin, batches, prepared.tree); });
  const SectionsOfScene sections(flown.tin,
                                 is_wanted(wanted, "cells") || is_wanted(wanted, "law-tan"));
  const auto by_occluders = [&] {
    return std::make_unique<OccluderHiding>(prepared.tree, batches, flown.tin, sections.sections);
  };
  const auto cells = [&](const char* label, std::unique_ptr<NodeHiding> hiding) {
    return std::make_unique<CellCulling>(label, std::move(hiding), cells_of_view(flown));
  };
  if (flown.groups.has_certified())
    add("cells", true, sections.prepare_s, sections.bytes(), [&] {
      auto by_regions = std::make_unique<CertifiedHiding>(prepared.tree, flown.groups.certified);
      return cells("cells", std::make_unique<JointHiding>(std::move(by_regions), by_occluders()));
    });
  add("law-tan", true, sections.prepare_s, sections.bytes(),
      [&] { return cells("law-tan", by_occluders()); });
  MaskOptions plain;
  plain.drawing = MaskDrawing::kByCentres;
  add("mask-plain", false, 0, 0,
      [&] { return std::make_unique<MaskCulling>(flown.tin, batches, prepared.tree, plain); });
  ImageCullingOptions hom;
  const auto add_hom = [&](const char* label, DepthTest depth) {
    add(label, false, 0, 0, [&] { return std::make_unique<HomCulling>(batches, depth, hom); });
  };
  hom.occluder_share = kEstimateShare;
  add_hom("hom", DepthTest::kEstimate);
  hom.occluder_share = 1;
  add_hom("hybrid", DepthTest::kPyramid);
  hom.opacity = kSmallGapOpacity;
  add_hom("hom-0.7", DepthTest::kPyramid);
  add("volume-scan", false, 0, 0, [&] { return std::make_unique<VolumeScanCulling>(batches); });
  const auto in_tiles = [&](std::unique_ptr<CullingMethod> method) {
    return std::make_unique<TiledCulling>(prepared.tiles, std::move(method));
  };
  if (prepared.coarse)
    for (const QueryUse use : {QueryUse::kSameFrame, QueryUse::kNextFrame})
      add(use == QueryUse::kSameFrame ? "lod-query" : "multi-frame", false, prepared.coarse_s,
          prepared.coarse->bytes(), [&] {
            return in_tiles(
                std::make_unique<QueryCulling>(*prepared.tile_batches, *prepared.coarse, use));
          });
  if (prepared.tile_batches)
    add("stop-and-wait", false, prepared.tiles_s, 0,
        [&] { return in_tiles(std::make_unique<StopAndWaitCulling>(*prepared.tile_batches)); });
  for (const std::string& name : wanted)
    if (std::none_of(all.begin(), all.end(), [&](const Contender& c) { return c.label == name; }))
      throw Error(ErrorCode::kInput,
                  fmt::format("--methods {}: the scene '{}' was built without it; build with "
                              "--horizon both, or leave it out",
                              name, flown.name));
  return all;
}

}  // namespace scarp
