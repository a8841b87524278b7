#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cli/scene_tiles.h"
#include "core/sight/tin_index.h"
#include "core/terrain/tin.h"

namespace scarp {

/// Lines of sight that a scene is to be asked about.
struct AskedLines {
  std::vector<std::size_t> tiles;  ///< all that have ground under a line
  std::vector<ViewPlan> ends;      ///< discs in which all of the lines' ends lie
};

/// Tiles of a scene as one surface that answers about lines as the whole scene does.
///
/// What a line meets is in the tiles under it. But an end over void is unknown where ground
/// encloses that void and sees freely where it is open to the outside, and void that the edge of
/// the tiles cuts tells neither. So all tiles are read where an end may lie over such void.
class PartGround {
 public:
  /// Throws Error{kResource} where the tiles take more than memory_bytes; 0: anything.
  /// @param tiles   where the tiles are read
  /// @param remedy  for the message
  PartGround(SceneTiles& tiles, const AskedLines& lines, std::uint64_t memory_bytes,
             const std::string& remedy);
  PartGround(const PartGround&) = delete;  // the index keeps a reference to the surface
  PartGround& operator=(const PartGround&) = delete;

  /// The tiles that the surface is made of, by rising number; its triangles are theirs, in this
  /// order.
  const std::vector<std::size_t>& used() const { return used_; }
  const Tin& tin() const { return tin_; }
  const TinIndex& index() const { return *index_; }

 private:
  std::vector<std::size_t> used_;
  Tin tin_;
  std::optional<TinIndex> index_;
};

}  // namespace scarp
