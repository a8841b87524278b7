#pragma once

#include <span>
#include <vector>

#include "core/culling/coarse_batches.h"
#include "core/culling/culling_method.h"
#include "core/raster/rasterise.h"

namespace scarp {

struct QueryOptions {
  int width_px = 320;              ///< of the pictures that are asked
  std::uint32_t threshold_px = 1;  ///< objects with fewer visible pixels there are left out
  double near_sizes = 1;  ///< nearer than so many diagonals of its box, a group is drawn whole
  double far_sizes = 4;   ///< farther than so many, at the coarser level
};

/// What becomes of the answers of a picture.
enum class QueryUse {
  kSameFrame,  ///< coarse levels to depth, coarse levels counted, then what was seen: lod-query
  kNextFrame,  ///< the same, but the counts of the frame before are used: multi-frame
};

/// Methods lod-query and multi-frame: the groups in view are drawn at coarse levels, the pixels
/// that each shows are counted, and what shows fewer than the threshold is left out. Grundhöfer et
/// al. 2006. multi-frame saves the wait for the counts: it takes those of the last frame, and draws
/// what was not in view then.
///
/// Side: none: coarse levels gape and bulge, and small pictures miss what is thin.
/// Requires Camera::shot. Keeps references; one thread at a time.
class QueryCulling : public CullingMethod {
 public:
  QueryCulling(const GroupBatches& batches, const CoarseBatches& coarse, QueryUse use,
               const QueryOptions& options = {});

  std::string_view name() const override {
    return use_ == QueryUse::kSameFrame ? "lod-query" : "multi-frame";
  }
  CullingAnswer visible(const Camera& camera) override;

 private:
  void count_pixels(const Camera& camera, std::span<const GroupIndex> groups);

  const GroupBatches& batches_;
  const CoarseBatches& coarse_;
  const QueryUse use_;
  const QueryOptions options_;
  GroupBatches::Drawing drawing_;
  std::vector<std::uint32_t> pixels_;   // [groups] that each shows
  std::vector<std::uint8_t> is_known_;  // [groups] of the last picture
};

/// Method stop-and-wait: boxes are asked one after the other, nearest first, against what has been
/// drawn; a group whose box shows is drawn at its finest level before the next is asked. The
/// baseline of Grundhöfer et al. 2006.
///
/// Side: none, but only through gaps between the centres of pixels.
/// Requires Camera::shot. Keeps references; one thread at a time.
class StopAndWaitCulling : public CullingMethod {
 public:
  StopAndWaitCulling(const GroupBatches& batches, const QueryOptions& options = {});

  std::string_view name() const override { return "stop-and-wait"; }
  CullingAnswer visible(const Camera& camera) override;

 private:
  const GroupBatches& batches_;
  const QueryOptions options_;
};

}  // namespace scarp
