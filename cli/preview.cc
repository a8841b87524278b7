#include "core/raster/preview.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "cli/build/build_plan.h"
#include "cli/commands.h"
#include "cli/loaded_scene.h"
#include "cli/outputs.h"
#include "cli/picture_size.h"
#include "cli/scene_culling.h"
#include "core/culling/visible_groups.h"
#include "core/error/error.h"
#include "tiles/layers/png_image.h"

namespace scarp {
namespace {

/// The camera of --camera and --target, or the one that sees everything.
View perspective_view(const PreviewOptions& shape, const PreviewCommandOptions& options,
                      const LoadedScene& scene) {
  const Bounds bounds = bounds_of(scene.tin.vertices);
  if (!options.camera) return default_view(scene.tin.vertices, shape.width_px, shape.height_px);
  const GeoFrame::Placer placer(scene.frame);
  View view;
  view.eye = placer.place(resolve(*options.camera, options.crs, scene.frame, scene.index));
  if (options.target) {
    view.target = placer.place(resolve(*options.target, options.crs, scene.frame, scene.index));
  } else {
    view.target = {(bounds.low.x_m + bounds.high.x_m) / 2, (bounds.low.y_m + bounds.high.y_m) / 2,
                   (bounds.low.z_m + bounds.high.z_m) / 2};
  }
  if (view.eye == view.target)
    throw Error(ErrorCode::kInput,
                "--camera and --target are the same place; a direction to look in was expected; "
                "move one of them");
  view.vertical_field_of_view_rad = 50 * M_PI / 180;
  return view;
}

}  // namespace

int run_preview(const PreviewCommandOptions& options) {
  // What an observer does not see is known of the finest level only.
  ScenePart part{options.common.memory_budget_bytes};
  if (!options.observer) part.most_triangles = kMostPreviewTriangles;
  const LoadedScene scene(options.scene, part);
  const std::vector<double> heights_m = vertex_heights_m(scene.tin, scene.frame);
  PreviewOptions shape;
  shape.width_px = options.width_px;
  shape.heights_m = heights_m;
  std::vector<std::uint8_t> culled;
  if (options.observer) {
    const MapPoint at = resolve(*options.observer, options.crs, scene.frame, scene.index);
    shape.eye = GeoFrame::Placer(scene.frame).place(at);
    culled = culled_triangles(scene.groups, culling_method(scene, "")->visible({*shape.eye, {}}));
    shape.culled = culled;
  }
  const bool perspective = options.three_d || options.camera;
  double exaggeration = 1;
  Picture picture;
  if (perspective) {
    shape.height_px = shape.width_px * 9 / 16;
    const View view = perspective_view(shape, options, scene);
    exaggeration = view.vertical_exaggeration;
    picture = preview_3d(scene.tin, scene.groups, view, shape);
  } else {
    fit_to(bounds_of(scene.tin.vertices), shape);
    picture = preview_from_above(scene.tin, scene.groups, shape);
  }
  write_png(options.output, picture.width_px, picture.height_px, picture.rgb,
            existing(options.common));
  if (options.common.json) {
    const nlohmann::json result = {{"picture", options.output},
                                   {"width_px", picture.width_px},
                                   {"height_px", picture.height_px},
                                   {"level", scene.level},
                                   {"vertical_exaggeration", exaggeration}};
    fmt::print("{}\n", result.dump(2));
  } else {
    fmt::print(
        "{}: {} x {} pixels{}\n", options.output, picture.width_px, picture.height_px,
        exaggeration == 1 ? "" : fmt::format(", heights {:.1f} times exaggerated", exaggeration));
  }
  return 0;
}

}  // namespace scarp
