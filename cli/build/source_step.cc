#include <fmt/format.h>

#include "cli/build/step_run.h"

namespace scarp {
namespace {

std::vector<std::string> warnings_of(const BuildPlan& plan, const Dem& dem) {
  std::vector<std::string> warnings = dem.warnings;
  const char* option = option_for_one_tile(plan.options);
  if (option != nullptr && plan.scheme.tile_samples() > plan.options.tile_samples)
    warnings.push_back(fmt::format(
        "{} takes all {} x {} samples in one piece; leave it out for tiles of --tile-samples {}",
        option, dem.columns, dem.rows, plan.options.tile_samples));
  return warnings;
}

}  // namespace

void read_source(StepRun& run) {
  run.part("read", [&](const Progress& progress) {
    const DemWindows source = run.open_source();
    nlohmann::json inputs = nlohmann::json::array();
    for (const DemSource& read : source.check(progress))
      inputs.push_back({{"name", read.name},
                        {"size", read.size_bytes},
                        {"samples", read.samples},
                        {"xxh3", read.checksum}});
    run.facts = {{"inputs", std::move(inputs)},
                 {"height_unit", source.dem().height_unit},
                 {"warnings", warnings_of(run.plan(), source.dem())}};
  });
  run.check_sources();
}

}  // namespace scarp
