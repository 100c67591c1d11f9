#include "store/store_files.h"

#include "base/error.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "tests/store/file_size_limit.h"
#include "tests/store/temp_store.h"
#include "tests/temporary_folder.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr BlockKey kLeftKey{BlockKind::kLinks, 3, 4, 5};

class NewStore : public ::testing::Test {
 protected:
  // Leaves what remains of a program that is killed and whose store is removed:
  // a journal with a commit in it.
  void LeaveAJournal() {
    const auto store = CreateStore(path_);
    store->Put(kLeftKey, TestContent(1, 1000));
    store->Commit();
    std::filesystem::copy_file(path_ + "-wal", folder_ / "wal");
    ASSERT_GT(std::filesystem::file_size(folder_ / "wal"), 0U);
  }

  void SetUp() override {
    LeaveAJournal();
    std::filesystem::remove(path_);
    std::filesystem::rename(folder_ / "wal", path_ + "-wal");
  }

  TemporaryFolder folder_;
  std::string path_ = folder_ / "a.enf";
};

TEST_F(NewStore, HoldsNothingOfOneThatWasRemoved) {
  const auto store = MakeStore(
      path_, [](BlockStorage& made) { made.SetMeta("settings", "new"); });
  EXPECT_EQ(store->Meta("settings"), "new");
  EXPECT_EQ(store->Count(BlockKind::kLinks), 0U);
  store->VerifyAll({});
}

TEST_F(NewStore, IsNotThereIfItCannotBeFilled) {
  EXPECT_THROW(MakeStore(path_, [](BlockStorage&) { throw DiskError("full"); }),
               DiskError);
  EXPECT_FALSE(std::filesystem::exists(path_));
  EXPECT_FALSE(std::filesystem::exists(path_ + ".part"));
}

TEST_F(NewStore, LeavesNothingWhateverItsFillingThrows) {
  EXPECT_THROW(
      MakeStore(path_, [](BlockStorage&) { throw UsageError("a name"); }),
      UsageError);
  EXPECT_TRUE(std::filesystem::is_empty(folder_.Path()));
}

// The content fits into the journal but not into the file behind the tables:
// after a rename it would stay in a journal of another name.
TEST_F(NewStore, IsNotThereIfTheDiskIsFullBeforeAllIsInItsFile) {
  std::optional<FileSizeLimit> full;
  const auto fill = [&](BlockStorage& made) {
    full.emplace(std::filesystem::file_size(path_ + ".part") + 1000);
    made.SetMeta("settings", std::string(40'000, 's'));
  };
  EXPECT_THROW(MakeStore(path_, fill), DiskError);
  EXPECT_TRUE(std::filesystem::is_empty(folder_.Path()));
}

// A reader keeps the state from before the store was filled: until the reader
// is gone, the rest stays in the journal, which would have another name after a
// rename.
TEST_F(NewStore, IsNotThereIfAReaderKeepsAllFromComingIntoItsFile) {
  std::unique_ptr<BlockStorage> reader;
  const auto fill = [&](BlockStorage& made) {
    reader = OpenStore(path_ + ".part", StoreAccess::kRead);
    made.SetMeta("settings", "new");
  };
  EXPECT_THROW(MakeStore(path_, fill), DiskError);
  reader.reset();
  EXPECT_TRUE(std::filesystem::is_empty(folder_.Path()));
}

TEST_F(NewStore, IsNotMadeOverAnother) {
  const auto fill = [](BlockStorage& made) { made.SetMeta("who", "first"); };
  MakeStore(path_, fill);
  EXPECT_THROW(MakeStore(path_, [](BlockStorage&) {}), DiskError);
  EXPECT_EQ(OpenStore(path_, StoreAccess::kRead)->Meta("who"), "first");
}

// The link may lead to a disk that is absent now.
TEST_F(NewStore, IsNotMadeInThePlaceOfALinkToNothing) {
  std::filesystem::create_symlink(folder_ / "elsewhere", path_);
  EXPECT_THROW(MakeStore(path_, [](BlockStorage&) {}), DiskError);
  EXPECT_TRUE(std::filesystem::is_symlink(path_));
}

}  // namespace
}  // namespace enfilade
