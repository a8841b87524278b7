#include "tiles/store/part_file.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "core/error/error.h"
#include "tests/tiles/limits.h"
#include "tests/tiles/temporary_folder.h"
#include "tiles/store/checksum.h"

namespace scarp {
namespace {

using test::TemporaryFolder;

std::span<const std::byte> bytes(std::string_view text) {
  return std::as_bytes(std::span(text));
}

/// The error of a step that must fail.
template <class Step>
Error error_of(Step step) {
  try {
    step();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no error";
  return Error(ErrorCode::kUsage, "");
}

TEST(PartFile, AppearsWholeOrNotAtAll) {
  const TemporaryFolder folder;
  {
    PartFile file(folder / "a", Existing::kRefuse);
    file.append(bytes("one "));
    EXPECT_FALSE(std::filesystem::exists(folder / "a"));
    file.append(bytes("two"));
    file.commit();
  }
  EXPECT_EQ(test::read_text(folder / "a"), "one two");
  {
    PartFile file(folder / "a", Existing::kReplace);
    file.append(bytes("never"));
  }
  EXPECT_EQ(test::read_text(folder / "a"), "one two");
  write_file(folder / "a", bytes("new"), Existing::kReplace);
  EXPECT_EQ(test::read_text(folder / "a"), "new");
  EXPECT_EQ(folder.names(), std::set<std::string>{"a"});
}

TEST(PartFile, RefusesWhatExistsBeforeAndAfterTheWork) {
  const TemporaryFolder folder;
  test::write_text(folder / "a", "old");
  EXPECT_EQ(error_of([&] { PartFile(folder / "a", Existing::kRefuse); }).code(), ErrorCode::kInput);
  PartFile file(folder / "b", Existing::kRefuse);
  test::write_text(folder / "b", "of somebody else");
  EXPECT_EQ(error_of([&] { file.commit(); }).code(), ErrorCode::kInput);
  EXPECT_EQ(test::read_text(folder / "b"), "of somebody else");
  EXPECT_EQ(error_of([&] { PartFile(folder.path(), Existing::kReplace); }).code(),
            ErrorCode::kInput);
}

TEST(PartFile, SaysWhatIsMissing) {
  const TemporaryFolder folder;
  const Error missing = error_of([&] { PartFile(folder / "no/a", Existing::kRefuse); });
  EXPECT_EQ(missing.code(), ErrorCode::kResource);
  EXPECT_NE(std::string(missing.what()).find("no/a': could not be written: No such file"),
            std::string::npos);
  EXPECT_NE(std::string(missing.what()).find("create it first"), std::string::npos);

  std::filesystem::permissions(folder.path(), std::filesystem::perms(0555));
  const test::NotRoot not_root;
  const Error denied = error_of([&] { PartFile(folder / "a", Existing::kRefuse); });
  EXPECT_EQ(denied.code(), ErrorCode::kResource);
  EXPECT_NE(std::string(denied.what()).find("permissions"), std::string::npos) << denied.what();
}

TEST(PartFile, FullDiskLeavesNothingBehind) {
  const TemporaryFolder folder;
  test::write_text(folder / "a", "old");
  const std::string large(100'000, 'x');
  {
    const test::FullDisk full(40'000);
    const Error error =
        error_of([&] { write_file(folder / "a", bytes(large), Existing::kReplace); });
    EXPECT_EQ(error.code(), ErrorCode::kResource);
    EXPECT_NE(std::string(error.what()).find("/a': could not be written: File too large"),
              std::string::npos)
        << error.what();
  }
  EXPECT_EQ(test::read_text(folder / "a"), "old");
  EXPECT_EQ(folder.names(), std::set<std::string>{"a"});
}

TEST(ReplaceFolder, AtEveryMomentThereIsOne) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "now");
  std::atomic<bool> stop = false;
  std::atomic<int> missing = 0, looks = 0;
  std::thread looker([&] {
    for (; !stop; ++looks) missing += std::filesystem::exists(folder / "now") ? 0 : 1;
  });
  while (looks == 0) std::this_thread::yield();
  for (int i = 0; i < 3000; ++i) {
    std::filesystem::create_directory(folder / "next");
    const std::string old = replace_folder(folder / "next", folder / "now");
    std::filesystem::remove(old);
  }
  stop = true;
  looker.join();
  EXPECT_EQ(missing, 0) << "of " << looks;
  EXPECT_EQ(folder.names(), std::set<std::string>{"now"});
  EXPECT_EQ(error_of([&] { replace_folder(folder / "next", folder / "now"); }).code(),
            ErrorCode::kResource);
  EXPECT_EQ(folder.names(), std::set<std::string>{"now"});
}

TEST(Checksum, HexGoesThereAndBack) {
  // XXH3-128 of nothing, from the specification's own test vectors
  EXPECT_EQ(to_hex(checksum_of({})), "99aa06d3014798d86001c324468d497f");
  const Checksum checksum = checksum_of(bytes("scarp"));
  EXPECT_EQ(checksum_from_hex(to_hex(checksum)), checksum);
  EXPECT_EQ(checksum_from_hex("99aa"), std::nullopt);
  EXPECT_EQ(checksum_from_hex("99AA06D3014798D86001C324468D497F"), std::nullopt);
  ChecksumStream stream;
  stream.add(bytes("sc"));
  stream.add(bytes("arp"));
  EXPECT_EQ(stream.checksum(), checksum);
}

TEST(Checksum, OfAFile) {
  const TemporaryFolder folder;
  const std::string text(3'000'000, 'y');
  test::write_text(folder / "f", text);
  const FileDigest digest = digest_of_file(folder / "f");
  EXPECT_EQ(digest.size, text.size());
  EXPECT_EQ(digest.checksum, checksum_of(bytes(text)));
  EXPECT_EQ(error_of([&] { digest_of_file(folder / "none"); }).code(), ErrorCode::kInput);
  EXPECT_EQ(error_of([&] { digest_of_file(folder.path()); }).code(), ErrorCode::kInput);
}

}  // namespace
}  // namespace scarp
