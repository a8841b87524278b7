#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/occlusion/groups.h"
#include "core/terrain/tin.h"
#include "core/threads/progress.h"
#include "tiles/store/open_file.h"
#include "tiles/store/scene_description.h"
#include "tiles/store/section_file.h"

/// A scene: a folder with scene.json and a file per tile and kind.
///
/// Thread safety: a Scene may be read from several threads; a SceneWriter takes path_for() and
/// record() from several threads, the rest from one.
namespace scarp {

/// An open scene. Holds its folder, so that a scene that is replaced meanwhile is still read as the
/// one that was opened: never half of each.
class Scene {
 public:
  const SceneDescription& description() const { return description_; }
  const std::string& path() const { return path_; }
  std::string path_of(const StoredFile& file) const { return path_ + "/" + file.name; }

  /// The first file of this kind in a tile, or nothing.
  const StoredFile* find(const std::string& tile, const std::string& kind) const;

  /// As find, and Error{kCorrupt} where there is none.
  const StoredFile& require(const std::string& tile, const std::string& kind) const;

  /// Errors: kInput where the file is gone, kCorrupt where its size is not the promised one or
  /// SectionFile::open finds a fault.
  SectionFile open(const StoredFile& file, Verify verify = Verify::kStructure) const;

 private:
  friend Scene open_scene(const std::string& path);
  std::string path_;
  OpenFile folder_;
  SceneDescription description_;
};

/// Opens a scene by its folder. Reads scene.json only.
/// Errors: kInput where there is no scene, kCorrupt where scene.json is damaged.
Scene open_scene(const std::string& path);

/// Whether a folder holds a scene.json, damaged or not.
bool is_scene(const std::string& path);

/// "tiles/0/0/0.tin" for tile "0/0/0" and kind "tin".
std::string tile_file_name(const std::string& tile, const std::string& kind);

/// What a build keeps for itself in the folder that grows; finish() removes it.
inline constexpr char kWorkFolder[] = "work";

/// Makes a scene in "<path>.part" beside its final name; finish() writes scene.json and renames, so
/// that the name always shows a whole scene or none.
///
/// Without finish() the folder is removed by the destructor, or stays for a later kResume after
/// keep_unfinished() or a kill. What stays holds whole files only, apart from "*.part".
/// Errors, of all members: kInput where the output may not be replaced or is no scene, or an
/// unfinished build is in the way; kResource from the disk, or where another process builds here.
class SceneWriter {
 public:
  enum class Start {
    kAnew,    ///< in a new folder; an unfinished one with work in it is replaced by kReplace only
    kResume,  ///< go on in the unfinished folder, or begin where there is none
    kShare,   ///< the same, beside other processes that do so
  };

  /// Existing::kReplace replaces a scene or an empty folder, and nothing else.
  SceneWriter(std::string path, Existing existing, Start start = Start::kAnew);
  ~SceneWriter();
  SceneWriter(const SceneWriter&) = delete;
  SceneWriter& operator=(const SceneWriter&) = delete;

  /// The folder that grows.
  const std::string& folder() const { return folder_; }

  /// Path to write a file of the scene at, its folders made.
  std::string path_for(const std::string& name) const;

  /// Size and checksum of a file that lies there, for the description. Reads it once.
  StoredFile record(const std::string& name, const std::string& kind) const;

  void keep_unfinished(bool keep = true) { keep_ = keep; }

  /// The last call. Requires check_description to find nothing (else Error{kUsage}), every
  /// listed file to be there with its size (else Error{kCorrupt}), and that nobody shares the
  /// folder (else Error{kResource}).
  void finish(const SceneDescription& description);

  /// Renames a folder whose scene.json was written already: by a finish() that was killed.
  void finish_again();

 private:
  void rename_to_scene();

  std::string path_;
  std::string folder_;
  Existing existing_;
  OpenFile lock_;
  bool keep_ = false;
};

/// Where a build of this scene grows: "<path>.part".
std::string unfinished_scene(const std::string& path);

/// Something that check_scene found.
struct SceneFinding {
  bool is_fault = true;  ///< false: a note, the scene is sound
  std::string message;
};

/// The invariants of groups, checked by who knows them. Returns the first broken one, or nothing.
using GroupsCheck = std::function<std::optional<std::string>(const Tin&, const Groups&)>;

/// Everything that can be said about a scene without its sources: every listed file there, of its
/// size, with its checksum; the checksum of every section; check_tin, and that horizons and groups
/// fit their TIN; `check_groups` where it is given. Files that nobody lists are notes.
/// Errors: none but memory; a scene that does not open is a finding.
/// Cost: reads every file twice, O(n log n) a tile.
std::vector<SceneFinding> check_scene(const std::string& path, const GroupsCheck& check_groups = {},
                                      const Progress& progress = {});

}  // namespace scarp
