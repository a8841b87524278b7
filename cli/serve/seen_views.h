#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "cli/eyes_raster.h"
#include "cli/serve/byte_cache.h"
#include "cli/serve/served_scenes.h"
#include "core/threads/progress.h"

namespace scarp {

/// A viewshed that was asked for, whole.
struct SeenView {
  const ServedScene* scene = nullptr;
  std::shared_ptr<const ViewSource> source;
  ViewshedOptions options;
  std::unique_ptr<EyesRaster> raster;
  nlohmann::json summary;   ///< of EyesRaster
  std::uint64_t known = 0;  ///< samples
  std::uint64_t seen = 0;   ///< of them, by any eye; in modes ground and dem those with a height
  double see_ms = 0;        ///< what it took
};

/// Viewsheds by their inputs: the last ones are kept, so that a picture, its numbers and its
/// download are one piece of work.
class SeenViews {
 public:
  SeenViews(std::size_t most_bytes, const ServeLimits& limits)
      : kept_(most_bytes), limits_(limits) {}

  /// @param inputs  of process viewshed, that its schema finds nothing wrong with
  /// Throws Refusal{413} where that is more than the limits allow, and what placing eyes throws.
  std::shared_ptr<const SeenView> look(const ServedScenes& scenes, const nlohmann::json& inputs,
                                       const Progress& progress);

  ByteCache<SeenView>::Counts counts() const { return kept_.counts(); }

 private:
  ByteCache<SeenView> kept_;
  const ServeLimits& limits_;
};

/// Throws Refusal{503} where the request's time is over or its client has left: after work within a
/// StopScope, before anybody believes it.
void require_not_stopped();

}  // namespace scarp
