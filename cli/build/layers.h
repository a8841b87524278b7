#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/occlusion/groups.h"
#include "core/sight/tin_index.h"
#include "core/terrain/ground_grid.h"
#include "core/terrain/sample_grid.h"
#include "core/terrain/tile_scheme.h"
#include "core/threads/progress.h"
#include "ingest/dem/dem.h"
#include "tiles/layers/geopackage.h"
#include "tiles/layers/geotiff.h"

namespace scarp {

/// Values of layers/groups.tif that are no group.
inline constexpr std::int32_t kOrphanValue = -1;
inline constexpr std::int32_t kVoidGroupValue = -9999;

/// Values of layers/viewshed.tif.
inline constexpr std::uint8_t kHiddenValue = 0;
inline constexpr std::uint8_t kVisibleValue = 1;
inline constexpr std::uint8_t kUnknownValue = 255;

/// The triangle under each sample, kNone where there is none. [rows * columns]
/// A border sample of a bent grid may lie a fraction of a cell outside the mesh: it then has the
/// triangle that is nearest inwards.
std::vector<TriangleIndex> triangle_of_samples(const SampleGrid& grid, const TinIndex& index);

/// Group of each sample, kOrphanValue, or kVoidGroupValue. [rows * columns]
std::vector<std::int32_t> group_of_samples(const std::vector<TriangleIndex>& triangle_of_sample,
                                           const Groups& groups);

/// What an eye sees of the TIN at each sample, by the judge, as `scarp viewshed SCENE` has it.
/// Targets stand on the TIN, rounded up to the lattice. Side: a target is never lower than the
/// ground, by at most two lattice steps higher.
/// @param raster  places of all samples of the raster, of which the window's are asked for
/// @return [window.rows * window.columns] of the values above
std::vector<std::uint8_t> viewshed_of_samples(const GroundGrid::Placement& raster,
                                              std::int32_t raster_columns, const TileWindow& window,
                                              const TinIndex& index, const Position& eye,
                                              const Progress& progress);

/// Outlines of the groups in map coordinates, with what the polygons layer tells about each.
/// @param heights_m  of the vertices, above the datum of the data
std::vector<GroupPolygon> group_polygons(const Tin& tin, const Groups& groups,
                                         const std::vector<double>& heights_m,
                                         const GeoFrame& frame);

/// A layer over the DEM's samples, in its CRS.
RasterLayer layer_over(const Dem& dem, LayerSamples samples, const std::string& band_name);

}  // namespace scarp
