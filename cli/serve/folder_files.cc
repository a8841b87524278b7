#include "cli/serve/folder_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <string_view>
#include <utility>

#include "cli/serve/negotiation.h"
#include "cli/serve/problem.h"
#include "core/error/error.h"

namespace scarp {
namespace {

std::shared_ptr<const int> owned(int descriptor) {
  return {new int(descriptor), [](const int* own) {
            ::close(*own);
            delete own;
          }};
}

bool is_proper(const std::string& name) {
  return !name.empty() && name != "." && name != ".." && name.find('/') == std::string::npos &&
         name.find('\0') == std::string::npos;
}

}  // namespace

FolderFiles::FolderFiles(const std::string& folder)
    : folder_(folder), descriptor_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (descriptor_ < 0)
    throw Error(
        ErrorCode::kInput,
        fmt::format("'{}': is no folder that can be read; one with files was expected", folder));
}

FolderFiles::~FolderFiles() {
  ::close(descriptor_);
}

std::optional<FolderFiles::Found> FolderFiles::open(const std::vector<std::string>& path) const {
  if (path.empty()) return {};
  std::shared_ptr<const int> folder;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    if (!is_proper(path[i])) return {};
    const int next = ::openat(folder ? *folder : descriptor_, path[i].c_str(),
                              O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (next < 0) return {};
    folder = owned(next);
  }
  if (!is_proper(path.back())) return {};
  // Not to wait for the writer of a pipe that somebody put there.
  const int file = ::openat(folder ? *folder : descriptor_, path.back().c_str(),
                            O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return {};
  Found found;
  found.descriptor = owned(file);
  struct stat status {};
  if (::fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) return {};
  found.bytes = static_cast<std::uint64_t>(status.st_size);
  found.etag = fmt::format("\"{:x}-{:x}-{:x}\"", status.st_size, status.st_mtim.tv_sec,
                           status.st_mtim.tv_nsec);
  return found;
}

HttpResponse FolderFiles::respond(const HttpRequest& request,
                                  const std::vector<std::string>& path) const {
  const std::optional<Found> found = open(path);
  if (!found) return problem(404, "there is no such file");
  HttpResponse response;
  response.set("ETag", found->etag);
  response.set("Accept-Ranges", "bytes");
  response.set("Cache-Control", "no-cache");
  if (matches_etag(request.header("if-none-match"), found->etag)) {
    response.status = 304;
    return response;
  }
  FileBody body{found->descriptor, 0, found->bytes};
  ByteRange part;
  switch (parse_range_header(request.header("range"), found->bytes, part)) {
    case RangeAnswer::kUnsatisfiable:
      response = problem(416, fmt::format("the file has {} bytes", found->bytes));
      response.set("Content-Range", fmt::format("bytes */{}", found->bytes));
      return response;
    case RangeAnswer::kPart:
      response.status = 206;
      response.set("Content-Range", fmt::format("bytes {}-{}/{}", part.first,
                                                part.first + part.bytes - 1, found->bytes));
      body.offset = part.first;
      body.bytes = part.bytes;
      break;
    default:
      break;
  }
  response.set("Content-Type", media_type_of(path.back()));
  response.file = std::make_shared<const FileBody>(std::move(body));
  return response;
}

std::string media_type_of(const std::string& name) {
  static constexpr std::array<std::pair<std::string_view, const char*>, 19> kTypes = {
      {{".html", "text/html; charset=utf-8"},
       {".js", "text/javascript; charset=utf-8"},
       {".mjs", "text/javascript; charset=utf-8"},
       {".css", "text/css; charset=utf-8"},
       {".json", "application/json"},
       {".map", "application/json"},
       {".geojson", "application/geo+json"},
       {".svg", "image/svg+xml"},
       {".png", "image/png"},
       {".ico", "image/x-icon"},
       {".tif", "image/tiff; application=geotiff"},
       {".gpkg", "application/geopackage+sqlite3"},
       {".glb", "model/gltf-binary"},
       {".gltf", "model/gltf+json"},
       {".pbf", "application/x-protobuf"},
       {".txt", "text/plain; charset=utf-8"},
       {".csv", "text/csv; charset=utf-8"},
       {".woff2", "font/woff2"},
       {".wasm", "application/wasm"}}};
  for (const auto& [ending, type] : kTypes)
    if (name.ends_with(ending)) return type;
  return "application/octet-stream";
}

}  // namespace scarp
