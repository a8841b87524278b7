#include "cli/serve/seen_views.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "cli/serve/problem.h"
#include "cli/serve/process.h"
#include "core/threads/stop.h"

namespace scarp {
namespace {

using nlohmann::json;

DegreeRange range_of(const json& inputs, const char* name) {
  if (!inputs.contains(name)) return {};
  return std::pair(inputs[name][0].get<double>(), inputs[name][1].get<double>());
}

ViewshedMode mode_of(const json& inputs) {
  const std::string mode = inputs.value("mode", "visible");
  return mode == "count"    ? ViewshedMode::kCount
         : mode == "ground" ? ViewshedMode::kGround
         : mode == "dem"    ? ViewshedMode::kDem
                            : ViewshedMode::kVisible;
}

Accuracy accuracy_of(const json& inputs) {
  const std::string accuracy = inputs.value("accuracy", "exact");
  return accuracy == "high"   ? Accuracy::kHigh
         : accuracy == "fast" ? Accuracy::kFast
                              : Accuracy::kExact;
}

ViewshedOptions options_of(const ServedScene& scene, const json& inputs) {
  ViewshedOptions options;
  options.sources = {scene.path()};
  options.mode = mode_of(inputs);
  options.accuracy = accuracy_of(inputs);
  options.target_height_m = inputs.value("target_height_m", 0.0);
  options.min_distance_m = inputs.value("min_distance_m", 0.0);
  if (inputs.contains("max_distance_m"))
    options.max_distance_m = inputs["max_distance_m"].get<double>();
  options.azimuth_deg = range_of(inputs, "azimuth");
  options.pitch_deg = range_of(inputs, "pitch");
  if (options.max_distance_m && options.min_distance_m > *options.max_distance_m)
    throw Refusal(400, fmt::format("inputs.min_distance_m: {} is greater than max_distance_m, {}; "
                                   "nothing lies between",
                                   options.min_distance_m, *options.max_distance_m));
  if (options.pitch_deg && options.pitch_deg->first > options.pitch_deg->second)
    throw Refusal(400, "inputs.pitch: the lowest comes first");
  for (const json& observer : inputs["observers"])
    options.observers.push_back(scene.in_data(position_of(observer)));
  return options;
}

void check_cells(const ServedScene& scene, const ViewshedOptions& options,
                 const ServeLimits& limits) {
  const GroundGrid& grid = scene.source().samples();
  const double all = static_cast<double>(grid.columns()) * static_cast<double>(grid.rows());
  double of_eye = all;
  if (options.max_distance_m)
    of_eye = std::min(all, std::pow(2 * *options.max_distance_m / scene.cell_m() + 1, 2));
  const double cells = of_eye * static_cast<double>(options.observers.size());
  if (cells > static_cast<double>(limits.cells))
    throw Refusal(413,
                  fmt::format("{} eyes would look at {:.3g} cells; {:.3g} are the most; give "
                              "a smaller max_distance_m or fewer observers",
                              options.observers.size(), cells, static_cast<double>(limits.cells)));
}

void count_up(SeenView& view) {
  const EyesRaster& raster = *view.raster;
  view.summary = raster.summary();
  const json& s = view.summary;
  view.known = view.source->known_samples();
  if (s.contains("visible_samples"))
    view.seen = s["visible_samples"];
  else if (s.contains("seen_samples"))
    view.seen = s["seen_samples"];
  else
    view.seen = raster.heights_m().size() - s["unknown_samples"].get<std::size_t>();
}

}  // namespace

std::shared_ptr<const SeenView> SeenViews::look(const ServedScenes& scenes, const json& inputs,
                                                const Progress& progress) {
  const std::string name = inputs.dump();
  if (auto kept = kept_.find(name)) return kept;
  const auto begun = std::chrono::steady_clock::now();
  const ServedScene& scene = scenes.require(inputs["scene"].get<std::string>());
  auto view = std::make_shared<SeenView>();
  view->scene = &scene;
  view->options = options_of(scene, inputs);
  check_cells(scene, view->options, limits_);
  std::optional<double> refraction;
  if (inputs.contains("refraction")) refraction = inputs["refraction"].get<double>();
  view->source = scene.source(refraction, view->options.accuracy);
  std::vector<RunEye> eyes;
  for (const TypedPosition& at : view->options.observers)
    eyes.push_back(eye_at(at, view->options, *view->source));
  view->raster = std::make_unique<EyesRaster>(*view->source, view->options);
  view->raster->see(std::move(eyes), progress, {});
  require_not_stopped();
  count_up(*view);
  view->see_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begun).count();
  const GroundGrid& grid = view->source->samples();
  const std::size_t samples =
      static_cast<std::size_t>(grid.columns()) * static_cast<std::size_t>(grid.rows());
  const bool is_wide = view->options.mode != ViewshedMode::kVisible;
  // A view keeps the source that it was seen in, which may be there for its sake only.
  constexpr std::size_t kSourceBytesPerSample = 5;
  const bool is_own_source = view->source != scene.source({});
  kept_.put(name, view,
            samples * ((is_wide ? 4 : 1) + (is_own_source ? kSourceBytesPerSample : 0)));
  return view;
}

void require_not_stopped() {
  if (stop_asked())
    throw Refusal(503,
                  "it takes longer than an answer may; ask for less, or with the header "
                  "Prefer: respond-async");
}

}  // namespace scarp
