// What a reader sees of a store that it may not write, or beside which it may
// not write, as that of another user.

#include "base/error.h"
#include "store/sqlite_store.h"
#include "store/store_files.h"

#include <filesystem>
#include <optional>
#include <string>

#include "tests/store/file_size_limit.h"
#include "tests/store/temp_store.h"
#include "tests/temporary_folder.h"
#include <grp.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

namespace enfilade {
namespace {

namespace fs = std::filesystem;

constexpr uid_t kNobody = 65534;

// To root, nothing is forbidden. Returns whether the process is another now.
bool BecomeNobody() {
  return setgroups(0, nullptr) == 0 &&
         setresgid(kNobody, kNobody, kNobody) == 0 &&
         setresuid(kNobody, kNobody, kNobody) == 0;
}

// The meta value "n", or why it cannot be read.
std::string ValueIn(const std::string& path) {
  try {
    return OpenStore(path, StoreAccess::kRead)->Meta("n").value_or("none");
  } catch (const std::exception& error) {
    return error.what();
  }
}

// Holds n = 1 in its file, and n = 2 in its journal. Nobody may write it.
class StoreOfAnother : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string made = folder_ / "made";
    CreateStore(made).reset();
    Write(made, "1");
    const auto writer = OpenStore(made, StoreAccess::kWrite);
    writer->SetMeta("n", "2");
    writer->Commit();
    fs::create_directory(fs::path(path_).parent_path());
    for (const std::string suffix : {"", "-wal", "-shm"}) {
      fs::copy_file(made + suffix, path_ + suffix);
      fs::permissions(path_ + suffix, fs::perms(0444));
    }
    fs::permissions(folder_.Path(), fs::perms(0755));
    MayWriteBeside(false);
  }

  void TearDown() override { MayWriteBeside(true); }

  static void Write(const std::string& path, const std::string& value) {
    const auto writer = OpenStore(path, StoreAccess::kWrite);
    writer->SetMeta("n", value);
    writer->Commit();
  }

  void MayWriteBeside(bool may) {
    fs::permissions(fs::path(path_).parent_path(),
                    fs::perms(may ? 0777 : 0555));
  }

  // As the owner, whatever the folder's permissions are at other times.
  void Remove(const char* suffix) {
    MayWriteBeside(true);
    fs::remove(path_ + suffix);
    MayWriteBeside(false);
  }

  // ValueIn() in a process of another user; of this one, if it is not root.
  [[nodiscard]] std::string Seen() const {
    int ends[2];
    EXPECT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) {
      const std::string seen = getuid() != 0 || BecomeNobody()
                                   ? ValueIn(path_)
                                   : "cannot become another user";
      _exit(write(ends[1], seen.data(), seen.size()) < 0 ? 1 : 0);
    }
    close(ends[1]);
    std::string seen(1000, '\0');
    const ssize_t size = read(ends[0], seen.data(), seen.size());
    seen.resize(size < 0 ? 0 : static_cast<size_t>(size));
    close(ends[0]);
    waitpid(child, nullptr, 0);
    return seen;
  }

  TemporaryFolder folder_;
  std::string path_ = folder_ / "shown/a.enf";
};

TEST_F(StoreOfAnother, IsReadWithWhatIsInItsJournal) {
  EXPECT_EQ(Seen(), "2");
}

TEST_F(StoreOfAnother, IsOneFileIfThereIsNoJournal) {
  Remove("-wal");
  EXPECT_EQ(Seen(), "1");
  Remove("-shm");
  EXPECT_EQ(Seen(), "1");
}

// As a writer leaves it that has folded it in and could not remove it.
TEST_F(StoreOfAnother, IsOneFileIfNothingIsInItsJournal) {
  Remove("-shm");
  fs::permissions(path_ + "-wal", fs::perms(0644));
  fs::resize_file(path_ + "-wal", 0);
  EXPECT_EQ(Seen(), "1");
}

TEST_F(StoreOfAnother, IsNotReadWithoutItsJournal) {
  Remove("-shm");
  const std::string refused = Seen();
  EXPECT_NE(refused.find(path_), std::string::npos) << refused;
  EXPECT_NE(refused.find("'a.enf-wal'"), std::string::npos) << refused;
  EXPECT_NE(refused.find("enfilade info"), std::string::npos) << refused;
}

TEST_F(StoreOfAnother, IsNotReadIfItsJournalCannotBe) {
  fs::permissions(path_ + "-wal", fs::perms::none);
  const std::string refused = Seen();
  EXPECT_NE(refused.find("'a.enf-wal'"), std::string::npos) << refused;
}

// The owner could not write to an index that is the reader's.
TEST_F(StoreOfAnother, GetsNoFilesOfTheReader) {
  Remove("-shm");
  MayWriteBeside(true);
  EXPECT_NE(Seen().find("'a.enf-wal'"), std::string::npos);
  EXPECT_FALSE(fs::exists(path_ + "-shm"));
}

// A reader without locks: a full disk has no room for the index.
TEST(FrozenStore, IsNotReadOnceItIsWritten) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.enf";
  constexpr BlockKey kKey{BlockKind::kLinks, 1, 0, 0};
  const auto write = [&](uint64_t seed) {
    const auto writer = OpenStore(path, StoreAccess::kWrite);
    writer->Put(kKey, TestContent(seed, 200'000 * seed));
    writer->Commit();
  };
  CreateStore(path).reset();
  write(1);
  std::optional<FileSizeLimit> full(0);
  const auto reader = OpenStore(path, StoreAccess::kRead);
  full.reset();
  EXPECT_EQ(reader->GetOrThrow(kKey), TestContent(1, 200'000));
  write(2);
  EXPECT_THROW(static_cast<void>(reader->Get(kKey)), DiskError);
  EXPECT_THROW(static_cast<void>(reader->Meta("n")), DiskError);
  EXPECT_THROW(static_cast<void>(reader->Count(BlockKind::kLinks)), DiskError);
  EXPECT_THROW(reader->VerifyAll({}), DiskError);
}

// As a store is that was removed and solved anew.
TEST(FrozenStore, IsReadWhileAnotherHasItsName) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.enf";
  const auto make = [&](const char* value) {
    MakeStore(path, [&](BlockStorage& store) { store.SetMeta("n", value); });
  };
  make("old");
  std::optional<FileSizeLimit> full(0);
  const auto reader = OpenStore(path, StoreAccess::kRead);
  full.reset();
  fs::remove(path);
  make("new");
  EXPECT_EQ(reader->Meta("n"), "old");
}

}  // namespace
}  // namespace enfilade
