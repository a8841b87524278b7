#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/fly/flight.h"
#include "cli/fly/flown_ground.h"
#include "core/culling/box_tree.h"
#include "core/culling/coarse_batches.h"
#include "core/culling/object_tiles.h"

namespace scarp {

/// Whether a method is among those that are wanted; all are where none are named.
bool is_wanted(const std::vector<std::string>& wanted, const std::string& method);

/// What methods are made from; some of them share it.
struct Prepared {
  GroupBatches batches;
  BoxTree tree;
  /// What queries ask for, where one of them flies: groups, large ones in tiles, and their levels.
  ObjectTiles tiles;
  std::optional<GroupBatches> tile_batches;
  std::optional<CoarseBatches> coarse;
  double tiles_s = 0, coarse_s = 0;  ///< to cut, and then to make the levels

  Prepared(const FlownGround& flown, const std::vector<std::string>& wanted);

  static std::vector<double> query_shares();
};

/// Every culling method that is wanted and that the ground has regions for, ready to fly. Both
/// arguments must outlive them. Throws Error{kInput} where a method that is named has no regions.
std::vector<Contender> contenders_of(const FlownGround& flown, const Prepared& prepared,
                                     const std::vector<std::string>& wanted);

}  // namespace scarp
