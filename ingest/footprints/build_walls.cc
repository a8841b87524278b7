#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/error/error.h"
#include "core/threads/parallel_for.h"
#include "ingest/footprints/block.h"
#include "ingest/footprints/footprints.h"
#include "ingest/footprints/ground_profile.h"
#include "ingest/footprints/plane_graph.h"

namespace scarp {
namespace {

/// Ticks that a wall's run is divided into, at least: a quarter of a millimetre.
constexpr double kTicksPerRun = 256;

/// Least distance between a corner and an edge that it is no end of, as a part of a wall's run: two
/// steps of the lattice, so that rounding cannot take it to the other side.
constexpr double kClearanceRuns = kBlockGridRuns / 8;

/// A footprint in the plane, cut to the ground.
struct Placed {
  std::vector<PlanePolygon> parts;
  PlaneBox box;
  double level_m = 0;
  bool raised = false;  // to the highest ground at its outline
};

/// A block with places, heights and everything that walls need.
struct RaisedBlock {
  std::vector<WallVertex> vertices;
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<PlanePolygon> covered;
  std::uint32_t buildings = 0, slivers = 0, dropped = 0;
};

class WallBuilder {
 public:
  WallBuilder(const Dem& dem, const SampleGrid& grid, double foot_error_m)
      : dem_(dem),
        grid_(grid),
        ground_(dem, grid),
        foot_error_m_(foot_error_m),
        run_m_(std::min(kWallRunM, kWallRunCells * std::min(grid.cell_x_m, grid.cell_y_m))),
        tick_cells_(std::exp2(std::floor(
            std::log2(run_m_ / kTicksPerRun / std::max(grid.cell_x_m, grid.cell_y_m))))) {}

  WallsAndRoofs run(const std::vector<Footprint>& footprints, std::vector<std::string>& warnings) {
    std::vector<Placed> placed(footprints.size());
    in_shares(footprints.size(), [&](std::size_t begin, std::size_t end) {
      const GeosSession geos;
      for (std::size_t i = begin; i < end; ++i) {
        try {
          placed[i] = place(geos, footprints[i]);
        } catch (const GeosFailure&) {
          placed[i] = {};
        }
      }
    });
    const auto clusters = cluster(placed);
    std::vector<RaisedBlock> blocks(clusters.size());
    in_shares(clusters.size(), [&](std::size_t begin, std::size_t end) {
      const GeosSession geos;
      const GeoFrame::Placer placer(*dem_.frame);
      for (std::size_t i = begin; i < end; ++i)
        blocks[i] = raise(geos, placer, placed, clusters[i]);
    });
    report(placed, blocks, warnings);
    return merge(blocks);
  }

 private:
  /// Sessions of GEOS and PROJ take longer to open than a block to build: one for a share of them.
  template <class Work>
  static void in_shares(std::size_t count, const Work& work) {
    constexpr std::size_t kShare = 64;
    parallel_for((count + kShare - 1) / kShare,
                 [&](std::size_t i) { work(i * kShare, std::min(count, (i + 1) * kShare)); });
  }

  GridPlace to_grid(const PlanePoint& p) const {
    return {p.x_m / grid_.cell_x_m, -p.y_m / grid_.cell_y_m};
  }
  PlanePoint to_plane(const GridPlace& p) const {
    return {p.column * grid_.cell_x_m, -p.row * grid_.cell_y_m};
  }

  // From footprints to what stands on the ground.

  Placed place(const GeosSession& geos, const Footprint& footprint) const {
    PlanePolygon rings;
    for (const auto& ring : footprint.rings) {
      PlaneRing& points = rings.emplace_back();
      for (const auto& [x, y] : ring)
        points.push_back(to_plane({(x - dem_.geotransform[0]) / dem_.geotransform[1] - 0.5,
                                   (y - dem_.geotransform[3]) / dem_.geotransform[5] - 0.5}));
      if (!points.empty()) points.push_back(points.front());
    }
    GeosSession::Geometry outline = geos.polygon(rings);
    if (!geos.is_valid(outline)) {
      // Repaired outlines may carry lines and points, which overlays do not take.
      std::vector<GeosSession::Geometry> parts;
      for (const PlanePolygon& part : geos.polygons(geos.valid(outline)))
        parts.push_back(geos.polygon(part));
      outline = geos.node(geos.collection(std::move(parts)), 0);
    }
    outline = cut_to_ground(geos, std::move(outline));
    Placed placed{geos.polygons(outline), {}, 0, false};
    if (placed.parts.empty()) return placed;
    placed.box = geos.box(outline);
    double lowest_m = std::numeric_limits<double>::infinity(), highest_m = -lowest_m;
    for (const PlanePolygon& part : placed.parts) {
      for (const PlaneRing& ring : part) {
        for (std::size_t i = 0; i + 1 < ring.size(); ++i) {
          const GridPlace p = to_grid(ring[i]), q = to_grid(ring[i + 1]);
          const auto look = [&](double t) {
            const double height_m = ground_.height_m(between(p, q, t));
            lowest_m = std::min(lowest_m, height_m);
            highest_m = std::max(highest_m, height_m);
          };
          look(0);
          for (const double t : profile_parameters(p, q)) look(t);
        }
      }
    }
    placed.level_m = round_to_lattice(std::max(lowest_m + footprint.height_m, highest_m));
    placed.raised = highest_m > lowest_m + footprint.height_m;
    return placed;
  }

  static GridPlace between(const GridPlace& p, const GridPlace& q, double t) {
    return {p.column + t * (q.column - p.column), p.row + t * (q.row - p.row)};
  }

  PlanePolygon rectangle(double column0, double row0, double column1, double row1) const {
    return {{to_plane({column0, row0}), to_plane({column0, row1}), to_plane({column1, row1}),
             to_plane({column1, row0}), to_plane({column0, row0})}};
  }

  /// What is left of an outline where it keeps kBorderClearanceCells from what is not ground.
  GeosSession::Geometry cut_to_ground(const GeosSession& geos,
                                      GeosSession::Geometry outline) const {
    constexpr double kAway = kBorderClearanceCells;
    const double grid_m = run_m_ * kCornerGridRuns;
    if (geos.is_empty(outline)) return outline;
    PlaneBox box = geos.box(outline);
    const GridPlace low = to_grid({box.low_x_m, box.high_y_m}),
                    high = to_grid({box.high_x_m, box.low_y_m});
    if (low.column < kAway || low.row < kAway || high.column > grid_.columns - 1 - kAway ||
        high.row > grid_.rows - 1 - kAway) {
      const auto inside =
          geos.polygon(rectangle(kAway, kAway, grid_.columns - 1 - kAway, grid_.rows - 1 - kAway));
      outline = geos.intersection(outline, inside, grid_m);
      if (geos.is_empty(outline)) return outline;
    }
    std::vector<GeosSession::Geometry> voids;
    const auto cell = [&](double at, std::int32_t cells) {
      return static_cast<std::int32_t>(std::clamp(std::floor(at), 0.0, cells - 1.0));
    };
    const std::int32_t last_row = cell(high.row + kAway, grid_.rows - 1);
    const std::int32_t last_column = cell(high.column + kAway, grid_.columns - 1);
    for (std::int32_t r = cell(low.row - kAway, grid_.rows - 1); r <= last_row; ++r) {
      for (std::int32_t c = cell(low.column - kAway, grid_.columns - 1); c <= last_column; ++c) {
        const std::int32_t first = c;
        while (c <= last_column && !grid_.is_ground_cell(c, r)) ++c;
        if (c > first)
          voids.push_back(
              geos.polygon(rectangle(first - kAway, r - kAway, c + kAway, r + 1 + kAway)));
      }
    }
    if (voids.empty()) return outline;
    const auto all = geos.node(geos.collection(std::move(voids)), grid_m);
    return geos.difference(outline, all, grid_m);
  }

  /// Footprints that may touch each other, in the order of their first.
  std::vector<std::vector<std::uint32_t>> cluster(const std::vector<Placed>& placed) const {
    const double reach_m = 4 * run_m_;
    std::vector<std::uint32_t> order, group(placed.size());
    for (std::uint32_t i = 0; i < placed.size(); ++i)
      if (!placed[i].parts.empty()) order.push_back(i);
    std::iota(group.begin(), group.end(), 0U);
    const auto root = [&](std::uint32_t i) {
      while (group[i] != i) i = group[i] = group[group[i]];
      return i;
    };
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::pair(placed[a].box.low_x_m, a) < std::pair(placed[b].box.low_x_m, b);
    });
    for (std::size_t i = 0; i < order.size(); ++i) {
      const PlaneBox& box = placed[order[i]].box;
      for (std::size_t j = i + 1; j < order.size(); ++j) {
        if (placed[order[j]].box.low_x_m > box.high_x_m + reach_m) break;
        if (!box.meets(placed[order[j]].box, reach_m)) continue;
        const std::uint32_t a = root(order[i]), b = root(order[j]);
        group[std::max(a, b)] = std::min(a, b);
      }
    }
    std::vector<std::vector<std::uint32_t>> by_root(placed.size()), clusters;
    for (std::uint32_t i = 0; i < placed.size(); ++i)
      if (!placed[i].parts.empty()) by_root[root(i)].push_back(i);
    for (auto& members : by_root)
      if (!members.empty()) clusters.push_back(std::move(members));
    return clusters;
  }

  // From a block in the plane to walls.

  /// Leaves out, one after another, footprints at which lines come too near to each other to be
  /// told apart after rounding; that is rare, because all lines are snapped before.
  RaisedBlock raise(const GeosSession& geos, const GeoFrame::Placer& placer,
                    const std::vector<Placed>& placed, std::vector<std::uint32_t> members) const {
    std::uint32_t dropped = 0;
    for (; !members.empty(); ++dropped) {
      std::vector<Standing> standing;
      for (const std::uint32_t m : members) {
        std::vector<GeosSession::Geometry> parts;
        for (const PlanePolygon& part : placed[m].parts) parts.push_back(geos.polygon(part));
        standing.push_back(
            {geos.node(geos.collection(std::move(parts)), 0), placed[m].box, placed[m].level_m});
      }
      std::vector<const Standing*> all;
      for (const Standing& s : standing) all.push_back(&s);
      std::size_t offender = 0;
      try {
        Block block = build_block(geos, all, run_m_);
        RaisedBlock raised = raise(placer, block);
        raised.dropped = dropped;
        const auto conflict = conflict_of(raised);
        if (!conflict) return raised;
        offender = nearest(geos, standing, *conflict);
      } catch (const GeosFailure&) {
        offender = smallest(geos, standing);
      }
      members.erase(members.begin() + static_cast<std::ptrdiff_t>(offender));
    }
    RaisedBlock none;
    none.dropped = dropped;
    return none;
  }

  static std::size_t smallest(const GeosSession& geos, const std::vector<Standing>& standing) {
    std::size_t found = 0;
    for (std::size_t i = 1; i < standing.size(); ++i)
      if (geos.area_m2(standing[i].outline) < geos.area_m2(standing[found].outline)) found = i;
    return found;
  }

  /// The smallest footprint at a place, or the nearest where none is at it.
  std::size_t nearest(const GeosSession& geos, const std::vector<Standing>& standing,
                      const PlanePoint& p) const {
    std::size_t found = 0;
    std::pair<double, double> least{std::numeric_limits<double>::infinity(), 0};
    for (std::size_t i = 0; i < standing.size(); ++i) {
      const double away_m = geos.distance_m(standing[i].outline, p);
      const std::pair<double, double> rank{std::max(away_m, 2 * run_m_),
                                           geos.area_m2(standing[i].outline)};
      if (rank < least) {
        least = rank;
        found = i;
      }
    }
    return found;
  }

  RaisedBlock raise(const GeoFrame::Placer& placer, const Block& block) const {
    RaisedBlock raised;
    raised.covered = block.covered;
    raised.buildings = block.buildings;
    raised.slivers = block.slivers;
    for (std::size_t i = 0; i < block.points.size(); ++i)
      raised.vertices.push_back(vertex(to_grid(block.points[i]), block.levels_m[i], placer));
    for (const auto& [a, b] : block.edges) {
      if (raised.vertices[a].on_roof || raised.vertices[b].on_roof)
        raised.edges.push_back({a, b});
      else
        add_foot(a, b, placer, raised);
    }
    return raised;
  }

  WallVertex vertex(const GridPlace& wanted, double level_m, const GeoFrame::Placer& placer) const {
    WallVertex v;
    v.column = std::nearbyint(wanted.column / tick_cells_) * tick_cells_;
    v.row = std::nearbyint(wanted.row / tick_cells_) * tick_cells_;
    v.on_roof = !std::isnan(level_m);
    Position p = ground_.position({v.column, v.row});
    if (v.on_roof) p.z_m = placer.place({dem_.x_of(v.column), dem_.y_of(v.row), level_m}).z_m;
    v.position = round_to_lattice(p);
    return v;
  }

  /// The foot of a wall, with corners where the ground leaves the straight line too far.
  void add_foot(std::uint32_t from, std::uint32_t to, const GeoFrame::Placer& placer,
                RaisedBlock& raised) const {
    const GridPlace p{raised.vertices[from].column, raised.vertices[from].row};
    const GridPlace q{raised.vertices[to].column, raised.vertices[to].row};
    std::vector<double> at{0}, heights_m{raised.vertices[from].position.z_m};
    const double length_m =
        std::hypot((q.column - p.column) * grid_.cell_x_m, (q.row - p.row) * grid_.cell_y_m);
    // Corners closer than a run would make needles for nothing.
    const double least = run_m_ / length_m;
    for (const double t : profile_parameters(p, q)) {
      if (t - at.back() < least || 1 - t < least) continue;
      at.push_back(t);
      heights_m.push_back(ground_.position(between(p, q, t)).z_m);
    }
    at.push_back(1);
    heights_m.push_back(raised.vertices[to].position.z_m);
    std::uint32_t last = from;
    for (const std::size_t i : profile_corners(at, heights_m)) {
      raised.vertices.push_back(
          vertex(between(p, q, at[i]), std::numeric_limits<double>::quiet_NaN(), placer));
      const auto next = static_cast<std::uint32_t>(raised.vertices.size() - 1);
      raised.edges.push_back({last, next});
      last = next;
    }
    raised.edges.push_back({last, to});
  }

  /// Inner points of a profile to keep so that straight lines between them stay within
  /// foot_error_m.
  std::vector<std::size_t> profile_corners(const std::vector<double>& at,
                                           const std::vector<double>& heights_m) const {
    std::vector<std::size_t> kept;
    std::vector<std::pair<std::size_t, std::size_t>> open{{0, at.size() - 1}};
    while (!open.empty()) {
      const auto [a, b] = open.back();
      open.pop_back();
      double worst_m = foot_error_m_;
      std::size_t worst = a;
      for (std::size_t i = a + 1; i < b; ++i) {
        const double straight_m =
            heights_m[a] + (heights_m[b] - heights_m[a]) * (at[i] - at[a]) / (at[b] - at[a]);
        const double error_m = std::abs(heights_m[i] - straight_m);
        // Rounding to the lattice is no reason for a corner.
        if (error_m > std::max(worst_m, kLatticeStepM)) {
          worst_m = error_m;
          worst = i;
        }
      }
      if (worst == a) continue;
      kept.push_back(worst);
      open.push_back({a, worst});
      open.push_back({worst, b});
    }
    std::sort(kept.begin(), kept.end());
    return kept;
  }

  /// Where lines come too near to each other, in either plane.
  std::optional<PlanePoint> conflict_of(const RaisedBlock& raised) const {
    PlaneGraph samples, flattened;
    samples.edges = flattened.edges = raised.edges;
    samples.step_x_m = tick_cells_ * grid_.cell_x_m;
    samples.step_y_m = tick_cells_ * grid_.cell_y_m;
    flattened.step_x_m = flattened.step_y_m = kLatticeStepM;
    for (const WallVertex& v : raised.vertices) {
      samples.points.push_back({static_cast<std::int64_t>(v.column / tick_cells_),
                                static_cast<std::int64_t>(v.row / tick_cells_)});
      flattened.points.push_back({lattice_steps(v.position.x_m), lattice_steps(v.position.y_m)});
    }
    for (const PlaneGraph* graph : {&samples, &flattened}) {
      if (const auto found = find_conflict(*graph, run_m_ * kClearanceRuns)) {
        // The shorter edge points at the place better.
        const auto length = [&](std::uint32_t e) {
          const WallVertex &a = raised.vertices[raised.edges[e][0]],
                           &b = raised.vertices[raised.edges[e][1]];
          return std::hypot(a.column - b.column, a.row - b.row);
        };
        const std::uint32_t e =
            length((*found)[0]) <= length((*found)[1]) ? (*found)[0] : (*found)[1];
        const WallVertex& v = raised.vertices[raised.edges[e][0]];
        return to_plane({v.column, v.row});
      }
    }
    return {};
  }

  // All together.

  void report(const std::vector<Placed>& placed, const std::vector<RaisedBlock>& blocks,
              std::vector<std::string>& warnings) const {
    std::uint64_t off_ground = 0, raised = 0, slivers = 0, dropped = 0;
    for (const Placed& p : placed) {
      off_ground += p.parts.empty();
      raised += p.raised;
    }
    for (const RaisedBlock& block : blocks) {
      slivers += block.slivers;
      dropped += block.dropped;
    }
    const auto say = [&](std::uint64_t count, const char* what) {
      if (count > 0) warnings.push_back(fmt::format("{} {}", count, what));
    };
    say(off_ground, "footprints left out, not on the ground of the DEM");
    say(raised, "roofs raised to the highest ground at their outline");
    say(slivers, "slivers of buildings and gaps given to what surrounds them");
    say(dropped, "footprints left out, their lines run too near to others");
  }

  WallsAndRoofs merge(const std::vector<RaisedBlock>& blocks) const {
    WallsAndRoofs walls;
    walls.tick_cells = tick_cells_;
    walls.run_m = run_m_;
    for (const RaisedBlock& block : blocks) {
      const auto first = static_cast<std::uint32_t>(walls.vertices.size());
      walls.vertices.insert(walls.vertices.end(), block.vertices.begin(), block.vertices.end());
      for (const auto& [a, b] : block.edges) walls.edges.push_back({first + a, first + b});
      walls.buildings += block.buildings;
    }
    if (walls.buildings == 0) return walls;
    walls.covered.assign(grid_.positions.size(), 0);
    for (const RaisedBlock& block : blocks)
      for (const PlanePolygon& polygon : block.covered) cover(polygon, walls.covered);
    return walls;
  }

  /// Marks the samples inside a polygon.
  void cover(const PlanePolygon& polygon, std::vector<std::uint8_t>& covered) const {
    double top = std::numeric_limits<double>::infinity(), bottom = -top;
    for (const PlanePoint& p : polygon[0]) {
      top = std::min(top, to_grid(p).row);
      bottom = std::max(bottom, to_grid(p).row);
    }
    std::vector<double> crossings;
    const auto last = std::min<std::int64_t>(static_cast<std::int64_t>(bottom), grid_.rows - 1);
    for (auto r = std::max<std::int64_t>(static_cast<std::int64_t>(std::ceil(top)), 0); r <= last;
         ++r) {
      crossings.clear();
      const auto row = static_cast<double>(r);
      for (const PlaneRing& ring : polygon) {
        for (std::size_t i = 0; i + 1 < ring.size(); ++i) {
          const GridPlace p = to_grid(ring[i]), q = to_grid(ring[i + 1]);
          if ((p.row <= row) == (q.row <= row)) continue;
          crossings.push_back(p.column + (row - p.row) / (q.row - p.row) * (q.column - p.column));
        }
      }
      std::sort(crossings.begin(), crossings.end());
      for (std::size_t i = 0; i + 1 < crossings.size(); i += 2) {
        const auto from = static_cast<std::int32_t>(std::max(std::ceil(crossings[i]), 0.0));
        const auto to =
            static_cast<std::int32_t>(std::min(std::floor(crossings[i + 1]), grid_.columns - 1.0));
        for (std::int32_t c = from; c <= to; ++c)
          covered[grid_.index(c, static_cast<std::int32_t>(r))] = 1;
      }
    }
  }

  const Dem& dem_;
  const SampleGrid& grid_;
  const GroundBetweenSamples ground_;
  const double foot_error_m_;
  const double run_m_;
  const double tick_cells_;
};

}  // namespace

WallsAndRoofs build_walls(const std::vector<Footprint>& footprints, const Dem& dem,
                          const SampleGrid& grid, double foot_error_m,
                          std::vector<std::string>& warnings) {
  return WallBuilder(dem, grid, foot_error_m).run(footprints, warnings);
}

WallsAndRoofs add_footprints(const Dem& dem, const SampleGrid& grid, const std::string& file,
                             const std::string& height_field, double foot_error_m,
                             std::vector<std::string>& warnings) {
  const std::vector<Footprint> footprints = read_footprints(file, height_field, dem, warnings);
  WallsAndRoofs walls = build_walls(footprints, dem, grid, foot_error_m, warnings);
  if (walls.buildings == 0)
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': none of {} buildings stands on the ground of the DEM ({}); some "
                            "were expected; check the coordinate system of both",
                            file, footprints.size(), fmt::join(warnings, "; ")));
  return walls;
}

}  // namespace scarp
