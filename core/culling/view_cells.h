#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/occlusion/certified/certified_regions.h"
#include "core/occlusion/groups.h"
#include "core/threads/progress.h"

namespace scarp {

/// Sets of groups, each kept as another set and what it adds. Set 0 is empty. All are different.
/// Source: Law and Tan 1999, the hierarchy of hidden sets.
struct HiddenSets {
  std::vector<std::uint32_t> parent;  ///< a set with a smaller number; 0 of set 0
  std::vector<std::uint32_t> first;   ///< [sets + 1] into added
  std::vector<GroupIndex> added;      ///< by rising number in each set

  std::size_t size() const { return parent.size(); }
};

/// All groups of a set, by rising number. Cost: O(groups log groups).
std::vector<GroupIndex> groups_of(const HiddenSets& sets, std::uint32_t set);

/// Cells of the airspace: columns over squares of the plane, cut into bands. Band b of a column
/// reaches from any depth up to top_m: what is hidden from a place is hidden from all below it. The
/// band of a camera is the lowest whose top is above it.
struct ViewCells {
  double low_x_m = 0, low_y_m = 0, cell_m = 1;
  std::int32_t columns = 0, rows = 0, bands = 0;
  std::vector<float> top_m;  ///< [rows * columns * bands], by rising band; NaN: a column without
  std::vector<std::uint32_t> set;  ///< [rows * columns * bands], into sets
  HiddenSets sets;

  std::size_t at(std::int32_t column, std::int32_t row, std::int32_t band) const {
    return (static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
            static_cast<std::size_t>(column)) *
               static_cast<std::size_t>(bands) +
           static_cast<std::size_t>(band);
  }
};

/// Fills cells.set and cells.sets with the groups that are hidden from all of each cell.
///
/// Method: a quadtree over the columns; groups hidden from all of a square are not looked at in its
/// quarters, those hidden from a band not in the bands below. Where a square's own set, or that of
/// the band above, has nearly all that its cells have, it stands for theirs.
/// @param keep  share of the members of cells' sets that must be left for that, in [0, 1]; 1 leaves
///              nothing out
/// Side: as hides_group_from: what is in a set is hidden from everywhere in its cell.
/// Requires proper places and tops. The same bits for any number of threads.
/// Cost: one test for each cell and group that is not hidden from a larger one.
void find_hidden_sets(const CertifiedRegions& regions, double keep, ViewCells& cells,
                      const Progress& progress = {});

}  // namespace scarp
