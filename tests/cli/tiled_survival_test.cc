// Builds in tiles that are stopped by something: what was finished stays usable.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <thread>

#include "tests/cli/tiled_terrain.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;
using test::files_of;
using test::records_of;
using test::run_scarp;
using test::RunResult;

bool is_one_line(const std::string& text) {
  return std::ranges::count(text, '\n') == 1;
}

/// A build in a process of its own, beside the test.
class RunningBuild {
 public:
  explicit RunningBuild(const std::string& command) : errors_(folder_.path("errors")) {
    child_ = fork();
    if (child_ == 0) {
      const std::string exec =
          "SCARP='" SCARP_PROGRAM "'; exec " + command + " >/dev/null 2>'" + errors_ + "'";
      execl("/bin/sh", "sh", "-c", exec.c_str(), nullptr);
      _exit(127);
    }
  }
  ~RunningBuild() {
    if (is_running()) kill();
  }

  bool is_running() {
    if (child_ != 0 && waitpid(child_, &status_, WNOHANG) == child_) child_ = 0;
    return child_ != 0;
  }

  /// Until there are so many records of finished steps. @return false where it ended before
  bool wait_for_records(const std::string& scene, std::size_t count) {
    while (is_running()) {
      if (records_of(scene).size() >= count) return true;
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    return false;
  }

  void pause() const { ::kill(child_, SIGSTOP); }
  void go_on() const { ::kill(child_, SIGCONT); }

  /// @return whether it was still running
  bool kill() {
    if (child_ != 0) {
      ::kill(child_, SIGKILL);
      finish();
    }
    return WIFSIGNALED(status_);
  }

  /// Waits for its end.
  RunResult finish() {
    if (child_ != 0) waitpid(child_, &status_, 0);
    child_ = 0;
    std::ostringstream text;
    text << std::ifstream(errors_).rdbuf();
    return {WIFEXITED(status_) ? WEXITSTATUS(status_) : -1, "", text.str()};
  }

 private:
  test::TempFolder folder_;
  std::string errors_;
  pid_t child_ = 0;
  int status_ = 0;
};

class TiledSurvival : public test::TiledTerrain {
 protected:
  /// A build of `dem` that has finished some steps and is held still.
  static std::unique_ptr<RunningBuild> held_build(const std::string& dem,
                                                  const std::string& scene) {
    for (;;) {
      auto running = std::make_unique<RunningBuild>(build_of(dem, scene) + "--overwrite");
      if (!running->wait_for_records(scene, 3)) continue;
      running->pause();
      // On a busy machine it may have come to its end before it was held.
      if (records_of(scene).size() < 12) return running;
    }
  }

  /// It ends in one line that says `says`, and with --resume in the same bits.
  static void expect_line(const RunResult& stopped, const std::string& says) {
    EXPECT_EQ(stopped.exit_code, 1) << stopped.errors;
    EXPECT_TRUE(is_one_line(stopped.errors)) << stopped.errors;
    EXPECT_NE(stopped.errors.find(says), std::string::npos) << stopped.errors;
  }
  static void expect_finished_by(const std::string& resume, const std::string& scene) {
    const auto before = records_of(scene);
    EXPECT_GE(before.size(), 3U);
    const RunResult run = run_scarp(resume);
    EXPECT_EQ(run.exit_code, 0) << run.errors;
    EXPECT_EQ(files_of(scene), files_of(scene_));
    EXPECT_FALSE(fs::exists(scene + ".part"));
  }
};

TEST_F(TiledSurvival, KilledAndResumedItMakesTheSameSceneAndRepeatsNothing) {
  // SCARP_PROVE_KILLS=50 is the long form.
  const char* asked = std::getenv("SCARP_PROVE_KILLS");
  const int kills = asked ? std::atoi(asked) : 4;
  const std::string scene = folder_->path("killed.scene");
  const auto begun = std::chrono::steady_clock::now();
  ASSERT_EQ(run_scarp(build(scene)).exit_code, 0);
  const auto whole = std::chrono::duration_cast<std::chrono::milliseconds>(
      std::chrono::steady_clock::now() - begun);
  fs::remove_all(scene);
  std::uint64_t random = 1;
  int killed = 0;
  while (killed < kills) {
    random = random * 6364136223846793005U + 1442695040888963407U;
    const auto after = whole * static_cast<int>((random >> 33) % 1000) / 1000 / (asked ? 1 : 2);
    const auto before = records_of(scene);
    RunningBuild running(build(scene) + "--resume");
    std::this_thread::sleep_for(after);
    if (running.kill()) {
      ++killed;
      for (const auto& [record, time] : records_of(scene))
        if (before.contains(record)) {
          EXPECT_EQ(before.at(record), time) << record;
        }
      if (fs::exists(scene + "/scene.json")) {
        EXPECT_EQ(files_of(scene), files_of(scene_));
        fs::remove_all(scene);
      }
    } else {
      EXPECT_EQ(files_of(scene), files_of(scene_));
      fs::remove_all(scene);
    }
  }
  const RunResult last = run_scarp(build(scene) + "--resume");
  EXPECT_EQ(last.exit_code, 0) << last.errors;
  EXPECT_EQ(files_of(scene), files_of(scene_));
  EXPECT_EQ(run_scarp("$SCARP check " + scene).exit_code, 0);
  EXPECT_FALSE(fs::exists(scene + ".part"));
  fs::remove_all(scene);
}

TEST_F(TiledSurvival, AFullDiskIsOneLineAndWhatWasFinishedIsGoneOnWith) {
  const std::string scene = folder_->path("full.scene");
  // Tiles fit under the limit, the pictures do not.
  const RunResult full = run_scarp("trap '' XFSZ; ulimit -f 700; " + build(scene));
  EXPECT_EQ(full.exit_code, 1);
  EXPECT_TRUE(is_one_line(full.errors)) << full.errors;
  EXPECT_NE(full.errors.find("--resume"), std::string::npos) << full.errors;
  EXPECT_FALSE(fs::exists(scene));
  const RunResult anew = run_scarp(build(scene));
  EXPECT_EQ(anew.exit_code, 1);
  EXPECT_NE(anew.errors.find("unfinished build"), std::string::npos) << anew.errors;
  const RunResult otherwise = run_scarp(build(scene) + "--resume --seed 2");
  EXPECT_EQ(otherwise.exit_code, 1);
  EXPECT_NE(otherwise.errors.find("other options"), std::string::npos) << otherwise.errors;
  const auto before = records_of(scene);
  EXPECT_EQ(before.size(), 17U);  // all but the last
  ASSERT_EQ(run_scarp(build(scene) + "--resume").exit_code, 0);
  EXPECT_EQ(files_of(scene), files_of(scene_));
  EXPECT_EQ(run_scarp(build(scene) + "--resume").exit_code, 0);  // nothing left to do
}

TEST_F(TiledSurvival, ASourceThatGoesOrChangesMidwayIsNamed) {
  const std::string dem = folder_->path("going.tif"), scene = folder_->path("going.scene");
  const std::string plan = folder_->path("going.json");
  fs::copy_file(dem_, dem);
  const std::string build = build_of(dem, scene);
  ASSERT_EQ(run_scarp(build + "--plan " + plan).exit_code, 0);
  const auto step = [&](int i) {
    return run_scarp("$SCARP build --plan " + plan + " --step " + std::to_string(i));
  };
  ASSERT_EQ(step(0).exit_code, 0);
  ASSERT_EQ(step(1).exit_code, 0);
  fs::rename(dem, dem + ".away");
  const RunResult gone = step(2);
  EXPECT_EQ(gone.exit_code, 1);
  EXPECT_NE(gone.errors.find("no such file"), std::string::npos) << gone.errors;
  fs::copy_file(dem_, dem);  // the same bytes, but who knows
  const RunResult changed = step(2);
  EXPECT_EQ(changed.exit_code, 1);
  EXPECT_NE(changed.errors.find("other sources"), std::string::npos) << changed.errors;
  fs::remove(dem);
  fs::rename(dem + ".away", dem);
  EXPECT_EQ(step(1).output.find("was done already") != std::string::npos, true);
  EXPECT_EQ(step(2).exit_code, 0);
  ASSERT_EQ(run_scarp(build + "--resume").exit_code, 0);
  EXPECT_EQ(files_of(scene), files_of(scene_));
}

/// A disk that is full by the kernel, where a process may have one of its own.
TEST_F(TiledSurvival, ADiskThatFillsUpIsOneLineAndWhatWasFinishedIsGoneOnWith) {
  const std::string disk = folder_->path("disk");
  fs::create_directory(disk);
  const std::string mount = "mount -t tmpfs -o size=450k none " + disk;
  if (run_scarp("unshare -rm " + mount).exit_code != 0)
    GTEST_SKIP() << "this machine lets no process mount a disk of its own";
  const std::string scene = disk + "/full.scene", kept = folder_->path("kept");
  std::ofstream(folder_->path("fill.sh"))
      << mount << "\n"
      << build(scene) << " || echo stopped\n"
      << "ls " << scene << ".part/work/steps | wc -l\n"
      << "mount -o remount,size=64m " << disk << "\n"
      << build(scene) << "--resume >/dev/null && cp -r " << scene << " " << kept << "\n";
  const RunResult run = run_scarp("SCARP=$SCARP unshare -rm sh " + folder_->path("fill.sh"));
  EXPECT_EQ(run.exit_code, 0) << run.errors;
  EXPECT_TRUE(is_one_line(run.errors)) << run.errors;
  EXPECT_NE(run.errors.find("No space left on device"), std::string::npos) << run.errors;
  std::istringstream output(run.output);
  std::string stopped;
  int records = 0;
  output >> stopped >> records;
  EXPECT_EQ(stopped, "stopped") << run.output;
  EXPECT_GE(records, 3);
  EXPECT_EQ(files_of(kept), files_of(scene_));
}

/// Permissions bind even the superuser so.
std::string bound_by_permissions() {
  return geteuid() != 0 ? ""
                        : "setpriv --bounding-set=-dac_override,-dac_read_search "
                          "--inh-caps=-dac_override,-dac_read_search ";
}

TEST_F(TiledSurvival, AReadOnlyFolderIsOneLineAndLeavesNothingBehind) {
  const std::string locked = folder_->path("locked");
  fs::create_directory(locked);
  fs::permissions(locked, fs::perms(0555));
  const RunResult run = run_scarp(bound_by_permissions() + build(locked + "/x.scene"));
  expect_line(run, "name an output in a folder that can be written to");
  EXPECT_TRUE(fs::is_empty(locked));
  fs::permissions(locked, fs::perms(0755));
}

TEST_F(TiledSurvival, AFolderThatBecomesReadOnlyIsOneLineAndWhatWasFinishedIsGoneOnWith) {
  const std::string scene = folder_->path("locked.scene"), part = scene + ".part";
  held_build(dem_, scene)->kill();
  const auto before = records_of(scene);
  ASSERT_EQ(run_scarp("chmod -R a-w " + part).exit_code, 0);
  const RunResult run = run_scarp(bound_by_permissions() + build(scene) + "--resume");
  expect_line(run, "Permission denied");
  EXPECT_NE(run.errors.find("--resume"), std::string::npos) << run.errors;
  EXPECT_EQ(records_of(scene), before);
  ASSERT_EQ(run_scarp("chmod -R u+w " + part).exit_code, 0);
  expect_finished_by(build(scene) + "--resume", scene);
}

TEST_F(TiledSurvival, ASourceThatDisappearsOrShrinksUnderARunningBuildIsNamed) {
  const std::string dem = folder_->path("shrinking.tif"), scene = folder_->path("shrunk.scene");
  const std::string copy = "cp -p " + dem_ + " " + dem;  // with its time
  const std::pair<std::string, std::string> endings[] = {{"rm ", "no such file"},
                                                         {"truncate -s 12000 ", "'" + dem + "'"}};
  for (const auto& [what, says] : endings) {
    ASSERT_EQ(run_scarp(copy).exit_code, 0);
    const std::unique_ptr<RunningBuild> running = held_build(dem, scene);
    ASSERT_EQ(run_scarp(what + dem).exit_code, 0);
    running->go_on();
    const RunResult stopped = running->finish();
    expect_line(stopped, says);
    EXPECT_NE(stopped.errors.find("--resume"), std::string::npos) << stopped.errors;
    ASSERT_EQ(run_scarp(copy).exit_code, 0);
    expect_finished_by(build_of(dem, scene) + "--resume", scene);
    fs::remove_all(scene);
  }
}

TEST_F(TiledSurvival, TwoBuildsOfOneSceneAreOneTooMany) {
  const std::string scene = folder_->path("both.scene");
  const std::unique_ptr<RunningBuild> first = held_build(dem_, scene);
  for (const char* options : {"", "--overwrite", "--resume"})
    expect_line(run_scarp(build(scene) + options), "another process is building");
  first->go_on();
  EXPECT_EQ(first->finish().exit_code, 0);
  EXPECT_EQ(files_of(scene), files_of(scene_));
}

TEST_F(TiledSurvival, AReaderBesideARunningBuildSeesTheOldSceneOrTheNewOne) {
  const std::string scene = folder_->path("read.scene");
  const std::string other = folder_->path("other.tif");
  ASSERT_EQ(run_scarp("gdal_translate -q -srcwin 0 0 141 90 " + dem_ + " " + other).exit_code, 0);
  ASSERT_EQ(run_scarp(build_of(other, scene)).exit_code, 0);
  const auto ask = [&](const std::string& of) {
    return run_scarp("$SCARP cull " + of + " --camera=401900,5198200,40 --json | grep -v _s");
  };
  const std::string old_answer = ask(scene).output, new_answer = ask(scene_).output;
  ASSERT_NE(old_answer, new_answer);
  RunningBuild running(build(scene) + "--overwrite");
  int old_answers = 0;
  while (running.is_running()) {
    const RunResult run = ask(scene);
    if (run.errors.empty()) {
      EXPECT_TRUE(run.output == old_answer || run.output == new_answer) << run.output;
    } else {  // replaced between its description and its tiles
      EXPECT_TRUE(is_one_line(run.errors)) << run.errors;
      EXPECT_NE(run.errors.find("open it again"), std::string::npos) << run.errors;
    }
    old_answers += run.output == old_answer;
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
  }
  EXPECT_GT(old_answers, 0);
  EXPECT_EQ(running.finish().exit_code, 0);
  EXPECT_EQ(ask(scene).output, new_answer);
}

}  // namespace
}  // namespace scarp
