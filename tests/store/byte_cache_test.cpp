#include "store/byte_cache.h"

#include "base/error.h"
#include "base/random.h"
#include "store/belady.h"

#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

using Cache = ByteCache<int, std::string>;

// A cache of strings whose next uses a test sets by key (0 if it doesn't), and
// a log of what was written back.
class ByteCacheTest : public testing::Test {
 protected:
  Cache::Loader Load(const std::string& text, uint64_t bytes) {
    return [=, this] {
      ++loads_;
      return Cache::Loaded{std::make_shared<std::string>(text), bytes};
    };
  }

  Cache::Pointer Get(int key, uint64_t bytes) {
    return cache_.Get(key, bytes, Load(std::to_string(key), bytes));
  }

  MemoryBudget budget_{100};
  std::map<int, uint64_t> next_use_;
  std::vector<int> written_;
  int loads_ = 0;
  Cache cache_{
      budget_,
      "the strings",
      [this](int key) { return next_use_[key]; },
      [this](int key, const std::string&) { written_.push_back(key); }};
};

TEST_F(ByteCacheTest, LoadsOnceWhatFits) {
  EXPECT_EQ(*Get(1, 40), "1");
  EXPECT_EQ(*Get(1, 40), "1");
  EXPECT_EQ(loads_, 1);
  EXPECT_EQ(cache_.Stats().hits, 1U);
  EXPECT_EQ(cache_.Stats().misses, 1U);
  EXPECT_EQ(budget_.UsedBytes(), 40U);
}

TEST_F(ByteCacheTest, EvictsWhatIsNeededLast) {
  next_use_ = {{1, 5}, {2, 9}, {3, 7}};
  Get(1, 30);
  Get(2, 30);
  Get(3, 30);
  Get(4, 30);
  EXPECT_EQ(cache_.Peek(2), nullptr);
  EXPECT_NE(cache_.Peek(1), nullptr);
  EXPECT_NE(cache_.Peek(3), nullptr);
}

TEST_F(ByteCacheTest, TiesGoInTheOrderOfTheKeys) {
  Get(2, 30);
  Get(1, 30);
  Get(3, 30);
  EXPECT_TRUE(cache_.EvictToFit(60));
  EXPECT_EQ(cache_.Peek(1), nullptr);
  EXPECT_EQ(cache_.Peek(2), nullptr);
  EXPECT_NE(cache_.Peek(3), nullptr);
}

TEST_F(ByteCacheTest, HeldEntryIsNotEvicted) {
  next_use_ = {{1, Cache::kNever}, {2, 1}};
  const auto held = Get(1, 50);
  Get(2, 50);
  Get(3, 50);
  EXPECT_EQ(cache_.Peek(1), held);
  EXPECT_EQ(cache_.Peek(2), nullptr);
}

TEST_F(ByteCacheTest, AllHeldMeansDoesNotFit) {
  const auto held = Get(1, 60);
  EXPECT_THROW(Get(2, 50), DoesNotFitError);
  EXPECT_EQ(loads_, 1) << "room is made before anything is loaded";
  EXPECT_EQ(budget_.UsedBytes(), 60U);
  EXPECT_FALSE(cache_.EvictToFit(50));
}

TEST_F(ByteCacheTest, FailedLoadLeavesNothingBehind) {
  EXPECT_THROW(cache_.Get(1,
                          40,
                          []() -> Cache::Loaded {
                            throw std::runtime_error("no such block");
                          }),
               std::runtime_error);
  EXPECT_EQ(budget_.UsedBytes(), 0U);
  EXPECT_EQ(cache_.Stats().bytes, 0U);
  EXPECT_EQ(cache_.Peek(1), nullptr);
}

TEST_F(ByteCacheTest, LoadedSizeReplacesTheExpectedOne) {
  cache_.Get(1, 10, Load("x", 70));
  EXPECT_EQ(budget_.UsedBytes(), 70U);
  cache_.Get(2, 90, Load("y", 5));  // evicts the first
  EXPECT_EQ(budget_.UsedBytes(), 5U);
}

TEST_F(ByteCacheTest, DirtyEntryIsWrittenBackOnceAtEviction) {
  Get(1, 60);
  cache_.MarkDirty(1);
  Get(2, 60);
  EXPECT_EQ(written_, std::vector<int>{1});
  cache_.Flush();
  EXPECT_EQ(written_, std::vector<int>{1});
}

TEST_F(ByteCacheTest, FlushWritesDirtyEntriesInOrderAndKeepsThem) {
  for (const int key : {3, 1, 2}) {
    Get(key, 10);
  }
  cache_.MarkDirty(3);
  cache_.MarkDirty(1);
  cache_.Flush();
  cache_.Flush();
  EXPECT_EQ(written_, (std::vector<int>{1, 3}));
  EXPECT_EQ(cache_.Size(), 3U);
}

TEST_F(ByteCacheTest, FailedWriteBackKeepsTheEntryDirty) {
  bool disk_is_full = true;
  Cache cache(
      budget_,
      "the strings",
      [](int) { return 0; },
      [&](int, const std::string&) {
        if (disk_is_full) {
          throw DiskError("full");
        }
      });
  cache.Put(1, {std::make_shared<std::string>("new"), 60}, true);
  EXPECT_THROW(cache.EvictToFit(90), DiskError);
  EXPECT_EQ(*cache.Peek(1), "new");
  disk_is_full = false;
  cache.Flush();
  EXPECT_EQ(cache.Stats().write_backs, 1U);
}

TEST_F(ByteCacheTest, ResizeChargesTheDifferenceAndEvictsOthers) {
  Get(1, 40);
  Get(2, 40);
  cache_.Resize(1, 70);
  EXPECT_NE(cache_.Peek(1), nullptr);
  EXPECT_EQ(cache_.Peek(2), nullptr);
  EXPECT_EQ(budget_.UsedBytes(), 70U);
  cache_.Resize(1, 10);
  EXPECT_EQ(budget_.UsedBytes(), 10U);
}

TEST_F(ByteCacheTest, PutReplacesAndEraseReleases) {
  Get(1, 40);
  cache_.Put(1, {std::make_shared<std::string>("new"), 25}, false);
  EXPECT_EQ(*cache_.Peek(1), "new");
  EXPECT_EQ(budget_.UsedBytes(), 25U);
  cache_.Erase(1);
  EXPECT_EQ(budget_.UsedBytes(), 0U);
}

TEST_F(ByteCacheTest, OthersGetMemoryBackOnDemand) {
  Get(1, 45);
  Get(2, 45);
  ASSERT_FALSE(budget_.TryCharge(50));
  ASSERT_TRUE(cache_.EvictToFit(50));
  EXPECT_TRUE(budget_.TryCharge(50));
  budget_.Release(50);
}

TEST_F(ByteCacheTest, EndOfTheCacheReleasesEverything) {
  {
    Cache other(budget_, "others", [](int) { return 0; });
    other.Put(1, {std::make_shared<std::string>("x"), 33}, false);
    EXPECT_EQ(budget_.UsedBytes(), 33U);
  }
  EXPECT_EQ(budget_.UsedBytes(), 0U);
}

// The cache told the whole future reads what the offline optimum reads.
TEST(ByteCache, KnowingTheFutureReachesBelady) {
  Random random(3);
  std::vector<uint32_t> trace(2000);
  for (auto& item : trace) {
    item = random.NextBelow(40);
  }
  size_t now = 0;
  const auto next_use = [&](uint32_t key) -> uint64_t {
    for (size_t i = now; i < trace.size(); ++i) {
      if (trace[i] == key) {
        return i;
      }
    }
    return UINT64_MAX;
  };
  MemoryBudget budget(120);
  ByteCache<uint32_t, const int> cache(budget, "items", next_use);
  for (; now < trace.size(); ++now) {
    static_cast<void>(cache.Get(trace[now], 10, [] {
      return ByteCache<uint32_t, const int>::Loaded{
          std::make_shared<const int>(1), 10};
    }));
  }
  const std::vector<uint64_t> sizes(40, 10);
  EXPECT_EQ(cache.Stats().bytes_loaded,
            MeasureBelady(trace, sizes, 120).optimal_bytes);
}

}  // namespace
}  // namespace enfilade
