#include "core/culling/view_cells.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <mutex>
#include <numeric>
#include <unordered_map>

#include "core/occlusion/certified/box_hiding.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Columns along the side of the squares that are worked on side by side.
constexpr std::int32_t kPieceColumns = 8;

/// A set before it has a number: what it adds to another of the same list.
struct Node {
  std::uint32_t parent;
  std::vector<GroupIndex> added;
};

/// A square of columns.
struct Square {
  std::int32_t column, row, side;
};

class Finder {
 public:
  Finder(const CertifiedRegions& regions, const ViewCells& cells, double keep)
      : regions_(regions), cells_(cells), keep_(keep) {}

  /// Highest top in a square, -infinity where no column of it has one.
  double top_m(const Square& square) const {
    double top = -HUGE_VAL;
    for (std::int32_t row = square.row; row < std::min(square.row + square.side, cells_.rows);
         ++row)
      for (std::int32_t column = square.column;
           column < std::min(square.column + square.side, cells_.columns); ++column) {
        const auto here =
            static_cast<double>(cells_.top_m[cells_.at(column, row, cells_.bands - 1)]);
        if (here > top) top = here;
      }
    return top;
  }

  /// Moves what is hidden from below a height over a square out of `open`.
  std::vector<GroupIndex> take_hidden(const Square& square, double top_m,
                                      std::vector<GroupIndex>& open) const {
    const double x_m = cells_.low_x_m + square.column * cells_.cell_m;
    const double y_m = cells_.low_y_m + square.row * cells_.cell_m;
    const double side_m = square.side * cells_.cell_m;
    // Outwards by more than the rounding of the corners.
    const double slack_m = (std::abs(x_m) + std::abs(y_m) + side_m) * 0x1p-50;
    const Bounds box{{x_m - slack_m, y_m - slack_m, top_m},
                     {x_m + side_m + slack_m, y_m + side_m + slack_m, top_m}};
    std::vector<GroupIndex> hidden, left;
    for (const GroupIndex group : open)
      (hides_group_from(regions_, group, box) ? hidden : left).push_back(group);
    open = std::move(left);
    return hidden;
  }

  /// What can be hidden from a square's cells, all their sets together, and how many cells these
  /// are.
  struct Tally {
    std::size_t members = 0, cells = 0;
  };

  /// Sets of a square's columns: nodes that hang below nodes[parent], whose set has `held` members.
  Tally divide(const Square& square, std::uint32_t parent, std::size_t held,
               std::vector<GroupIndex> open, std::vector<Node>& nodes,
               std::vector<std::uint32_t>& node_of_cell) const {
    if (square.column >= cells_.columns || square.row >= cells_.rows) return {};
    const double top = top_m(square);
    if (top == -HUGE_VAL) return {};
    const std::uint32_t node = add(square, parent, top, open, nodes);
    held += node == parent ? 0 : nodes[node].added.size();
    if (square.side == 1)
      return fill_column(square, node, held, std::move(open), nodes, node_of_cell);
    const std::size_t before = nodes.size();
    const std::int32_t half = square.side / 2;
    Tally tally;
    for (const std::int32_t down : {0, half})
      for (const std::int32_t right : {0, half}) {
        const Tally part = divide({square.column + right, square.row + down, half}, node, held,
                                  open, nodes, node_of_cell);
        tally.members += part.members, tally.cells += part.cells;
      }
    if (!stands_for(held, tally)) return tally;
    nodes.resize(before);
    for_each_cell(square, [&](std::size_t cell) { node_of_cell[cell] = node; });
    return tally;
  }

  /// Calls visit(cell) for each cell of a square that has a top.
  template <class Visit>
  void for_each_cell(const Square& square, Visit visit) const {
    for (std::int32_t row = square.row; row < std::min(square.row + square.side, cells_.rows);
         ++row)
      for (std::int32_t column = square.column;
           column < std::min(square.column + square.side, cells_.columns); ++column)
        for (std::int32_t band = 0; band < cells_.bands; ++band) {
          const std::size_t cell = cells_.at(column, row, band);
          if (!std::isnan(cells_.top_m[cell])) visit(cell);
        }
  }

 private:
  bool stands_for(std::size_t held, const Tally& tally) const {
    return static_cast<double>(held) * static_cast<double>(tally.cells) >=
           keep_ * static_cast<double>(tally.members);
  }

  /// A node for what is hidden from below a height over a square, or the one above where that adds
  /// nothing.
  std::uint32_t add(const Square& square, std::uint32_t parent, double top_m,
                    std::vector<GroupIndex>& open, std::vector<Node>& nodes) const {
    std::vector<GroupIndex> hidden = take_hidden(square, top_m, open);
    if (hidden.empty()) return parent;
    nodes.push_back({parent, std::move(hidden)});
    return static_cast<std::uint32_t>(nodes.size() - 1);
  }

  /// The bands of one column, from the highest, which `node` is, to the lowest.
  Tally fill_column(const Square& square, std::uint32_t node, std::size_t held,
                    std::vector<GroupIndex> open, std::vector<Node>& nodes,
                    std::vector<std::uint32_t>& node_of_cell) const {
    Tally tally;
    for (std::int32_t band = cells_.bands - 1; band >= 0; --band) {
      const std::size_t cell = cells_.at(square.column, square.row, band);
      std::vector<GroupIndex> open_below = open;
      const std::uint32_t lower =
          add(square, node, static_cast<double>(cells_.top_m[cell]), open_below, nodes);
      const std::size_t below = held + (lower == node ? 0 : nodes[lower].added.size());
      if (lower != node && stands_for(held, {below, 1})) {
        nodes.pop_back();
      } else {
        node = lower, held = below, open = std::move(open_below);
      }
      node_of_cell[cell] = node;
      tally.members += below, ++tally.cells;
    }
    return tally;
  }

  const CertifiedRegions& regions_;
  const ViewCells& cells_;
  double keep_;
};

/// Numbers sets so that equal ones have one number.
class Numbering {
 public:
  explicit Numbering(HiddenSets& sets) : sets_(sets) {
    sets_.parent = {0};
    sets_.first = {0, 0};
    sets_.added.clear();
    sums_ = {0};
    known_[0] = {0};
  }

  std::uint32_t number(std::uint32_t parent, const std::vector<GroupIndex>& added) {
    // A sum over the members does not depend on how they are shared out.
    std::uint64_t sum = sums_[parent];
    for (const GroupIndex group : added) sum += mixed(group);
    std::vector<GroupIndex> all = groups_of(sets_, parent);
    all.insert(all.end(), added.begin(), added.end());
    std::sort(all.begin(), all.end());
    for (const std::uint32_t set : known_[sum])
      if (groups_of(sets_, set) == all) return set;
    const auto set = static_cast<std::uint32_t>(sets_.size());
    sets_.parent.push_back(parent);
    sets_.added.insert(sets_.added.end(), added.begin(), added.end());
    sets_.first.push_back(static_cast<std::uint32_t>(sets_.added.size()));
    sums_.push_back(sum);
    known_[sum].push_back(set);
    return set;
  }

 private:
  static std::uint64_t mixed(std::uint64_t value) {
    value = (value + 0x9e3779b97f4a7c15U) * 0xbf58476d1ce4e5b9U;
    value = (value ^ (value >> 31)) * 0x94d049bb133111ebU;
    return value ^ (value >> 29);
  }

  HiddenSets& sets_;
  std::vector<std::uint64_t> sums_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> known_;
};

/// A piece of the columns, worked on by itself.
struct Piece {
  Square square;
  std::uint32_t parent;  // among the nodes above all pieces
  std::size_t held;      // members of its set
  std::vector<GroupIndex> open;
  std::vector<Node> nodes;
};

}  // namespace

std::vector<GroupIndex> groups_of(const HiddenSets& sets, std::uint32_t set) {
  std::vector<GroupIndex> groups;
  for (;; set = sets.parent[set]) {
    groups.insert(groups.end(), sets.added.begin() + sets.first[set],
                  sets.added.begin() + sets.first[set + 1]);
    if (set == 0) break;
  }
  std::sort(groups.begin(), groups.end());
  return groups;
}

void find_hidden_sets(const CertifiedRegions& regions, double keep, ViewCells& cells,
                      const Progress& progress) {
  assert(cells.top_m.size() == cells.at(0, cells.rows, 0) && cells.bands > 0);
  const Finder finder(regions, cells, keep);
  std::vector<GroupIndex> all(regions.groups.size());
  std::iota(all.begin(), all.end(), 0U);
  std::int32_t side = kPieceColumns;
  while (side < std::max(cells.columns, cells.rows)) side *= 2;

  // The squares above the pieces, from the largest down.
  std::vector<Node> above = {{0, {}}};
  std::vector<Piece> pieces = {{{0, 0, side}, 0, 0, std::move(all), {}}};
  for (; side > kPieceColumns; side /= 2) {
    std::vector<Piece> quarters;
    for (Piece& piece : pieces) {
      const double top = finder.top_m(piece.square);
      if (top == -HUGE_VAL) continue;
      std::vector<GroupIndex> hidden = finder.take_hidden(piece.square, top, piece.open);
      if (!hidden.empty()) {
        piece.held += hidden.size();
        above.push_back({piece.parent, std::move(hidden)});
        piece.parent = static_cast<std::uint32_t>(above.size() - 1);
      }
      for (const std::int32_t down : {0, side / 2})
        for (const std::int32_t right : {0, side / 2}) {
          const Square quarter{piece.square.column + right, piece.square.row + down, side / 2};
          if (quarter.column < cells.columns && quarter.row < cells.rows)
            quarters.push_back({quarter, piece.parent, piece.held, piece.open, {}});
        }
    }
    pieces = std::move(quarters);
  }

  std::vector<std::uint32_t> node_of_cell(cells.top_m.size(), 0);
  std::mutex telling;
  std::size_t done = 0;
  parallel_for(pieces.size(), [&](std::size_t i) {
    Piece& piece = pieces[i];
    piece.nodes = {{0, {}}};  // stands for the parent
    finder.divide(piece.square, 0, piece.held, std::move(piece.open), piece.nodes, node_of_cell);
    if (!progress) return;
    const std::lock_guard lock(telling);
    progress(static_cast<double>(++done) / static_cast<double>(pieces.size()));
  });

  Numbering numbering(cells.sets);
  std::vector<std::uint32_t> number_above = {0};
  for (std::size_t n = 1; n < above.size(); ++n)
    number_above.push_back(numbering.number(number_above[above[n].parent], above[n].added));
  cells.set.assign(cells.top_m.size(), 0);
  for (const Piece& piece : pieces) {
    std::vector<std::uint32_t> number = {number_above[piece.parent]};
    for (std::size_t n = 1; n < piece.nodes.size(); ++n)
      number.push_back(numbering.number(number[piece.nodes[n].parent], piece.nodes[n].added));
    finder.for_each_cell(piece.square,
                         [&](std::size_t cell) { cells.set[cell] = number[node_of_cell[cell]]; });
  }
}

}  // namespace scarp
