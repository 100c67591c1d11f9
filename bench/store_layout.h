// The layouts that bench_store compares, behind one seam: the program's store
// (frames as rows of one SQLite file) and a candidate (frames in segment files,
// SQLite only for the catalogue). Both compress and checksum as the store does,
// so that only the layout differs.
//
// The candidate, as little as is honest:
// - Frames are appended to segment files of up to 64 MiB; a row of the
// catalogue
//   names file, offset and length.
// - Commit syncs the segments written to (and the folder, if one is new), then
//   commits the catalogue. Only then do replaced frames count as garbage.
// - A segment without a live frame is deleted after the commit that emptied it.
//   With `kSegmentsReused` the extents of replaced frames are written again,
//   best fit first, from the commit after; otherwise they stay as garbage.
//   Nothing is compacted.
// - Opening deletes segments that the catalogue does not name and cuts off what
//   follows the last frame of each of the others.
//
// All members throw DiskError or DamagedStoreError. Not thread-safe.

#pragma once

#include "base/bytes.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>

namespace enfilade::bench {

enum class LayoutKind { kOneFile, kSegments, kSegmentsReused };

inline constexpr LayoutKind kAllLayouts[] = {
    LayoutKind::kOneFile, LayoutKind::kSegments, LayoutKind::kSegmentsReused};

const char* NameOf(LayoutKind kind);

class Layout {
 public:
  virtual ~Layout() = default;

  // Replaces the block.
  virtual void Put(uint32_t key, std::span<const std::byte> content) = 0;

  // The content, verified; nullopt when there is no such block.
  [[nodiscard]] virtual std::optional<Bytes> Get(uint32_t key) const = 0;

  // Everything since the last commit is on the disk when it returns.
  virtual void Commit() = 0;
};

// Makes a new layout in an empty folder.
std::unique_ptr<Layout> CreateLayout(LayoutKind kind,
                                     const std::filesystem::path& folder);

// Opens one as the last process left it, for reading and writing.
std::unique_ptr<Layout> OpenLayout(LayoutKind kind,
                                   const std::filesystem::path& folder);

}  // namespace enfilade::bench
