#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/accuracy.h"
#include "ingest/dem/dem.h"

namespace scarp {

/// What every command understands.
struct CommonOptions {
  bool json = false;
  bool overwrite = false;
  int threads = 0;                        ///< 0: all processors
  std::uint64_t memory_budget_bytes = 0;  ///< half of the machine's unless given
};

/// A position as typed: "X,Y[,H]", H in metres above ground (2 unless given) or "1200asl", above
/// the height datum of the data.
struct TypedPosition {
  double x = 0;
  double y = 0;
  double height_m = 2;
  bool above_datum = false;
  std::string text;  ///< as typed, for messages
};

/// What guides the growth of groups.
enum class Growth { kHiddenTogether, kBreadthFirst };

/// What a scene is built to be culled by.
enum class Hiding {
  kCertified,  ///< regions that are never wrong on the unsafe side
  kStewart,    ///< horizons of the vertices, as published
  kBoth,
};
inline bool has_certified(Hiding hiding) {
  return hiding != Hiding::kStewart;
}
inline bool has_stewart(Hiding hiding) {
  return hiding != Hiding::kCertified;
}

/// What certified regions may cost.
struct Budget {
  std::optional<double> seconds;             ///< of certifying, on this machine
  std::optional<double> bytes_per_triangle;  ///< of what is stored
};

inline constexpr std::int32_t kDefaultTileSamples = 1024;

struct BuildOptions {
  CommonOptions common;
  Accuracy accuracy = Accuracy::kExact;
  DemOptions dem;
  std::vector<std::string> dem_files;
  std::string scene;
  std::optional<double> max_error_m;
  std::optional<std::uint32_t> vertices;
  std::string footprints_file;
  std::string footprints_height_field = "height";
  Hiding horizon = Hiding::kCertified;
  /// Of certified regions where there are any: as many as kCertifiedBytes hold; of horizons
  /// otherwise: 16.
  std::optional<int> sectors;
  std::optional<int> subsectors;  ///< of horizons; 4
  std::optional<int> fans;        ///< of certified regions
  std::optional<double> patch;    ///< of certified regions
  Budget budget;                  ///< of certified regions
  Growth growth = Growth::kHiddenTogether;
  int group_triangles = 128;
  std::uint32_t min_group_triangles = 30;
  std::optional<std::uint32_t> seeds;  ///< breadth-first only
  std::uint32_t max_groups = 0;        ///< breadth-first only; 0: no limit
  std::uint64_t seed = 1;
  std::optional<TypedPosition> observer;
  std::string crs;  ///< of the observer; empty: the data's
  /// Cells along a side of a tile of the finest level, a power of two.
  std::int32_t tile_samples = kDefaultTileSamples;
  bool outlines = false;            ///< layers/groups.gpkg in scenes of several tiles too
  bool resume = false;              ///< go on where a build was stopped
  std::string plan_file;            ///< empty: none
  std::optional<std::size_t> step;  ///< of the plan: do this one only
};

enum class ViewshedMode { kVisible, kCount, kGround, kDem };

struct ViewshedOptions {
  CommonOptions common;
  Accuracy accuracy = Accuracy::kExact;
  DemOptions dem;
  std::vector<std::string> sources;    ///< a scene, or DEM files
  std::vector<std::string> obstacles;  ///< a surface model that blocks instead; may be empty
  std::string output;
  std::string polygons;  ///< a GeoPackage of what is seen; empty: none
  std::vector<TypedPosition> observers;
  std::string observers_file;
  std::string each_folder;  ///< a raster for each eye goes here
  std::string crs;          ///< of the observers; empty: the data's
  ViewshedMode mode = ViewshedMode::kVisible;
  double target_height_m = 0;
  double min_distance_m = 0;
  std::optional<double> max_distance_m;
  std::optional<std::pair<double, double>> azimuth_deg;  ///< from, to, clockwise from north
  std::optional<std::pair<double, double>> pitch_deg;    ///< lowest, highest
  bool gdal_values = false;                              ///< 255 visible, 0 hidden
  bool total = false;            ///< how much ground each sample sees, instead of eyes
  double eye_height_m = 2;       ///< of all eyes of --total, above ground
  std::uint64_t samples = 1000;  ///< of the ground, that --total looks for
  std::uint64_t seed = 1;        ///< that chooses them
};

struct SightOptions {
  CommonOptions common;
  DemOptions dem;
  std::vector<std::string> sources;  ///< a scene, or DEM files
  TypedPosition from, to;
  std::string crs;  ///< of both; empty: the data's
  std::optional<double> frequency_hz;
  std::string output;  ///< .svg or .json; empty: none
};

struct HorizonOptions {
  CommonOptions common;
  DemOptions dem;
  std::vector<std::string> sources;  ///< a scene, or DEM files
  std::optional<TypedPosition> at;
  std::string crs;  ///< of `at`; empty: the data's
  std::optional<int> azimuths;
  std::string output;  ///< of a place .csv or .json, empty: standard output; of all points .tif

  // All points:
  double eye_height_m = 0;
  Accuracy accuracy = Accuracy::kExact;
  std::optional<double> tolerance_deg;  ///< between bounds; that of the accuracy unless given
  bool estimate_only = false;
  std::string distance_output, sky_view_output, openness_output, negative_openness_output;
  std::optional<double> sun_days;  ///< since 2000-01-01T12:00 UTC
  std::string sun_text;            ///< as typed

  bool of_all_points() const { return !at; }
};

struct CullOptions {
  CommonOptions common;
  std::string scene;
  TypedPosition camera;
  std::string method;  ///< empty: certified where the scene has it, or thesis
  std::string crs;
  std::optional<double> azimuth_deg;  ///< of the view's middle; none: all around
  double field_of_view_deg = 90;
  std::optional<double> max_distance_m;
  std::string entities_file;  ///< points whose sight is asked for instead of groups; empty: none
  double entity_radius_m = 2;
  double entity_height_m = 2;  ///< of their tops, above ground
  double within_m = 0;         ///< how far the camera may be from where it is said to be
};

struct VerifyOptions {
  CommonOptions common;
  std::string scene;
  int eyes = 8;
  std::vector<double> heights_m = {2, 50, 300, 1000};
  std::uint64_t seed = 1;
};

struct CompareOptions {
  CommonOptions common;
  DemOptions dem;
  std::vector<std::string> sources;  ///< a scene, or DEM files
  std::string output;                ///< folder
  int eyes = 4;
  std::vector<double> heights_m = {2, 50, 300, 1000};
  std::uint64_t seed = 1;
  double limit_s = 300;
};

struct FlyOptions {
  CommonOptions common;
  std::string scene;
  std::string output;     ///< folder
  std::string path_file;  ///< empty: a path is found
  std::string route = "walk";
  int frames = 120;
  std::uint64_t seed = 1;
  std::vector<std::string> methods;  ///< empty: all that the scene has
  int width_px = 640;
  double field_of_view_deg = 45;  ///< vertical
  int pictures = 2;               ///< frames that are kept as pictures
  int movers = 0;                 ///< vehicles and aircraft
  std::uint32_t changes = 0;      ///< groups that come and go every few frames
  double refine_px = 0;           ///< 0: not drawn with refinement
  std::uint64_t budget = 0;       ///< 0: not drawn within a budget
};

struct PreviewCommandOptions {
  CommonOptions common;
  std::string scene;
  std::string output;
  std::optional<TypedPosition> camera;  ///< none: from above
  std::optional<TypedPosition> target;
  bool three_d = false;                   ///< from the default camera
  std::optional<TypedPosition> observer;  ///< what it does not see is drawn as wireframe
  std::string crs;
  int width_px = 1600;
};

/// What the server may be asked for; beyond it requests are refused.
struct ServeLimits {
  double time_s = 30;                 ///< of an answer that is waited for
  double job_time_s = 600;            ///< of a job
  std::uint64_t cells = 100'000'000;  ///< of a viewshed: of all eyes together
  double max_distance_m = 500'000;
  std::size_t waiting = 128, waiting_of_client = 32;
  std::size_t jobs = 100, running_jobs = 16;
  std::uint64_t cache_bytes = 128 << 20;  ///< of tiles and of viewsheds, together
};

struct ServeOptions {
  CommonOptions common;
  DemOptions dem;
  std::vector<std::string> sources;  ///< scenes and DEM files, each a scene of its own
  std::string host = "127.0.0.1";
  int port = 8080;
  std::string page_folder;            ///< empty: where the program was installed
  std::string cors_origin;            ///< empty: none
  std::vector<std::string> tilesets;  ///< NAME=FOLDER, 3D Tiles of a scene
  ServeLimits limits;
};

struct CheckOptions {
  CommonOptions common;
  std::string scene;
};

struct ExportOptions {
  CommonOptions common;
  std::string scene;
  std::string output;  ///< a folder
  std::string to;      ///< name of an exporter (export.h)
  // vdb:
  std::optional<TypedPosition> observer;
  std::string crs;  ///< of the observer; empty: the scene's
  std::vector<double>
      altitudes_m;               ///< above ground, where bands end; empty: those of export_vdb.cc
  std::optional<double> cell_m;  ///< side of a view cell
  double keep = 0.95;            ///< of the members of sets, where cells share one
  bool compress = false;         ///< 3dtiles
  /// ugrid: what the scene was built from, for the error of each triangle; may be empty.
  std::vector<std::string> dem_files;
};

/// Reads "X,Y[,H]". Throws Error{kUsage}.
TypedPosition parse_position(const std::string& text);

/// Reads "A,B", two numbers. Throws Error{kUsage} that names the option.
std::pair<double, double> parse_range(const std::string& option, const std::string& text);

/// Reads "5.8GHz", "868MHz", "2.4e9" and the like as hertz. Throws Error{kUsage}.
double parse_frequency(const std::string& text);

/// Reads a moment such as 2026-06-21T12:00Z, 2026-06-21T14:00:30+02:00, as days since
/// 2000-01-01T12:00 UTC. Throws Error{kUsage}.
double parse_moment(const std::string& text);

/// The typed place in the CRS of the data, converted from `crs` where that is given; its height as
/// typed. Throws Error{kInput}.
MapPoint to_map_point(const TypedPosition& typed, const std::string& crs, const GeoFrame& frame);

/// Reads "10s", "5min" or "1h", or "4B/triangle", into what it limits. Throws Error{kUsage}.
void take_budget(const std::string& text, Budget& budget);

/// Reads "10s", "5min" or "1h" as seconds, or nothing where it is not understood.
std::optional<double> parse_duration(const std::string& text);

/// Reads "2GiB", "512M", "1000000" and the like as bytes. Throws Error{kUsage}.
std::uint64_t parse_bytes(const std::string& text);

}  // namespace scarp
