#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/options.h"
#include "cli/outputs.h"
#include "cli/view_source.h"
#include "core/sight/ground_along.h"
#include "core/sight/line_of_sight.h"
#include "ingest/crs/geo_frame.h"
#include "ingest/dem/dem.h"

namespace scarp {

/// An end of a sight line.
struct SightEnd {
  Position position;
  MapPoint map;                    ///< in the CRS of the data; height above its height datum
  std::optional<double> ground_m;  ///< the ground's height there, in the same way; none over void

  /// Nothing where the ground is not known.
  std::optional<double> above_ground_m() const {
    return ground_m ? std::optional(map.height_m - *ground_m) : std::nullopt;
  }
};

/// A surface that sight lines are judged on: the `tin` of a scene, or the `grid` of DEMs.
class SightSurface {
 public:
  virtual ~SightSurface() = default;

  virtual const char* name() const = 0;
  virtual const GeoFrame& frame() const = 0;

  /// Throws Error{kInput} where a height above ground is asked for and there is none.
  virtual SightEnd place(const TypedPosition& typed, const std::string& crs) const = 0;
  virtual SightEnd place(const MapPoint& map) const = 0;

  virtual Sight judge(const Position& a, const Position& b) const = 0;
  /// Requires different places in plan.
  virtual GroundAlong ground_along(const Position& a, const Position& b) const = 0;
  /// Whether the line leaves a into the ground right away.
  virtual bool starts_under_ground(const Position& a, const Position& b) const = 0;

  /// No ground that was read lies farther from a place than this, in plan.
  virtual double reach_m(const Position& from) const = 0;

  /// Tiles of a scene, and how many of them were read; 0 where there are none.
  virtual std::size_t tiles() const { return 0; }
  virtual std::size_t tiles_read() const { return 0; }
};

/// The ends of the only line that is asked for, as they are typed.
struct TypedLine {
  TypedPosition from, to;
  std::string crs;  ///< empty: the data's
};

/// @param line  of a scene only the tiles along it are read, or all where an end may lie over void
///              that they do not know (PartGround); all answers about it are those of the whole
///              scene. None: all
/// Throws Error: what a scene or a DEM throws; kUsage where options for reading a DEM are given
/// with a scene, or a scene is not alone.
std::unique_ptr<SightSurface> open_surface(const std::vector<std::string>& sources,
                                           const DemOptions& options, const Progress& progress,
                                           const std::optional<TypedLine>& line = {});

/// The surface of a source that is open already, for one thread at a time; it keeps the source.
/// Requires a source without obstacles. Cost: a millisecond.
std::unique_ptr<SightSurface> surface_over(std::shared_ptr<const ViewSource> source);

SurfaceNote note_of(const SightSurface& surface);

}  // namespace scarp
