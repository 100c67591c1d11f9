// The tables of a store and its queries, as prepared statements.
// Small rows (the catalogue) and large ones (the frames) lie in tables of
// their own, so that counting and walking keys reads no frames.
//
// Not thread-safe: SqliteStore serialises the calls.

#pragma once

#include "base/block_storage.h"
#include "store/sqlite_db.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace enfilade::internal {

inline constexpr int64_t kApplicationId = 0x456e6631;  // "Enf1"
inline constexpr int64_t kFormatVersion = 25;

// A row of the catalogue.
struct BlockEntry {
  BlockKey key;
  int64_t frame = 0;           // row of the frame
  uint64_t content_bytes = 0;  // decompressed
  uint64_t frame_bytes = 0;    // compressed
  uint64_t checksum = 0;       // BlockChecksum of the content
};

// A hash of a row; the sum over all rows is the catalogue's own checksum.
uint64_t EntryHash(const BlockEntry& entry);

// The first components of a key, which select the blocks of an operation.
struct KeyPrefix {
  BlockKind kind{};
  std::optional<uint32_t> a;
  std::optional<uint32_t> b;

  [[nodiscard]] BlockKey First() const;
  [[nodiscard]] BlockKey Last() const;
};

struct BlockTotals {
  uint64_t blocks = 0;
  uint64_t frame_bytes = 0;
};

void CreateTables(Database& database);

class BlockCatalogue {
 public:
  explicit BlockCatalogue(Database& database);

  [[nodiscard]] std::optional<BlockEntry> Find(const BlockKey& key);

  // Entries with first <= key <= last in ascending order, at most `limit`.
  [[nodiscard]] std::vector<BlockEntry> Range(const BlockKey& first,
                                              const BlockKey& last,
                                              size_t limit);

  [[nodiscard]] BlockTotals Totals(const KeyPrefix& prefix);

  // Adds a block or replaces it; entry.frame is ignored.
  void Put(const BlockEntry& entry, std::span<const std::byte> frame);

  void Erase(const BlockEntry& entry);

  void SetMeta(std::string_view name, std::string_view value);
  [[nodiscard]] std::optional<std::string> Meta(std::string_view name);

  // Checks every meta value; throws DamagedStoreError.
  void VerifyMeta();

  // Walks all entries. Throws DamagedStoreError if one was lost or changed.
  void VerifyEntries();

 private:
  // Sum of EntryHash over all entries, as kept by Put and Erase.
  [[nodiscard]] uint64_t StoredDigest();
  void StoreDigest(uint64_t digest);

  Database* database_;
  Statement find_;
  Statement range_;
  Statement totals_;
  Statement all_entries_;
  Statement add_frame_;
  Statement replace_frame_;
  Statement erase_frame_;
  Statement put_entry_;
  Statement erase_entry_;
  Statement put_meta_;
  Statement find_meta_;
  Statement all_meta_;
  Statement find_digest_;
  Statement put_digest_;
};

}  // namespace enfilade::internal
