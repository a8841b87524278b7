#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <functional>
#include <map>
#include <new>

#include "cli/build/certified_settings.h"
#include "cli/commands.h"
#include "cli/export.h"
#include "cli/stage_clock.h"
#include "core/error/error.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Lets an option be typed as X,Y[,H]; CLI11 would split it at commas otherwise.
std::function<void(const std::string&)> position_into(std::optional<TypedPosition>& position) {
  return [&position](const std::string& text) { position = parse_position(text); };
}

void add_common(CLI::App& command, CommonOptions& common) {
  command.add_flag("--json", common.json, "Print the result as JSON");
  command.add_option("--threads", common.threads, "Threads to use; all processors unless given")
      ->check(CLI::Range(1, 4096));
  command.add_option_function<std::string>(
      "--memory",
      [&common](const std::string& text) { common.memory_budget_bytes = parse_bytes(text); },
      "Memory budget, such as 2GiB; half of the machine's unless given");
  command.add_flag("--overwrite", common.overwrite, "Replace an output that exists");
}

void add_surface(CLI::App& command, DemOptions& dem) {
  command
      .add_option_function<std::string>(
          "--earth",
          [&dem](const std::string& text) {
            dem.earth = text == "flat" ? Earth::kFlat : Earth::kEllipsoid;
          },
          "ellipsoid or flat; ellipsoid where the DEM has a CRS")
      ->check(CLI::IsMember({"ellipsoid", "flat"}));
  command.add_option("--refraction", dem.refraction,
                     "Refraction coefficient, 0 to 1: 0.13 light, 0.25 radio; 0 unless given");
  command.add_option("--geoid", dem.geoid_file,
                     "Raster of geoid undulations to add; without it heights are taken as "
                     "ellipsoidal");
  command.add_option("--height-unit", dem.height_unit, "m, ft or us-ft, over what the DEM says");
  command.add_option("--nodata", dem.nodata, "A value that stands for void, besides the DEM's own");
}

/// @param what  high and fast are for the command
void add_accuracy(CLI::App& command, Accuracy& accuracy, const std::string& what) {
  command
      .add_option(
          "--accuracy", accuracy,
          "exact, high or fast, where other options leave it open; exact unless given. " + what)
      ->transform(CLI::CheckedTransformer(std::map<std::string, Accuracy>{
          {"exact", Accuracy::kExact}, {"high", Accuracy::kHigh}, {"fast", Accuracy::kFast}}));
}

void add_build(CLI::App& app, BuildOptions& o, std::function<int()>& run) {
  CLI::App* c = app.add_subcommand("build", "Build a scene from one DEM or several");
  c->footer(
      "Example:\n  scarp build alps.tif -o alps.scene --max-error 5\n"
      "Several DEMs that share their cells make one mosaic; later ones lie on top.\n"
      "A build that was stopped goes on with the same command and --resume. For a queue of jobs:\n"
      "  scarp build alps.tif -o alps.scene --plan plan.json   # writes the steps, does none\n"
      "  scarp build --plan plan.json --step 7                 # does one, in the order it allows");
  auto* dem = c->add_option("dem", o.dem_files, "Any rasters that GDAL reads");
  auto* output = c->add_option("-o,--output", o.scene, "The scene, a new folder");
  auto* error = c->add_option("--max-error", o.max_error_m,
                              "Greatest height error of the mesh over its whole surface, metres; "
                              "a tenth of the cell size unless given");
  add_accuracy(*c, o.accuracy,
               "high and fast: meshes of a quarter and a whole cell's error, a half and a quarter "
               "of the fans; what is culled is certified at each");
  c->add_option("--vertices", o.vertices, "Mesh to this many vertices instead")
      ->excludes(error)
      ->check(CLI::Range(4U, 400'000'000U));
  c->add_option("--footprints", o.footprints_file, "Building polygons, any source that OGR reads");
  c->add_option("--height-field", o.footprints_height_field,
                "Field of --footprints with heights above ground, metres; height unless given");
  c->add_option("--horizon", o.horizon,
                "certified: regions that never cull what is visible; stewart: horizons of "
                "vertices, as published, faster, may cull what is visible; both; certified unless "
                "given")
      ->transform(
          CLI::CheckedTransformer(std::map<std::string, Hiding>{{"certified", Hiding::kCertified},
                                                                {"stewart", Hiding::kStewart},
                                                                {"both", Hiding::kBoth}}));
  c->add_option("--sectors", o.sectors,
                "Directions that are kept. Certified: a multiple of 8, as many as 16 bytes a "
                "triangle hold unless given; stewart: 16 unless given (and with both)")
      ->check(CLI::Range(4, 4096));
  c->add_option("--subsectors", o.subsectors,
                "Stewart: parts of a sector, the lowest counts; 4 unless given")
      ->check(CLI::Range(1, 64));
  c->add_option("--fans", o.fans,
                fmt::format("Certified: directions that are looked along, a multiple of 8; more "
                            "take longer and cull more; {} unless given",
                            HidingOptions{}.fans))
      ->check(CLI::Range(8, 65'536))
      ->check([](const std::string& text) {
        return std::atoi(text.c_str()) % 8 == 0 ? "" : text + " is not a multiple of 8";
      });
  c->add_option("--patch", o.patch,
                "Certified: size of what is looked at at once, in mean distances between vertices; "
                "greater is faster and culls less; 1 unless given")
      ->check(CLI::Range(0.125, 64.0));
  c->add_option_function<std::vector<std::string>>(
       "--budget",
       [&o](const std::vector<std::string>& texts) {
         for (const std::string& text : texts) take_budget(text, o.budget);
       },
       "Certified: what certifying may take, 10s, 5min, 1h on this machine, which chooses --fans; "
       "or "
       "what regions may take, 4B/triangle, which chooses --sectors; may be given for both. The "
       "choice is written to scene.json and report.json")
      ->allow_extra_args(false);
  c->add_option("--group-triangles", o.group_triangles,
                "Mean triangles of a group that is aimed at; 128 unless given")
      ->check(CLI::Range(2, 1'000'000));
  c->add_option("--min-group-triangles", o.min_group_triangles,
                "Groups below this are merged or set free; 30 unless given");
  c->add_option_function<std::string>(
       "--growth",
       [&o](const std::string& text) {
         o.growth = text == "breadth-first" ? Growth::kBreadthFirst : Growth::kHiddenTogether;
       },
       "hidden-together, from a sample of eyes, or breadth-first, as published, which needs "
       "--horizon stewart or both; hidden-together unless given")
      ->check(CLI::IsMember({"hidden-together", "breadth-first"}));
  c->add_option("--seeds", o.seeds,
                "Breadth-first: crystals sown in the first pass, over --group-triangles");
  c->add_option("--max-groups", o.max_groups,
                "Breadth-first: no more groups than this; 0: no limit");
  c->add_option(
      "--seed", o.seed,
      "Of the numbers that scatter eyes or crystals; the same seed repeats a run exactly");
  c->add_option_function<std::string>("--observer", position_into(o.observer),
                                      "Eye of layers/viewshed.tif, X,Y[,H]; 2 m above the highest "
                                      "sample unless given");
  c->add_option("--crs", o.crs, "CRS of --observer, such as OGC:CRS84; the DEM's unless given");
  c->add_option(
       "--tile-samples", o.tile_samples,
       fmt::format("Cells along a side of a tile, a power of two from 64 on; a DEM that is "
                   "no larger has one tile; {} unless given",
                   kDefaultTileSamples))
      ->check(CLI::Range(64, 1 << 20))
      ->check([](const std::string& text) {
        const int side = std::atoi(text.c_str());
        return (side & (side - 1)) == 0 ? "" : text + " is not a power of two";
      });
  c->add_flag("--outlines", o.outlines,
              "Write layers/groups.gpkg, the outlines of groups, in a scene of several tiles too, "
              "where it may take more bytes than the meshes; a scene of one tile always has it");
  auto* resume = c->add_flag("--resume", o.resume,
                             "Go on where a build with the same options was stopped; what it "
                             "finished is not done again");
  auto* plan =
      c->add_option("--plan", o.plan_file,
                    "Write the steps of the build to this file instead of doing them; with "
                    "--step, the file to read");
  plan->excludes(resume);
  c->add_option("--step", o.step, "Do this step of --plan, a number from 0 on")
      ->needs(plan)
      ->excludes(dem)
      ->excludes(output);
  add_surface(*c, o.dem);
  add_common(*c, o.common);
  c->callback([&] { run = [&o] { return run_build(o); }; });
}

void add_sources(CLI::App& command, std::vector<std::string>& sources) {
  command.add_option("source", sources, "A scene, or any rasters of heights that GDAL reads")
      ->required();
}

void add_viewshed(CLI::App& app, ViewshedOptions& o, std::function<int()>& run) {
  CLI::App* c =
      app.add_subcommand("viewshed", "What one eye or several see of a DEM or a scene, exactly");
  c->footer(
      "Example:\n  scarp viewshed alps.tif --observer 8.65,46.55,2 --crs OGC:CRS84 -o seen.tif\n"
      "1 visible, 0 hidden, 255 unknown (void). On the ellipsoid wherever the DEM has a CRS, in\n"
      "degrees too. Several DEMs that share their cells make one mosaic.");
  add_sources(*c, o.sources);
  c->add_option("-o,--output", o.output, "The raster of the answer, a cloud-optimised GeoTIFF")
      ->required();
  c->add_option_function<std::vector<std::string>>(
       "--observer",
       [&o](const std::vector<std::string>& texts) {
         for (const std::string& text : texts) o.observers.push_back(parse_position(text));
       },
       "An eye at X,Y[,H]: H metres above ground (2), or as 1200asl; may be repeated")
      ->allow_extra_args(false);
  c->add_option(
      "--observers", o.observers_file,
      "Eyes from points of any file that OGR reads. Attributes: name, height or elevation, "
      "target_height, max_distance (or radius), min_distance, azimuth_from, azimuth_to, "
      "pitch_low, pitch_high; the options hold for what is missing");
  c->add_option("--each", o.each_folder,
                "A folder for a raster of each eye besides: its name, or 0001.tif and so on");
  c->add_option("--crs", o.crs, "CRS of the observers, such as OGC:CRS84; the DEM's unless given");
  c->add_option("--target-height", o.target_height_m, "Metres above ground of what is looked for")
      ->check(CLI::Range(0.0, 100'000.0));
  constexpr double kLeastDistanceM = 1e-3, kMostDistanceM = 1e8;
  c->add_option("--max-distance", o.max_distance_m,
                "Metres along the ground. Of a scene of several tiles, tiles beyond it are neither "
                "read nor in the answer")
      ->check(CLI::Range(kLeastDistanceM, kMostDistanceM));
  c->add_option("--min-distance", o.min_distance_m, "Metres along the ground")
      ->check(CLI::Range(0.0, kMostDistanceM));
  c->add_option_function<std::string>(
      "--azimuth",
      [&o](const std::string& text) { o.azimuth_deg = parse_range("--azimuth", text); },
      "FROM,TO: degrees clockwise from true north (from grid north without a CRS)");
  c->add_option_function<std::string>(
      "--pitch", [&o](const std::string& text) { o.pitch_deg = parse_range("--pitch", text); },
      "LOWEST,HIGHEST: degrees above the level plane of the eye");
  c->add_option("--mode", o.mode,
                "visible: seen by an eye; count: by how many eyes; ground: least height above "
                "ground at which a target is seen, metres; dem: the same as elevation; visible "
                "unless given")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, ViewshedMode>{{"visible", ViewshedMode::kVisible},
                                              {"count", ViewshedMode::kCount},
                                              {"ground", ViewshedMode::kGround},
                                              {"dem", ViewshedMode::kDem}}));
  add_accuracy(*c, o.accuracy,
               "high: what bounds leave open is guessed between them, and a scene is seen as "
               "the raster of its heights; fast: so too, with every second sample");
  c->add_option("--obstacles", o.obstacles,
                "A surface model over the DEM's cells (trees, buildings) that blocks; what is seen "
                "is the DEM under it");
  c->add_option("--polygons", o.polygons,
                "A GeoPackage for the outlines of what is seen besides; in --mode count of what "
                "each number of eyes sees");
  c->add_flag("--total", o.total,
              "Instead of eyes: how much ground every sample sees, square kilometres");
  c->add_option("--eye-height", o.eye_height_m,
                "Metres above ground of the eyes of --total; 2 unless given")
      ->check(CLI::Range(0.0, 100'000.0));
  c->add_option("--samples", o.samples,
                "Samples of the ground that --total looks for, drawn at random; 1000 unless given, "
                "all and so exact where there are no more")
      ->check(CLI::PositiveNumber);
  c->add_option("--seed", o.seed, "Of the draw of --samples");
  c->add_flag("--gdal-values", o.gdal_values, "Write 255 for visible, as gdal_viewshed does");
  add_surface(*c, o.dem);
  add_common(*c, o.common);
  c->callback([&] { run = [&o] { return run_viewshed(o); }; });
}

void add_sight(CLI::App& app, SightOptions& o, std::function<int()>& run) {
  CLI::App* c = app.add_subcommand("sight", "Whether two places see each other, exactly");
  c->footer(
      "Examples:\n  scarp sight alps.tif --from 8.65,46.55,2 --to 8.9,46.7,20 --crs OGC:CRS84\n"
      "  scarp sight alps.tif --from 690000,158000,15 --to 702000,164000,30 --frequency 5.8GHz \\\n"
      "    -o link.svg\n"
      "Tells what blocks the line first, how clear it runs, and how high each end must be.");
  add_sources(*c, o.sources);
  c->add_option_function<std::string>(
       "--from", [&o](const std::string& text) { o.from = parse_position(text); },
       "The eye, X,Y[,H]: H metres above ground (2), or as 1200asl")
      ->required();
  c->add_option_function<std::string>(
       "--to", [&o](const std::string& text) { o.to = parse_position(text); },
       "The target, in the same way")
      ->required();
  c->add_option("--crs", o.crs, "CRS of both, such as OGC:CRS84; that of the data unless given");
  c->add_option_function<std::string>(
      "--frequency", [&o](const std::string& text) { o.frequency_hz = parse_frequency(text); },
      "Of a radio link, such as 5.8GHz: adds the clearance of the first Fresnel zone");
  c->add_option("-o,--output", o.output, "The profile as a picture, .svg, or as data, .json");
  add_surface(*c, o.dem);
  add_common(*c, o.common);
  c->callback([&] { run = [&o] { return run_sight(o); }; });
}

/// What is for all points of a DEM.
void add_all_horizons(CLI::App& command, HorizonOptions& o) {
  command
      .add_option("--eye-height", o.eye_height_m, "All points: metres above ground; 0 unless given")
      ->check(CLI::Range(0.0, 10'000.0));
  add_accuracy(command, o.accuracy,
               "All points: high has a --tolerance of 1 degree, fast of 3, and no bounds; a place "
               "is exact at each");
  command
      .add_option("--tolerance", o.tolerance_deg,
                  "All points: degrees by which a horizon's bounds may differ at most; 0.3 unless "
                  "given")
      ->check(CLI::Range(0.0, 10.0));
  command.add_flag("--estimate-only", o.estimate_only, "All points: leave the bounds out");
  command.add_option("--distance", o.distance_output,
                     "All points: a raster of the horizons' distances, metres along the ground");
  command.add_option("--sky-view", o.sky_view_output, "All points: a raster of sky view factors");
  command.add_option("--openness", o.openness_output,
                     "All points: a raster of positive openness, degrees");
  command.add_option("--negative-openness", o.negative_openness_output,
                     "All points: a raster of negative openness, degrees");
  command.add_option_function<std::string>(
      "--sun",
      [&o](const std::string& text) {
        o.sun_days = parse_moment(text);
        o.sun_text = text;
      },
      "All points: instead of horizons, what lies in the shadow that the ground casts at a time, "
      "such as 2026-06-21T12:00Z: 1 lit, 0 in shadow, 255 unknown");
}

void add_horizon(CLI::App& app, HorizonOptions& o, std::function<int()>& run) {
  CLI::App* c = app.add_subcommand(
      "horizon", "The horizon all around a place, or around each point of a DEM with bounds");
  c->footer(
      "Examples:\n  scarp horizon alps.tif --at 8.65,46.55,2 --crs OGC:CRS84 > horizon.csv\n"
      "  scarp horizon alps.tif -o horizons.tif --azimuths 32 --sky-view sky.tif\n"
      "  scarp horizon alps.tif -o shadow.tif --sun 2026-06-21T12:00Z\n"
      "Of a place, a line for each azimuth: the elevation angle under which the highest ground is\n"
      "seen, how far it is and where. Of all points, three bands for each azimuth: the angle, and\n"
      "bounds that it is between, in steps of 0.01 degree; -9000 no ground that way, -32768\n"
      "unknown. Angles are against the level plane of the eye, below it too.");
  add_sources(*c, o.sources);
  c->add_option_function<std::string>("--at", position_into(o.at),
                                      "The eye, X,Y[,H]: H metres above ground (2), or as 1200asl");
  c->add_option("--crs", o.crs, "CRS of --at, such as OGC:CRS84; that of the data unless given");
  c->add_option(
       "--azimuths", o.azimuths,
       "Directions, from north clockwise; 360 unless given, 16 for all points. True north, grid "
       "north without a CRS")
      ->check(CLI::Range(1, 1'000'000));
  c->add_option("-o,--output", o.output,
                "With --at a file, .csv or .json, standard output unless given; otherwise .tif");
  add_all_horizons(*c, o);
  add_surface(*c, o.dem);
  add_common(*c, o.common);
  c->callback([&] { run = [&o] { return run_horizon(o); }; });
}

void add_cull(CLI::App& app, CullOptions& o, std::function<int()>& run) {
  CLI::App* c = app.add_subcommand("cull", "Which groups a camera can see");
  c->footer(
      "Examples:\n  scarp cull alps.scene --camera 8.65,46.55,50 --crs OGC:CRS84 --json\n"
      "  scarp cull alps.scene --camera 8.65,46.55,50 --crs OGC:CRS84 --entities vehicles.csv");
  c->add_option("scene", o.scene, "A scene")->required();
  c->add_option_function<std::string>(
       "--camera", [&o](const std::string& text) { o.camera = parse_position(text); },
       "X,Y[,H]: H metres above ground, or as 1200asl")
      ->required();
  c->add_option("--crs", o.crs, "CRS of --camera, such as OGC:CRS84; the scene's unless given");
  c->add_option("--method", o.method,
                "thesis or certified; certified unless given where the scene was built with it")
      ->check(CLI::IsMember({"thesis", "certified"}));
  auto* azimuth = c->add_option("--azimuth", o.azimuth_deg,
                                "Direction of view, degrees clockwise from true north (from grid "
                                "north without a CRS); all around unless given");
  c->add_option("--field-of-view", o.field_of_view_deg, "Degrees; 90 unless given")
      ->needs(azimuth)
      ->check(CLI::Range(0.1, 179.0));
  c->add_option("--max-distance", o.max_distance_m,
                "Leave out groups beyond this, metres in plan; tiles beyond it are not read")
      ->check(CLI::PositiveNumber);
  auto* entities = c->add_option(
      "--entities", o.entities_file,
      "Points of any file that OGR reads: tell which can be seen at all, so that the rest can "
      "sleep. Attributes: name, height (of the top above ground) or elevation, radius; the options "
      "hold for what is missing");
  c->add_option("--entity-radius", o.entity_radius_m, "Metres; 2 unless given")
      ->needs(entities)
      ->check(CLI::Range(0.0, 10'000.0));
  c->add_option("--entity-height", o.entity_height_m,
                "Metres from the ground to the top; 2 unless given")
      ->needs(entities)
      ->check(CLI::Range(-1'000.0, 100'000.0));
  c->add_option("--within", o.within_m,
                "With --entities: the answer holds while the camera is this near to --camera along "
                "each axis, metres; 0 unless given")
      ->needs(entities)
      ->check(CLI::Range(0.0, 1e6));
  add_common(*c, o.common);
  c->callback([&] { run = [&o] { return run_cull(o); }; });
}

void add_verify(CLI::App& app, VerifyOptions& o, std::function<int()>& run) {
  CLI::App* c = app.add_subcommand("verify", "Judge the groups of a scene from random eyes");
  c->footer("Example:\n  scarp verify alps.scene --eyes 8 --heights 2,50,300,1000");
  c->add_option("scene", o.scene, "A scene")->required();
  c->add_option("--eyes", o.eyes, "Random eyes for each height; 8 unless given")
      ->check(CLI::Range(1, 1'000'000));
  c->add_option("--heights", o.heights_m, "Metres above ground; 2,50,300,1000 unless given")
      ->delimiter(',');
  c->add_option("--seed", o.seed, "Where the random eyes begin; 1 unless given");
  add_common(*c, o.common);
  c->callback([&] { run = [&o] { return run_verify(o); }; });
}

void add_compare(CLI::App& app, CompareOptions& o, std::function<int()>& run) {
  CLI::App* c = app.add_subcommand("compare", "Chart speed against accuracy on your terrain");
  c->footer(
      "Examples:\n  scarp compare alps.tif -o alps-compared --time 5min\n"
      "  scarp compare alps.scene -o alps-compared\n"
      "Of a DEM, in a square around its middle: viewsheds, least heights, horizons, meshes and\n"
      "groups, by every method and setting, GDAL and GRASS (where it is installed) among them,\n"
      "against the exact judge; flights over the groups with every culling method; and time and\n"
      "memory by size, of squares up to all of the DEM. Of a scene: its groups, prepared anew "
      "with\n"
      "several settings, and flights over them as they are.\n"
      "Writes compare.html (charts and tables), the charts as SVG, compare.csv and compare.json.\n"
      "What would not fit into the time is left out and named.");
  add_sources(*c, o.sources);
  c->add_option("-o,--output", o.output, "A new folder")->required();
  c->add_option("--eyes", o.eyes, "Random eyes for each height; 4 unless given")
      ->check(CLI::Range(1, 1'000'000));
  c->add_option("--heights", o.heights_m, "Metres above ground; 2,50,300,1000 unless given")
      ->delimiter(',');
  c->add_option("--seed", o.seed, "Where the random eyes begin; 1 unless given");
  c->add_option_function<std::string>(
      "--time",
      [&o](const std::string& text) {
        const auto seconds = parse_duration(text);
        if (!seconds)
          throw Error(
              ErrorCode::kUsage,
              fmt::format("--time {}: not understood; a time such as 90s or 5min was expected",
                          text));
        o.limit_s = *seconds;
      },
      "What it may take in all; 5min unless given");
  add_surface(*c, o.dem);
  add_common(*c, o.common);
  c->callback([&] { run = [&o] { return run_compare(o); }; });
}

void add_fly(CLI::App& app, FlyOptions& o, std::function<int()>& run) {
  CLI::App* c = app.add_subcommand("fly", "Fly a path with every culling method and compare them");
  c->footer(
      "Example:\n  scarp fly alps.scene --route walk -o flight\n"
      "Writes flight.html (charts and pictures), frames.csv and path.csv into the folder.");
  c->add_option("scene", o.scene, "A scene")->required();
  c->add_option("-o,--output", o.output, "A new folder")->required();
  auto* path = c->add_option("--path", o.path_file,
                             "A CSV file with a camera a line: x,y,height_m,azimuth_deg,pitch_deg");
  c->add_option("--route", o.route,
                "Find a path instead: walk or drive at 2 m along a valley's floor, "
                "street at 2 m through a town, helicopter at 100 m, airliner at 10 km; walk unless "
                "given")
      ->check(CLI::IsMember({"walk", "drive", "street", "helicopter", "airliner"}))
      ->excludes(path);
  c->add_option("--frames", o.frames, "Frames of a path that is found; 120 unless given")
      ->check(CLI::Range(1, 1'000'000))
      ->excludes(path);
  c->add_option("--seed", o.seed, "Where such a path begins; 1 unless given")->excludes(path);
  c->add_option("--methods", o.methods, "Some of them only, separated by commas")
      ->delimiter(',')
      ->check(CLI::IsMember({"frustum", "thesis", "certified", "swept", "cells", "law-tan", "hzb",
                             "mask", "mask-plain", "hom", "hom-0.7", "hybrid", "volume-scan",
                             "lod-query", "multi-frame", "stop-and-wait"}));
  c->add_option("--width", o.width_px, "Of the pictures, pixels, 16:9; 640 unless given")
      ->check(CLI::Range(16, 8192));
  c->add_option("--field-of-view", o.field_of_view_deg, "Vertical, degrees; 45 unless given")
      ->check(CLI::Range(1.0, 120.0));
  c->add_option("--movers", o.movers,
                "Vehicles and aircraft that move through the flight, some translucent; none unless "
                "given")
      ->check(CLI::Range(0, 10'000));
  c->add_option("--changes", o.changes,
                "Groups that are taken away or come back every ten frames; methods that prepared "
                "for the scene as it was do not fly; none unless given")
      ->check(CLI::Range(0, 1'000'000));
  c->add_option("--refine", o.refine_px,
                "Draw the answers with levels of detail too, refined until no place is off by more "
                "pixels, and nothing under the outline of what is nearer; not unless given")
      ->check(CLI::Range(0.01, 1000.0))
      ->excludes("--changes");
  c->add_option("--budget", o.budget,
                "Draw the answers with levels of groups too, in so many triangles a frame; not "
                "unless given")
      ->check(CLI::Range(1, 1'000'000'000))
      ->excludes("--changes");
  c->add_option("--pictures", o.pictures, "Frames that are kept as pictures; 2 unless given")
      ->check(CLI::Range(0, 1000));
  add_common(*c, o.common);
  c->callback([&] { run = [&o] { return run_fly(o); }; });
}

void add_preview(CLI::App& app, PreviewCommandOptions& o, std::function<int()>& run) {
  CLI::App* c = app.add_subcommand("preview", "Draw a scene as a picture");
  c->footer(
      "Examples:\n  scarp preview alps.scene -o alps.png\n"
      "  scarp preview alps.scene -o seen.png --observer 8.65,46.55,300 --crs OGC:CRS84");
  c->add_option("scene", o.scene, "A scene")->required();
  c->add_option("-o,--output", o.output, "The picture, PNG")->required();
  auto* three_d = c->add_flag("--3d", o.three_d, "In perspective, from a camera that sees it all");
  auto* camera = c->add_option_function<std::string>("--camera", position_into(o.camera),
                                                     "In perspective, from X,Y[,H]")
                     ->excludes(three_d);
  c->add_option_function<std::string>("--target", position_into(o.target),
                                      "What the camera looks at, X,Y[,H]; the middle unless given")
      ->needs(camera);
  c->add_option_function<std::string>("--observer", position_into(o.observer),
                                      "Draw what is culled for an eye at X,Y[,H] as wireframe");
  c->add_option("--crs", o.crs,
                "CRS of the positions, such as OGC:CRS84; the scene's unless given");
  c->add_option("--width", o.width_px, "Pixels; 1600 unless given")->check(CLI::Range(16, 16'384));
  add_common(*c, o.common);
  c->callback([&] { run = [&o] { return run_preview(o); }; });
}

void add_check(CLI::App& app, CheckOptions& o, std::function<int()>& run) {
  CLI::App* c = app.add_subcommand("check", "Verify checksums and invariants of a scene");
  c->footer("Example:\n  scarp check alps.scene");
  c->add_option("scene", o.scene, "A scene")->required();
  add_common(*c, o.common);
  c->callback([&] { run = [&o] { return run_check(o); }; });
}

void add_vdb_options(CLI::App& command, ExportOptions& o) {
  command.add_option_function<std::string>(
      "--observer", position_into(o.observer),
      "vdb: what an eye at X,Y[,H] sees of the airspace instead of view cells");
  command.add_option("--crs", o.crs,
                     "vdb: CRS of --observer, such as OGC:CRS84; the scene's unless given");
  command
      .add_option("--altitudes", o.altitudes_m,
                  "vdb: metres above the highest ground of a column where the bands of view cells "
                  "end; 10,25,50,100,200,400,700,1000 unless given. With --observer the last one "
                  "counts")
      ->delimiter(',')
      ->check(CLI::Range(0.0, 100'000.0));
  command
      .add_option("--cell", o.cell_m,
                  "vdb: side of a cell, metres; a 64th of the scene unless given, with --observer "
                  "a 128th")
      ->check(CLI::Range(0.1, 1e6));
  command
      .add_option("--keep", o.keep,
                  "vdb: where the set of a larger cell has this share of what smaller ones have, "
                  "it stands for theirs; 0.95 unless given, 1 leaves nothing out")
      ->check(CLI::Range(0.0, 1.0));
}

void add_export(CLI::App& app, ExportOptions& o, std::function<int()>& run) {
  CLI::App* c = app.add_subcommand("export", "Write a scene for simulators and GIS");
  c->footer(
      "Examples:\n  scarp export alps.scene --to 3dtiles -o alps-tiles\n"
      "  scarp export alps.scene --to groups -o alps-groups\n"
      "  scarp export alps.scene --to vdb -o alps-cells --altitudes 2,50,300,1000\n"
      "  scarp export alps.scene --to vdb -o alps-seen --observer 8.65,46.55,300 --crs OGC:CRS84");
  c->add_option("scene", o.scene, "A scene")->required();
  c->add_option("-o,--output", o.output, "A new folder")->required();
  std::string names;
  for (const Exporter& exporter : exporters())
    names += fmt::format("{}{}: {}", names.empty() ? "" : "; ", exporter.name, exporter.help);
  c->add_option("--to", o.to, names)->required()->check([](const std::string& text) {
    return find_exporter(text) != nullptr ? "" : text + " is not a format that is known";
  });
  add_vdb_options(*c, o);
  c->add_flag("--compress", o.compress,
              "3dtiles: meshes as EXT_meshopt_compression, a third of the bytes");
  c->add_option("--dem", o.dem_files,
                "ugrid: the DEMs that the scene was built from, for the error of each triangle; "
                "without them all have the greatest one");
  add_common(*c, o.common);
  c->callback([&] { run = [&o] { return run_export(o); }; });
}

void add_serve(CLI::App& app, ServeOptions& o, std::function<int()>& run) {
  CLI::App* c = app.add_subcommand("serve", "Answer over HTTP, with a page to look at");
  c->footer(
      "Example:\n  scarp serve alps.tif alps.scene\n"
      "  curl 'http://127.0.0.1:8080/scenes/alps/height?at=8.65,46.55'\n"
      "Each source is a scene of its own, by its file's name. Ends by SIGTERM or Ctrl-C.");
  c->add_option("sources", o.sources, "Scenes, and any rasters that GDAL reads")->required();
  c->add_option("--host", o.host,
                "Address to listen on; 127.0.0.1, this machine only, unless given");
  c->add_option("--port", o.port, "8080 unless given; 0: one that is free")
      ->check(CLI::Range(0, 65'535));
  c->add_option("--page", o.page_folder, "Folder of the page; the installed one unless given");
  c->add_option("--cors", o.cors_origin,
                "Let pages from this origin ask, such as https://maps.example; none unless given");
  c->add_option("--tileset", o.tilesets, "NAME=FOLDER: 3D Tiles of a scene, to be served with it")
      ->allow_extra_args(false);
  add_surface(*c, o.dem);
  ServeLimits& limits = o.limits;
  const auto seconds_into = [](double& seconds, const char* name) {
    return [&seconds, name](const std::string& text) {
      const auto given = parse_duration(text);
      if (!given)
        throw Error(
            ErrorCode::kUsage,
            fmt::format("{} {}: not understood; a time such as 10s, 5min or 1h was expected", name,
                        text));
      seconds = *given;
    };
  };
  c->add_option_function<std::string>("--time-limit", seconds_into(limits.time_s, "--time-limit"),
                                      "Of an answer that is waited for; 30s unless given");
  c->add_option_function<std::string>("--job-time-limit",
                                      seconds_into(limits.job_time_s, "--job-time-limit"),
                                      "Of a job; 10min unless given");
  c->add_option("--max-cells", limits.cells,
                "Cells that the eyes of one viewshed look at, together; 100000000 unless given");
  c->add_option("--max-radius", limits.max_distance_m,
                "Greatest distance of a viewshed, metres; 500000 unless given")
      ->check(CLI::Range(1.0, 1e7));
  c->add_option("--queue", limits.waiting,
                "Requests that may wait for their turn; 128 unless given")
      ->check(CLI::Range(1, 100'000));
  c->add_option("--queue-per-client", limits.waiting_of_client, "Of one client; 32 unless given")
      ->check(CLI::Range(1, 100'000));
  c->add_option_function<std::string>(
      "--cache", [&limits](const std::string& text) { limits.cache_bytes = parse_bytes(text); },
      "Memory for tiles and viewsheds that were asked for; 128MiB unless given");
  add_common(*c, o.common);
  c->callback([&] { run = [&o] { return run_serve(o); }; });
}

/// "Error: message" without line breaks, so that scripts can rely on one line.
int report(const std::string& message, int exit_code) {
  std::string line = message;
  std::replace(line.begin(), line.end(), '\n', ' ');
  fmt::print(stderr, "scarp: {}\n", line);
  return exit_code;
}

}  // namespace

int run_command_line(int argc, char** argv) {
  CLI::App app("What can be seen from where, on terrain.");
  app.set_version_flag("--version", "scarp " SCARP_VERSION);
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  BuildOptions build;
  CullOptions cull;
  VerifyOptions verify;
  CompareOptions compare;
  FlyOptions fly;
  PreviewCommandOptions preview;
  ViewshedOptions viewshed;
  SightOptions sight;
  HorizonOptions horizon;
  CheckOptions check;
  ExportOptions to;
  ServeOptions serve;
  std::function<int()> run;
  add_build(app, build, run);
  add_cull(app, cull, run);
  add_verify(app, verify, run);
  add_compare(app, compare, run);
  add_fly(app, fly, run);
  add_preview(app, preview, run);
  add_viewshed(app, viewshed, run);
  add_sight(app, sight, run);
  add_horizon(app, horizon, run);
  add_check(app, check, run);
  add_export(app, to, run);
  add_serve(app, serve, run);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    return report(fmt::format("{}; see scarp --help", e.what()), 2);
  } catch (const Error& e) {
    return report(e.what(), 2);
  }
  try {
    for (CommonOptions* common : {&build.common, &cull.common, &verify.common, &compare.common,
                                  &fly.common, &preview.common, &viewshed.common, &sight.common,
                                  &horizon.common, &check.common, &to.common, &serve.common}) {
      if (!common->memory_budget_bytes) common->memory_budget_bytes = machine_memory_bytes() / 2;
      if (common->threads) set_thread_count(common->threads);
    }
    return run();
  } catch (const Error& e) {
    return report(e.what(), e.code() == ErrorCode::kUsage ? 2 : 1);
  } catch (const std::bad_alloc&) {
    return report("out of memory; give a smaller DEM or a larger --max-error", 1);
  } catch (const std::exception& e) {
    return report(fmt::format("unexpected failure: {}", e.what()), 1);
  }
}

}  // namespace scarp
