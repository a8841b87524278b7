#include <fmt/format.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "cli/accuracy.h"
#include "cli/compare/jobs.h"
#include "ingest/mesh/mesh.h"

namespace scarp {
namespace {

constexpr double kErrorsCells[] = {0.05, 0.1, 0.25, 0.5, 1, 2};

/// Triangles over samples, whoever made them.
struct SampleMesh {
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< of samples
};

/// How far a mesh lies from the samples, metres: one looker for all meshers.
struct MetresOff {
  double most = 0, sum = 0;
  std::uint64_t count = 0;
};

/// Compares every sample in a triangle with its plane. Samples on an edge count twice.
void look_at(const SampleGrid& grid, const std::array<std::uint32_t, 3>& triangle, MetresOff& off) {
  const auto columns = static_cast<std::uint32_t>(grid.columns);
  std::array<std::int64_t, 3> c{}, r{};
  std::array<double, 3> z{};
  for (std::size_t k = 0; k < 3; ++k) {
    c[k] = triangle[k] % columns, r[k] = triangle[k] / columns;
    z[k] = grid.positions[triangle[k]].z_m;
  }
  const auto twice = [](std::int64_t ax, std::int64_t ay, std::int64_t bx, std::int64_t by) {
    return ax * by - ay * bx;
  };
  const std::int64_t area = twice(c[1] - c[0], r[1] - r[0], c[2] - c[0], r[2] - r[0]);
  if (area == 0) return;
  const std::int64_t turn = area > 0 ? 1 : -1;
  const auto [low_c, high_c] = std::minmax_element(c.begin(), c.end());
  const auto [low_r, high_r] = std::minmax_element(r.begin(), r.end());
  for (std::int64_t row = *low_r; row <= *high_r; ++row)
    for (std::int64_t column = *low_c; column <= *high_c; ++column) {
      std::array<std::int64_t, 3> share{};
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t a = (k + 1) % 3, b = (k + 2) % 3;
        share[k] = turn * twice(c[b] - c[a], r[b] - r[a], column - c[a], row - r[a]);
      }
      if (share[0] < 0 || share[1] < 0 || share[2] < 0) continue;
      const auto at = static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column);
      if (!grid.known[at]) continue;
      double plane_m = 0;
      for (std::size_t k = 0; k < 3; ++k)
        plane_m += z[k] * static_cast<double>(share[k]) / static_cast<double>(turn * area);
      const double miss_m = std::abs(plane_m - grid.positions[at].z_m);
      off.most = std::max(off.most, miss_m);
      off.sum += miss_m;
      ++off.count;
    }
}

MetresOff look_at(const SampleGrid& grid, const SampleMesh& mesh) {
  MetresOff off;
  for (const auto& triangle : mesh.triangles) look_at(grid, triangle, off);
  return off;
}

class MeshComparison {
 public:
  MeshComparison(const ComparedGround& ground, const Progress& progress)
      : ground_(ground), progress_(progress) {}

  ComparedJob run() {
    job_.name = "mesh";
    job_.title = "Triangles for an error";
    job_.notes = {
        fmt::format("{} x {} samples of {:.3g} m; errors asked for are labels, those "
                    "drawn are measured at every sample by one looker for all.",
                    ground_.dem.columns, ground_.dem.rows, ground_.cell_m()),
        fmt::format("Over the surface: the bound holds between samples, too, whichever way "
                    "a cell is read. Times: median of {} runs,",
                    kComparedRuns),
        "lines from the least to the most."};
    job_.charts = {
        {"triangles", "triangles", "largest_error_m", "largest error at a sample, m", ""},
        {"seconds", "seconds, one thread", "largest_error_m", "largest error at a sample, m", ""}};
    full_mesh();
    double done = 0;
    for (const double cells : kErrorsCells) {
      const double error_m = cells * ground_.cell_m();
      ours(error_m, cells, MeshBound::kSurface);
      ours(error_m, cells, MeshBound::kSamples);
      peer(error_m);
      if (progress_) progress_(++done / static_cast<double>(std::size(kErrorsCells)));
    }
    return std::move(job_);
  }

 private:
  void finish(ComparedPoint point, const Timed& time, const SampleMesh& mesh) {
    add_time(point, time);
    const MetresOff off = look_at(ground_.samples, mesh);
    point.figures["triangles"] = static_cast<double>(mesh.triangles.size());
    point.figures["largest_error_m"] = off.most;
    point.figures["mean_error_m"] =
        off.sum / static_cast<double>(std::max<std::uint64_t>(1, off.count));
    job_.points.push_back(std::move(point));
  }

  void ours(double error_m, double cells, MeshBound bound) {
    Mesh mesh;
    const Timed time = timed(kComparedRuns, [&] {
      mesh = mesh_samples(ground_.samples, {.max_error_m = error_m, .bound = bound}, {});
    });
    SampleMesh over;
    for (const auto& t : mesh.tin.triangles) {
      auto& to = over.triangles.emplace_back();
      for (std::size_t k = 0; k < 3; ++k)
        to[k] = static_cast<std::uint32_t>(mesh.sample_of_vertex[t[k]]);
    }
    const bool is_surface = bound == MeshBound::kSurface;
    ComparedPoint point{is_surface ? "scarp, over the surface" : "scarp, at samples",
                        fmt::format("{:.3g} m", error_m),
                        {},
                        false,
                        false,
                        false,
                        ""};
    point.is_default = is_surface && cells == build_accuracy(Accuracy::kExact).error_cells;
    if (is_surface)
      point.command = fmt::format("scarp build '{}' -o S --max-error {:g}{}",
                                  fmt::join(ground_.files, "' '"), error_m, ground_.surface_flags);
    point.figures["asked_m"] = error_m;
    point.figures["error_over_surface_m"] = mesh.error_over_surface_m;
    finish(std::move(point), time, over);
  }

  void full_mesh() {
    const SampleGrid& grid = ground_.samples;
    full_ = ground_.cell_corners();
    const Position& first = grid.positions.front();
    for (const Position& p : grid.positions)
      for (const double v : {p.x_m - first.x_m, p.y_m - first.y_m, p.z_m - first.z_m})
        places_.push_back(static_cast<float>(v));
  }

  /// meshoptimizer, whose error is a distance and no bound.
  void peer(double error_m) {
    const std::size_t vertices = ground_.samples.positions.size();
    const float scale = meshopt_simplifyScale(places_.data(), vertices, 3 * sizeof(float));
    std::vector<std::uint32_t> kept(full_.size());
    std::size_t count = 0;
    const Timed time = timed(kComparedRuns, [&] {
      count = meshopt_simplify(kept.data(), full_.data(), full_.size(), places_.data(), vertices,
                               3 * sizeof(float), 0, static_cast<float>(error_m) / scale,
                               meshopt_SimplifyLockBorder, nullptr);
    });
    SampleMesh mesh;
    for (std::size_t i = 0; i + 2 < count; i += 3)
      mesh.triangles.push_back({kept[i], kept[i + 1], kept[i + 2]});
    ComparedPoint point{
        "meshoptimizer", fmt::format("{:.3g} m", error_m), {}, false, false, false, ""};
    point.figures["asked_m"] = error_m;
    finish(std::move(point), time, mesh);
  }

  const ComparedGround& ground_;
  const Progress& progress_;
  ComparedJob job_;
  std::vector<std::uint32_t> full_;  // every ground cell as two triangles
  std::vector<float> places_;
};

}  // namespace

ComparedJob compare_meshes(const ComparedGround& ground, const Progress& progress) {
  return MeshComparison(ground, progress).run();
}

}  // namespace scarp
