#include "tools/pending_file.h"

#include "base/error.h"

#include <array>
#include <filesystem>
#include <iterator>
#include <ostream>
#include <string>

#include "tests/tools/run_program.h"
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

namespace enfilade {
namespace {

namespace fs = std::filesystem;

TEST(PendingFile, AppearsOnlyWhenItIsKept) {
  const TemporaryFolder folder;
  const fs::path path = folder / "a.json";
  PendingFile file(path);
  WriteFile(file.Path(), "new");
  EXPECT_FALSE(fs::exists(path));
  file.Keep();
  EXPECT_EQ(ReadFile(path), "new");
}

TEST(PendingFile, WhatWasThereStaysUnlessItIsKept) {
  const TemporaryFolder folder;
  const fs::path path = folder / "a.json";
  WriteFile(path, "old");
  {
    const PendingFile file(path);
    WriteFile(file.Path(), "half of the n");
  }
  EXPECT_EQ(ReadFile(path), "old");
  const fs::directory_iterator entries(folder.Path());
  EXPECT_EQ(std::distance(begin(entries), end(entries)), 1);
}

TEST(WriteFileInOneStep, LeavesWhatWasThereIfItFails) {
  const TemporaryFolder folder;
  const fs::path path = folder / "a.json";
  WriteFileInOneStep(path, [](std::ostream& out) { out << "old"; });
  const auto fail = [](std::ostream& out) {
    out << "half of the n";
    out.setstate(std::ios::badbit);
  };
  EXPECT_THROW(WriteFileInOneStep(path, fail), DiskError);
  EXPECT_EQ(ReadFile(path), "old");
}

TEST(PendingFile, LinksAreFollowed) {
  const TemporaryFolder folder;
  WriteFile(folder / "target", "old");
  fs::create_symlink(folder / "target", folder / "link");
  PendingFile file(folder / "link");
  WriteFile(file.Path(), "new");
  file.Keep();
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_EQ(ReadFile(folder / "target"), "new");
}

// The link names a place that is to be written, as a larger disk.
TEST(PendingFile, LinksToWhatIsNotThereYetAreFollowed) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "disk");
  fs::create_symlink("disk/target", folder / "near");
  fs::create_symlink(folder / "near", folder / "link");
  WriteFileInOneStep(folder / "link", [](std::ostream& out) { out << "new"; });
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_TRUE(fs::is_symlink(folder / "near"));
  EXPECT_EQ(ReadFile(folder / "disk/target"), "new");
}

TEST(PendingFile, LinksInACircleAreAnError) {
  const TemporaryFolder folder;
  fs::create_symlink(folder / "a", folder / "b");
  fs::create_symlink(folder / "b", folder / "a");
  EXPECT_THROW(PendingFile(folder / "a"), DiskError);
}

// A file renamed over a pipe would take the pipe away from its readers.
TEST(PendingFile, PipesAreWrittenAsTheyAre) {
  const TemporaryFolder folder;
  const std::string path = folder / "pipe";
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  const int reader = open(path.c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  {
    PendingFile file(path);
    EXPECT_TRUE(file.IsStream());
    WriteFile(file.Path(), "new");
    file.Keep();
  }
  std::array<char, 8> got{};
  EXPECT_EQ(read(reader, got.data(), got.size()), 3);
  close(reader);
  EXPECT_TRUE(fs::is_fifo(path));
}

TEST(PendingFile, StandardOutputIsNoFileToReplace) {
  EXPECT_TRUE(PendingFile("/dev/stdout").IsStream());
}

TEST(PendingFile, FilesInSharedMemoryAreFiles) {
  EXPECT_FALSE(PendingFile("/dev/shm/enfilade_pending_file_test").IsStream());
}

TEST(PendingFile, AskingWhetherItCouldBeWrittenTouchesNothing) {
  const TemporaryFolder folder;
  WriteFile(folder / "a.json.part", "of another run");
  RequireWritable(folder / "a.json");
  EXPECT_EQ(ReadFile(folder / "a.json.part"), "of another run");
}

TEST(PendingFile, WhatCannotBeWrittenIsADiskErrorAtOnce) {
  const TemporaryFolder folder;
  EXPECT_THROW(RequireWritable(folder / "no/such/a.json"), DiskError);
  EXPECT_THROW(RequireWritable(folder.Path()), DiskError);
  EXPECT_NO_THROW(RequireWritable(folder / "a.json"));
  EXPECT_TRUE(fs::is_empty(folder.Path()));
}

}  // namespace
}  // namespace enfilade
