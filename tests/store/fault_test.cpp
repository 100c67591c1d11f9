// What a store must survive: crashes, full disks, damage.

#include "base/error.h"
#include "store/sqlite_store.h"

#include <csignal>
#include <fstream>
#include <iterator>
#include <memory>
#include <vector>

#include "tests/store/file_size_limit.h"
#include "tests/store/temp_store.h"
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

namespace enfilade {
namespace {

BlockKey RandomKey(Random& random) {
  return {kAllKinds[random.NextBelow(3)],
          random.NextBelow(3),
          random.NextBelow(3),
          random.NextBelow(3)};
}

// Sizes from empty to several pages, small ones more often.
size_t RandomSize(Random& random) {
  return random.NextBelow(1U << random.NextBelow(18));
}

void EraseFromModel(StoreModel& model,
                    const std::function<bool(const BlockKey&)>& is_meant) {
  std::erase_if(model.blocks,
                [&](const auto& block) { return is_meant(block.first); });
}

// One random change, to the store and to the model alike.
void Mutate(BlockStorage& store, StoreModel& model, Random& random) {
  const BlockKey key = RandomKey(random);
  switch (random.NextBelow(12)) {
    case 0: {
      const std::string name = "meta " + std::to_string(key.a);
      const std::string value(random.NextBelow(50'000), 'v');
      store.SetMeta(name, value);
      model.meta[name] = value;
      return;
    }
    case 1:
      store.Erase(key);
      model.blocks.erase(key);
      return;
    case 2:
      store.EraseAll(key.kind, key.a, key.b);
      EraseFromModel(model, [&](const BlockKey& other) {
        return other.kind == key.kind && other.a == key.a && other.b == key.b;
      });
      return;
    case 3:
      if (random.NextBelow(4) == 0) {
        store.EraseAll(key.kind, key.a);
        EraseFromModel(model, [&](const BlockKey& other) {
          return other.kind == key.kind && other.a == key.a;
        });
      }
      return;
    default:
      const Bytes content = TestContent(random.NextBits(), RandomSize(random));
      store.Put(key, content);
      model.blocks[key] = content;
      return;
  }
}

TEST(StoreFaults, RandomOperationsEqualTheModel) {
  const TemporaryFolder folder;
  const auto path = folder / "a.enf";
  Random random(11);
  StoreModel model;
  StoreModel committed;
  auto store = CreateStore(path);
  for (int step = 0; step < 1500; ++step) {
    Mutate(*store, model, random);
    if (random.NextBelow(20) == 0) {
      store->Commit();
      committed = model;
    }
    if (random.NextBelow(60) == 0) {
      ASSERT_TRUE(ReadAll(*store, model.meta) == model) << "step " << step;
      store.reset();  // drops what was not committed
      store = OpenStore(path, StoreAccess::kWrite);
      ASSERT_TRUE(ReadAll(*store, model.meta) == committed) << "step " << step;
      model = committed;
    }
  }
  store->VerifyAll({});
}

// Writes generation after generation until it is killed. Each has the same
// number in a meta value and in every block's content; each is announced on
// the pipe after its commit.
[[noreturn]] void WriteUntilKilled(const std::filesystem::path& path,
                                   int pipe_end) {
  const auto store = OpenStore(path, StoreAccess::kWrite);
  for (uint32_t generation = 1;; ++generation) {
    for (uint32_t block = 0; block < 8; ++block) {
      store->Put({BlockKind::kLinks, block, 0, 0},
                 TestContent(generation, 20'000 + 40'000 * (block % 3)));
    }
    store->SetMeta("generation", std::to_string(generation));
    store->Commit();
    if (write(pipe_end, &generation, sizeof generation) < 0) {
      _exit(1);
    }
  }
}

// Kills the child after this time, which begins with the child's first commit
// if that is awaited. Returns the number of the last commit that it announced.
uint32_t KillAfter(pid_t child,
                   int pipe_end,
                   bool awaits_commit,
                   useconds_t microseconds) {
  uint32_t last = 0;
  uint32_t announced = 0;
  if (awaits_commit &&
      read(pipe_end, &announced, sizeof announced) == sizeof announced) {
    last = announced;
  }
  usleep(microseconds);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  while (read(pipe_end, &announced, sizeof announced) == sizeof announced) {
    last = announced;
  }
  return last;
}

TEST(StoreFaults, KilledWriterLeavesItsLastCommit) {
  const TemporaryFolder folder;
  const auto path = folder / "a.enf";
  CreateStore(path).reset();
  Random random(5);
  for (int round = 0; round < 25; ++round) {
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      close(ends[0]);
      WriteUntilKilled(path, ends[1]);
    }
    close(ends[1]);
    const bool awaits_commit = round % 2 == 1;
    const uint32_t announced = KillAfter(
        child, ends[0], awaits_commit, 1000 + random.NextBelow(60'000));
    close(ends[0]);
    ASSERT_TRUE(announced > 0 || !awaits_commit) << "round " << round;
    // The store holds generation `announced`, or the next one if the kill came
    // between its commit and its announcement. Before the first announcement it
    // holds what the round before left.
    const auto store = OpenStore(path, StoreAccess::kWrite);
    store->VerifyAll({});
    const auto generation = store->Meta("generation");
    if (announced > 0) {
      ASSERT_TRUE(generation == std::to_string(announced) ||
                  generation == std::to_string(announced + 1))
          << *generation << " after " << announced;
    }
    if (generation) {
      const uint64_t seed = std::stoull(*generation);
      for (uint32_t block = 0; block < 8; ++block) {
        ASSERT_EQ(store->GetOrThrow({BlockKind::kLinks, block, 0, 0}),
                  TestContent(seed, 20'000 + 40'000 * (block % 3)));
      }
    }
  }
}

// A closed store with a few blocks of all sizes, and what it holds.
StoreModel MakeSample(const std::filesystem::path& path) {
  StoreModel model;
  const auto store = CreateStore(path);
  Random random(9);
  for (int i = 0; i < 12; ++i) {
    Mutate(*store, model, random);
  }
  for (uint32_t size : {0U, 1000U, 70'000U, 300'000U}) {
    const BlockKey key{BlockKind::kLinks, size, 0, 0};
    store->Put(key, model.blocks[key] = TestContent(size, size));
  }
  store->SetMeta("settings", model.meta["settings"] = "{\"error\": 0.05}");
  store->Commit();
  return model;
}

std::vector<char> ReadFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void WriteFile(const std::filesystem::path& path,
               const std::vector<char>& bytes,
               size_t size) {
  std::ofstream(path, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(size));
}

// Reads everything that the model names. Blocks that come back must be right;
// a typed error of a damaged or foreign file is as good. Returns whether any
// damage was noticed.
bool IsDamageNoticed(const std::filesystem::path& path,
                     const StoreModel& model) {
  std::unique_ptr<BlockStorage> store;
  try {
    store = OpenStore(path, StoreAccess::kRead);
  } catch (const Error&) {
    return true;
  }
  bool noticed = false;
  const auto attempt = [&](const auto& action) {
    try {
      action();
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()), "");
      noticed = true;
    }
  };
  for (const auto& block : model.blocks) {
    attempt(
        [&] { EXPECT_TRUE(store->GetOrThrow(block.first) == block.second); });
  }
  for (const auto& entry : model.meta) {
    attempt([&] {
      if (const auto found = store->Meta(entry.first)) {
        EXPECT_EQ(*found, entry.second);
      } else {
        noticed = true;
      }
    });
  }
  for (const BlockKind kind : kAllKinds) {
    attempt([&] { store->ForEachKey(kind, [](const BlockKey&) {}); });
    attempt([&] { static_cast<void>(store->StoredBytes(kind)); });
  }
  attempt([&] { store->VerifyAll({}); });
  return noticed;
}

TEST(StoreFaults, FlippedBytesAreNoticedOrHarmless) {
  const TemporaryFolder folder;
  const StoreModel model = MakeSample(folder / "a.enf");
  const auto bytes = ReadFile(folder / "a.enf");
  ASSERT_FALSE(IsDamageNoticed(folder / "a.enf", model));
  Random random(21);
  int noticed = 0;
  constexpr int kTrials = 400;
  for (int trial = 0; trial < kTrials; ++trial) {
    auto damaged = bytes;
    // Every other trial in the first page, where the header is.
    const auto range =
        trial % 2 == 0 ? static_cast<uint32_t>(bytes.size()) : 32768U;
    const size_t at = random.NextBelow(range);
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << random.NextBelow(8)));
    WriteFile(folder / "b.enf", damaged, damaged.size());
    SCOPED_TRACE("byte " + std::to_string(at));
    noticed += IsDamageNoticed(folder / "b.enf", model) ? 1 : 0;
  }
  EXPECT_GT(noticed, kTrials / 20);
}

// For what a schema lacks, SQLite has no error of its own.
TEST(StoreFaults, AColumnOfAnotherNameIsDamage) {
  const TemporaryFolder folder;
  MakeSample(folder / "a.enf");
  auto bytes = ReadFile(folder / "a.enf");
  const std::string_view name = "frame_bytes";
  auto at = std::search(bytes.begin(), bytes.end(), name.begin(), name.end());
  ASSERT_NE(at, bytes.end());
  while (at != bytes.end()) {
    *at = 'g';
    at = std::search(at, bytes.end(), name.begin(), name.end());
  }
  WriteFile(folder / "b.enf", bytes, bytes.size());
  EXPECT_THROW(OpenStore(folder / "b.enf", StoreAccess::kRead),
               DamagedStoreError);
}

// The damaged byte is the schema's format number in the header, for which
// SQLite has no error of its own.
TEST(StoreFaults, AHeaderOfAnUnknownFormatIsDamage) {
  constexpr size_t kSchemaFormat = 47;
  const TemporaryFolder folder;
  MakeSample(folder / "a.enf");
  auto bytes = ReadFile(folder / "a.enf");
  bytes[kSchemaFormat] = static_cast<char>(bytes[kSchemaFormat] ^ 0xff);
  WriteFile(folder / "b.enf", bytes, bytes.size());
  EXPECT_THROW(OpenStore(folder / "b.enf", StoreAccess::kRead),
               DamagedStoreError);
}

// Whether a block is refused, or lost with its catalogue. Wrong content is a
// failure, and so is a message that does not name the file.
bool IsBlockDamaged(const std::filesystem::path& path,
                    const BlockKey& key,
                    const Bytes& content) {
  try {
    const auto store = OpenStore(path, StoreAccess::kRead);
    EXPECT_EQ(store->GetOrThrow(key), content);
    return false;
  } catch (const DamagedStoreError& error) {
    EXPECT_NE(std::string(error.what()).find(path.string()), std::string::npos)
        << error.what();
    return true;
  }
}

TEST(StoreFaults, EveryFlippedByteOfAFrameIsNoticed) {
  const TemporaryFolder folder;
  const BlockKey key{BlockKind::kLinks, 1, 2, 3};
  const Bytes content = TestContent(1, 100'000);
  uint64_t frame_bytes = 0;
  {
    const auto store = CreateStore(folder / "a.enf");
    store->Put(key, content);
    store->Commit();
    frame_bytes = store->StoredBytes(BlockKind::kLinks);
  }
  auto bytes = ReadFile(folder / "a.enf");
  constexpr size_t kStride = 499;
  uint64_t noticed = 0;
  for (size_t at = 32768; at < bytes.size(); at += kStride) {
    bytes[at] = static_cast<char>(~bytes[at]);
    WriteFile(folder / "b.enf", bytes, bytes.size());
    bytes[at] = static_cast<char>(~bytes[at]);
    noticed += IsBlockDamaged(folder / "b.enf", key, content) ? 1U : 0U;
  }
  // The frame lies in whole pages and one partial page: at the ends of each, at
  // most two strides are cut.
  EXPECT_GE(noticed + 2 * (frame_bytes / 32768 + 2), frame_bytes / kStride);
  EXPECT_GT(noticed, 80U);
}

TEST(StoreFaults, TruncatedFileIsRefused) {
  const TemporaryFolder folder;
  const StoreModel model = MakeSample(folder / "a.enf");
  const auto bytes = ReadFile(folder / "a.enf");
  std::vector<size_t> sizes{0, 1, 15, 16, 99, 100, 101, 512, 32767};
  Random random(4);
  for (size_t page = 1; page * 32768 < bytes.size(); ++page) {
    sizes.push_back(page * 32768);
    sizes.push_back(page * 32768 + random.NextBelow(32768));
  }
  for (const size_t size : sizes) {
    if (size < bytes.size()) {
      WriteFile(folder / "b.enf", bytes, size);
      EXPECT_TRUE(IsDamageNoticed(folder / "b.enf", model)) << size << " bytes";
    }
  }
}

// Puts blocks and commits until the disk is full, at whatever moment that is.
void FillUntilFull(BlockStorage& store, uint32_t& committed) {
  for (uint32_t i = 1; i < 1000; ++i) {
    store.Put({BlockKind::kCellTree, i, 0, 0}, TestContent(i, 100'000));
    store.SetMeta("blocks", std::to_string(i));
    store.Commit();
    committed = i;
  }
}

// The message of the DiskError that `body` throws.
template <typename Body>
std::string WhatFails(const Body& body) {
  try {
    body();
  } catch (const DiskError& e) {
    return e.what();
  }
  ADD_FAILURE() << "did not fail";
  return {};
}

TEST(StoreFaults, FullDiskKeepsThePreviousCommit) {
  for (const rlim_t limit :
       {70'000UL, 300'000UL, 700'000UL, 1'500'000UL, 4'000'000UL}) {
    const TemporaryFolder folder;
    const auto path = folder / "a.enf";
    uint32_t committed = 0;
    {
      auto store = CreateStore(path);
      const FileSizeLimit full(limit);
      const std::string first =
          WhatFails([&] { FillUntilFull(*store, committed); });
      EXPECT_THROW(store->Commit(), DiskError) << "after a failure";
      const std::string later = WhatFails([&] { store->SetMeta("n", "1"); });
      EXPECT_NE(later.find(first), std::string::npos) << later;
      // What was put since the commit is gone; nobody may miss it unawares.
      EXPECT_THROW(static_cast<void>(store->Get({BlockKind::kCellTree, 1})),
                   DiskError);
      store.reset();
    }
    const auto store = OpenStore(path, StoreAccess::kWrite);
    store->VerifyAll({});
    ASSERT_EQ(store->Count(BlockKind::kCellTree), committed);
    for (uint32_t i = 1; i <= committed; ++i) {
      ASSERT_EQ(store->GetOrThrow({BlockKind::kCellTree, i, 0, 0}),
                TestContent(i, 100'000));
    }
    store->Put({BlockKind::kCellTree, 9999, 0, 0}, TestContent(1, 10));
    store->Commit();
  }
}

// What has not been committed is gone, so that no answer fits what the caller
// has written.
TEST(StoreFaults, AfterAFailedWriteNothingIsAnswered) {
  const TemporaryFolder folder;
  auto store = CreateStore(folder / "a.enf");
  store->SetMeta("name", "value");
  store->Put({BlockKind::kCellTree, 1, 0, 0}, TestContent(1, 1000));
  {
    const FileSizeLimit full(0);
    EXPECT_THROW(
        {
          for (uint32_t i = 0; i < 100; ++i) {
            store->Put({BlockKind::kCellTree, 2, i, 0},
                       TestContent(i, 1'000'000));
          }
          store->Commit();
        },
        DiskError);
  }
  EXPECT_THROW(static_cast<void>(store->Meta("name")), DiskError);
  EXPECT_THROW(static_cast<void>(store->Get({BlockKind::kCellTree, 1, 0, 0})),
               DiskError);
  EXPECT_THROW(static_cast<void>(store->Count(BlockKind::kCellTree)),
               DiskError);
  EXPECT_THROW(store->ForEachKey(BlockKind::kCellTree, [](const BlockKey&) {}),
               DiskError);
}

TEST(StoreFaults, AFullDiskKeepsNobodyFromReading) {
  const TemporaryFolder folder;
  const auto path = folder / "a.enf";
  {
    auto store = CreateStore(path);
    store->Put({BlockKind::kCellTree, 1, 0, 0}, TestContent(1, 100'000));
    store->Commit();
  }
  const FileSizeLimit full(0);
  EXPECT_EQ(OpenStore(path, StoreAccess::kRead)
                ->GetOrThrow({BlockKind::kCellTree, 1, 0, 0}),
            TestContent(1, 100'000));
}

TEST(StoreFaults, ReaderWorksBesideAWritingProcess) {
  const TemporaryFolder folder;
  const auto path = folder / "a.enf";
  CreateStore(path).reset();
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    WriteUntilKilled(path, ends[1]);
  }
  uint32_t announced = 0;
  for (int round = 0; round < 20; ++round) {
    ASSERT_EQ(read(ends[0], &announced, sizeof announced),
              static_cast<ssize_t>(sizeof announced));
    const auto store = OpenStore(path, StoreAccess::kRead);
    const auto generation = store->Meta("generation");
    ASSERT_TRUE(generation.has_value());
    EXPECT_GE(std::stoul(*generation), announced);
    for (uint32_t block = 0; block < 8; ++block) {
      EXPECT_EQ(
          store->GetOrThrow({BlockKind::kLinks, block, 0, 0}),
          TestContent(std::stoull(*generation), 20'000 + 40'000 * (block % 3)));
    }
  }
  EXPECT_THROW(static_cast<void>(OpenStore(path, StoreAccess::kWrite)),
               DiskError);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  close(ends[0]);
  close(ends[1]);
  EXPECT_NE(OpenStore(path, StoreAccess::kWrite), nullptr);
}

}  // namespace
}  // namespace enfilade
