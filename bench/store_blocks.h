// The blocks that bench_store writes, and small things its measures share.

#pragma once

#include "base/bytes.h"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace enfilade::bench {

// Blocks with the sizes of a real store's frames, each in as many versions as
// are asked for: sizes differ by up to a fifth from version to version. The
// content does not compress, so that it goes through the codec unchanged and
// only the layout counts. A pure function of its seed.
class Blocks {
 public:
  // As many blocks as have `bytes` together.
  explicit Blocks(uint64_t bytes);

  [[nodiscard]] uint32_t Count() const {
    return static_cast<uint32_t>(sizes_.size());
  }

  // Borrowed from this.
  [[nodiscard]] std::span<const std::byte> Content(uint32_t key,
                                                   uint64_t version) const;

 private:
  std::vector<uint64_t> sizes_;
  Bytes pool_;
};

// A folder of our own below the one given; removed with all in it.
class WorkFolder {
 public:
  explicit WorkFolder(const std::filesystem::path& parent);
  ~WorkFolder();
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& Path() const { return path_; }

 private:
  std::filesystem::path path_;
};

struct FolderSize {
  uint64_t files = 0;
  uint64_t bytes = 0;
};

FolderSize SizeOf(const std::filesystem::path& folder);

// Syncs the folder's files and asks the system to forget their pages.
void DropCaches(const std::filesystem::path& folder);

// What this process caused to be read from and written to disks, by the
// system's count (/proc/self/io): 4 KiB pages, without the file system's own
// journal.
struct DiskTraffic {
  uint64_t read_bytes = 0;
  uint64_t written_bytes = 0;
};

DiskTraffic TrafficSoFar();

class Stopwatch {
 public:
  [[nodiscard]] double Seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() -
                                         start_)
        .count();
  }

 private:
  std::chrono::steady_clock::time_point start_ =
      std::chrono::steady_clock::now();
};

}  // namespace enfilade::bench
