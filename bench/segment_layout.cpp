#include "bench/segment_layout.h"

#include "base/block_storage.h"
#include "store/frame_codec.h"
#include "store/sqlite_db.h"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "bench/raw_file.h"
#include <fcntl.h>
#include <fmt/format.h>

namespace enfilade::bench {
namespace {

using internal::Database;
using internal::OpenMode;
using internal::ResetAtEnd;
using internal::Statement;

constexpr uint64_t kSegmentBytes = 64ULL << 20;

struct Extent {
  int64_t segment = 0;
  uint64_t offset = 0;
  uint64_t length = 0;
};

struct Segment {
  explicit Segment(RawFile opened) : file(std::move(opened)) {}

  RawFile file;
  uint64_t end_bytes = 0;   // where the next frame is appended
  uint64_t live_bytes = 0;  // of frames in the last or the next commit
  bool is_dirty = false;
  std::map<uint64_t, uint64_t> free;  // length by offset; no two are adjacent
};

struct Entry {
  Extent place;
  uint64_t content_bytes = 0;
  uint64_t checksum = 0;
};

BlockKey KeyOf(uint32_t key) {
  return {BlockKind::kLinks, key, 0, 0};
}

std::filesystem::path CataloguePath(const std::filesystem::path& folder) {
  return folder / "catalogue.enf";
}

std::filesystem::path SegmentPath(const std::filesystem::path& folder,
                                  int64_t id) {
  return folder / fmt::format("segment-{}", id);
}

// The store's settings that matter here (store_database.cpp). The pages of the
// catalogue are smaller than the store's, because its rows are small.
void Configure(Database& database) {
  database.Execute(
      "PRAGMA cache_size = -2048;"
      "PRAGMA synchronous = FULL;"
      "PRAGMA journal_size_limit = 67108864;");
}

class SegmentLayout final : public Layout {
 public:
  SegmentLayout(std::filesystem::path folder, bool reuse);
  ~SegmentLayout() override = default;
  SegmentLayout(const SegmentLayout&) = delete;
  SegmentLayout& operator=(const SegmentLayout&) = delete;

  void Put(uint32_t key, std::span<const std::byte> content) override;
  [[nodiscard]] std::optional<Bytes> Get(uint32_t key) const override;
  void Commit() override;

 private:
  void LoadSegments();
  void RemoveUnnamedSegments();
  [[nodiscard]] std::optional<Entry> Find(uint32_t key) const;
  Extent Allocate(uint64_t length);
  std::optional<Extent> TakeFree(uint64_t length);
  void SyncSegments();
  void Release(const Extent& place);

  std::filesystem::path folder_;
  bool reuse_;
  Database database_;
  mutable Statement find_;
  Statement put_;
  std::map<int64_t, Segment> segments_;
  int64_t current_ = 0;  // id of the segment to which frames are appended
  bool folder_is_dirty_ = false;
  std::vector<Extent> replaced_;  // in this transaction
  mutable internal::FrameCodec codec_;
};

SegmentLayout::SegmentLayout(std::filesystem::path folder, bool reuse)
    : folder_(std::move(folder)),
      reuse_(reuse),
      database_(CataloguePath(folder_), OpenMode::kReadWrite),
      find_(database_,
            "SELECT segment, offset, length, content_bytes, checksum"
            " FROM catalogue WHERE key = ?1"),
      put_(database_,
           "INSERT OR REPLACE INTO catalogue VALUES(?1, ?2, ?3, ?4, ?5, ?6)") {
  Configure(database_);
  LoadSegments();
  RemoveUnnamedSegments();
}

void SegmentLayout::LoadSegments() {
  Statement all(database_,
                "SELECT segment, offset, length FROM catalogue"
                " ORDER BY segment, offset");
  while (all.Step()) {
    const int64_t id = all.Integer(0);
    const auto offset = static_cast<uint64_t>(all.Integer(1));
    const auto length = static_cast<uint64_t>(all.Integer(2));
    auto found = segments_.find(id);
    if (found == segments_.end()) {
      found =
          segments_.try_emplace(id, RawFile(SegmentPath(folder_, id), O_RDWR))
              .first;
    }
    Segment& segment = found->second;
    if (reuse_ && offset > segment.end_bytes) {
      segment.free[segment.end_bytes] = offset - segment.end_bytes;
    }
    segment.end_bytes = offset + length;
    segment.live_bytes += length;
    current_ = id;
  }
  for (auto& [id, segment] : segments_) {
    if (std::filesystem::file_size(segment.file.Path()) > segment.end_bytes) {
      segment.file.Truncate(segment.end_bytes);
    }
  }
}

void SegmentLayout::RemoveUnnamedSegments() {
  std::vector<std::filesystem::path> unnamed;
  for (const auto& file : std::filesystem::directory_iterator(folder_)) {
    const bool named = std::any_of(
        segments_.begin(), segments_.end(), [&](const auto& segment) {
          return segment.second.file.Path() == file.path();
        });
    if (!named && file.path().filename().string().starts_with("segment-")) {
      unnamed.push_back(file.path());
    }
  }
  for (const auto& path : unnamed) {
    std::filesystem::remove(path);
  }
}

std::optional<Entry> SegmentLayout::Find(uint32_t key) const {
  const ResetAtEnd reset(find_);
  find_.Bind(1, int64_t{key});
  if (!find_.Step()) {
    return std::nullopt;
  }
  return Entry{{find_.Integer(0),
                static_cast<uint64_t>(find_.Integer(1)),
                static_cast<uint64_t>(find_.Integer(2))},
               static_cast<uint64_t>(find_.Integer(3)),
               static_cast<uint64_t>(find_.Integer(4))};
}

std::optional<Extent> SegmentLayout::TakeFree(uint64_t length) {
  Segment* best = nullptr;
  Extent place;
  for (auto& [id, segment] : segments_) {
    for (const auto& [offset, free] : segment.free) {
      if (free >= length && (best == nullptr || free < place.length)) {
        best = &segment;
        place = {id, offset, free};
      }
    }
  }
  if (best == nullptr) {
    return std::nullopt;
  }
  best->free.erase(place.offset);
  if (place.length > length) {
    best->free[place.offset + length] = place.length - length;
  }
  place.length = length;
  return place;
}

Extent SegmentLayout::Allocate(uint64_t length) {
  if (reuse_) {
    if (const auto place = TakeFree(length)) {
      return *place;
    }
  }
  auto found = segments_.find(current_);
  if (found == segments_.end() ||
      found->second.end_bytes + length > kSegmentBytes) {
    ++current_;
    found = segments_
                .try_emplace(current_,
                             RawFile(SegmentPath(folder_, current_),
                                     O_RDWR | O_CREAT | O_EXCL))
                .first;
    folder_is_dirty_ = true;
  }
  Segment& segment = found->second;
  segment.end_bytes += length;
  return {current_, segment.end_bytes - length, length};
}

void SegmentLayout::Put(uint32_t key, std::span<const std::byte> content) {
  const auto frame = codec_.Compress(content);
  const uint64_t checksum = internal::BlockChecksum(KeyOf(key), content);
  if (!database_.InTransaction()) {
    database_.Execute("BEGIN IMMEDIATE");
  }
  if (const auto old = Find(key)) {
    replaced_.push_back(old->place);
  }
  const Extent place = Allocate(frame.View().size());
  Segment& segment = segments_.at(place.segment);
  segment.file.WriteAt(place.offset, frame.View());
  segment.live_bytes += place.length;
  segment.is_dirty = true;
  const ResetAtEnd reset(put_);
  put_.Bind(1, int64_t{key})
      .Bind(2, place.segment)
      .Bind(3, static_cast<int64_t>(place.offset))
      .Bind(4, static_cast<int64_t>(place.length))
      .Bind(5, static_cast<int64_t>(content.size()))
      .Bind(6, static_cast<int64_t>(checksum))
      .Run();
}

std::optional<Bytes> SegmentLayout::Get(uint32_t key) const {
  const auto entry = Find(key);
  if (!entry) {
    return std::nullopt;
  }
  const auto segment = segments_.find(entry->place.segment);
  if (segment == segments_.end()) {
    internal::ThrowDamagedBlock(KeyOf(key), "its segment is missing");
  }
  internal::RawBuffer frame(entry->place.length);
  segment->second.file.ReadAt(entry->place.offset, frame.All());
  return codec_.Decompress(
      KeyOf(key), frame.View(), entry->content_bytes, entry->checksum);
}

void SegmentLayout::SyncSegments() {
  for (auto& [id, segment] : segments_) {
    if (segment.is_dirty) {
      segment.file.Sync();
      segment.is_dirty = false;
    }
  }
  if (folder_is_dirty_) {
    RawFile(folder_, O_RDONLY | O_DIRECTORY).Sync();
    folder_is_dirty_ = false;
  }
}

// Makes the extent garbage, or free if extents are reused. Requires that the
// last commit does not name the extent any more.
void SegmentLayout::Release(const Extent& place) {
  Segment& segment = segments_.at(place.segment);
  segment.live_bytes -= place.length;
  if (!reuse_) {
    return;
  }
  auto here = segment.free.emplace(place.offset, place.length).first;
  const auto next = std::next(here);
  if (next != segment.free.end() && here->first + here->second == next->first) {
    here->second += next->second;
    segment.free.erase(next);
  }
  if (here != segment.free.begin()) {
    const auto before = std::prev(here);
    if (before->first + before->second == here->first) {
      before->second += here->second;
      segment.free.erase(here);
    }
  }
}

void SegmentLayout::Commit() {
  if (!database_.InTransaction()) {
    return;
  }
  SyncSegments();
  database_.Execute("COMMIT");
  for (const Extent& place : std::exchange(replaced_, {})) {
    Release(place);
  }
  std::erase_if(segments_, [&](const auto& s) {
    const bool is_empty = s.second.live_bytes == 0 && s.first != current_;
    if (is_empty) {
      std::filesystem::remove(s.second.file.Path());
    }
    return is_empty;
  });
}

}  // namespace

void CreateSegmentCatalogue(const std::filesystem::path& folder) {
  const auto path = CataloguePath(folder);
  RawFile(path, O_RDWR | O_CREAT | O_EXCL);
  Database database(path, OpenMode::kReadWrite);
  database.Execute("PRAGMA page_size = 4096; PRAGMA journal_mode = WAL");
  Configure(database);
  database.Execute(
      "CREATE TABLE catalogue("
      "  key INTEGER PRIMARY KEY, segment INTEGER NOT NULL,"
      "  offset INTEGER NOT NULL, length INTEGER NOT NULL,"
      "  content_bytes INTEGER NOT NULL, checksum INTEGER NOT NULL)");
}

std::unique_ptr<Layout> OpenSegmentLayout(const std::filesystem::path& folder,
                                          bool reuse) {
  return std::make_unique<SegmentLayout>(folder, reuse);
}

}  // namespace enfilade::bench
