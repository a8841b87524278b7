#include "core/culling/cell_culling.h"

#include <algorithm>
#include <numeric>

#include "core/occlusion/certified/box_hiding.h"

namespace scarp {
namespace {

bool holds(const Bounds& box, const Position& p) {
  return p.x_m >= box.low.x_m && p.x_m <= box.high.x_m && p.y_m >= box.low.y_m &&
         p.y_m <= box.high.y_m && p.z_m >= box.low.z_m && p.z_m <= box.high.z_m;
}

Position middle_of(const Bounds& box) {
  return {(box.low.x_m + box.high.x_m) / 2, (box.low.y_m + box.high.y_m) / 2,
          (box.low.z_m + box.high.z_m) / 2};
}

}  // namespace

CellCulling::CellCulling(const CertifiedRegions& regions, const Bounds& space, double least_m)
    : regions_(regions), least_m_(least_m) {
  std::vector<GroupIndex> all(regions.groups.size());
  std::iota(all.begin(), all.end(), 0U);
  cells_.push_back(cell_of(space, all));
}

CellCulling::Cell CellCulling::cell_of(const Bounds& box,
                                       const std::vector<GroupIndex>& open) const {
  Cell cell{box, {}, {}, kNone};
  for (const GroupIndex g : open)
    (hides_group_from(regions_, g, box) ? cell.hidden : cell.open).push_back(g);
  return cell;
}

void CellCulling::divide(std::uint32_t index) {
  const auto first = static_cast<std::uint32_t>(cells_.size());
  const Bounds box = cells_[index].box;
  const std::vector<GroupIndex> open = std::move(cells_[index].open);
  cells_[index].open.clear();
  cells_[index].first_child = first;
  const Position middle = middle_of(box);
  for (unsigned i = 0; i < 8; ++i) {
    Bounds part = box;
    const auto halve = [&](unsigned bit, double Position::*c) {
      Position& moved = (i & bit) != 0 ? part.low : part.high;
      moved.*c = middle.*c;
    };
    halve(1, &Position::x_m);
    halve(2, &Position::y_m);
    halve(4, &Position::z_m);
    cells_.push_back(cell_of(part, open));
  }
}

CullingAnswer CellCulling::visible(const Camera& camera) {
  CullingAnswer answer;
  std::vector<std::uint8_t> is_hidden(regions_.groups.size(), 0);
  if (holds(cells_[0].box, camera.eye)) {
    std::uint32_t at = 0;
    for (;;) {
      for (const GroupIndex g : cells_[at].hidden) is_hidden[g] = 1;
      ++answer.nodes_tested;
      const Bounds box = cells_[at].box;
      if (cells_[at].first_child == kNone) {
        if (box.high.x_m - box.low.x_m <= 2 * least_m_) break;
        divide(at);
      }
      const Position middle = middle_of(box);
      at = cells_[at].first_child + (camera.eye.x_m >= middle.x_m ? 1 : 0) +
           (camera.eye.y_m >= middle.y_m ? 2 : 0) + (camera.eye.z_m >= middle.z_m ? 4 : 0);
    }
  }
  for (GroupIndex g = 0; g < is_hidden.size(); ++g)
    if (!is_hidden[g]) answer.visible_groups.push_back(g);
  return answer;
}

std::uint64_t CellCulling::bytes() const {
  std::uint64_t bytes = 0;
  for (const Cell& cell : cells_) bytes += sizeof(Cell) + cell.hidden.size() * sizeof(GroupIndex);
  return bytes;
}

}  // namespace scarp
