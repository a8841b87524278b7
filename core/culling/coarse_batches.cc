#include "core/culling/coarse_batches.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cassert>

namespace scarp {

CoarseBatches::CoarseBatches(const GroupBatches& batches, const std::vector<double>& shares) {
  for (const double share : shares) {
    assert(share > 0 && share < 1);
    Level& level = levels_.emplace_back();
    level.first_vertex.push_back(0);
    level.first_triangle.push_back(0);
    for (GroupIndex g = 0; g < batches.groups(); ++g) {
      GroupBatches::Drawing fine;
      batches.add_to(g, fine);
      const Position& low = batches.box(g).low;
      std::vector<float> places;
      for (const Position& p : fine.vertices)
        for (const double metres : {p.x_m - low.x_m, p.y_m - low.y_m, p.z_m - low.z_m})
          places.push_back(static_cast<float>(metres));
      const auto* indices = fine.triangles.front().data();
      const std::size_t count = 3 * fine.triangles.size();
      std::vector<unsigned> coarse(count);
      const auto wanted = static_cast<std::size_t>(share * static_cast<double>(count));
      coarse.resize(meshopt_simplifySloppy(coarse.data(), indices, count, places.data(),
                                           fine.vertices.size(), 3 * sizeof(float), wanted, 1,
                                           nullptr));
      std::vector<VertexIndex> used(coarse.begin(), coarse.end());
      std::sort(used.begin(), used.end());
      used.erase(std::unique(used.begin(), used.end()), used.end());
      const auto local = [&](unsigned v) {
        return static_cast<VertexIndex>(std::lower_bound(used.begin(), used.end(), v) -
                                        used.begin());
      };
      for (const VertexIndex v : used) level.vertices.push_back(fine.vertices[v]);
      for (std::size_t i = 0; i < coarse.size(); i += 3)
        level.triangles.push_back({local(coarse[i]), local(coarse[i + 1]), local(coarse[i + 2])});
      level.first_vertex.push_back(static_cast<std::uint32_t>(level.vertices.size()));
      level.first_triangle.push_back(static_cast<std::uint32_t>(level.triangles.size()));
    }
  }
}

void CoarseBatches::add_to(std::size_t level, GroupIndex group,
                           GroupBatches::Drawing& drawing) const {
  const Level& from = levels_[level];
  const auto base = static_cast<VertexIndex>(drawing.vertices.size());
  drawing.vertices.insert(drawing.vertices.end(), from.vertices.begin() + from.first_vertex[group],
                          from.vertices.begin() + from.first_vertex[group + 1]);
  for (std::uint32_t i = from.first_triangle[group]; i < from.first_triangle[group + 1]; ++i) {
    const auto& [a, b, c] = from.triangles[i];
    drawing.triangles.push_back({base + a, base + b, base + c});
    drawing.objects.push_back(group);
  }
}

std::uint64_t CoarseBatches::bytes() const {
  std::uint64_t bytes = 0;
  for (const Level& level : levels_)
    bytes += level.vertices.size() * sizeof(Position) + level.triangles.size() * 12 +
             (level.first_vertex.size() + level.first_triangle.size()) * 4;
  return bytes;
}

}  // namespace scarp
