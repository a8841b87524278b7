#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geodesy/position.h"
#include "core/sight/tin_index.h"

namespace scarp {

/// The judge of whole triangles over the surface `tin`: exact, and never undecided.
enum class TriangleSight : std::uint8_t {
  kVisible,  ///< some point of the triangle's interior is visible
  kHidden,   ///< none is
};

/// Whether any point of a triangle's interior can be seen from the eye. Void never blocks.
///
/// Method. An eye strictly under the triangle's plane sees none of its interior. For an eye above
/// that plane, the sight line rises as its target moves outwards over the triangle, while the
/// ground before the triangle stays the same: so in each direction the far border is seen best,
/// and some interior point is visible exactly where the sight line to the far border passes
/// strictly above all mesh edges before it. Along a far edge, a mesh edge hides an interval whose
/// ends are rational; the triangle is hidden when such intervals cover its far edges but for their
/// end points. For an eye in the plane all sight lines lie in it; then the intervals are open where
/// an edge dips through the plane, and the judge looks along one edge that spans the triangle.
/// Everything is decided in integers of at most 256 bits, so no direction is left undecided.
///
/// Eye: a lattice position anywhere, also over void, outside the data or under ground.
/// Cost: the bins between eye and triangle whose ground reaches up to the sight lines; on a mesh of
/// 100,000 triangles a few microseconds each with judge_all, on one core.
/// Source: own; the subtraction of shadows in the plane of the triangle, which this is equal to, is
/// carried out exactly in tests/judge.
TriangleSight judge_triangle(const TinIndex& index, const Position& eye, TriangleIndex triangle);

/// Judges every triangle, in parallel; the same bits for any number of threads.
/// @return one answer per triangle
std::vector<TriangleSight> judge_all(const TinIndex& index, const Position& eye);

/// Judges some triangles, in parallel; answers in the order of the list.
std::vector<TriangleSight> judge_each(const TinIndex& index, const Position& eye,
                                      std::span<const TriangleIndex> triangles);

}  // namespace scarp
