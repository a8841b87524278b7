#pragma once

#include <string>

namespace scarp {

/// The name of a file in a folder of its own below the system's folder for temporary files; both
/// are removed with it.
class TempFile {
 public:
  /// @param ending  such as ".tif". Throws Error{kResource}.
  explicit TempFile(const std::string& ending);
  ~TempFile();
  TempFile(const TempFile&) = delete;
  TempFile& operator=(const TempFile&) = delete;

  const std::string& path() const { return path_; }
  /// What was written there. Throws Error{kResource}.
  std::string read() const;

 private:
  std::string folder_, path_;
};

}  // namespace scarp
