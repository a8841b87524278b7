#include "core/culling/cell_culling.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Eyes of walkers and drivers.
constexpr double kWalkingAirM = 10;

bool holds(const Bounds& box, const Position& p) {
  return p.x_m >= box.low.x_m && p.x_m <= box.high.x_m && p.y_m >= box.low.y_m &&
         p.y_m <= box.high.y_m && p.z_m >= box.low.z_m && p.z_m <= box.high.z_m;
}

Position middle_of(const Bounds& box) {
  return round_to_lattice(Position{(box.low.x_m + box.high.x_m) / 2,
                                   (box.low.y_m + box.high.y_m) / 2,
                                   (box.low.z_m + box.high.z_m) / 2});
}

}  // namespace

CellTree::CellTree(const NodeHiding& hiding, const CellSpace& space)
    : hiding_(hiding), space_(space) {
  Cell root{space.box, {}, kNone, kNone};
  root.hidden = hiding.find_hidden(root.box, {});
  cells_.push_back(std::move(root));
}

bool CellTree::is_smallest(std::uint32_t cell) const {
  const Bounds& box = cells_[cell].box;
  return box.high.x_m - box.low.x_m < 2 * space_.least_m;
}

Bounds CellTree::part_of(const Bounds& box, unsigned child) const {
  const Position middle = middle_of(box);
  Bounds part = box;
  const auto halve = [&](unsigned bit, double Position::*c) {
    Position& moved = (child & bit) != 0 ? part.low : part.high;
    moved.*c = middle.*c;
  };
  halve(1, &Position::x_m);
  halve(2, &Position::y_m);
  if (!space_.ground) {
    halve(4, &Position::z_m);
    return part;
  }
  // Heights only choose the cell: an eye is in it where its box holds it.
  if (const auto heights_m = space_.ground->over(part)) {
    part.low.z_m = std::max(part.low.z_m, round_to_lattice((*heights_m)[0] - kLatticeStepM));
    part.high.z_m =
        std::min(part.high.z_m, round_to_lattice((*heights_m)[1] + space_.air_m + kLatticeStepM));
  }
  return part;
}

void CellTree::divide(std::uint32_t index) {
  const auto first = static_cast<std::uint32_t>(cells_.size());
  std::vector<NodeIndex> known;
  collect(index, known);
  for (unsigned i = 0; i < children(); ++i)
    cells_.push_back({part_of(cells_[index].box, i), {}, index, kNone});
  parallel_for(children(), [&](std::size_t i) {
    cells_[first + i].hidden = hiding_.find_hidden(cells_[first + i].box, known);
  });
  cells_[index].first_child = first;
}

void CellTree::collect(std::uint32_t cell, std::vector<NodeIndex>& hidden) const {
  hidden.clear();
  for (std::uint32_t at = cell; at != kNone; at = cells_[at].parent)
    hidden.insert(hidden.end(), cells_[at].hidden.begin(), cells_[at].hidden.end());
  std::sort(hidden.begin(), hidden.end());
  // A cell may hide a whole node of which a cell above hid a part.
  keep_highest(hiding_.tree(), hidden);
}

std::uint32_t CellTree::hidden_from(const Position& eye, std::vector<NodeIndex>& hidden) {
  hidden.clear();
  if (!holds(cells_[0].box, eye)) return kNone;
  std::uint32_t at = 0;
  for (bool goes_on = true; goes_on && !is_smallest(at);) {
    if (cells_[at].first_child == kNone) divide(at);
    const std::uint32_t first = cells_[at].first_child;
    goes_on = false;
    for (std::uint32_t child = first; child < first + children() && !goes_on; ++child)
      if (holds(cells_[child].box, eye)) {
        at = child;
        goes_on = true;
      }
  }
  collect(at, hidden);
  return at;
}

void CellTree::divide_all() {
  for (std::uint32_t cell = 0; cell < cells_.size(); ++cell)
    if (!is_smallest(cell) && cells_[cell].first_child == kNone) divide(cell);
}

std::uint64_t CellTree::bytes() const {
  std::uint64_t bytes = 0;
  for (const Cell& cell : cells_) bytes += sizeof(Cell) + cell.hidden.size() * sizeof(NodeIndex);
  return bytes;
}

CellCulling::CellCulling(std::string name, std::unique_ptr<NodeHiding> hiding,
                         const std::vector<CellSpace>& spaces)
    : name_(std::move(name)), hiding_(std::move(hiding)) {
  for (const CellSpace& space : spaces) trees_.emplace_back(*hiding_, space);
  if (!hiding_->tree().nodes().empty()) active_.push_back({0, false});
}

CullingAnswer CellCulling::visible(const Camera& camera) {
  hidden_.clear();
  for (CellTree& tree : trees_) {
    const std::uint32_t cell = tree.hidden_from(camera.eye, hidden_);
    // Where a cell over the ground does not reach up to the eye, those of the air may know more.
    if (cell != kNone && tree.is_smallest(cell)) break;
  }
  answer_.nodes_tested = 0;
  if (!answer_.visible_groups.empty() && hidden_ == hidden_before_) return answer_;
  hidden_before_ = hidden_;
  answer_.nodes_tested = walk_jointly(hiding_->tree(), hidden_, active_);
  answer_.visible_groups.clear();
  for (const ActiveNode& active : active_)
    if (!active.is_hidden)
      answer_.visible_groups.push_back(
          hiding_->tree().groups_of(hiding_->tree().nodes()[active.node]).front());
  std::sort(answer_.visible_groups.begin(), answer_.visible_groups.end());
  return answer_;
}

std::uint64_t CellCulling::bytes() const {
  std::uint64_t bytes = 0;
  for (const CellTree& tree : trees_) bytes += tree.bytes();
  return bytes;
}

std::vector<CellSpace> walk_and_flight(const Tin& ground, double least_m) {
  const Bounds bounds = bounds_of(ground.vertices);
  Bounds walk = bounds, flight = bounds;
  walk.high.z_m += kWalkingAirM;
  flight.high.z_m += std::max(1.0, std::ceil(bounds.high.z_m - bounds.low.z_m));
  return {{walk, least_m, std::make_shared<GroundHeights>(ground), kWalkingAirM},
          {flight, least_m}};
}

}  // namespace scarp
