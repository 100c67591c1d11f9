#include "store/sqlite_store.h"

#include "base/error.h"

#include <atomic>
#include <cstdint>
#include <fstream>
#include <memory>
#include <thread>
#include <vector>

#include "tests/store/temp_store.h"
#include <gtest/gtest.h>
#include <sqlite3.h>

namespace enfilade {
namespace {

constexpr BlockKey kKey{BlockKind::kLinks, 3, 4, 5};

std::vector<BlockKey> KeysOf(const BlockStorage& store, BlockKind kind) {
  std::vector<BlockKey> keys;
  store.ForEachKey(kind, [&](const BlockKey& key) { keys.push_back(key); });
  return keys;
}

std::string MessageOfOpening(const std::filesystem::path& path) {
  try {
    static_cast<void>(OpenStore(path, StoreAccess::kRead));
  } catch (const Error& error) {
    return error.what();
  }
  return "opened";
}

TEST(Store, MemoryStoreReturnsWhatWasPut) {
  const auto store = CreateStoreInMemory();
  const Bytes content = TestContent(1, 100'000);
  store->Put(kKey, content);
  store->SetMeta("settings", "{}");
  EXPECT_EQ(store->GetOrThrow(kKey), content);
  EXPECT_EQ(store->Meta("settings"), "{}");
  store->Commit();
  EXPECT_EQ(store->GetOrThrow(kKey), content);
  EXPECT_GT(store->FileBytes(), 0U);
  store->VerifyAll({});
}

TEST(Store, EmptyBlockIsABlock) {
  const auto store = CreateStoreInMemory();
  store->Put(kKey, {});
  store->SetMeta("empty", "");
  ASSERT_TRUE(store->Get(kKey).has_value());
  EXPECT_TRUE(store->Get(kKey)->empty());
  EXPECT_EQ(store->Meta("empty"), "");
  store->VerifyAll({});
}

TEST(Store, AbsentBlockIsNulloptOrANamedError) {
  const auto store = CreateStoreInMemory();
  EXPECT_FALSE(store->Get(kKey).has_value());
  EXPECT_FALSE(store->Meta("nothing").has_value());
  store->Erase(kKey);
  try {
    static_cast<void>(store->GetOrThrow(kKey));
    FAIL() << "an absent block was returned";
  } catch (const DamagedStoreError& error) {
    EXPECT_NE(std::string(error.what()).find("links 3 4 5"), std::string::npos);
  }
}

TEST(Store, DamageInAMetaEntryNamesStoreAndEntry) {
  const auto store = CreateStoreInMemory();
  const auto read = [&] {
    return ReadPackedMeta(
        *store, "scene", [](ByteReader& in) { return in.Get<uint8_t>(); });
  };
  EXPECT_EQ(read(), std::nullopt);
  store->SetMeta("scene", "a");
  EXPECT_EQ(read(), 'a');
  for (const std::string damaged : {"", "ab"}) {
    store->SetMeta("scene", damaged);
    try {
      read();
      FAIL() << "damage was read as a value";
    } catch (const DamagedStoreError& error) {
      const std::string text = error.what();
      EXPECT_NE(text.find(store->Name()), std::string::npos) << text;
      EXPECT_NE(text.find("'scene'"), std::string::npos) << text;
    }
  }
}

TEST(Store, KeysAreVisitedInAscendingOrderAcrossBatches) {
  const auto store = CreateStoreInMemory();
  constexpr uint32_t kBlocks = 2500;  // more than two batches of a walk
  for (uint32_t i = 0; i < kBlocks; ++i) {
    const uint32_t j = (i * 1117) % kBlocks;  // a permutation
    store->Put({BlockKind::kLinks, j / 100, j % 100 / 10, j % 10}, {});
  }
  store->Put({BlockKind::kTrace, 0xffffffff, 0, 0}, {});
  store->Put({BlockKind::kTrace, 0x80000000, 0, 0}, {});
  const auto keys = KeysOf(*store, BlockKind::kLinks);
  ASSERT_EQ(keys.size(), kBlocks);
  EXPECT_TRUE(std::is_sorted(keys.begin(), keys.end()));
  EXPECT_EQ(KeysOf(*store, BlockKind::kTrace).back().a, 0xffffffff);
}

TEST(Store, VisitorMayUseTheStore) {
  const auto store = CreateStoreInMemory();
  store->Put({BlockKind::kScratch, 1, 0, 0}, TestContent(1, 10));
  store->Put({BlockKind::kScratch, 2, 0, 0}, TestContent(2, 10));
  store->ForEachKey(BlockKind::kScratch, [&](const BlockKey& key) {
    EXPECT_TRUE(store->Get(key).has_value());
    store->Erase(key);
  });
  EXPECT_EQ(store->Count(BlockKind::kScratch), 0U);
}

TEST(Store, EraseAllTakesThePrefixAndNothingElse) {
  const auto store = CreateStoreInMemory();
  for (uint32_t i = 0; i < 27; ++i) {
    store->Put({BlockKind::kLinks, i / 9, i / 3 % 3, i % 3}, {});
  }
  store->Put({BlockKind::kFaces, 1, 1, 1}, {});
  EXPECT_EQ(store->Count(BlockKind::kLinks, 1, 1), 3U);
  store->EraseAll(BlockKind::kLinks, 1, 1);
  EXPECT_EQ(store->Count(BlockKind::kLinks, 1, 1), 0U);
  EXPECT_EQ(store->Count(BlockKind::kLinks), 24U);
  store->EraseAll(BlockKind::kLinks, 0);
  EXPECT_EQ(store->Count(BlockKind::kLinks), 15U);
  store->EraseAll(BlockKind::kLinks);
  EXPECT_EQ(store->Count(BlockKind::kLinks), 0U);
  EXPECT_EQ(store->Count(BlockKind::kFaces), 1U);
  store->VerifyAll({});
}

TEST(Store, StoredBytesAreTheCompressedBytesOfItsBlocks) {
  const auto store = CreateStoreInMemory();
  store->Put(kKey, TestContent(1, 1 << 20));
  const uint64_t once = store->StoredBytes(BlockKind::kLinks);
  EXPECT_LT(once, 1U << 20);
  EXPECT_EQ(store->Stats().bytes_written, once);
  static_cast<void>(store->Get(kKey));
  EXPECT_EQ(store->Stats().bytes_read, once);
  store->Put(kKey, {});
  EXPECT_LT(store->StoredBytes(BlockKind::kLinks), 100U);
}

TEST(Store, CommittedContentIsInOneFileAfterClosing) {
  const TemporaryFolder folder;
  const Bytes content = TestContent(7, 3'000'000);
  {
    const auto store = CreateStore(folder / "a.enf");
    store->Put(kKey, content);
    store->Commit();
    store->Put({BlockKind::kLinks, 9, 9, 9}, content);  // never committed
  }
  const auto files = std::filesystem::directory_iterator(folder / "");
  EXPECT_EQ(std::distance(begin(files), end(files)), 1);
  std::filesystem::rename(folder / "a.enf", folder / "b.enf");
  const auto store = OpenStore(folder / "b.enf", StoreAccess::kRead);
  EXPECT_EQ(store->GetOrThrow(kKey), content);
  EXPECT_EQ(store->Count(BlockKind::kLinks), 1U);
  store->VerifyAll({});
}

TEST(Store, LargestBlockComesBack) {
  const TemporaryFolder folder;
  const auto store = CreateStore(folder / "a.enf");
  const Bytes content(64ULL << 20, std::byte{42});
  store->Put(kKey, content);
  store->Commit();
  EXPECT_EQ(store->GetOrThrow(kKey), content);
}

TEST(Store, SecondWriterIsRefused) {
  const TemporaryFolder folder;
  auto store = CreateStore(folder / "a.enf");
  EXPECT_THROW(
      static_cast<void>(OpenStore(folder / "a.enf", StoreAccess::kWrite)),
      DiskError);
  EXPECT_THROW(static_cast<void>(CreateStore(folder / "a.enf")), DiskError);
  store.reset();
  EXPECT_NE(OpenStore(folder / "a.enf", StoreAccess::kWrite), nullptr);
}

TEST(Store, SecondWriterThroughALinkIsRefused) {
  const TemporaryFolder folder;
  std::filesystem::create_symlink(folder / "a.enf", folder / "link.enf");
  const auto first = CreateStore(folder / "a.enf");
  EXPECT_THROW(OpenStore(folder / "link.enf", StoreAccess::kWrite), DiskError);
  EXPECT_FALSE(std::filesystem::exists(folder / "link.enf-lock"));
}

TEST(Store, ReaderSeesTheLastCommitBeforeItOpened) {
  const TemporaryFolder folder;
  const auto writer = CreateStore(folder / "a.enf");
  writer->SetMeta("n", "1");
  writer->Commit();
  writer->SetMeta("n", "2");
  const auto reader = OpenStore(folder / "a.enf", StoreAccess::kRead);
  EXPECT_EQ(reader->Meta("n"), "1");
  writer->Commit();
  EXPECT_EQ(reader->Meta("n"), "1");
  EXPECT_EQ(OpenStore(folder / "a.enf", StoreAccess::kRead)->Meta("n"), "2");
  writer->SetMeta("n", "3");
  writer->Commit();
  EXPECT_EQ(writer->Meta("n"), "3");
}

TEST(Store, CreateRefusesAnExistingFile) {
  const TemporaryFolder folder;
  std::ofstream(folder / "a.enf") << "something dear";
  EXPECT_THROW(static_cast<void>(CreateStore(folder / "a.enf")), DiskError);
  EXPECT_EQ(std::filesystem::file_size(folder / "a.enf"), 14U);
}

TEST(Store, CreateIsNotConfusedByRemainsOfADeletedStore) {
  const TemporaryFolder folder;
  std::ofstream(folder / "a.enf-wal") << std::string(100'000, 'x');
  std::ofstream(folder / "a.enf-lock");
  CreateStore(folder / "a.enf")->Commit();
  OpenStore(folder / "a.enf", StoreAccess::kRead)->VerifyAll({});
}

TEST(Store, OpeningWhatIsNoStoreSaysSo) {
  const TemporaryFolder folder;
  EXPECT_THROW(
      static_cast<void>(OpenStore(folder / "none.enf", StoreAccess::kRead)),
      DiskError);
  std::ofstream(folder / "empty.enf");
  EXPECT_NE(MessageOfOpening(folder / "empty.enf").find("empty"),
            std::string::npos);
  std::ofstream(folder / "text.enf") << std::string(100'000, 'o');
  EXPECT_NE(MessageOfOpening(folder / "text.enf")
                .find("is not an Enfilade store, or"),
            std::string::npos);
  EXPECT_NE(MessageOfOpening(folder / "").find("not a file"),
            std::string::npos);
}

// Runs SQL on the file from outside.
void Tamper(const std::filesystem::path& path, const char* sql) {
  sqlite3* handle = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &handle), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(handle, sql, nullptr, nullptr, nullptr), SQLITE_OK)
      << sqlite3_errmsg(handle);
  sqlite3_close(handle);
}

TEST(Store, OtherDatabasesAndOtherFormatsAreNamed) {
  const TemporaryFolder folder;
  Tamper(folder / "other.db", "CREATE TABLE t(x)");
  EXPECT_NE(MessageOfOpening(folder / "other.db").find("not an Enfilade store"),
            std::string::npos);
  CreateStore(folder / "new.enf")->Commit();
  Tamper(folder / "new.enf", "PRAGMA user_version = 99");
  EXPECT_NE(MessageOfOpening(folder / "new.enf").find("format 99"),
            std::string::npos);
}

TEST(Store, BlockUnderAnotherKeyIsDamaged) {
  const TemporaryFolder folder;
  const auto path = folder / "a.enf";
  const BlockKey other{BlockKind::kLinks, 3, 4, 6};
  {
    const auto store = CreateStore(path);
    store->Put(kKey, TestContent(1, 1000));
    store->Put(other, TestContent(2, 1000));
    store->Commit();
  }
  // Frames 1 and 2 change places, and so does all that the catalogue says of
  // them except the keys.
  Tamper(path,
         "UPDATE catalogue SET frame = 3 - frame, frame_bytes = "
         "(SELECT sum(frame_bytes) FROM catalogue) - frame_bytes");
  const auto store = OpenStore(path, StoreAccess::kRead);
  EXPECT_THROW(static_cast<void>(store->Get(kKey)), DamagedStoreError);
  EXPECT_THROW(static_cast<void>(store->Get(other)), DamagedStoreError);
}

// For some kinds of blocks, a missing block would be taken for an empty one.
TEST(Store, LostOrRenamedBlockIsFoundAtOpening) {
  const TemporaryFolder folder;
  const auto path = folder / "a.enf";
  {
    const auto store = CreateStore(path);
    store->Put(kKey, TestContent(1, 1000));
    store->Put({BlockKind::kFaces, 0, 0, 0}, TestContent(2, 1000));
    store->Commit();
    store->VerifyAll({});
  }
  std::filesystem::copy_file(path, folder / "b.enf");
  Tamper(path, "DELETE FROM catalogue WHERE kind = 1");
  Tamper(folder / "b.enf", "UPDATE catalogue SET c = 6 WHERE c <> 0");
  for (const auto access : {StoreAccess::kRead, StoreAccess::kWrite}) {
    EXPECT_THROW(OpenStore(path, access), DamagedStoreError);
    EXPECT_THROW(OpenStore(folder / "b.enf", access), DamagedStoreError);
  }
}

TEST(Store, ChangedMetaIsDamaged) {
  const TemporaryFolder folder;
  const auto path = folder / "a.enf";
  {
    const auto store = CreateStore(path);
    store->SetMeta("settings", "{\"error\": 0.05}");
    store->Commit();
  }
  Tamper(path, "UPDATE meta SET value = CAST('{\"error\": 0.06}' AS BLOB)");
  const auto store = OpenStore(path, StoreAccess::kRead);
  EXPECT_THROW(static_cast<void>(store->Meta("settings")), DamagedStoreError);
  EXPECT_THROW(store->VerifyAll({}), DamagedStoreError);
}

TEST(Store, ThreadsMayPutAndGetAtOnce) {
  const TemporaryFolder folder;
  const auto store = CreateStore(folder / "a.enf");
  const auto work = [&](uint32_t thread) {
    for (uint32_t i = 0; i < 50; ++i) {
      const BlockKey key{BlockKind::kCellTree, thread, i, 0};
      store->Put(key, TestContent(thread * 1000 + i, 5000 + i));
      ASSERT_EQ(store->GetOrThrow(key),
                TestContent(thread * 1000 + i, 5000 + i));
    }
  };
  std::vector<std::thread> threads;
  for (uint32_t thread = 0; thread < 3; ++thread) {
    threads.emplace_back(work, thread);
  }
  for (auto& thread : threads) {
    thread.join();
  }
  store->Commit();
  EXPECT_EQ(store->Count(BlockKind::kCellTree), 150U);
}

TEST(Store, BlockThatIsReplacedMeanwhileIsTheOldOrTheNewOne) {
  const auto store = CreateStoreInMemory();
  const Bytes shorter = TestContent(1, 100);
  const Bytes longer = TestContent(2, 5000);
  store->Put(kKey, shorter);
  std::atomic<bool> done = false;
  std::atomic<size_t> short_reads = 0;
  std::atomic<size_t> long_reads = 0;
  const auto read = [&] {
    while (!done) {
      Bytes found;
      EXPECT_NO_THROW(found = store->GetOrThrow(kKey));
      EXPECT_TRUE(found == shorter || found == longer);
      ++(found == longer ? long_reads : short_reads);
    }
  };
  std::vector<std::thread> readers;
  for (int i = 0; i < 3; ++i) {
    readers.emplace_back(read);
  }
  // Until each content was read many times, but not for ever.
  constexpr size_t kReads = 100;
  const auto is_enough = [&] {
    return short_reads >= kReads && long_reads >= kReads;
  };
  for (int i = 0; i < 20'000 || (!is_enough() && i < 1'000'000); ++i) {
    store->Put(kKey, i % 2 == 0 ? longer : shorter);
  }
  EXPECT_TRUE(is_enough()) << short_reads << " and " << long_reads;
  done = true;
  for (auto& reader : readers) {
    reader.join();
  }
}

}  // namespace
}  // namespace enfilade
