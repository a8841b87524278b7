#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "cli/fly/flight_path.h"
#include "cli/fly/movers.h"
#include "core/culling/culling_method.h"
#include "core/culling/group_batches.h"
#include "core/raster/rasterise.h"
#include "core/sight/tin_index.h"
#include "core/threads/progress.h"

namespace scarp {

/// A picture is taken at the lens's size and at so many times it, to see whether an error hides
/// between the pixels.
inline constexpr std::array<int, 2> kPictureScales = {1, 2};

/// A method on a flight, and what it took to prepare.
struct Contender {
  std::string label;             ///< name, and what it is set to where there are several of it
  bool is_conservative = false;  ///< claims that no pixel is ever wrong
  double prepare_s = 0;          ///< NaN where it is part of the scene
  std::uint64_t bytes = 0;       ///< that it keeps besides the triangles
  std::unique_ptr<CullingMethod> method;
};

/// What a method made of a frame.
struct FrameCounts {
  std::uint32_t groups = 0;         ///< that it calls visible, in the picture
  std::uint32_t missed_groups = 0;  ///< of which a pixel is seen at the finest scale
  std::uint32_t movers = 0;         ///< that it draws
  std::uint32_t missed_movers = 0;
  std::uint64_t drawn = 0;  ///< triangles of those groups, and the orphans
  /// Processor time, of all threads: to find the groups, and which of them are in the picture.
  double find_ms = 0;
  double draw_ms = 0;  ///< the same, to draw them at scale 1
  std::array<std::uint64_t, kPictureScales.size()> wrong_px{};
  /// Of those: an exact ray through the pixel's centre reaches what was left out.
  std::array<std::uint64_t, kPictureScales.size()> judged_wrong_px{};
};

/// A frame, whatever the method.
struct FrameTruth {
  std::uint64_t in_view = 0;            ///< triangles of the groups in the picture, and orphans
  std::uint64_t visible = 0;            ///< triangles with a pixel at the finest scale
  std::uint64_t in_visible_groups = 0;  ///< triangles of groups with a pixel there, and orphans
  std::uint32_t movers = 0;             ///< in the picture
  std::uint32_t visible_movers = 0;     ///< with a pixel at the finest scale
};

struct Flight {
  std::vector<FrameTruth> truth;                 ///< [frames]
  std::vector<std::vector<FrameCounts>> counts;  ///< [contenders][frames]
};

/// What happens on a flight.
struct FlightPlan {
  std::vector<Shot> shots;  ///< a frame each
  std::vector<Mover> movers = {};
  /// Groups that are taken away, or come back, every kChangeFrames; 0: the scene stays as it is.
  std::uint32_t changes = 0;
  std::uint64_t seed = 1;  ///< of the changes
  /// Called with each answer: the groups in the picture.
  std::function<void(std::size_t frame, std::size_t contender, std::span<const GroupIndex> groups)>
      see_groups = {};
};
inline constexpr std::size_t kChangeFrames = 10;

/// Called with each frame as it is drawn whole at scale 1, and as a contender draws it.
using SeeFrame = std::function<void(std::size_t frame, std::size_t contender, const Target& whole,
                                    const Target& drawn)>;

/// Flies a path with every method and compares its pictures, number by number, with those of
/// everything in view; pixels that differ are judged by exact rays (PixelJudge). Methods are asked
/// in turn, each for every frame, so that those that remember earlier frames may.
///
/// Translucent movers are drawn last, over the depths of all else; a pixel is wrong where either
/// number differs.
/// Requires contenders that follow where the plan has changes.
Flight fly(const TinIndex& index, const GroupBatches& batches, const FlightPlan& plan,
           std::vector<Contender>& contenders, const SeeFrame& see, const Progress& progress);

}  // namespace scarp
