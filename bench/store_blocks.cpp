#include "bench/store_blocks.h"

#include "base/error.h"
#include "base/random.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>
#include <system_error>

#include "bench/raw_file.h"
#include <fcntl.h>
#include <fmt/format.h>

namespace enfilade::bench {
namespace {

constexpr uint64_t kBlocksSeed = 20;
constexpr size_t kPoolBytes = 8 << 20;

// Frame sizes of the 5,405 blocks (762 MB) of a solved townhouse: 3,000 of
// links, 2,300 of trees, the rest small.
struct Quantile {
  double share;
  double bytes;
};

constexpr std::array<Quantile, 8> kFrameBytes{{{0, 11},
                                               {0.1, 916},
                                               {0.25, 20902},
                                               {0.5, 136897},
                                               {0.75, 197694},
                                               {0.9, 312988},
                                               {0.99, 471776},
                                               {1, 1000954}}};

// The frame size at a share of the distribution, by linear interpolation of the
// logarithm between the quantiles.
uint64_t FrameBytes(double share) {
  size_t i = 1;
  while (i + 1 < kFrameBytes.size() && kFrameBytes[i].share < share) {
    ++i;
  }
  const Quantile& low = kFrameBytes[i - 1];
  const Quantile& high = kFrameBytes[i];
  const double t = (share - low.share) / (high.share - low.share);
  return static_cast<uint64_t>(low.bytes * std::pow(high.bytes / low.bytes, t));
}

}  // namespace

Blocks::Blocks(uint64_t bytes) : pool_(kPoolBytes) {
  Random random(kBlocksSeed);
  for (size_t i = 0; i < kPoolBytes; i += sizeof(uint64_t)) {
    const uint64_t bits = random.NextBits();
    std::memcpy(&pool_[i], &bits, sizeof bits);
  }
  for (uint64_t sum = 0; sum < bytes; sum += sizes_.back()) {
    sizes_.push_back(FrameBytes(random.Next()));
  }
}

std::span<const std::byte> Blocks::Content(uint32_t key,
                                           uint64_t version) const {
  const uint64_t seed = MixKey(kBlocksSeed, version);
  Random random(MixKey(seed, uint64_t{key}));
  const double factor = 0.8 + 0.4 * random.Next();
  const auto size =
      static_cast<size_t>(factor * static_cast<double>(sizes_[key]));
  const size_t start =
      random.NextBelow(static_cast<uint32_t>(kPoolBytes - size));
  return std::span(pool_).subspan(start, size);
}

WorkFolder::WorkFolder(const std::filesystem::path& parent) {
  std::string pattern = (parent / "bench_store-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) {
    throw DiskError(fmt::format("{}: cannot make a folder in it: {}",
                                parent.string(),
                                std::generic_category().message(errno)));
  }
  path_ = pattern;
}

WorkFolder::~WorkFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

FolderSize SizeOf(const std::filesystem::path& folder) {
  FolderSize size;
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    ++size.files;
    size.bytes += file.file_size();
  }
  return size;
}

void DropCaches(const std::filesystem::path& folder) {
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    RawFile file(entry.path(), O_RDWR);
    file.Sync();
    file.DropCache();
  }
}

DiskTraffic TrafficSoFar() {
  std::ifstream io("/proc/self/io");
  DiskTraffic traffic;
  std::string name;
  uint64_t value = 0;
  uint64_t cancelled = 0;
  while (io >> name >> value) {
    if (name == "read_bytes:") {
      traffic.read_bytes = value;
    } else if (name == "write_bytes:") {
      traffic.written_bytes = value;
    } else if (name == "cancelled_write_bytes:") {
      cancelled = value;
    }
  }
  traffic.written_bytes -= std::min(cancelled, traffic.written_bytes);
  return traffic;
}

}  // namespace enfilade::bench
