#include "tiles/store/scene.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <cerrno>

#include "core/error/error.h"
#include "tiles/store/file_error.h"
#include "tiles/store/mapped_file.h"

namespace scarp {

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
  SectionFile opened = SectionFile::open_in(folder_.descriptor(), file.name, path_of(file), verify);
  if (opened.size() != file.size)
    opened.fail(fmt::format("{} bytes where scene.json promises {}", opened.size(), file.size));
  return opened;
}

Scene open_scene(const std::string& path) {
  Scene scene;
  scene.path_ = path;
  scene.folder_ = OpenFile(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!scene.folder_ && errno == ENOTDIR)
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': is a file; a scene, which is a folder, was expected", path));
  if (!scene.folder_) throw_read_error(path, errno);
  if (::faccessat(scene.folder_.descriptor(), kSceneJson, F_OK, 0) != 0)
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': holds no {}; a scene was expected; make one with scarp build",
                            path, kSceneJson));
  const std::string name = path + "/" + kSceneJson;
  const MappedFile json = MappedFile::open_in(scene.folder_.descriptor(), kSceneJson, name);
  scene.description_ = scene_from_json(
      {reinterpret_cast<const char*>(json.bytes().data()), json.bytes().size()}, name);
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
