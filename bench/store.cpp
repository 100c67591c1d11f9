// Compares the store's layout (frames as rows of one SQLite file) with segment
// files and a SQLite catalogue, on the disk of a folder: writing and rewriting
// in rounds, commits, reading, and what a killed writer leaves. A plain file is
// written and read in the same run as the limit of each rate.
//
//   bench_store [--live MIB] [--rounds N] [--repeats N] [--kills N] [FOLDER]

#include "base/error.h"
#include "base/memory.h"
#include "base/random.h"
#include "base/stopwatch.h"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "bench/raw_file.h"
#include "bench/store_blocks.h"
#include "bench/store_crash.h"
#include "bench/store_layout.h"
#include <CLI/CLI.hpp>
#include <fcntl.h>
#include <fmt/format.h>

namespace enfilade::bench {
namespace {

constexpr uint64_t kMiB = 1 << 20;
constexpr uint64_t kStoreSeed = 22;
// A solve writes cell after cell; a cell has about this many blocks.
constexpr uint32_t kBlocksOfCell = 16;
// The share of the cells that each round after the first writes again.
constexpr double kRewrittenShare = 0.75;

struct Options {
  std::filesystem::path folder = ".";
  uint64_t live_mib = 64;
  uint64_t rounds = 4;
  uint64_t repeats = 2;
  uint64_t kills = 15;
};

// The bytes that were put into a layout or a plain file, and the time until all
// of them were on the disk.
struct Writing {
  double seconds = 0;
  std::vector<double> commit_seconds;
  uint64_t put_bytes = 0;
  uint64_t written_bytes = 0;  // to the disk
  uint64_t live_bytes = 0;
  uint64_t most_bytes = 0;  // of all files, after any commit
  uint64_t end_bytes = 0;
};

struct Reading {
  double sequential = 0;  // MB/s
  double random = 0;
  double from_disk = 0;  // share of the bytes; caches had the rest
};

double Rate(uint64_t bytes, double seconds) {
  return static_cast<double>(bytes) / 1e6 / seconds;
}

double Ratio(uint64_t a, uint64_t b) {
  return static_cast<double>(a) / static_cast<double>(b);
}

double QuantileOf(std::vector<double> values, double share) {
  if (values.empty()) {
    return 0;
  }
  std::ranges::sort(values);
  const auto i =
      static_cast<size_t>(share * static_cast<double>(values.size()));
  return values[std::min(i, values.size() - 1)];
}

template <typename T>
void Shuffle(std::vector<T>& values, Random& random) {
  for (size_t i = values.size(); i > 1; --i) {
    std::swap(values[i - 1],
              values[random.NextBelow(static_cast<uint32_t>(i))]);
  }
}

// The blocks of a round in the order in which they are put. The first round has
// all blocks; a later round has some of the cells in random order.
std::vector<uint32_t> KeysOfRound(const Blocks& blocks, uint64_t round) {
  Random random(MixKey(kStoreSeed, round));
  std::vector<uint32_t> cells((blocks.Count() + kBlocksOfCell - 1) /
                              kBlocksOfCell);
  std::iota(cells.begin(), cells.end(), 0U);
  if (round > 0) {
    Shuffle(cells, random);
    cells.resize(static_cast<size_t>(kRewrittenShare *
                                     static_cast<double>(cells.size())));
  }
  std::vector<uint32_t> keys;
  for (const uint32_t cell : cells) {
    for (uint32_t i = 0; i < kBlocksOfCell; ++i) {
      const uint32_t key = cell * kBlocksOfCell + i;
      if (key < blocks.Count()) {
        keys.push_back(key);
      }
    }
  }
  return keys;
}

// Calls put(key, content) for every block of all rounds, and commit() after
// every `commit_bytes` and at the end.
template <typename Put, typename Commit>
Writing WriteRounds(const Blocks& blocks,
                    const Options& options,
                    uint64_t commit_bytes,
                    const Put& put,
                    const Commit& commit) {
  Writing writing;
  std::vector<uint64_t> sizes(blocks.Count());
  uint64_t pending = 0;
  const auto timed_commit = [&] {
    const auto begin = std::chrono::steady_clock::now();
    commit();
    writing.commit_seconds.push_back(SecondsSince(begin));
    pending = 0;
  };
  for (uint64_t round = 0; round < options.rounds; ++round) {
    for (const uint32_t key : KeysOfRound(blocks, round)) {
      const auto content = blocks.Content(key, round);
      put(key, content);
      sizes[key] = content.size();
      writing.put_bytes += content.size();
      pending += content.size();
      if (pending >= commit_bytes) {
        timed_commit();
      }
    }
  }
  timed_commit();
  writing.live_bytes = std::accumulate(sizes.begin(), sizes.end(), 0UL);
  return writing;
}

Writing WriteLayout(LayoutKind kind,
                    const Blocks& blocks,
                    const Options& options,
                    uint64_t commit_bytes,
                    const std::filesystem::path& folder) {
  const DiskTraffic before = TrafficSoFar();
  const auto begin = std::chrono::steady_clock::now();
  auto layout = CreateLayout(kind, folder);
  uint64_t most_bytes = 0;
  Writing writing = WriteRounds(
      blocks,
      options,
      commit_bytes,
      [&](uint32_t key, std::span<const std::byte> content) {
        layout->Put(key, content);
      },
      [&] {
        layout->Commit();
        most_bytes = std::max(most_bytes, SizeOf(folder).bytes);
      });
  layout.reset();
  writing.seconds = SecondsSince(begin);
  writing.written_bytes = TrafficSoFar().written_bytes - before.written_bytes;
  writing.most_bytes = most_bytes;
  writing.end_bytes = SizeOf(folder).bytes;
  return writing;
}

// Measures the limit: writes the same bytes one after the other into a plain
// file.
Writing WritePlainFile(const Blocks& blocks,
                       const Options& options,
                       uint64_t commit_bytes,
                       const std::filesystem::path& folder) {
  const DiskTraffic before = TrafficSoFar();
  const auto begin = std::chrono::steady_clock::now();
  RawFile file(folder / "plain", O_RDWR | O_CREAT | O_EXCL);
  uint64_t end = 0;
  Writing writing = WriteRounds(
      blocks,
      options,
      commit_bytes,
      [&](uint32_t /*key*/, std::span<const std::byte> content) {
        file.WriteAt(end, content);
        end += content.size();
      },
      [&] { file.Sync(); });
  writing.seconds = SecondsSince(begin);
  writing.written_bytes = TrafficSoFar().written_bytes - before.written_bytes;
  writing.most_bytes = end;
  writing.end_bytes = end;
  return writing;
}

// Calls read = open() and then read(key), which returns the number of bytes
// read, for all keys: first in order, then shuffled. Drops the caches before
// each of the two passes.
template <typename Open>
Reading ReadTwice(const Blocks& blocks,
                  const std::filesystem::path& folder,
                  const Open& open) {
  Random random(kStoreSeed);
  std::vector<uint32_t> keys(blocks.Count());
  std::iota(keys.begin(), keys.end(), 0U);
  const DiskTraffic before = TrafficSoFar();
  uint64_t all_bytes = 0;
  const auto pass = [&] {
    DropCaches(folder);
    const auto read = open();
    const auto begin = std::chrono::steady_clock::now();
    uint64_t bytes = 0;
    for (const uint32_t key : keys) {
      bytes += read(key);
    }
    all_bytes += bytes;
    return Rate(bytes, SecondsSince(begin));
  };
  Reading reading;
  reading.sequential = pass();
  Shuffle(keys, random);
  reading.random = pass();
  reading.from_disk =
      Ratio(TrafficSoFar().read_bytes - before.read_bytes, all_bytes);
  return reading;
}

Reading ReadLayout(LayoutKind kind,
                   const Blocks& blocks,
                   const std::filesystem::path& folder) {
  return ReadTwice(blocks, folder, [&] {
    return [layout = std::shared_ptr<Layout>(OpenLayout(kind, folder))](
               uint32_t key) -> uint64_t {
      const auto content = layout->Get(key);
      if (!content) {
        throw DamagedStoreError(fmt::format("block {} is missing", key));
      }
      return content->size();
    };
  });
}

// Measures the limit: reads the first version of every block from one plain
// file.
Reading ReadPlainFile(const Blocks& blocks,
                      const std::filesystem::path& folder) {
  std::vector<uint64_t> starts;
  uint64_t end = 0;
  {
    RawFile file(folder / "plain", O_RDWR | O_CREAT | O_TRUNC);
    for (uint32_t key = 0; key < blocks.Count(); ++key) {
      starts.push_back(end);
      file.WriteAt(end, blocks.Content(key, 0));
      end += blocks.Content(key, 0).size();
    }
  }
  return ReadTwice(blocks, folder, [&] {
    return [&, file = std::make_shared<RawFile>(folder / "plain", O_RDONLY)](
               uint32_t key) -> uint64_t {
      Bytes target(blocks.Content(key, 0).size());
      file->ReadAt(starts[key], target);
      return target.size();
    };
  });
}

void PrintWriting(const char* name, const Writing& w, const Writing& limit) {
  fmt::print(
      "  {:<22} {:6.0f} MB/s {:5.2f} | commit {:6.1f} {:6.1f} ms | written "
      "{:5.2f} per byte put | disk {:5.2f} at most, {:5.2f} at the end\n",
      name,
      Rate(w.put_bytes, w.seconds),
      limit.seconds / w.seconds,
      1e3 * QuantileOf(w.commit_seconds, 0.5),
      1e3 * QuantileOf(w.commit_seconds, 0.95),
      Ratio(w.written_bytes, w.put_bytes),
      Ratio(w.most_bytes, w.live_bytes),
      Ratio(w.end_bytes, w.live_bytes));
}

void PrintReading(const char* name, const Reading& r, const Reading& limit) {
  fmt::print(
      "  {:<22} in order {:6.0f} MB/s {:5.2f} | shuffled {:6.0f} MB/s {:5.2f} "
      "| from disk {:4.2f}\n",
      name,
      r.sequential,
      r.sequential / limit.sequential,
      r.random,
      r.random / limit.random,
      r.from_disk);
}

// The best results of a layout, or of plain files, over the repeats.
struct Measured {
  std::optional<LayoutKind> kind;  // nullopt: plain files
  Writing writing;
  Reading reading;

  [[nodiscard]] const char* Name() const {
    return kind ? NameOf(*kind) : "plain file, fsync";
  }

  void Keep(const Writing& w, const Reading& r) {
    if (writing.seconds == 0 || w.seconds < writing.seconds) {
      writing = w;
    }
    reading.sequential = std::max(reading.sequential, r.sequential);
    reading.random = std::max(reading.random, r.random);
    reading.from_disk = std::max(reading.from_disk, r.from_disk);
  }
};

void MeasureOnce(const Options& options,
                 const Blocks& blocks,
                 uint64_t commit_bytes,
                 Measured& measured) {
  const WorkFolder folder(options.folder);
  if (measured.kind) {
    const Writing writing = WriteLayout(
        *measured.kind, blocks, options, commit_bytes, folder.Path());
    measured.Keep(writing, ReadLayout(*measured.kind, blocks, folder.Path()));
  } else {
    const Writing writing =
        WritePlainFile(blocks, options, commit_bytes, folder.Path());
    measured.Keep(writing, ReadPlainFile(blocks, folder.Path()));
  }
}

// Measures all layouts in each repeat, so that other work on the disk affects
// all of them alike.
void MeasureRates(const Options& options,
                  const Blocks& blocks,
                  uint64_t commit_mib) {
  std::vector<Measured> all(1);
  for (const LayoutKind kind : kAllLayouts) {
    all.emplace_back().kind = kind;
  }
  for (uint64_t repeat = 0; repeat < options.repeats; ++repeat) {
    for (Measured& measured : all) {
      MeasureOnce(options, blocks, commit_mib * kMiB, measured);
    }
  }
  fmt::print(
      "writing, commit every {} MiB: rate, share of the plain file's; "
      "commit, median and 95th percentile; disk by live bytes\n",
      commit_mib);
  for (const Measured& measured : all) {
    PrintWriting(measured.Name(), measured.writing, all[0].writing);
  }
  fmt::print("reading what was written so: rate, share of the plain file's\n");
  for (const Measured& measured : all) {
    PrintReading(measured.Name(), measured.reading, all[0].reading);
  }
}

// Returns whether every layout held its last commit after every kill.
bool MeasureCrashes(const Options& options) {
  if (options.kills == 0) {
    return true;
  }
  bool is_kept = true;
  fmt::print("writers killed while they commit every 2 MiB of 24 live\n");
  for (const LayoutKind kind : kAllLayouts) {
    const CrashOutcome c = KillWriters(kind, options.folder, options.kills);
    fmt::print(
        "  {:<22} {} kills, {} commits, {} failures | left at most {} files, "
        "{:.1f} MiB garbage; after opening {:.1f} MiB | opens in {:.1f} ms\n",
        NameOf(kind),
        c.kills,
        c.commits,
        c.failures,
        c.most_files_left,
        static_cast<double>(c.most_garbage_left) / kMiB,
        static_cast<double>(c.most_garbage_after) / kMiB,
        1e3 * c.open_seconds);
    is_kept = is_kept && c.failures == 0;
  }
  return is_kept;
}

bool Run(const Options& options) {
  const Blocks blocks(options.live_mib * kMiB);
  fmt::print("{} blocks, {} MiB, {} rounds, best of {}\n",
             blocks.Count(),
             options.live_mib,
             options.rounds,
             options.repeats);
  for (const uint64_t commit_mib : {4UL, 64UL}) {
    MeasureRates(options, blocks, commit_mib);
  }
  const bool is_kept = MeasureCrashes(options);
  fmt::print("peak {:.0f} MiB\n",
             static_cast<double>(PeakResidentBytes()) / kMiB);
  return is_kept;
}

// Throws CLI::ParseError for wrong arguments and for --help.
Options ParseOptions(CLI::App& app, int argc, char** argv) {
  Options options;
  app.add_option("folder", options.folder, "where to write (default: here)")
      ->check(CLI::ExistingDirectory);
  app.add_option("--live", options.live_mib, "MiB of live blocks")
      ->check(CLI::Range(1, 1 << 20))
      ->capture_default_str();
  app.add_option("--rounds", options.rounds, "how often blocks are written")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option(
         "--repeats", options.repeats, "measurements, the best of which counts")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--kills", options.kills, "writers killed per layout")
      ->check(CLI::Range(0, 10000))
      ->capture_default_str();
  app.parse(argc, argv);
  return options;
}

int Main(int argc, char** argv) {
  CLI::App app{
      "Measures the store's layout beside segment files, on the disk of a "
      "folder. Needs room for rounds x live MiB there, in folders of its own "
      "(bench_store-*) that it removes. Exit 1: a layout lost a commit."};
  try {
    return Run(ParseOptions(app, argc, argv)) ? 0 : 1;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : static_cast<int>(ExitCode::kUsage);
  } catch (const Error& error) {
    std::fprintf(stderr, "bench_store: %s\n", error.what());
    return static_cast<int>(error.Code());
  }
}

}  // namespace
}  // namespace enfilade::bench

int main(int argc, char** argv) {
  try {
    return enfilade::bench::Main(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_store: %s\n", error.what());
    return 1;
  }
}
