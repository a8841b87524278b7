#pragma once

#include <optional>
#include <string>
#include <vector>

namespace scarp {

/// An eye from a file: where it stands in the CRS of the data, and what its attributes say; what
/// they leave out is up to the run.
struct ObserverRecord {
  double x = 0;
  double y = 0;
  std::string name;                   ///< "name"; empty: none
  std::optional<double> height_m;     ///< "height": above ground
  std::optional<double> elevation_m;  ///< "elevation": above the height datum, instead of height
  std::optional<double> target_height_m;                      ///< "target_height"
  std::optional<double> min_distance_m, max_distance_m;       ///< "min_distance", "max_distance"
  std::optional<double> azimuth_from_deg, azimuth_to_deg;     ///< "azimuth_from", "azimuth_to"
  std::optional<double> pitch_lowest_deg, pitch_highest_deg;  ///< "pitch_low", "pitch_high"
};

/// Reads the points of every layer of a file that OGR reads, in order; of tables without geometry
/// the columns x and y, lon and lat, or longitude and latitude. Attributes are found by
/// the names above, in any case; "radius" is another name of max_distance. A height of the
/// geometry itself is not used.
/// @param data_crs_wkt  what points are converted to; empty: they are taken as they are
/// @param crs           of layers that declare none (any text that PROJ understands); empty: the
///                      data's
///
/// Throws Error{kInput} with one line where the file cannot be read, holds no point or something
/// else than points, an attribute is no number, or a point cannot be converted.
std::vector<ObserverRecord> read_observers(const std::string& file, const std::string& data_crs_wkt,
                                           const std::string& crs);

}  // namespace scarp
