#include "cli/build/workspace.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cassert>
#include <filesystem>
#include <fstream>

#include "cli/outputs.h"
#include "core/error/error.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

json to_json(const std::vector<StoredFile>& files) {
  json list = json::array();
  for (const StoredFile& file : files)
    list.push_back({file.name, file.kind, file.size, to_hex(file.checksum)});
  return list;
}

std::vector<StoredFile> files_from(const json& list) {
  std::vector<StoredFile> files;
  for (const json& file : list)
    files.push_back({file.at(0).get<std::string>(), file.at(1).get<std::string>(),
                     file.at(2).get<std::uint64_t>(),
                     checksum_from_hex(file.at(3).get<std::string>()).value()});
  return files;
}

json to_json(const StepRecord& record, const std::string& plan) {
  json stages = json::array();
  for (const StageCost& stage : record.stages)
    stages.push_back({stage.name, stage.seconds, stage.peak_bytes});
  return {{"plan", plan},
          {"inputs", to_json(record.inputs)},
          {"outputs", to_json(record.outputs)},
          {"facts", record.facts},
          {"stages", std::move(stages)},
          {"bytes_read", record.bytes_read},
          {"bytes_written", record.bytes_written}};
}

/// Nothing where there is no record. Throws Error{kInput} where it is of another plan: records are
/// written whole, so then other options or sources made it.
std::optional<StepRecord> record_from(const std::string& path, const BuildPlan& plan) {
  std::ifstream file(path);
  const json object = json::parse(file, nullptr, false);
  if (object.is_discarded()) return {};
  try {
    if (object.at("plan") != plan.fingerprint)
      throw Error(ErrorCode::kInput,
                  fmt::format("'{}': was begun with other options, or the DEM has changed since; "
                              "give the same ones, or leave --resume out and give --overwrite",
                              unfinished_scene(plan.options.scene)));
    StepRecord record;
    record.inputs = files_from(object.at("inputs"));
    record.outputs = files_from(object.at("outputs"));
    record.facts = object.at("facts");
    for (const json& stage : object.at("stages"))
      record.stages.push_back({stage.at(0).get<std::string>(), stage.at(1).get<double>(),
                               stage.at(2).get<std::uint64_t>()});
    record.bytes_read = object.at("bytes_read").get<std::uint64_t>();
    record.bytes_written = object.at("bytes_written").get<std::uint64_t>();
    return record;
  } catch (const json::exception&) {
    return {};
  }
}

bool is_there(const std::string& folder, const StoredFile& file) {
  struct stat status;
  return ::stat((folder + "/" + file.name).c_str(), &status) == 0 &&
         static_cast<std::uint64_t>(status.st_size) == file.size;
}

/// What a kill left of files that were being written.
void remove_parts(const std::string& folder) {
  std::vector<fs::path> parts;
  std::error_code failure;
  for (fs::recursive_directory_iterator i(folder, failure), end; !failure && i != end;
       i.increment(failure))
    if (i->path().extension() == ".part") parts.push_back(i->path());
  for (const fs::path& part : parts) fs::remove(part, failure);
}

}  // namespace

const StoredFile* StepRecord::output(const std::string& name) const {
  const auto found = std::find_if(outputs.begin(), outputs.end(),
                                  [&](const StoredFile& file) { return file.name == name; });
  return found == outputs.end() ? nullptr : &*found;
}

Workspace::Workspace(const BuildPlan& plan, SceneWriter::Start start)
    : plan_(plan),
      writer_(plan.options.scene, existing(plan.options.common), start),
      records_(plan.steps.size()) {
  writer_.keep_unfinished();
  // Others may be writing where the folder is shared.
  if (start == SceneWriter::Start::kResume) remove_parts(writer_.folder());
  read_records();
}

std::string Workspace::record_name(std::size_t step) const {
  return fmt::format("{}/steps/{}.json", kWorkFolder, step);
}

void Workspace::read_records() {
  for (std::size_t step = 0; step < records_.size(); ++step) {
    const std::string path = writer_.folder() + "/" + record_name(step);
    std::optional<StepRecord> record = record_from(path, plan_);
    if (!record) continue;
    // Steps before it come first, so what they made is known.
    const auto as_now = [&](const StoredFile& input) {
      const std::optional<StoredFile> now = find(input.name);
      return now && *now == input;
    };
    const auto there = [&](const StoredFile& output) { return is_there(writer_.folder(), output); };
    if (std::all_of(record->inputs.begin(), record->inputs.end(), as_now) &&
        std::all_of(record->outputs.begin(), record->outputs.end(), there))
      records_[step] = std::move(record);
  }
}

bool Workspace::is_done(std::size_t step) const {
  const std::scoped_lock lock(mutex_);
  return records_.at(step).has_value();
}

StepRecord Workspace::record(std::size_t step) const {
  const std::scoped_lock lock(mutex_);
  assert(records_.at(step));
  return *records_[step];
}

std::size_t Workspace::done_count() const {
  const std::scoped_lock lock(mutex_);
  return static_cast<std::size_t>(
      std::count_if(records_.begin(), records_.end(), [](const auto& r) { return r.has_value(); }));
}

void Workspace::add_record(std::size_t step, const StepRecord& record) {
  const std::string text = to_json(record, plan_.fingerprint).dump() + "\n";
  write_file(writer_.path_for(record_name(step)), std::as_bytes(std::span(text)),
             Existing::kReplace);
  const std::scoped_lock lock(mutex_);
  records_.at(step) = record;
}

std::optional<StoredFile> Workspace::find(const std::string& name) const {
  const std::scoped_lock lock(mutex_);
  for (const std::optional<StepRecord>& record : records_) {
    if (!record) continue;
    if (const StoredFile* file = record->output(name)) return *file;
  }
  return {};
}

SectionFile Workspace::open(const StoredFile& file) const {
  SectionFile opened = SectionFile::open(writer_.folder() + "/" + file.name);
  if (opened.size() != file.size)
    opened.fail(fmt::format("{} bytes where {} were written", opened.size(), file.size));
  return opened;
}

}  // namespace scarp
