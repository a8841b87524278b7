#include "tiles/store/scene.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <cerrno>

#include "core/error/error.h"
#include "tiles/store/file_error.h"
#include "tiles/store/mapped_file.h"

namespace scarp {
namespace {

OpenFile open_folder(const std::string& path) {
  OpenFile folder(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!folder && errno == ENOTDIR)
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': is a file; a scene, which is a folder, was expected", path));
  if (!folder) throw_read_error(path, errno);
  return folder;
}

/// Whether the path still names this folder.
bool is_at(const std::string& path, const OpenFile& folder) {
  struct stat named, opened;
  return ::stat(path.c_str(), &named) == 0 && ::fstat(folder.descriptor(), &opened) == 0 &&
         named.st_dev == opened.st_dev && named.st_ino == opened.st_ino;
}

/// The scene.json of an open folder; nothing where the folder was replaced while it was looked at.
std::optional<MappedFile> open_json(const OpenFile& folder, const std::string& path) {
  try {
    return MappedFile::open_in(folder.descriptor(), kSceneJson, path + "/" + kSceneJson);
  } catch (const Error&) {
    if (::faccessat(folder.descriptor(), kSceneJson, F_OK, 0) == 0) throw;
    if (!is_at(path, folder)) return {};
  }
  throw Error(ErrorCode::kInput,
              fmt::format("'{}': holds no {}; a scene was expected; make one with scarp build",
                          path, kSceneJson));
}

}  // namespace

const StoredFile* Scene::find(const std::string& tile, const std::string& kind) const {
  for (const SceneTile& candidate : description_.tiles) {
    if (candidate.id != tile) continue;
    for (const StoredFile& file : candidate.files) {
      if (file.kind == kind) return &file;
    }
  }
  return nullptr;
}

const StoredFile& Scene::require(const std::string& tile, const std::string& kind) const {
  if (const StoredFile* found = find(tile, kind)) return *found;
  throw Error(ErrorCode::kCorrupt,
              fmt::format("'{}': tile {} has no file of kind \"{}\"; build the scene again", path_,
                          tile, kind));
}

SectionFile Scene::open(const StoredFile& file, Verify verify) const {
  if (::faccessat(folder_.descriptor(), file.name.c_str(), F_OK, 0) != 0 && !is_at(path_, folder_))
    throw Error(
        ErrorCode::kInput,
        fmt::format("'{}': was replaced or removed while it was open; open it again", path_));
  SectionFile opened = SectionFile::open_in(folder_.descriptor(), file.name, path_of(file), verify);
  if (opened.size() != file.size)
    opened.fail(fmt::format("{} bytes where scene.json promises {}", opened.size(), file.size));
  return opened;
}

Scene open_scene(const std::string& path) {
  Scene scene;
  scene.path_ = path;
  std::optional<MappedFile> json;
  while (!json) {
    scene.folder_ = open_folder(path);
    json = open_json(scene.folder_, path);
  }
  scene.description_ =
      scene_from_json({reinterpret_cast<const char*>(json->bytes().data()), json->bytes().size()},
                      path + "/" + kSceneJson);
  return scene;
}

bool is_scene(const std::string& path) {
  struct stat status;
  return ::stat((path + "/" + kSceneJson).c_str(), &status) == 0;
}

std::string tile_file_name(const std::string& tile, const std::string& kind) {
  return "tiles/" + tile + "." + kind;
}

}  // namespace scarp
