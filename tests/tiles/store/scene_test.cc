#include "tiles/store/scene.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "core/error/error.h"
#include "tests/tiles/limits.h"
#include "tests/tiles/small_scene.h"
#include "tests/tiles/temporary_folder.h"
#include "tiles/store/groups_file.h"
#include "tiles/store/horizon_file.h"
#include "tiles/store/tin_file.h"

namespace scarp {
namespace {

using test::TemporaryFolder;

/// Writes a small scene whose heights and parameter "generation" go together.
void write_scene(const std::string& path, Existing existing, int generation = 0) {
  SceneWriter writer(path, existing);
  const Tin tin = test::grid_tin(3, 3, generation);
  SceneDescription scene = test::small_description();
  scene.parameters["generation"] = std::int64_t{generation};
  SceneTile tile{"0/0/0", {}};
  for (const char* kind : {"tin", "horizon", "groups"}) {
    const std::string name = tile_file_name(tile.id, kind);
    const std::string file = writer.path_for(name);
    if (std::string(kind) == "tin") write_tin(file, tin, {}, Existing::kReplace);
    if (std::string(kind) == "horizon")
      write_horizon(file, test::small_horizons(tin), Existing::kReplace);
    if (std::string(kind) == "groups")
      write_groups(file, test::small_groups(tin), Existing::kReplace);
    tile.files.push_back(writer.record(name, kind));
  }
  scene.tiles = {tile};
  test::write_text(writer.path_for("layers/note.json"), "{}");
  scene.layers = {writer.record("layers/note.json", "json")};
  writer.finish(scene);
}

template <class Step>
std::string message_of(Step step) {
  try {
    step();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(SceneDescription, TextGoesThereAndBack) {
  SceneDescription scene = test::small_description();
  scene.parameters["tiny"] = 5e-324;
  scene.parameters["whole"] = 2.0;  // comes back as double
  scene.parameters["least"] = std::numeric_limits<std::int64_t>::min();
  scene.parameters["text"] = std::string("a \"b\"\n\t\\ \xC3\xA4");
  scene.sources[0].size = std::numeric_limits<std::uint64_t>::max();
  scene.tiles = {{"0/0/0", {{"tiles/0/0/0.tin", "tin", 7, checksum_of({})}}, {}},
                 {"3/1/2", {}, {}}};
  scene.tiles[1].contents = TileContents{{-1, 2, 3}, {4, 5.5, 1e-9}, 12, 20, 3};
  scene.layers = {{"layers/x.tif", "cog", 1, {}}};
  const std::string text = scene_to_json(scene);
  EXPECT_EQ(scene_from_json(text, "s"), scene);
  EXPECT_EQ(scene_to_json(scene_from_json(text, "s")), text);
  scene.sources[0].name = "caf\xE9.tif";  // not UTF-8
  EXPECT_EQ(scene_from_json(scene_to_json(scene), "s").sources[0].name, "caf\xEF\xBF\xBD.tif");
}

TEST(SceneDescription, FinestTilesGoByRowThenColumn) {
  SceneDescription scene = test::small_description();
  for (const char* id : {"2/10/0", "0/0/0", "2/0/1", "1/0/0", "2/2/0", "2/1/1"})
    scene.tiles.push_back({id, {}, {}});
  EXPECT_EQ(finest_tiles(scene), (std::vector<std::size_t>{4, 0, 2, 5}));
}

TEST(SceneDescription, EveryTruncationAndEveryFlippedByteIsAnError) {
  SceneDescription scene = test::small_description();
  scene.tiles = {{"0/0/0", {{"tiles/0/0/0.tin", "tin", 7, checksum_of({})}}}};
  const std::string text = scene_to_json(scene);
  const auto is_refused = [](const std::string& bytes) {
    try {
      scene_from_json(bytes, "s");
      return false;
    } catch (const Error& error) {
      return error.code() == ErrorCode::kCorrupt;
    }
  };
  for (std::size_t at = 0; at < text.size(); ++at) {
    EXPECT_TRUE(is_refused(text.substr(0, at))) << at;
    for (const char mask : {'\x01', '\x10', '\x20', '\x7f'}) {
      std::string flipped = text;
      flipped[at] = static_cast<char>(flipped[at] ^ mask);
      EXPECT_TRUE(is_refused(flipped)) << at;
    }
  }
  EXPECT_TRUE(is_refused(text + " "));
  EXPECT_TRUE(is_refused(std::string(100'000, '[')));
}

TEST(SceneDescription, NamesWhatIsWrong) {
  const auto wrong = [](const std::function<void(SceneDescription&)>& damage) {
    SceneDescription scene = test::small_description();
    scene.tiles = {{"0/0/0", {{"tiles/0/0/0.tin", "tin", 7, {}}}}};
    damage(scene);
    return check_description(scene).value_or("");
  };
  EXPECT_EQ(wrong([](SceneDescription&) {}), "");
  EXPECT_EQ(wrong([](SceneDescription& s) { s.earth.refraction = 1.5; }),
            "refraction 1.5 is not in 0 to 1");
  EXPECT_NE(wrong([](SceneDescription& s) { s.earth.centre[1] = INFINITY; }), "");
  EXPECT_NE(wrong([](SceneDescription& s) { s.raster.rows = 0; }), "");
  EXPECT_NE(wrong([](SceneDescription& s) { s.parameters["x"] = std::nan(""); }), "");
  EXPECT_EQ(wrong([](SceneDescription& s) { s.tiles.push_back(s.tiles[0]); }),
            "tile \"0/0/0\" is listed twice");
  for (const char* id : {"", "0", "0/0", "0/0/0/0", "0//0", "a/0/0", "0/0/", "-1/0/0"})
    EXPECT_NE(wrong([&](SceneDescription& s) { s.tiles[0].id = id; }), "") << id;
  for (const char* name :
       {"", "/etc/passwd", "../x", "a/../b", "a//b", "a/", "./a", "a b", "scene.json", "a\\b"})
    EXPECT_NE(wrong([&](SceneDescription& s) { s.tiles[0].files[0].name = name; }), "") << name;
  EXPECT_EQ(wrong([](SceneDescription& s) { s.layers = s.tiles[0].files; }),
            "file \"tiles/0/0/0.tin\" is listed twice");
}

TEST(Scene, OpensWithItsTiles) {
  const TemporaryFolder folder;
  write_scene(folder / "a.scene/", Existing::kRefuse, 4);
  EXPECT_EQ(folder.names(), std::set<std::string>{"a.scene"});
  const Scene scene = open_scene(folder / "a.scene");
  const Tin tin = read_tin(scene.open(scene.require("0/0/0", "tin")));
  EXPECT_EQ(tin.vertices, test::grid_tin(3, 3, 4).vertices);
  EXPECT_EQ(scene.find("0/0/0", "other"), nullptr);
  EXPECT_EQ(scene.find("1/0/0", "tin"), nullptr);
  EXPECT_NE(message_of([&] { scene.require("1/0/0", "tin"); }).find("tile 1/0/0"),
            std::string::npos);
  EXPECT_TRUE(check_scene(folder / "a.scene").empty());
}

TEST(Scene, SaysWhyItDoesNotOpen) {
  const TemporaryFolder folder;
  test::write_text(folder / "file", "");
  EXPECT_NE(message_of([&] { open_scene(folder / "none"); }).find("does not exist"),
            std::string::npos);
  EXPECT_NE(message_of([&] { open_scene(folder / "file"); }).find("is a file"), std::string::npos);
  EXPECT_NE(message_of([&] { open_scene(folder.path()); }).find("holds no scene.json"),
            std::string::npos);
}

TEST(SceneWriter, WithoutFinishNothingStays) {
  const TemporaryFolder folder;
  {
    SceneWriter writer(folder / "a", Existing::kRefuse);
    test::write_text(writer.path_for("tiles/0/0/0.tin"), "x");
    EXPECT_EQ(folder.names().size(), 1U);
  }
  EXPECT_TRUE(folder.names().empty());
}

TEST(SceneWriter, RefusesAnExistingOutput) {
  const TemporaryFolder folder;
  write_scene(folder / "a", Existing::kRefuse, 1);
  EXPECT_NE(
      message_of([&] { write_scene(folder / "a", Existing::kRefuse, 2); }).find("exists already"),
      std::string::npos);
  SceneWriter late(folder / "b", Existing::kRefuse);
  write_scene(folder / "c", Existing::kRefuse, 3);
  std::filesystem::rename(folder / "c", folder / "b");
  EXPECT_NE(message_of([&] { late.finish(test::small_description()); }).find("exists already"),
            std::string::npos);
  EXPECT_EQ(
      std::get<std::int64_t>(open_scene(folder / "b").description().parameters.at("generation")),
      3);
}

TEST(SceneWriter, ReplacesScenesOnly) {
  const TemporaryFolder folder;
  write_scene(folder / "a", Existing::kRefuse, 1);
  write_scene(folder / "a", Existing::kReplace, 2);
  EXPECT_EQ(
      std::get<std::int64_t>(open_scene(folder / "a").description().parameters.at("generation")),
      2);
  EXPECT_EQ(folder.names(), std::set<std::string>{"a"});
  std::filesystem::create_directory(folder / "empty");
  write_scene(folder / "empty", Existing::kReplace);
  std::filesystem::create_directory(folder / "thesis");
  test::write_text(folder / "thesis/years-of-work.txt", "!");
  EXPECT_NE(message_of([&] {
              write_scene(folder / "thesis", Existing::kReplace);
            }).find("is not a scene"),
            std::string::npos);
  EXPECT_EQ(test::read_text(folder / "thesis/years-of-work.txt"), "!");
  EXPECT_NE(
      message_of([&] { write_scene(folder / "thesis/years-of-work.txt", Existing::kReplace); }),
      "");
}

TEST(SceneWriter, RefusesADescriptionThatDoesNotHold) {
  const TemporaryFolder folder;
  const auto finish = [&](const StoredFile& file) {
    SceneWriter writer(folder / "a", Existing::kRefuse);
    test::write_text(writer.path_for("there"), "1234");
    SceneDescription scene = test::small_description();
    scene.layers = {file};
    writer.finish(scene);
  };
  EXPECT_NE(message_of([&] {
              finish({"missing", "json", 1, {}});
            }).find("does not exist"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              finish({"there", "json", 3, {}});
            }).find("4 bytes where 3"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              finish({"../x", "json", 3, {}});
            }).find("not relative"),
            std::string::npos);
  EXPECT_TRUE(folder.names().empty());
}

TEST(SceneWriter, FullDiskAndMissingFoldersLeaveNothingBehind) {
  const TemporaryFolder folder;
  EXPECT_NE(
      message_of([&] { write_scene(folder / "no/a", Existing::kRefuse); }).find("create it first"),
      std::string::npos);
  {
    const test::FullDisk full(500);
    EXPECT_NE(message_of([&] { write_scene(folder / "a", Existing::kRefuse); }), "");
  }
  EXPECT_TRUE(folder.names().empty());
  std::filesystem::permissions(folder.path(), std::filesystem::perms(0555));
  const test::NotRoot not_root;
  EXPECT_NE(message_of([&] { write_scene(folder / "a", Existing::kRefuse); }).find("permissions"),
            std::string::npos);
}

TEST(SceneWriter, ResumesTheOneUnfinishedBuild) {
  const TemporaryFolder folder;
  const std::string path = folder / "a";
  {
    SceneWriter writer(path, Existing::kRefuse);
    test::write_text(writer.path_for("tiles/0/0/0.tin"), "done");
    EXPECT_NE(message_of([&] {
                SceneWriter(path, Existing::kRefuse, SceneWriter::Start::kResume);
              }).find("another process"),
              std::string::npos);
    writer.keep_unfinished();
  }
  EXPECT_EQ(folder.names(), std::set<std::string>{"a.part"});
  {
    SceneWriter writer(path, Existing::kRefuse, SceneWriter::Start::kResume);
    EXPECT_EQ(test::read_text(writer.path_for("tiles/0/0/0.tin")), "done");
    SceneDescription scene = test::small_description();
    scene.layers = {writer.record("tiles/0/0/0.tin", "json")};
    writer.finish(scene);
  }
  EXPECT_EQ(folder.names(), std::set<std::string>{"a"});
}

TEST(SceneWriter, TwoBuildsOfOneSceneAreOneTooMany) {
  const TemporaryFolder folder;
  const SceneWriter one(folder / "a", Existing::kRefuse);
  for (const auto start :
       {SceneWriter::Start::kAnew, SceneWriter::Start::kResume, SceneWriter::Start::kShare}) {
    EXPECT_NE(message_of([&] {
                SceneWriter(folder / "a", Existing::kReplace, start);
              }).find("another process"),
              std::string::npos);
  }
  const SceneWriter other(folder / "b", Existing::kRefuse);
}

TEST(SceneWriter, FinishesAloneWhatSeveralMade) {
  const TemporaryFolder folder;
  SceneWriter one(folder / "a", Existing::kRefuse, SceneWriter::Start::kShare);
  {
    SceneWriter two(folder / "a", Existing::kRefuse, SceneWriter::Start::kShare);
    EXPECT_NE(message_of([&] { one.finish(test::small_description()); }).find("another process"),
              std::string::npos);
    two.keep_unfinished();
  }
  one.finish(test::small_description());
  EXPECT_EQ(folder.names(), std::set<std::string>{"a"});
}

TEST(SceneWriter, UnfinishedWorkIsNotThrownAwayUnasked) {
  const TemporaryFolder folder;
  const std::string path = folder / "a";
  {
    SceneWriter writer(path, Existing::kRefuse);
    test::write_text(writer.path_for("work/steps/mesh.json"), "{}");
    writer.keep_unfinished();
  }
  EXPECT_NE(message_of([&] { write_scene(path, Existing::kRefuse); }).find("give --resume"),
            std::string::npos);
  EXPECT_EQ(test::read_text(path + ".part/work/steps/mesh.json"), "{}");
  write_scene(path, Existing::kReplace);
  EXPECT_EQ(folder.names(), std::set<std::string>{"a"});
  EXPECT_FALSE(std::filesystem::exists(path + "/work"));
}

TEST(SceneWriter, AFinishThatWasKilledIsDoneAgain) {
  const TemporaryFolder folder;
  const std::string path = folder / "a";
  {
    SceneWriter writer(path, Existing::kRefuse);
    test::write_text(writer.path_for("scene.json"), scene_to_json(test::small_description()));
    test::write_text(writer.path_for("work/steps/mesh.json"), "{}");
    writer.keep_unfinished();
  }
  SceneWriter(path, Existing::kRefuse, SceneWriter::Start::kResume).finish_again();
  EXPECT_EQ(open_scene(path).description(), test::small_description());
  EXPECT_FALSE(std::filesystem::exists(path + "/work"));
  EXPECT_EQ(folder.names(), std::set<std::string>{"a"});
}

TEST(SceneWriter, AReaderSeesTheOldSceneOrTheNewOne) {
  const TemporaryFolder folder;
  const std::string path = folder / "a";
  write_scene(path, Existing::kRefuse, 0);
  std::atomic<bool> stop = false;
  int read = 0, replaced = 0;
  std::string fault;
  std::thread reader([&] {
    while (!stop && fault.empty()) {
      try {
        const Scene scene = open_scene(path);  // never fails: there is always a scene
        const auto generation =
            std::get<std::int64_t>(scene.description().parameters.at("generation"));
        try {
          const SectionFile file = scene.open(scene.require("0/0/0", "tin"), Verify::kEverything);
          if (read_tin(file).vertices[0].z_m != static_cast<double>(generation))
            fault = "the tile is of another generation";
          ++read;
        } catch (const Error& error) {
          if (std::string(error.what()).find("was replaced") == std::string::npos)
            fault = error.what();
          ++replaced;
        }
      } catch (const Error& error) {
        fault = error.what();
      }
    }
  });
  for (int generation = 1; generation <= 12; ++generation)
    write_scene(path, Existing::kReplace, generation);
  stop = true;
  reader.join();
  EXPECT_EQ(fault, "");
  EXPECT_GT(read, 0);
  EXPECT_EQ(folder.names(), std::set<std::string>{"a"});
}

TEST(CheckScene, FindsWhatIsWrongAndNotesStrays) {
  const TemporaryFolder folder;
  const std::string path = folder / "a";
  const auto findings_after = [&](const std::function<void()>& damage) {
    write_scene(path, Existing::kReplace);
    damage();
    std::vector<std::string> messages;
    for (const SceneFinding& finding : check_scene(path))
      messages.push_back((finding.is_fault ? "fault " : "note ") + finding.message);
    return messages;
  };
  const auto mentions = [](const std::vector<std::string>& messages, const std::string& part) {
    for (const std::string& message : messages) {
      if (message.find(part) != std::string::npos) return true;
    }
    return false;
  };
  write_scene(path, Existing::kRefuse);
  const std::string tin = path + "/tiles/0/0/0.tin", groups = path + "/tiles/0/0/0.groups";
  EXPECT_TRUE(findings_after([] {}).empty());
  EXPECT_TRUE(mentions(findings_after([&] { std::filesystem::remove(groups); }), "does not exist"));
  EXPECT_TRUE(mentions(findings_after([&] { std::ofstream(tin, std::ios::app) << "x"; }),
                       "where scene.json promises"));
  for (const std::string& file : {tin, groups, path + "/layers/note.json"}) {
    const auto found = findings_after([&] {
      std::string text = test::read_text(file);
      text.back() = static_cast<char>(text.back() ^ 1);
      test::write_text(file, text);
    });
    EXPECT_TRUE(mentions(found, "checksum")) << file;
  }
  const auto strays = findings_after([&] { test::write_text(path + "/tiles/x.part", ""); });
  EXPECT_EQ(strays.size(), 1U);
  EXPECT_TRUE(mentions(strays, "note '" + path + "/tiles/x.part': is not listed"));
  EXPECT_TRUE(mentions(findings_after([&] { std::filesystem::remove(path + "/scene.json"); }),
                       "holds no scene.json"));
}

TEST(CheckScene, AsksTheChecksOfTheCore) {
  const TemporaryFolder folder;
  const std::string path = folder / "a";
  SceneWriter writer(path, Existing::kRefuse);
  Tin tin = test::grid_tin(3, 3);
  const Groups groups = test::small_groups(tin);
  const HorizonTable horizons = test::small_horizons(test::grid_tin(4, 4));
  tin.vertices.push_back({500, 500, 0});  // without a triangle: it can be walked, check_tin minds
  write_tin(writer.path_for("t.tin"), tin, std::vector<std::int64_t>(10, 9), Existing::kRefuse);
  write_groups(writer.path_for("t.groups"), groups, Existing::kRefuse);
  write_horizon(writer.path_for("t.horizon"), horizons, Existing::kRefuse);
  SceneDescription scene = test::small_description();
  scene.tiles = {{"0/0/0",
                  {writer.record("t.tin", "tin"), writer.record("t.groups", "groups"),
                   writer.record("t.horizon", "horizon")}}};
  writer.finish(scene);
  double done = 0;
  const auto findings = check_scene(
      path, [](const Tin&, const Groups&) { return "node 1 is too small"; },
      [&](double d) { done = d; });
  ASSERT_EQ(findings.size(), 4U);
  EXPECT_NE(findings[0].message.find("vertex 9 has no triangle"), std::string::npos);
  EXPECT_NE(findings[1].message.find("sample 9 in a raster of 9"), std::string::npos);
  EXPECT_NE(findings[2].message.find("node 1 is too small"), std::string::npos);
  EXPECT_NE(findings[3].message.find("horizons of 16 vertices for a TIN of 10"), std::string::npos);
  EXPECT_EQ(done, 1);
}

}  // namespace
}  // namespace scarp
