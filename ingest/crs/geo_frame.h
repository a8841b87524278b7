#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>

#include "core/geodesy/earth_frame.h"
#include "core/geodesy/position.h"

namespace scarp {

/// kEllipsoid: positions go to ECEF on the CRS's own ellipsoid and are flattened.
/// kFlat: map coordinates times their linear unit, nothing else.
enum class Earth { kEllipsoid, kFlat };

/// All that is needed to place a map coordinate in the scene's flattened frame, again and again
/// with the same bits.
struct FrameDescription {
  std::string crs_wkt;  ///< WKT2; empty where the data have no CRS
  Earth earth = Earth::kEllipsoid;
  double refraction = 0;   ///< k in [0, 1]
  std::string geoid_file;  ///< undulation raster; empty: heights are taken as ellipsoidal
  double centre_x = 0;     ///< the scene's centre in CRS units
  double centre_y = 0;
};

/// A place in map coordinates (CRS units, x east or longitude) and its height in metres above the
/// height datum of the data: the geoid where one is given, otherwise the ellipsoid.
struct MapPoint {
  double x = 0;
  double y = 0;
  double height_m = 0;
};

/// Longitude and latitude in degrees on the datum of the data.
struct GeodeticPoint {
  double longitude_deg = 0;
  double latitude_deg = 0;
};

/// The undulation raster of a geoid, read once. Bilinear between its samples.
class Geoid;

/// Places points of one scene. Immutable and shared; `Placer` does the work, one for each thread,
/// because PROJ's objects belong to one thread.
/// Accuracy: PROJ's conversion without any change of datum, GeographicLib's ECEF (nanometres),
/// the lattice (0.12 mm in each coordinate).
class GeoFrame {
 public:
  /// Throws Error{kInput} where the CRS cannot be placed on the Earth, a flat frame is asked for
  /// in degrees, the refraction is outside [0, 1] or the geoid cannot be read.
  explicit GeoFrame(const FrameDescription& description);
  ~GeoFrame();

  const FrameDescription& description() const { return description_; }
  bool is_geographic() const { return geographic_; }
  /// The ellipsoid and the frame on it, for what core computes on the Earth; nothing where flat.
  std::optional<EarthFrame> earth_frame() const;

  class Placer {
   public:
    explicit Placer(const GeoFrame& frame);
    ~Placer();
    Placer(Placer&&) noexcept;

    /// Lattice positions of map points. Throws Error{kInput} for points that the CRS cannot place
    /// or that lie more than 87 degrees from the centre.
    void place(std::span<const MapPoint> points, std::span<Position> positions) const;
    Position place(const MapPoint& point) const;
    /// The same before rounding to the lattice.
    Position place_unrounded(const MapPoint& point) const;

    /// The inverse, for what leaves the program.
    MapPoint unplace(const Position& p) const;

    /// Requires an ellipsoidal frame.
    GeodeticPoint geodetic(double x, double y) const;

    /// Undulation that place adds to heights at a map point, metres; 0 without a geoid.
    double undulation_m(double x, double y) const;

    /// Direction in the flattened plane, radians counter-clockwise from +x, in which an azimuth
    /// leaves a point: degrees clockwise from true north, from grid north in a flat frame.
    double plane_direction_rad(const MapPoint& from, double azimuth_deg) const;

   private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
  };

 private:
  struct Datum;
  FrameDescription description_;
  bool geographic_ = false;
  double metres_per_unit_ = 1;  // flat frames
  std::unique_ptr<Geoid> geoid_;
  std::unique_ptr<Datum> datum_;  // ellipsoidal frames
};

/// Conversion of map coordinates between two CRSs (any text that PROJ understands, such as
/// "OGC:CRS84"), in the order x (east, longitude), y, with the change of datum between them.
/// Heights are left alone. For one thread at a time, because PROJ's objects belong to one; to make
/// one takes a millisecond, to use it a microsecond.
class CoordinateConversion {
 public:
  /// Throws Error{kInput} where a CRS is not known.
  CoordinateConversion(const std::string& from_crs, const std::string& to_crs);
  ~CoordinateConversion();
  CoordinateConversion(CoordinateConversion&&) noexcept;

  /// Nothing where a point has no place in the other CRS.
  std::optional<MapPoint> forwards(const MapPoint& point) const;
  std::optional<MapPoint> back(const MapPoint& point) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// One point. Throws Error{kInput}.
MapPoint convert_coordinates(const std::string& from_crs, const std::string& to_crs,
                             const MapPoint& point);

}  // namespace scarp
