#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "core/culling/culling_method.h"
#include "core/terrain/tin.h"

namespace scarp {

/// Groups as objects that are asked for one by one, the large ones cut into tiles.
struct ObjectTiles {
  Groups tiles;                           ///< a leaf a tile; no tree, no regions
  std::vector<GroupIndex> group_of_tile;  ///< [tiles] ascending
};

struct ObjectTileOptions {
  double most_share = 0.1;                 ///< of the scene's width and depth that a tile may have
  std::uint32_t most_triangles = 600'000;  ///< about twice as many as vertices
};

/// Cuts the box of a group that is too wide, or has too many triangles, into equal cells of the
/// plane, once; triangles belong to the cell that their middle is in, so that a tile reaches beyond
/// its cell by a triangle at most. Heights are not cut: a height field has no more than one layer.
/// Orphans stay so. Cost: O(n). Source: Grundhöfer et al. 2006, 4.2.
ObjectTiles cut_into_tiles(const Tin& tin, const Groups& groups,
                           const ObjectTileOptions& options = {});

/// A method that was made for tiles, asked for their groups: one is visible where a tile of it is.
/// Side: the method's.
class TiledCulling : public CullingMethod {
 public:
  /// @param tiles  kept as a reference
  TiledCulling(const ObjectTiles& tiles, std::unique_ptr<CullingMethod> method)
      : tiles_(tiles), method_(std::move(method)) {}

  std::string_view name() const override { return method_->name(); }
  CullingAnswer visible(const Camera& camera) override;
  bool may_show(const Bounds& box) override { return method_->may_show(box); }
  bool set_present(std::span<const std::uint8_t> is_present) override;

 private:
  const ObjectTiles& tiles_;
  std::unique_ptr<CullingMethod> method_;
};

}  // namespace scarp
