#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/geodesy/position.h"

namespace scarp {

/// The loops of RisingHorizon over triangles and over parts of the view, written once in vectors
/// of any length (Highway), compiled for several instruction sets of which the processor chooses
/// one. What they compute is defined by RisingHorizon's plain functions for one triangle, with the
/// same operations in the same order, so that every instruction set gives the same bits.

/// Relative allowance in every comparison: far above what double loses between the lattice and
/// here, as no edge is interpolated that is shorter than kLeastEdge.
inline constexpr double kHorizonRounding = 0x1p-30;
/// Across: shorter edges are not interpolated along, because a place on them is not exact enough.
inline constexpr double kLeastEdge = 0x1p-12;
/// Farther beside the view than this, or nearer to the eye's own plane, no place is exact enough.
inline constexpr double kMostAcross = 1024;
inline constexpr double kNearestAheadM = 0.5;
/// Of products of two places.
inline constexpr double kAreaRounding = 0x1p-44;

/// How far a view is divided, and what is kept of every part.
struct HorizonBins {
  static constexpr std::size_t kBins = 512;
  /// Kernels touch so many parts beyond the last at most.
  static constexpr std::size_t kBeyond = 16;

  double left = 0, right = 0, width = 0;           ///< of the view, and of a part, across
  std::array<double, kBins + kBeyond> up;          ///< what is lower is hidden
  std::array<double, kBins + kBeyond> farthest_m;  ///< where it is farther ahead than this
};

/// Where an eye is, and which level way it looks: a unit vector, but for rounding.
struct HorizonEye {
  Position at;
  double ahead_x = 1, ahead_y = 0;
};

/// Triangles that are set up at once, and laid out at once (HorizonTriangles).
inline constexpr std::size_t kSetUp = 64;
inline constexpr std::size_t kLaidOut = 8;

/// Triangles as an eye sees them, corners from left to right: a number of each a row.
struct SeenTriangles {
  using Row = std::array<double, kSetUp>;

  alignas(64) Row across0, across1, across2, up0, up1, up2;
  /// Of the edges from 0 to 2, from 0 to 1 and from 1 to 2: up for each across; 0 where they are
  /// too short for it. Where the latter two begin for what hides: -inf where they are too short.
  alignas(64) Row slope, slope01, slope12, up01, up12;
  alignas(64) Row nearest_m, farthest_m;  ///< farthest with rounding to spare
  alignas(64) Row top, margin;            ///< highest with rounding to spare, and how much that is
  alignas(64) Row first, last;            ///< parts that are touched, with rounding to spare
  alignas(64) Row from, to;               ///< borders that it lies across, likewise

  std::uint64_t open = 0;    ///< a bit each: not placed well enough to be hidden or to hide
  std::uint64_t facing = 0;  ///< placed, within the view, and not seen from behind
  std::uint64_t spanning =
      0;  ///< placed, within the view, and lie across a part: they hide something
};

/// Sets triangles up from their corners' coordinates, in steps of the lattice from `origin`.
/// @param steps  [count / kLaidOut][9][kLaidOut]: x, y, z of one corner after the other
/// @param count  at most kSetUp, a multiple of kLaidOut
void set_up(const HorizonEye& eye, const HorizonBins& bins, const Position& origin,
            const std::int32_t* steps, std::size_t count, SeenTriangles& seen);

/// Whether a triangle's top is under the horizon in all parts that it touches, and beyond it.
bool is_under(const HorizonBins& bins, const SeenTriangles& seen, std::size_t triangle);

/// Raises the horizon by all triangles that lie across a part.
void raise(const SeenTriangles& seen, HorizonBins& bins);

}  // namespace scarp
