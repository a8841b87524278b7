#include "core/horizon/stewart.h"

#include <algorithm>
#include <cassert>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "core/horizon/hull_tree.h"
#include "core/horizon/radix_sort.h"
#include "core/horizon/subsector.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Subsectors that are worked on before their sectors are closed, per thread: enough that threads
/// seldom wait for the last one, few enough that memory does not grow with the layout.
constexpr std::size_t kPartsPerThread = 16;

/// What one running subsector needs, kept for the next one.
struct Workspace {
  std::vector<Projection> projections;  // by vertex
  std::vector<KeyedIndex> order, scratch;
  // By rank, which is the order along the normal of boundary b:
  std::vector<PlanePoint> points;
  std::vector<std::int64_t> left_of_a;
  std::vector<std::uint32_t> tie_end;  // first rank that is farther to the left of b
  HullTree tree;
};

/// Workspaces that no running subsector holds: there are never more than threads.
class WorkspacePool {
 public:
  std::unique_ptr<Workspace> take() {
    const std::scoped_lock lock(mutex_);
    if (free_.empty()) return std::make_unique<Workspace>();
    std::unique_ptr<Workspace> taken = std::move(free_.back());
    free_.pop_back();
    return taken;
  }

  void give_back(std::unique_ptr<Workspace> workspace) {
    const std::scoped_lock lock(mutex_);
    free_.push_back(std::move(workspace));
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<Workspace>> free_;
};

/// Counts finished subsectors from any thread.
class Counter {
 public:
  Counter(const Progress& progress, std::size_t total) : progress_(progress), total_(total) {}

  void finish_one() {
    if (!progress_) return;
    const std::scoped_lock lock(mutex_);
    progress_(static_cast<double>(++finished_) / static_cast<double>(total_));
  }

 private:
  const Progress& progress_;
  const std::size_t total_;
  std::size_t finished_ = 0;
  std::mutex mutex_;
};

/// Sorts vertices by rising left_of_b and fills the arrays by rank.
void rank_along_b(std::span<const Position> vertices, const Subsector& subsector, Workspace& w) {
  const std::size_t n = vertices.size();
  w.projections.resize(n);
  w.order.resize(n);
  for (std::size_t v = 0; v < n; ++v) {
    w.projections[v] = subsector.project(vertices[v]);
    w.order[v] = {w.projections[v].left_of_b, static_cast<std::uint32_t>(v)};
  }
  sort_by_key(w.order, w.scratch);
  w.points.resize(n);
  w.left_of_a.resize(n);
  w.tie_end.resize(n);
  std::uint32_t end = static_cast<std::uint32_t>(n);
  for (std::size_t rank = n; rank-- > 0;) {
    const VertexIndex v = w.order[rank].index;
    if (rank + 1 < n && w.order[rank].key != w.order[rank + 1].key)
      end = static_cast<std::uint32_t>(rank + 1);
    w.tie_end[rank] = end;
    w.points[rank] = {w.projections[v].u, lattice_steps(vertices[v].z_m), v};
    w.left_of_a[rank] = w.projections[v].left_of_a;
  }
}

/// Leaves in w.order the ranks in the order of the sweep: falling left_of_a. Among equal ones by
/// falling u, so that each comes after all that its subsector holds.
void order_along_a(Workspace& w) {
  const std::size_t n = w.points.size();
  for (std::size_t rank = 0; rank < n; ++rank)
    w.order[rank] = {-w.left_of_a[rank], static_cast<std::uint32_t>(rank)};
  sort_by_key(w.order, w.scratch);
  for (std::size_t first = 0; first < n;) {
    std::size_t end = first + 1;
    while (end < n && w.order[end].key == w.order[first].key) ++end;
    const auto begin = w.order.begin();
    if (end > first + 1)
      std::sort(begin + static_cast<std::ptrdiff_t>(first),
                begin + static_cast<std::ptrdiff_t>(end),
                [&](const KeyedIndex& x, const KeyedIndex& y) {
                  const std::int64_t ux = w.points[x.index].u, uy = w.points[y.index].u;
                  return ux != uy ? ux > uy : x.index < y.index;
                });
    first = end;
  }
}

/// Horizon vertex of every vertex in one subsector. When a vertex is asked for, those inserted are
/// the ones on or left of its boundary a; the tree finds the steepest of them right of b.
void sweep(std::span<const Position> vertices, const Subsector& subsector, Workspace& w,
           std::span<VertexIndex> horizon) {
  rank_along_b(vertices, subsector, w);
  order_along_a(w);
  w.tree.reset(w.points);
  for (const KeyedIndex& item : w.order) {
    const PlanePoint& p = w.points[item.index];
    horizon[p.vertex] = w.tree.steepest(w.tie_end[item.index], p.u, p.z).vertex;
    w.tree.insert(item.index);
  }
}

/// Keeps the lowest of a sector's subsectors for every vertex. parts[j] is subsector j's result.
void keep_lowest(std::span<const Position> vertices, std::int32_t sector,
                 std::span<const std::vector<VertexIndex>> parts, HorizonTable& table) {
  const SectorLayout& layout = table.layout;
  std::vector<Slope> lowest(vertices.size());
  std::vector<VertexIndex> kept = parts[0];
  for (std::size_t j = 0; j < parts.size(); ++j) {
    const Subsector subsector(layout, sector * layout.subsectors + static_cast<std::int32_t>(j));
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      const VertexIndex h = parts[j][v];
      if (kept[v] == kNone || h == kNone) {
        kept[v] = kNone;
        continue;
      }
      const Slope slope{lattice_steps(vertices[h].z_m) - lattice_steps(vertices[v].z_m),
                        subsector.project_u(vertices[h]) - subsector.project_u(vertices[v])};
      if (j > 0 && compare_slopes(slope, lowest[v]) >= 0) continue;
      lowest[v] = slope;
      kept[v] = h;
    }
  }
  const auto count = static_cast<std::size_t>(layout.count);
  for (std::size_t v = 0; v < vertices.size(); ++v)
    table.horizon_vertex[v * count + static_cast<std::size_t>(sector)] = kept[v];
}

}  // namespace

HorizonTable stewart_horizons(std::span<const Position> vertices, const SectorLayout& layout,
                              const Progress& progress) {
  assert(layout.count >= 4 && layout.subsectors >= 1);
  assert(vertices.size() < kNone);
  const auto sectors = static_cast<std::size_t>(layout.count);
  const auto subsectors = static_cast<std::size_t>(layout.subsectors);
  HorizonTable table{layout, std::vector<VertexIndex>(vertices.size() * sectors, kNone)};
  Counter counter(progress, sectors * subsectors);
  WorkspacePool pool;
  const std::size_t wave = std::min(
      sectors,
      (kPartsPerThread * static_cast<std::size_t>(thread_count()) + subsectors - 1) / subsectors);
  std::vector<std::vector<VertexIndex>> parts(wave * subsectors);
  for (std::size_t first = 0; first < sectors; first += wave) {
    const std::size_t sectors_now = std::min(wave, sectors - first);
    parallel_for(sectors_now * subsectors, [&](std::size_t i) {
      parts[i].resize(vertices.size());
      std::unique_ptr<Workspace> workspace = pool.take();
      sweep(vertices, Subsector(layout, static_cast<std::int32_t>(first * subsectors + i)),
            *workspace, parts[i]);
      pool.give_back(std::move(workspace));
      counter.finish_one();
    });
    parallel_for(sectors_now, [&](std::size_t i) {
      keep_lowest(vertices, static_cast<std::int32_t>(first + i),
                  std::span(parts).subspan(i * subsectors, subsectors), table);
    });
  }
  return table;
}

}  // namespace scarp
