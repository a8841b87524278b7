#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "tiles/store/part_file.h"

namespace scarp {

/// A folder of results that appears under its name whole or not at all. It grows as
/// "<path>.part-<pid>-<random>"; without commit(), whatever the reason, it is removed.
///
/// Existing::kReplace replaces an empty folder, or one that holds a file named `mark`, by which
/// earlier results are known: a mistyped name loses nobody's work.
/// Errors, of all members: kInput where the output may not be replaced, kResource from the disk.
class PartFolder {
 public:
  PartFolder(std::string path, const std::string& mark, Existing existing);
  ~PartFolder();
  PartFolder(const PartFolder&) = delete;
  PartFolder& operator=(const PartFolder&) = delete;

  /// Where to write a file of the folder; the folders in its name are made.
  std::string path_for(const std::string& name) const;

  void write(const std::string& name, std::span<const std::byte> bytes) const;
  void write(const std::string& name, const std::string& text) const {
    write(name, std::as_bytes(std::span(text)));
  }

  /// Once, as the last call.
  void commit();

 private:
  std::string path_;
  std::string part_path_;
  Existing existing_;
  bool is_committed_ = false;
};

}  // namespace scarp
