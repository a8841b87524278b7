#include "tiles/store/part_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdio.h>
#include <sys/stat.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <filesystem>
#include <random>

#include "core/error/error.h"
#include "tiles/store/file_error.h"

namespace scarp {
namespace {

constexpr std::size_t kLargestWrite = std::size_t{1} << 30;  // Linux writes at most 2 GiB at once

bool exists(const std::string& path) {
  struct stat status;
  return ::lstat(path.c_str(), &status) == 0;
}

void check_target(const std::string& path, Existing existing) {
  struct stat status;
  if (::stat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode))
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': is a folder; the name of a file was expected", path));
  if (existing == Existing::kRefuse && exists(path)) throw_exists(path);
}

}  // namespace

std::string unique_suffix() {
  std::random_device random;
  return fmt::format("{}-{:08x}{:08x}", ::getpid(), random(), random());
}

std::string folder_of(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

int rename_to_new(const std::string& from, const std::string& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return errno;
  // A file system without that call: what comes between the question and the rename is lost.
  if (exists(to)) return EEXIST;
  return ::rename(from.c_str(), to.c_str()) == 0 ? 0 : errno;
}

std::string replace_folder(const std::string& folder, const std::string& path) {
  const std::string old = path + ".old-" + unique_suffix();
  if (::renameat2(AT_FDCWD, folder.c_str(), AT_FDCWD, path.c_str(), RENAME_EXCHANGE) == 0) {
    // from a name that kResume would take up to one that it would not
    return ::rename(folder.c_str(), old.c_str()) == 0 ? old : folder;
  }
  if (errno != EINVAL && errno != ENOSYS) throw_write_error(path, errno);
  if (::rename(path.c_str(), old.c_str()) != 0) throw_write_error(path, errno);
  if (::rename(folder.c_str(), path.c_str()) != 0) {
    const int reason = errno;
    ::rename(old.c_str(), path.c_str());
    throw_write_error(path, reason);
  }
  return old;
}

void flush_folder(const std::string& folder) {
  const OpenFile open(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!open) throw_write_error(folder, errno);
  // Some shared file systems cannot flush folders and say EINVAL; they keep their own order.
  if (::fsync(open.descriptor()) != 0 && errno != EINVAL) throw_write_error(folder, errno);
}

PartFile::PartFile(std::string path, Existing existing)
    : path_(std::move(path)), existing_(existing) {
  check_target(path_, existing_);
  part_path_ = path_ + "." + unique_suffix() + ".part";
  file_ = OpenFile(::open(part_path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (!file_) throw_write_error(path_, errno);
}

PartFile::~PartFile() {
  if (!part_path_.empty()) ::unlink(part_path_.c_str());
}

void PartFile::append(std::span<const std::byte> bytes) {
  assert(file_);
  while (!bytes.empty()) {
    const ssize_t written =
        ::write(file_.descriptor(), bytes.data(), std::min(bytes.size(), kLargestWrite));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) throw_write_error(path_, errno);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

void PartFile::take_over() {
  file_ = OpenFile(::open(part_path_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC));
  if (!file_) throw_write_error(path_, errno);
}

void PartFile::reserve(std::uint64_t bytes) {
  const auto length = static_cast<off_t>(bytes);
  if (::ftruncate(file_.descriptor(), length) != 0) throw_write_error(path_, errno);
  // A file system that cannot reserve shows its lack of room when it is written.
  if (length > 0 && ::fallocate(file_.descriptor(), 0, 0, length) != 0 && errno != EOPNOTSUPP &&
      errno != ENOSYS)
    throw_write_error(path_, errno);
}

void PartFile::write_at(std::uint64_t offset, std::span<const std::byte> bytes) {
  assert(file_);
  while (!bytes.empty()) {
    const ssize_t written =
        ::pwrite(file_.descriptor(), bytes.data(), std::min(bytes.size(), kLargestWrite),
                 static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) throw_write_error(path_, errno);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
    offset += static_cast<std::uint64_t>(written);
  }
}

void PartFile::begin_flush(std::uint64_t offset, std::uint64_t bytes) {
  // What fails here fails in commit() once more.
  ::sync_file_range(file_.descriptor(), static_cast<off_t>(offset), static_cast<off_t>(bytes),
                    SYNC_FILE_RANGE_WRITE);
}

void PartFile::commit() {
  assert(file_);
  if (::fsync(file_.descriptor()) != 0) throw_write_error(path_, errno);
  if (!file_.close()) throw_write_error(path_, errno);
  int reason = 0;
  if (existing_ == Existing::kRefuse)
    reason = rename_to_new(part_path_, path_);
  else if (::rename(part_path_.c_str(), path_.c_str()) != 0)
    reason = errno;
  if (reason == EEXIST) throw_exists(path_);
  if (reason != 0) throw_write_error(path_, reason);
  part_path_.clear();
  flush_folder(folder_of(path_));
}

void write_file(const std::string& path, std::span<const std::byte> bytes, Existing existing) {
  PartFile file(path, existing);
  file.append(bytes);
  file.commit();
}

}  // namespace scarp
