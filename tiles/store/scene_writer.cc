#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>

#include "core/error/error.h"
#include "tiles/store/file_error.h"
#include "tiles/store/scene.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;

constexpr char kPartMark[] = ".part";

std::string without_trailing_slashes(std::string path) {
  while (path.size() > 1 && path.back() == '/') path.pop_back();
  return path;
}

/// Deletes nothing that is not a scene, whatever --overwrite says.
void check_target(const std::string& path, Existing existing) {
  struct stat status;
  if (::lstat(path.c_str(), &status) != 0) return;
  if (existing == Existing::kRefuse) throw_exists(path);
  std::error_code ignored;
  if (S_ISDIR(status.st_mode) && (is_scene(path) || fs::is_empty(path, ignored))) return;
  throw Error(ErrorCode::kInput,
              fmt::format("'{}': is not a scene; only a scene or an empty folder is replaced; "
                          "choose another name or remove it yourself",
                          path));
}

OpenFile open_folder(const std::string& path) {
  OpenFile folder(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!folder) throw_write_error(path, errno);
  return folder;
}

/// One writer a folder, or several that share it: a lock that ends with the process.
bool try_lock(const OpenFile& folder, int operation) {
  return ::flock(folder.descriptor(), operation | LOCK_NB) == 0;
}

[[noreturn]] void throw_busy(const std::string& folder) {
  throw Error(
      ErrorCode::kResource,
      fmt::format("'{}': another process is building here; wait for it or stop it", folder));
}

/// Whether the path still names this folder.
bool is_at(const std::string& path, const OpenFile& folder) {
  struct stat named, opened;
  return ::stat(path.c_str(), &named) == 0 && ::fstat(folder.descriptor(), &opened) == 0 &&
         named.st_dev == opened.st_dev && named.st_ino == opened.st_ino;
}

/// Whether an unfinished folder holds something that a resumed build would not have to do again.
bool holds_work(const std::string& folder) {
  std::error_code ignored;
  const std::string work = folder + "/" + kWorkFolder;
  return fs::exists(folder + "/" + kSceneJson, ignored) ||
         (fs::is_directory(work, ignored) && !fs::is_empty(work, ignored));
}

void remove_contents(const std::string& folder) {
  std::error_code failure;
  for (const auto& entry : fs::directory_iterator(folder, failure)) {
    fs::remove_all(entry.path(), failure);
    if (failure) break;
  }
  if (failure) throw_write_error(folder, failure.value());
}

void flush_folders(const std::string& root) {
  std::error_code failure;
  for (fs::recursive_directory_iterator i(root, failure), end; !failure && i != end;
       i.increment(failure)) {
    if (i->is_directory(failure)) flush_folder(i->path().string());
  }
  if (failure) throw_write_error(root, failure.value());
  flush_folder(root);
}

void check_listed(const StoredFile& file, const std::string& folder) {
  struct stat status;
  const std::string path = folder + "/" + file.name;
  if (::stat(path.c_str(), &status) != 0) throw_read_error(path, errno);
  if (static_cast<std::uint64_t>(status.st_size) != file.size)
    throw Error(
        ErrorCode::kCorrupt,
        fmt::format("'{}': {} bytes where {} were written; something else changed it; build "
                    "again",
                    path, status.st_size, file.size));
}

}  // namespace

std::string unfinished_scene(const std::string& path) {
  return without_trailing_slashes(path) + kPartMark;
}

SceneWriter::SceneWriter(std::string path, Existing existing, Start start)
    : path_(without_trailing_slashes(std::move(path))), existing_(existing) {
  check_target(path_, existing_);
  const std::string folder = unfinished_scene(path_);
  if (::mkdir(folder.c_str(), 0777) != 0 && errno != EEXIST) throw_write_error(folder, errno);
  lock_ = open_folder(folder);
  // The folder may have become a scene, or been removed, before it was locked.
  if (!try_lock(lock_, start == Start::kShare ? LOCK_SH : LOCK_EX) || !is_at(folder, lock_))
    throw_busy(folder);
  if (start == Start::kAnew) {
    if (existing_ == Existing::kRefuse && holds_work(folder))
      throw Error(ErrorCode::kInput,
                  fmt::format("'{}': holds an unfinished build; give --resume to go on with it, "
                              "--overwrite to begin anew, or remove it",
                              folder));
    remove_contents(folder);
  }
  folder_ = folder;  // from here on the destructor removes it
}

SceneWriter::~SceneWriter() {
  std::error_code ignored;
  if (!keep_ && !folder_.empty()) fs::remove_all(folder_, ignored);
}

std::string SceneWriter::path_for(const std::string& name) const {
  const std::string path = folder_ + "/" + name;
  std::error_code failure;
  fs::create_directories(folder_of(path), failure);
  if (failure) throw_write_error(folder_of(path), failure.value());
  return path;
}

StoredFile SceneWriter::record(const std::string& name, const std::string& kind) const {
  const FileDigest digest = digest_of_file(folder_ + "/" + name);
  return {name, kind, digest.size, digest.checksum};
}

void SceneWriter::finish(const SceneDescription& description) {
  if (const auto wrong = check_description(description))
    throw Error(ErrorCode::kUsage, fmt::format("'{}': {}", path_, *wrong));
  if (!try_lock(lock_, LOCK_EX)) throw_busy(folder_);
  for (const SceneTile& tile : description.tiles) {
    for (const StoredFile& file : tile.files) check_listed(file, folder_);
  }
  for (const StoredFile& file : description.layers) check_listed(file, folder_);
  const std::string text = scene_to_json(description);
  write_file(folder_ + "/" + kSceneJson, std::as_bytes(std::span(text)), Existing::kReplace);
  rename_to_scene();
}

void SceneWriter::finish_again() {
  if (!try_lock(lock_, LOCK_EX)) throw_busy(folder_);
  rename_to_scene();
}

void SceneWriter::rename_to_scene() {
  std::error_code failure;
  fs::remove_all(folder_ + "/" + kWorkFolder, failure);
  if (failure) throw_write_error(folder_ + "/" + kWorkFolder, failure.value());
  flush_folders(folder_);
  check_target(path_, existing_);
  const int reason = rename_to_new(folder_, path_);
  if (reason != 0 && (reason != EEXIST || existing_ == Existing::kRefuse))
    reason == EEXIST ? throw_exists(path_) : throw_write_error(path_, reason);
  std::string old;
  if (reason == EEXIST) old = replace_folder(folder_, path_);
  folder_.clear();
  flush_folder(folder_of(path_));
  std::error_code ignored;
  if (!old.empty()) fs::remove_all(old, ignored);
}

}  // namespace scarp
