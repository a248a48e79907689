#include "nn/base/file_io.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "nn/base/suggest.h"
#include "refusal.h"
#include "temp_folder.h"

namespace swarmcert::files {
namespace {

namespace fs = std::filesystem;
using tests::refuses;

class FileIo : public testing::Test {
 protected:
  std::string path(const char* name) const { return folder_ / name; }
  std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator{}));
  }
  tests::TempFolder folder_;
};

TEST_F(FileIo, WhatIsWrittenIsRead) {
  const std::string bytes("a\0b\n\xff", 5);
  write_file(path("x"), bytes, false);
  EXPECT_EQ(read_file(path("x")), bytes);
  EXPECT_EQ(files(), 1u) << "a temporary file is left behind";
  write_file(path("empty"), "", false);
  EXPECT_EQ(read_file(path("empty")), "");
}

TEST_F(FileIo, FilesLargerThanAnyThatIsReadAsAWholeHaveAHash) {
  write_file(path("x"), "abc", false);
  EXPECT_EQ(sha256_of_file(path("x")), sha256("abc"));
  fs::resize_file(path("x"), 0);
  fs::resize_file(path("x"), kLargestFile_bytes + 3);
  // truncate -s 268435459 z; sha256sum z
  EXPECT_EQ(sha256_of_file(path("x")), "4eaf48af4ee6b10004ffed3fa5def5c7e15ee120b7ddd3cea6bad9b5746ca833");
  EXPECT_TRUE(refuses([&] { sha256_of_file(path("none")); }, {path("none"), "No such file"}));
}

TEST_F(FileIo, FilesThatCannotBeReadAreNamedWithTheReason) {
  EXPECT_TRUE(refuses([&] { read_file(path("none")); }, {path("none"), "No such file"}));
  EXPECT_TRUE(refuses([&] { read_file(folder_.path()); }, {"is a folder"}));
}

TEST_F(FileIo, TheLimitIsExact) {
  write_file(path("x"), std::string(100'000, 'x'), false);
  EXPECT_EQ(read_file(path("x"), 100'000).size(), 100'000u);
  EXPECT_TRUE(refuses([&] { read_file(path("x"), 99'999); }, {path("x"), "larger than 99999 bytes"}));
}

TEST_F(FileIo, TheLimitHoldsForFilesWithoutASize) {
  EXPECT_TRUE(refuses([&] { read_file("/dev/zero", 1 << 20); }, {"/dev/zero", "larger than"}));
}

TEST_F(FileIo, AnExistingFileIsReplacedOnlyIfToldTo) {
  write_file(path("x"), "old", false);
  EXPECT_TRUE(refuses([&] { write_file(path("x"), "new", false); }, {path("x"), "exists", "--force"}));
  EXPECT_EQ(read_file(path("x")), "old");
  write_file(path("x"), "new", true);
  EXPECT_EQ(read_file(path("x")), "new");
  EXPECT_EQ(files(), 1u);
}

TEST_F(FileIo, AnOpenFileKeepsItsOldContents) {
  write_file(path("x"), "old", false);
  std::ifstream reader(path("x"));
  write_file(path("x"), "new!", true);
  std::string seen;
  reader >> seen;
  EXPECT_EQ(seen, "old");  // replaced by a rename, not overwritten
}

TEST_F(FileIo, PlacesThatCannotBeWrittenAreNamed) {
  EXPECT_TRUE(refuses([&] { write_file(path("no/x"), "", false); }, {path("no/x"), "No such file"}));
  EXPECT_TRUE(refuses([&] { write_file(folder_.path(), "", true); }, {"is a folder"}));
  EXPECT_TRUE(refuses([&] { write_file("/dev/full", "x", true); }, {"/dev/full", "No space"}));
  EXPECT_EQ(files(), 0u);
}

TEST_F(FileIo, DevicesAreWrittenToNotReplaced) {
  write_file("/dev/null", "x", false);
  struct stat status = {};
  ASSERT_EQ(::stat("/dev/null", &status), 0);
  EXPECT_TRUE(S_ISCHR(status.st_mode));
}

TEST_F(FileIo, ADashIsStandardOutput) {
  testing::internal::CaptureStdout();
  write_file("-", "text\n", false);
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "text\n");
  EXPECT_FALSE(fs::exists("-"));
}

TEST(Sha256, AgreesWithTheStandardsExamples) {  // FIPS 180-2, appendix B
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST(InputErrorMessage, IsOneLineOfTheFilledParts) {
  EXPECT_STREQ(InputError({"f", "line 2", "k", "3", "rule", "hint"}).what(), "f: line 2: k = 3: rule; hint");
  EXPECT_STREQ(InputError({"f", "", "", "", "rule", ""}).what(), "f: rule");
  EXPECT_STREQ(InputError({"f", "", "", "448 bytes", "rule", ""}).what(), "f: 448 bytes: rule");
  EXPECT_STREQ(InputError({"", "", "k", "", "a\nb\x1b", ""}).what(), "k: a?b?");
  EXPECT_EQ(InputError({"f", "line 2", "k", "3", "rule", "hint"}).fault().value, "3");
  EXPECT_EQ(in_quotes(std::string(100, 'x')), "\"" + std::string(80, 'x') + "...\"");
}

TEST(Suggest, FindsTypingErrors) {
  EXPECT_EQ(nearest("wieghts", {"schema", "weights"}), "weights");
  EXPECT_EQ(nearest("ouput", {"input", "output"}), "output");
  EXPECT_EQ(nearest("gama", {"gamma"}), "gamma");
  EXPECT_EQ(nearest("tabel", {"data", "table"}), "table");
  EXPECT_EQ(nearest("weights", {"weights"}), "weights");
}

TEST(Suggest, DoesNotGuessWhereNothingIsNear) {
  EXPECT_EQ(nearest("phi", {"rho"}), "");
  EXPECT_EQ(nearest("ab", {"cd"}), "");
  EXPECT_EQ(nearest("", {"a"}), "");
  EXPECT_EQ(nearest(std::string(1'000'000, 'x'), {"a"}), "");
  EXPECT_EQ(nearest("x", {}), "");
}

TEST(Suggest, OffersOneWordOrTheList) {
  EXPECT_EQ(did_you_mean("gama", {"phi", "gamma"}), "did you mean \"gamma\"?");
  EXPECT_EQ(did_you_mean("zzz", {"phi", "gamma"}), "allowed: phi, gamma");
  EXPECT_EQ(did_you_mean("zzz", {}), "");
  const std::string list = did_you_mean("zzz", std::vector<std::string>(25, "word"));
  EXPECT_NE(list.find("and 5 more"), std::string::npos) << list;
}

}  // namespace
}  // namespace swarmcert::files
