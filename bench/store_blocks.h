// The blocks that bench_store writes, and helpers that its measurements share.

#pragma once

#include "base/bytes.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace enfilade::bench {

// Blocks with the sizes of a real store's frames. A block has any number of
// versions, whose sizes are within a fifth of the size of the block. The
// content does not compress, so that the codec leaves it as it is and only the
// layout counts. The content is a pure function of a fixed seed, the key and
// the version.
class Blocks {
 public:
  // Makes blocks until their sizes add up to at least `bytes`.
  explicit Blocks(uint64_t bytes);

  [[nodiscard]] uint32_t Count() const {
    return static_cast<uint32_t>(sizes_.size());
  }

  // The span is valid as long as this object.
  [[nodiscard]] std::span<const std::byte> Content(uint32_t key,
                                                   uint64_t version) const;

 private:
  std::vector<uint64_t> sizes_;
  Bytes pool_;
};

// A new folder below `parent`. The destructor removes it with its contents.
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

// Syncs the folder's files and asks the system to drop their pages from its
// cache.
void DropCaches(const std::filesystem::path& folder);

// The bytes that this process caused to be read from and written to disks, as
// counted by the system (/proc/self/io) in pages of 4 KiB, without the journal
// of the file system.
struct DiskTraffic {
  uint64_t read_bytes = 0;
  uint64_t written_bytes = 0;
};

DiskTraffic TrafficSoFar();

}  // namespace enfilade::bench
