#pragma once

#include <string>

namespace scarp {

/// The name of a file in a folder of its own below the system's folder for temporary files; the
/// folder is removed with it, and all that is in it.
class TempFile {
 public:
  /// @param ending  such as ".tif". Throws Error{kResource}.
  explicit TempFile(const std::string& ending);
  ~TempFile();
  TempFile(const TempFile&) = delete;
  TempFile& operator=(const TempFile&) = delete;

  const std::string& path() const { return path_; }
  /// Another file there.
  std::string beside(const std::string& name) const { return folder_ + "/" + name; }
  /// What was written there. Throws Error{kResource}.
  std::string read() const;

 private:
  std::string folder_, path_;
};

}  // namespace scarp
