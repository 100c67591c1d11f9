// The layouts that bench_store compares, behind one interface: the program's
// store (frames as rows of one SQLite file) and a candidate (frames in segment
// files, SQLite only for the catalogue). Both compress and checksum in the same
// way, so that only the layout differs.
//
// The candidate does no more than a fair comparison needs:
// - Frames are appended to segment files of up to 64 MiB. A row of the
//   catalogue has the file, offset and length of a frame.
// - Commit syncs the segments that were written to (and the folder, if a
//   segment is new), then commits the catalogue. Only then are replaced frames
//   garbage.
// - A segment without a live frame is deleted after the commit that emptied it.
//   With `kSegmentsReused`, later transactions write to the extents of replaced
//   frames, best fit first; otherwise the extents stay as garbage. Nothing is
//   compacted.
// - Opening deletes segments that the catalogue does not name, and truncates
//   each of the others after its last frame.
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

  // The content of the block, verified; nullopt if there is no such block.
  [[nodiscard]] virtual std::optional<Bytes> Get(uint32_t key) const = 0;

  // When this returns, all blocks put since the last commit are on the disk.
  virtual void Commit() = 0;
};

// Makes a new layout in an empty folder.
std::unique_ptr<Layout> CreateLayout(LayoutKind kind,
                                     const std::filesystem::path& folder);

// Opens a layout, as the last process left it, for reading and writing.
std::unique_ptr<Layout> OpenLayout(LayoutKind kind,
                                   const std::filesystem::path& folder);

}  // namespace enfilade::bench
