#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/occlusion/groups.h"
#include "core/raster/camera.h"
#include "core/terrain/tin.h"

namespace scarp {

/// The triangles of a scene as they are drawn: a batch a group, and a last one of the orphans.
/// Each has vertices of its own, side by side, as a graphics card would be given them.
class GroupBatches {
 public:
  GroupBatches(const Tin& tin, const Groups& groups);

  std::uint32_t groups() const { return static_cast<std::uint32_t>(boxes_.size()); }
  const Bounds& box(GroupIndex group) const { return boxes_[group]; }

  /// Triangles of a group, by their numbers in the TIN; of the orphans for group == groups().
  std::span<const TriangleIndex> triangles(GroupIndex group) const {
    return std::span(triangles_)
        .subspan(first_triangle_[group], first_triangle_[group + 1] - first_triangle_[group]);
  }

  /// A batch's vertices, and the corners of its triangles among them, in the order of triangles().
  std::span<const Position> vertices(GroupIndex group) const {
    return std::span(vertices_).subspan(first_vertex_[group],
                                        first_vertex_[group + 1] - first_vertex_[group]);
  }
  std::span<const std::array<VertexIndex, 3>> corners(GroupIndex group) const {
    return std::span(corners_).subspan(first_triangle_[group],
                                       first_triangle_[group + 1] - first_triangle_[group]);
  }

  /// Some batches, laid out for rasterise: object numbers are those of the TIN's triangles.
  struct Drawing {
    std::vector<Position> vertices;
    std::vector<std::array<VertexIndex, 3>> triangles;
    std::vector<std::uint32_t> objects;
  };

  /// Adds a batch to a drawing. Cost: O(its triangles).
  void add_to(GroupIndex group, Drawing& drawing) const;

 private:
  std::vector<Bounds> boxes_;                        // [groups]
  std::vector<std::uint32_t> first_triangle_;        // [groups + 2]
  std::vector<TriangleIndex> triangles_;             // by group
  std::vector<std::uint32_t> first_vertex_;          // [groups + 2]
  std::vector<Position> vertices_;                   // by group
  std::vector<std::array<VertexIndex, 3>> corners_;  // of triangles_, within their batch
};

/// What a perspective picture can show of boxes.
class Frustum {
 public:
  Frustum(const Projection& projection);

  /// Whether a box may be in the picture. Side: never false for one that is.
  bool may_show(const Bounds& box) const;

  const Projection& projection() const { return projection_; }

 private:
  /// a x + b y + c z + d >= 0 is inside.
  struct Plane {
    double a, b, c, d;
  };

  Projection projection_;
  std::array<Plane, 6> planes_;
};

/// Where a box is on a screen.
struct ScreenBox {
  double left, top, right, bottom;  ///< pixels
  double nearest;                   ///< depth, the greatest of any of its points
};

/// Side: never smaller or farther than the box is, but for rounding.
/// @return whether the box lies beyond the near plane; otherwise nothing is said
bool place_on_screen(const Projection& projection, const Bounds& box, int width_px, int height_px,
                     ScreenBox& on_screen);

}  // namespace scarp
