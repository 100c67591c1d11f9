// Chunks of links on their way to the store.

#include "solver/links/link_store.h"

#include "base/error.h"
#include "base/parallel.h"
#include "store/sqlite_store.h"

#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "tests/store/file_size_limit.h"
#include "tests/store/temp_store.h"
#include "tests/visibility/map_storage.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr CellPair kPair{CellId(3U), CellId(5U)};
constexpr LinkEnds kEnds{1000, 1000, 0};

// Weak links of one receiver.
LinkBlock WeakLinks(uint32_t receiver, size_t count) {
  LinkBlock block;
  for (size_t i = 0; i < count; ++i) {
    Link link;
    link.receiver = receiver;
    link.source = static_cast<uint32_t>(i * 7 % 1000);
    link.kind = LinkKind::kWeak;
    link.value = static_cast<uint16_t>(i * 37);
    block.links.push_back(link);
  }
  SortLinks(&block);
  return block;
}

void AppendTo(LinkBlock* to, const LinkBlock& from) {
  for (size_t i = 0; i < from.links.size(); ++i) {
    to->AppendFrom(from, i);
  }
}

TEST(ChunkWriter, WritesEachChunkOnceAndTellsWhatItTakes) {
  const auto store = CreateStoreInMemory();
  std::vector<LinkChunk> written;
  ChunkWriter writer(
      *store, [&](LinkChunk&& chunk) { written.push_back(std::move(chunk)); });
  writer.Finish();  // nothing is under way
  uint64_t told = 0;
  for (uint32_t i = 0; i < 3; ++i) {
    const LinkBlock& block = writer.Start({kPair, i, WeakLinks(i, 100 + i), 0});
    EXPECT_EQ(block.links.size(), 100 + i);
    writer.Finish();
    writer.Finish();
    ASSERT_EQ(written.size(), i + 1);
    told += written.back().stored_bytes;
    EXPECT_EQ(told, store->Stats().bytes_written);
    const auto read = ReadLinks(*store, kPair, i, kEnds);
    ASSERT_TRUE(read.has_value());
    EXPECT_EQ(read->links.size(), 100 + i);
  }
}

// A pair has the same chunks for any number of threads, and its reader never
// meets a chunk that is still being written.
TEST(LinkWriter, HandsChunksOutInOrderAndWritesThemAll) {
  const size_t links = 60'000;
  std::vector<std::vector<size_t>> sizes;
  for (const size_t threads : {size_t{1}, size_t{2}, size_t{4}}) {
    const ThreadLimit limit(threads);
    const auto store = CreateStoreInMemory();
    std::vector<uint32_t> kept;
    ChunkWriter chunks(*store, [&](LinkChunk&& c) { kept.push_back(c.chunk); });
    size_t seen = 0;
    LinkWriter writer(*store, chunks, kPair, 0, [&](const LinkBlock& block) {
      seen += block.links.size();
    });
    for (uint32_t r = 0; r < links / 1000; ++r) {
      AppendTo(&writer.Pending(), WeakLinks(r, 1000));
      if (writer.Full()) {
        writer.Flush();
      }
    }
    writer.Flush();
    chunks.Finish();
    EXPECT_EQ(seen, links);
    EXPECT_EQ(kept.size(), writer.Chunks());
    sizes.emplace_back();
    for (uint32_t i = 0; i < writer.Chunks(); ++i) {
      EXPECT_EQ(kept[i], i);
      const auto read = ReadLinks(*store, kPair, i, kEnds);
      ASSERT_TRUE(read.has_value());
      sizes.back().push_back(read->links.size());
    }
    EXPECT_FALSE(ReadLinks(*store, kPair, writer.Chunks(), kEnds).has_value());
  }
  EXPECT_EQ(sizes[0], sizes[1]);
  EXPECT_EQ(sizes[0], sizes[2]);
  EXPECT_GT(sizes[0].size(), 1U);
}

// The number of links in each chunk of a pair, as the store has them.
std::vector<size_t> StoredSizes(const BlockStorage& store, CellPair pair) {
  std::vector<size_t> sizes;
  for (uint32_t i = 0;; ++i) {
    const auto read = ReadLinks(store, pair, i, kEnds);
    if (!read) {
      return sizes;
    }
    sizes.push_back(read->links.size());
  }
}

class LinksOfAPair : public ::testing::Test {
 protected:
  // Writes one chunk of each size, after the pair's first `first_chunk` ones;
  // returns the writer's own number of chunks.
  uint32_t Write(CellPair pair,
                 uint32_t first_chunk,
                 const std::vector<size_t>& sizes) {
    ChunkWriter chunks(*store_, [](LinkChunk&& /*chunk*/) {});
    LinkWriter writer(
        *store_, chunks, pair, first_chunk, [](const LinkBlock& /*block*/) {});
    for (const size_t size : sizes) {
      AppendTo(&writer.Pending(), WeakLinks(1, size));
      writer.Flush();
    }
    chunks.Finish();
    return writer.Chunks();
  }

  std::unique_ptr<BlockStorage> store_ = CreateStoreInMemory();
};

using Sizes = std::vector<size_t>;

// A chunk of an older, longer list would be gathered with the newer ones.
TEST_F(LinksOfAPair, ThatAreMadeAnewReplaceAllOldOnes) {
  const CellPair other{kPair.source, kPair.receiver};
  Write(kPair, 0, {10, 11, 12});
  Write(other, 0, {20, 21});
  EXPECT_EQ(Write(kPair, 0, {30}), 1U);
  EXPECT_EQ(StoredSizes(*store_, kPair), Sizes{30});
  EXPECT_EQ(Write(kPair, 0, {}), 0U);
  EXPECT_EQ(StoredSizes(*store_, kPair), Sizes{});
  EXPECT_EQ(store_->Count(BlockKind::kLinks), 2U);
  EXPECT_EQ(StoredSizes(*store_, other), (Sizes{20, 21}));
}

// A solve that is resumed within a pair goes on after the chunks it has.
TEST_F(LinksOfAPair, AreContinuedAfterTheFirstChunks) {
  Write(kPair, 0, {10, 11});
  EXPECT_EQ(Write(kPair, 2, {12, 13}), 4U);
  EXPECT_EQ(StoredSizes(*store_, kPair), (Sizes{10, 11, 12, 13}));
  EXPECT_EQ(Write(kPair, 1, {21}), 2U);
  EXPECT_EQ(StoredSizes(*store_, kPair), (Sizes{10, 21, 12, 13}));
}

// The largest chunk has 24,576 links. More are cut into the least number of
// chunks, whose sizes differ by one at most.
TEST_F(LinksOfAPair, OfOneFlushAreCutEvenlyIntoChunks) {
  constexpr size_t kMost = 24'576;
  for (const size_t links : {kMost, kMost + 1, 2 * kMost, 2 * kMost + 1}) {
    const LinkBlock all = WeakLinks(1, links);
    const size_t expected = (links + kMost - 1) / kMost;
    EXPECT_EQ(Write(kPair, 0, {links}), expected);
    size_t at = 0;
    for (uint32_t i = 0; i < expected; ++i) {
      const auto read = ReadLinks(*store_, kPair, i, kEnds);
      ASSERT_TRUE(read.has_value());
      EXPECT_LE(read->links.size(), kMost);
      EXPECT_NEAR(static_cast<double>(read->links.size()),
                  static_cast<double>(links) / static_cast<double>(expected),
                  1);
      for (const Link& link : read->links) {
        EXPECT_EQ(link.source, all.links[at].source);
        EXPECT_EQ(link.value, all.links[at].value);
        ++at;
      }
    }
    EXPECT_EQ(at, links);
  }
}

// A write that fails in the background is reported where the writer waits for
// it; a writer that goes without waiting loses no more than the chunk.
TEST(ChunkWriter, AFullDiskIsToldAtTheEnd) {
  for (const bool waits : {true, false}) {
    const TemporaryFolder folder;
    const auto path = folder / "a.enf";
    {
      const auto store = CreateStore(path);
      store->Commit();
      const FileSizeLimit full(1);
      size_t written = 0;
      ChunkWriter writer(*store, [&](LinkChunk&& /*chunk*/) { ++written; });
      // More than SQLite keeps in memory.
      LinkBlock block;
      for (uint32_t r = 0; r < 1000; ++r) {
        AppendTo(&block, WeakLinks(r, 1000));
      }
      writer.Start({kPair, 0, std::move(block), 0});
      if (waits) {
        const auto finish_and_commit = [&] {
          writer.Finish();
          store->Commit();
        };
        EXPECT_THROW(finish_and_commit(), DiskError);
      }
    }
    const auto store = OpenStore(path, StoreAccess::kRead);
    store->VerifyAll({});
    EXPECT_EQ(store->Count(BlockKind::kLinks), 0U);
  }
}

// A store in which every Put fails as on a full disk.
class FullStorage : public test::MapStorage {
 public:
  uint64_t Put(const BlockKey& /*key*/,
               std::span<const std::byte> /*content*/) override {
    throw DiskError("full");
  }
};

TEST(ChunkWriter, DoesNotTellOfWhatFailed) {
  FullStorage store;
  size_t written = 0;
  ChunkWriter writer(store, [&](LinkChunk&& /*chunk*/) { ++written; });
  writer.Start({kPair, 0, WeakLinks(0, 10), 0});
  EXPECT_THROW(writer.Finish(), DiskError);
  writer.Finish();
  EXPECT_EQ(written, 0U);
}

}  // namespace
}  // namespace enfilade
