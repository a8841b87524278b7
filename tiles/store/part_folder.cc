#include "tiles/store/part_folder.h"

#include <fmt/format.h>

#include <cerrno>
#include <filesystem>
#include <system_error>

#include "core/error/error.h"

namespace scarp {
namespace fs = std::filesystem;

PartFolder::PartFolder(std::string path, const std::string& mark, Existing existing)
    : path_(std::move(path)), existing_(existing) {
  while (path_.size() > 1 && path_.back() == '/') path_.pop_back();
  if (fs::exists(fs::symlink_status(path_))) {
    if (existing == Existing::kRefuse)
      throw Error(ErrorCode::kInput,
                  fmt::format("'{}': exists; a new folder was expected; choose another name, or "
                              "give --overwrite",
                              path_));
    if (!fs::is_directory(fs::symlink_status(path_)) ||
        !(fs::is_empty(path_) || fs::exists(path_ + "/" + mark)))
      throw Error(ErrorCode::kInput,
                  fmt::format("'{}': not a folder of earlier results, which would hold {}; choose "
                              "another name",
                              path_, mark));
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

std::string PartFolder::path_for(const std::string& name) const {
  const fs::path path = fs::path(part_path_) / name;
  std::error_code failure;
  fs::create_directories(path.parent_path(), failure);
  if (failure)
    throw Error(ErrorCode::kResource,
                fmt::format("'{}': cannot be made ({}); room on the disk was expected",
                            path.parent_path().string(), failure.message()));
  return path.string();
}

void PartFolder::write(const std::string& name, std::span<const std::byte> bytes) const {
  write_file(path_for(name), bytes, Existing::kRefuse);
}

void PartFolder::commit() {
  flush_folder(part_path_);
  std::string old;
  if (existing_ == Existing::kReplace && fs::is_directory(path_)) {
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
