#include "bench/store_crash.h"

#include "base/error.h"
#include "base/random.h"
#include "base/stopwatch.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <span>
#include <system_error>
#include <vector>

#include "bench/store_blocks.h"
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

namespace enfilade::bench {
namespace {

constexpr uint64_t kCrashSeed = 21;
constexpr uint64_t kLiveBytes = 24 << 20;
constexpr uint32_t kPutsPerCommit = 16;  // about 2 MiB
constexpr uint32_t kLongestMilliseconds = 150;

// The blocks that a transaction puts; a block may occur twice.
std::array<uint32_t, kPutsPerCommit> KeysOf(uint64_t transaction,
                                            uint32_t count) {
  Random random(MixKey(kCrashSeed, transaction));
  std::array<uint32_t, kPutsPerCommit> keys{};
  std::generate(
      keys.begin(), keys.end(), [&] { return random.NextBelow(count); });
  return keys;
}

// Puts the blocks of a transaction, and its number as a block of its own whose
// key follows those of all others.
void PutTransaction(Layout& layout, const Blocks& blocks, uint64_t number) {
  for (const uint32_t key : KeysOf(number, blocks.Count())) {
    layout.Put(key, blocks.Content(key, number));
  }
  layout.Put(blocks.Count(), std::as_bytes(std::span(&number, 1)));
}

uint64_t TransactionOf(const Layout& layout, const Blocks& blocks) {
  const auto content = layout.Get(blocks.Count());
  uint64_t number = 0;
  if (content && content->size() == sizeof number) {
    std::memcpy(&number, content->data(), sizeof number);
  }
  return number;
}

// Runs in the child: writes until the child is killed, and writes the number of
// each commit that returned to the pipe `tell`.
[[noreturn]] void WriteUntilKilled(LayoutKind kind,
                                   const std::filesystem::path& folder,
                                   const Blocks& blocks,
                                   int tell) {
  try {
    const auto layout = OpenLayout(kind, folder);
    for (uint64_t number = TransactionOf(*layout, blocks) + 1;; ++number) {
      PutTransaction(*layout, blocks, number);
      layout->Commit();
      if (write(tell, &number, sizeof number) != sizeof number) {
        _exit(1);
      }
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "the writer failed: %s\n", error.what());
    _exit(1);
  }
}

[[noreturn]] void FailSystemCall(const char* what) {
  throw DiskError(
      fmt::format("{}: {}", what, std::generic_category().message(errno)));
}

struct KilledWriter {
  bool was_killed = false;  // false: ended on an error of its own
  uint64_t told = 0;        // the last commit that it told of; 0: none
};

KilledWriter RunAndKill(LayoutKind kind,
                        const std::filesystem::path& folder,
                        const Blocks& blocks,
                        uint32_t milliseconds) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) {
    FailSystemCall("pipe");
  }
  const pid_t child = fork();
  if (child < 0) {
    FailSystemCall("fork");
  }
  if (child == 0) {
    close(ends[0]);
    WriteUntilKilled(kind, folder, blocks, ends[1]);
  }
  close(ends[1]);
  usleep(1000 * milliseconds);
  kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  KilledWriter writer{WIFSIGNALED(status), 0};
  uint64_t number = 0;
  while (read(ends[0], &number, sizeof number) == sizeof number) {
    writer.told = number;
  }
  close(ends[0]);
  return writer;
}

// The blocks that a layout must hold after a given transaction.
class Expected {
 public:
  explicit Expected(const Blocks& blocks)
      : blocks_(&blocks), versions_(blocks.Count(), 0) {}

  [[nodiscard]] uint64_t Transaction() const { return transaction_; }

  void AdvanceTo(uint64_t transaction) {
    while (transaction_ < transaction) {
      ++transaction_;
      for (const uint32_t key : KeysOf(transaction_, blocks_->Count())) {
        versions_[key] = transaction_;
      }
    }
  }

  [[nodiscard]] bool Holds(const Layout& layout) const {
    for (uint32_t key = 0; key < blocks_->Count(); ++key) {
      const auto seen = layout.Get(key);
      if (seen.has_value() != (versions_[key] != 0)) {
        return false;
      }
      if (seen &&
          !std::ranges::equal(*seen, blocks_->Content(key, versions_[key]))) {
        return false;
      }
    }
    return true;
  }

  [[nodiscard]] uint64_t LiveBytes() const {
    uint64_t sum = 0;
    for (uint32_t key = 0; key < blocks_->Count(); ++key) {
      sum += versions_[key] == 0 ? 0
                                 : blocks_->Content(key, versions_[key]).size();
    }
    return sum;
  }

 private:
  const Blocks* blocks_;
  std::vector<uint64_t> versions_;  // 0: never put
  uint64_t transaction_ = 0;
};

uint64_t Garbage(const FolderSize& size, uint64_t live_bytes) {
  return size.bytes - std::min(size.bytes, live_bytes);
}

// Opens the layout that a killed writer left. Returns whether the layout holds
// the last commit completely, and nothing else.
bool IsLastCommit(LayoutKind kind,
                  const std::filesystem::path& folder,
                  const Blocks& blocks,
                  const KilledWriter& writer,
                  Expected& expected,
                  std::vector<double>& open_seconds) {
  try {
    const auto begin = std::chrono::steady_clock::now();
    const auto layout = OpenLayout(kind, folder);
    const uint64_t seen = TransactionOf(*layout, blocks);
    open_seconds.push_back(SecondsSince(begin));
    // The writer may have been killed after a commit and before telling of it.
    const uint64_t told = std::max(writer.told, expected.Transaction());
    expected.AdvanceTo(seen);
    return writer.was_killed && (seen == told || seen == told + 1) &&
           expected.Holds(*layout);
  } catch (const Error& error) {
    std::fprintf(stderr, "after a kill: %s\n", error.what());
    return false;
  }
}

}  // namespace

CrashOutcome KillWriters(LayoutKind kind,
                         const std::filesystem::path& parent,
                         uint64_t kills) {
  const WorkFolder folder(parent);
  const Blocks blocks(kLiveBytes);
  CreateLayout(kind, folder.Path());
  Random random(kCrashSeed);
  Expected expected(blocks);
  CrashOutcome outcome;
  std::vector<double> open_seconds;
  for (; outcome.kills < kills; ++outcome.kills) {
    const KilledWriter writer = RunAndKill(
        kind, folder.Path(), blocks, random.NextBelow(kLongestMilliseconds));
    const FolderSize left = SizeOf(folder.Path());
    if (!IsLastCommit(
            kind, folder.Path(), blocks, writer, expected, open_seconds)) {
      ++outcome.failures;
    }
    const uint64_t live = expected.LiveBytes();
    outcome.most_files_left = std::max(outcome.most_files_left, left.files);
    outcome.most_garbage_left =
        std::max(outcome.most_garbage_left, Garbage(left, live));
    outcome.most_garbage_after = std::max(outcome.most_garbage_after,
                                          Garbage(SizeOf(folder.Path()), live));
  }
  outcome.commits = expected.Transaction();
  if (!open_seconds.empty()) {
    std::ranges::sort(open_seconds);
    outcome.open_seconds = open_seconds[open_seconds.size() / 2];
  }
  return outcome;
}

}  // namespace enfilade::bench
