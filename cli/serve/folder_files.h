#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/serve/http.h"

namespace scarp {

/// Files below one folder, for reading only. Nothing outside of it can be named: a path is a list
/// of names, each opened in the folder before it, none followed where it is a symbolic link.
class FolderFiles {
 public:
  /// Throws Error{kInput} where there is no folder.
  explicit FolderFiles(const std::string& folder);
  ~FolderFiles();
  FolderFiles(const FolderFiles&) = delete;
  FolderFiles& operator=(const FolderFiles&) = delete;

  struct Found {
    std::shared_ptr<const int> descriptor;
    std::uint64_t bytes = 0;
    std::string etag;  ///< of its size and time of change
  };
  /// A plain file; nothing where there is none, or a name is empty, ".", ".." or holds a slash.
  std::optional<Found> open(const std::vector<std::string>& path) const;

  /// The answer to a request for a file: 200, 206 for a Range, 304, 404 or 416.
  HttpResponse respond(const HttpRequest& request, const std::vector<std::string>& path) const;

  const std::string& folder() const { return folder_; }

 private:
  std::string folder_;
  int descriptor_ = -1;
};

/// By the ending of a name; application/octet-stream where it is not known.
std::string media_type_of(const std::string& name);

}  // namespace scarp
