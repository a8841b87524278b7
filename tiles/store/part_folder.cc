#include "tiles/store/part_folder.h"

#include <fmt/format.h>

#include <cerrno>
#include <filesystem>
#include <system_error>

#include "core/error/error.h"

namespace scarp {
namespace fs = std::filesystem;

PartFolder::PartFolder(std::string path, Existing existing)
    : path_(std::move(path)), existing_(existing) {
  while (path_.size() > 1 && path_.back() == '/') path_.pop_back();
  if (fs::exists(fs::symlink_status(path_))) {
    if (existing == Existing::kRefuse)
      throw Error(ErrorCode::kInput,
                  fmt::format("'{}': exists; a new folder was expected; choose another name, or "
                              "give --overwrite",
                              path_));
    if (!fs::is_directory(fs::symlink_status(path_)))
      throw Error(ErrorCode::kInput,
                  fmt::format("'{}': no folder; a folder to replace was expected; choose another "
                              "name",
                              path_));
  }
  part_path_ = path_ + ".part-" + unique_suffix();
  std::error_code failure;
  if (!fs::create_directory(part_path_, failure))
    throw Error(ErrorCode::kResource,
                fmt::format("'{}': cannot be made ({}); a folder that exists and may be written to "
                            "was expected above it",
                            path_, failure.message()));
}

PartFolder::~PartFolder() {
  std::error_code ignored;
  if (!is_committed_) fs::remove_all(part_path_, ignored);
}

void PartFolder::write(const std::string& name, std::span<const std::byte> bytes) const {
  write_file(path_for(name), bytes, Existing::kRefuse);
}

/// What would be lost is told by name: anything that this run has not written itself.
void PartFolder::check_replaceable() const {
  for (const auto& entry : fs::directory_iterator(path_))
    if (!fs::exists(path_for(entry.path().filename().string())))
      throw Error(ErrorCode::kInput,
                  fmt::format("'{}': holds '{}', which is not of this output; a folder of earlier "
                              "results was expected; choose another name",
                              path_, entry.path().filename().string()));
}

void PartFolder::commit() {
  flush_folder(part_path_);
  std::string old;
  if (existing_ == Existing::kReplace && fs::is_directory(path_)) {
    check_replaceable();
    old = replace_folder(part_path_, path_);
  } else if (const int failure = rename_to_new(part_path_, path_)) {
    throw Error(failure == EEXIST ? ErrorCode::kInput : ErrorCode::kResource,
                fmt::format("'{}': {}; a new folder was expected; choose another name", path_,
                            std::generic_category().message(failure)));
  }
  is_committed_ = true;
  flush_folder(folder_of(path_));
  std::error_code ignored;
  if (!old.empty()) fs::remove_all(old, ignored);
}

}  // namespace scarp
