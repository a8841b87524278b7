#include "cli/build/step_run.h"

namespace scarp {

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
                 {"warnings", source.dem().warnings}};
  });
  run.check_sources();
}

}  // namespace scarp
