#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "cli/compare/compared_job.h"
#include "tiles/store/part_folder.h"

namespace scarp {

/// What all jobs of a comparison share: what was compared, when on what, and how to repeat it.
struct ComparedRun {
  std::string title;
  std::map<std::string, std::string> facts;  ///< machine, versions, inputs with checksums, command
  std::vector<ComparedJob> jobs;
};

/// Machine, processors, compiler and versions.
std::map<std::string, std::string> machine_facts();

/// Points that no command of their own gives get the run's, which is the fact "command".
void name_commands(ComparedRun& run);

/// What the folder of a comparison holds, that another may replace.
inline constexpr char kComparisonName[] = "compare.json";

nlohmann::json to_json(const ComparedRun& run);

/// Writes compare.html, which needs no other file and no network, compare.json, compare.csv (a line
/// a point and figure), and a picture for each chart, JOB-ERROR-by-COST.svg, and commits the
/// folder. Throws Error.
void write_comparison(const ComparedRun& run, PartFolder& folder);

}  // namespace scarp
