#include "ingest/footprints/block.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "ingest/footprints/footprints.h"

namespace scarp {
namespace {

using Geometry = GeosSession::Geometry;

constexpr double kGround = -std::numeric_limits<double>::infinity();
constexpr std::uint32_t kOutside = 0;  // the face around everything

/// A piece of the plane between lines, and the level on it.
struct Face {
  PlanePolygon rings;
  double level_m = kGround;
  double area_m2 = 0;
};

/// A segment of a face's border, least end first.
struct Side {
  PlanePoint low, high;
  std::uint32_t face;

  bool same_segment(const Side& other) const { return low == other.low && high == other.high; }
};

/// Two faces with a segment between them.
struct Contact {
  std::uint32_t one, other;
  double length_m;
};

class Parents {
 public:
  explicit Parents(std::size_t count) : parents_(count) {
    std::iota(parents_.begin(), parents_.end(), 0U);
  }
  std::uint32_t root(std::uint32_t i) {
    while (parents_[i] != i) i = parents_[i] = parents_[parents_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a), b = root(b);
    parents_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parents_;
};

/// Faces of one level that hang together.
struct Piece {
  Geometry shape;
  PlaneBox box;
  double level_m;
};

class BlockBuilder {
 public:
  BlockBuilder(const GeosSession& geos, std::span<const Standing* const> standing, double run_m)
      : geos_(geos), standing_(standing), run_m_(run_m) {}

  Block run() {
    cut_faces();
    find_contacts();
    while (give_slivers_away()) {
    }
    gather_pieces();
    lay_roofs();
    draw();
    return std::move(block_);
  }

 private:
  /// All outlines noded with each other, and the level of what lies between.
  void cut_faces() {
    std::vector<Geometry> outlines;
    for (const Standing* s : standing_) outlines.push_back(geos_.boundary(s->outline));
    const Geometry lines =
        geos_.node_until_still(geos_.collection(std::move(outlines)), corner_grid_m());
    faces_.resize(1);
    for (PlanePolygon& rings : geos_.polygons(geos_.polygonize(lines))) {
      Face face{std::move(rings)};
      const Geometry shape = geos_.polygon(face.rings);
      face.area_m2 = geos_.area_m2(shape);
      const PlanePoint inside = geos_.point_inside(shape);
      const PlaneBox at{inside.x_m, inside.y_m, inside.x_m, inside.y_m};
      for (const Standing* s : standing_) {
        if (s->level_m > face.level_m && s->box.meets(at, 0) && geos_.contains(s->outline, inside))
          face.level_m = s->level_m;
      }
      faces_.push_back(std::move(face));
    }
  }

  void find_contacts() {
    std::vector<Side> sides;
    for (std::uint32_t f = 1; f < faces_.size(); ++f) {
      for (const PlaneRing& ring : faces_[f].rings) {
        for (std::size_t i = 0; i + 1 < ring.size(); ++i)
          sides.push_back({std::min(ring[i], ring[i + 1]), std::max(ring[i], ring[i + 1]), f});
      }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
      if (a.low != b.low) return a.low < b.low;
      if (a.high != b.high) return a.high < b.high;
      return a.face < b.face;
    });
    for (std::size_t i = 0; i < sides.size(); ++i) {
      const Side& s = sides[i];
      const double length_m = std::hypot(s.high.x_m - s.low.x_m, s.high.y_m - s.low.y_m);
      const bool shared = i + 1 < sides.size() && s.same_segment(sides[i + 1]);
      contacts_.push_back({s.face, shared ? sides[i + 1].face : kOutside, length_m});
      if (shared) ++i;
    }
  }

  Parents connected() const {
    Parents parents(faces_.size());
    for (const Contact& c : contacts_)
      if (faces_[c.one].level_m == faces_[c.other].level_m) parents.join(c.one, c.other);
    return parents;
  }

  Geometry shape_of(const std::vector<std::uint32_t>& faces) const {
    std::vector<Geometry> shapes;
    for (const std::uint32_t f : faces) shapes.push_back(geos_.polygon(faces_[f].rings));
    return geos_.coverage_union(geos_.collection(std::move(shapes)), corner_grid_m());
  }

  /// Faces by the root of what they hang together with.
  std::vector<std::vector<std::uint32_t>> members(Parents& parents) const {
    std::vector<std::vector<std::uint32_t>> found(faces_.size());
    for (std::uint32_t f = 0; f < faces_.size(); ++f) found[parents.root(f)].push_back(f);
    return found;
  }

  /// Whether a piece has too little area, or, as a building, no room for a roof between its walls.
  bool is_sliver(const std::vector<std::uint32_t>& faces) const {
    double area_m2 = 0;
    for (const std::uint32_t f : faces) area_m2 += faces_[f].area_m2;
    if (area_m2 < kSliverAreaM2) return true;
    return faces_[faces[0]].level_m != kGround &&
           geos_.is_empty(geos_.offset(shape_of(faces), -least_half_width_m()));
  }

  /// Each sliver takes the level of the neighbour that it shares the longest border with. Fewer
  /// pieces are left after each round, until nothing changes.
  bool give_slivers_away() {
    Parents parents = connected();
    const auto pieces = members(parents);
    std::vector<std::uint8_t> settled(faces_.size(), 0);
    bool changed = false;
    for (std::uint32_t root = 1; root < faces_.size(); ++root) {
      if (parents.root(root) != root || !is_sliver(pieces[root])) continue;
      std::vector<std::pair<std::uint32_t, double>> shared;
      for (const Contact& c : contacts_) {
        const std::uint32_t a = parents.root(c.one), b = parents.root(c.other);
        if (a == b || (a != root && b != root)) continue;
        shared.emplace_back(a == root ? b : a, c.length_m);
      }
      std::sort(shared.begin(), shared.end());
      std::uint32_t winner = kOutside;
      double longest_m = -1;
      for (std::size_t i = 0; i < shared.size();) {
        double length_m = 0;
        const std::uint32_t neighbour = shared[i].first;
        for (; i < shared.size() && shared[i].first == neighbour; ++i) length_m += shared[i].second;
        if (length_m > longest_m) {
          longest_m = length_m;
          winner = neighbour;
        }
      }
      // A neighbour that has just changed its own level is asked again in the next round.
      if (settled[winner]) continue;
      settled[root] = 1;
      settled[winner] = 1;
      for (const std::uint32_t f : pieces[root]) faces_[f].level_m = faces_[winner].level_m;
      ++block_.slivers;
      changed = true;
    }
    return changed;
  }

  void gather_pieces() {
    Parents parents = connected();
    const auto groups = members(parents);
    for (std::uint32_t root = 1; root < faces_.size(); ++root) {
      if (groups[root].empty() || faces_[root].level_m == kGround) continue;
      Piece piece{shape_of(groups[root]), {}, faces_[root].level_m};
      piece.box = geos_.box(piece.shape);
      pieces_.push_back(std::move(piece));
    }
    block_.buildings = static_cast<std::uint32_t>(pieces_.size());
  }

  /// A roof ends a run inside the outline of all that is at least as high: walls stand inside the
  /// higher building, so that the foot of a wall between two roofs lies on the lower roof's edge.
  void lay_roofs() {
    for (const Piece& piece : pieces_) {
      std::vector<Geometry> as_high;
      for (const Piece& other : pieces_) {
        if (other.level_m >= piece.level_m && other.box.meets(piece.box, 4 * run_m_))
          as_high.push_back(geos_.clone(other.shape));
      }
      const Geometry solid =
          geos_.coverage_union(geos_.collection(std::move(as_high)), corner_grid_m());
      // Shrunk by more and grown again, so that necks between roofs have some width.
      const Geometry inside =
          geos_.offset(geos_.offset(solid, -least_half_width_m()), least_half_width_m() - run_m_);
      Geometry shape = geos_.intersection(inside, piece.shape, run_m_ * kBlockGridRuns);
      std::vector<Geometry> parts;
      for (const PlanePolygon& rings : geos_.polygons(shape)) {
        Geometry part = geos_.polygon(rings);
        if (geos_.area_m2(part) >= run_m_ * run_m_) parts.push_back(std::move(part));
      }
      if (!parts.empty())
        roofs_.push_back({geos_.collection(std::move(parts)), piece.box, piece.level_m});
    }
  }

  /// All lines noded once more, now with the roofs' edges, and taken apart into corners and edges.
  void draw() {
    if (pieces_.empty()) return;
    const double grid_m = run_m_ * kBlockGridRuns;
    std::vector<Geometry> outlines, edges, shapes;
    for (const Piece& piece : pieces_) {
      outlines.push_back(geos_.boundary(piece.shape));
      shapes.push_back(geos_.clone(piece.shape));
    }
    for (Piece& roof : roofs_) {
      std::vector<Geometry> rings;
      for (const PlanePolygon& polygon : geos_.polygons(roof.shape))
        rings.push_back(geos_.boundary(geos_.polygon(polygon)));
      roof.shape = geos_.collection(std::move(rings));  // from here on its edge
      outlines.push_back(geos_.clone(roof.shape));
    }
    const auto paths =
        geos_.lines(geos_.node_until_still(geos_.collection(std::move(outlines)), grid_m));
    for (const PlaneRing& path : paths)
      block_.points.insert(block_.points.end(), path.begin(), path.end());
    std::sort(block_.points.begin(), block_.points.end());
    block_.points.erase(std::unique(block_.points.begin(), block_.points.end()),
                        block_.points.end());
    const auto number = [&](const PlanePoint& p) {
      return static_cast<std::uint32_t>(
          std::lower_bound(block_.points.begin(), block_.points.end(), p) - block_.points.begin());
    };
    for (const PlaneRing& path : paths) {
      for (std::size_t i = 0; i + 1 < path.size(); ++i)
        block_.edges.push_back({number(path[i]), number(path[i + 1])});
    }
    for (const PlanePoint& p : block_.points) block_.levels_m.push_back(level_at_m(p));
    block_.covered = geos_.polygons(geos_.offset(
        geos_.coverage_union(geos_.collection(std::move(shapes)), corner_grid_m()), run_m_));
  }

  /// The level of the roof whose edge a corner lies on, the lowest on ties, or NaN.
  double level_at_m(const PlanePoint& p) const {
    const double reach_m = 2 * run_m_ * kBlockGridRuns;  // what the last rounding moves, and more
    const PlaneBox at{p.x_m, p.y_m, p.x_m, p.y_m};
    double level_m = std::numeric_limits<double>::quiet_NaN();
    for (const Piece& roof : roofs_) {
      if (roof.level_m >= level_m || !roof.box.meets(at, reach_m)) continue;
      if (geos_.distance_m(roof.shape, p) <= reach_m) level_m = roof.level_m;
    }
    return level_m;
  }

  double corner_grid_m() const { return run_m_ * kCornerGridRuns; }

  /// Half of what a building must be wide to have a roof: its wall and an eighth of it.
  double least_half_width_m() const { return run_m_ * 1.125; }

  const GeosSession& geos_;
  std::span<const Standing* const> standing_;
  const double run_m_;
  std::vector<Face> faces_;  // faces_[kOutside] has no rings
  std::vector<Contact> contacts_;
  std::vector<Piece> pieces_, roofs_;
  Block block_;
};

}  // namespace

Block build_block(const GeosSession& geos, std::span<const Standing* const> standing,
                  double run_m) {
  return BlockBuilder(geos, standing, run_m).run();
}

}  // namespace scarp
