#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "tiles/store/open_file.h"

namespace scarp {

/// What to do where the output is there already.
enum class Existing {
  kRefuse,   ///< Error{kInput}, before any work and again at the end
  kReplace,  ///< readers see the old one or the new one, never a mixture
};

/// A file that appears under its name whole or not at all. It grows as "<path>.<pid>-<random>.part"
/// in the same folder; commit() flushes it to the disk and renames it. Without commit(), whatever
/// the reason, the part is removed and what was there before stays.
///
/// The constructor makes the part, so that a missing folder or permission shows before long work.
/// Errors, of all members: Error{kResource} with the path, the reason and what to do;
/// Error{kInput} where the output exists and is not to be replaced.
class PartFile {
 public:
  PartFile(std::string path, Existing existing);
  ~PartFile();
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;

  void append(std::span<const std::byte> bytes);

  /// Makes the part so long, and asks for room on the disk, so that too little shows before long
  /// work. What is not written reads as zeros.
  void reserve(std::uint64_t bytes);
  /// Anywhere in the file, from several threads at once.
  void write_at(std::uint64_t offset, std::span<const std::byte> bytes);
  /// Has the system begin to move a stretch to the disk, so that commit() has less to wait for.
  void begin_flush(std::uint64_t offset, std::uint64_t bytes);

  /// The part's own name, for a writer that wants one and may put a new file there; afterwards
  /// take_over() makes what is there the part.
  const std::string& part_path() const { return part_path_; }
  void take_over();

  /// Flushes the file, renames it, flushes the folder. Once, as the last call.
  void commit();

 private:
  std::string path_;
  std::string part_path_;
  Existing existing_;
  OpenFile file_;
};

/// All of it at once.
void write_file(const std::string& path, std::span<const std::byte> bytes, Existing existing);

/// "<pid>-<random>", new at each call: for names that no other process chooses.
std::string unique_suffix();

/// Renames without replacing anything. Returns 0, or the errno (EEXIST where `to` exists).
int rename_to_new(const std::string& from, const std::string& to);

/// Puts a folder in the place of another, which is then called "<path>.old-<pid>-<random>".
/// Where the file system can exchange names, `path` names the one or the other at every moment;
/// elsewhere there is a moment, between two renames, when it names nothing.
/// @return the new name of the old folder. Errors: kResource, and all is as before.
std::string replace_folder(const std::string& folder, const std::string& path);

/// Makes renames and new names in a folder last through a loss of power.
void flush_folder(const std::string& folder);

/// The folder that a path's last part is in; "." where there is none.
std::string folder_of(const std::string& path);

}  // namespace scarp
