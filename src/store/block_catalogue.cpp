#include "store/block_catalogue.h"

#include "base/error.h"
#include "base/hash.h"
#include "base/random.h"

#include <limits>

#include <fmt/format.h>

namespace enfilade::internal {
namespace {

constexpr uint32_t kMaxComponent = std::numeric_limits<uint32_t>::max();

// Keys compare as (a, b, c) row values.
constexpr const char* kRangeWhere =
    " FROM catalogue WHERE kind = ?1 AND (a, b, c) >= (?2, ?3, ?4)"
    " AND (a, b, c) <= (?5, ?6, ?7)";

std::string RangeSql(const char* columns, const char* tail) {
  return fmt::format("SELECT {}{}{}", columns, kRangeWhere, tail);
}

void BindRange(Statement& statement,
               const BlockKey& first,
               const BlockKey& last) {
  statement.Bind(1, static_cast<int64_t>(first.kind))
      .Bind(2, int64_t{first.a})
      .Bind(3, int64_t{first.b})
      .Bind(4, int64_t{first.c})
      .Bind(5, int64_t{last.a})
      .Bind(6, int64_t{last.b})
      .Bind(7, int64_t{last.c});
}

void BindKey(Statement& statement, const BlockKey& key) {
  statement.Bind(1, static_cast<int64_t>(key.kind))
      .Bind(2, int64_t{key.a})
      .Bind(3, int64_t{key.b})
      .Bind(4, int64_t{key.c});
}

uint64_t MetaChecksum(std::string_view name, std::string_view value) {
  const uint64_t seed = HashBytes(std::as_bytes(std::span(name)));
  return HashBytes(std::as_bytes(std::span(value)), seed);
}

void CheckMeta(std::string_view name,
               std::string_view value,
               uint64_t checksum) {
  if (MetaChecksum(name, value) != checksum) {
    throw DamagedStoreError(
        fmt::format("the store's entry '{}' is damaged: its checksum does not "
                    "fit; restore the store from a copy or solve the scene "
                    "again",
                    name));
  }
}

}  // namespace

uint64_t EntryHash(const BlockEntry& entry) {
  uint64_t hash = MixKey(0, static_cast<uint64_t>(entry.key.kind));
  hash = MixKey(hash, entry.key.a);
  hash = MixKey(hash, entry.key.b);
  hash = MixKey(hash, entry.key.c);
  return MixKey(hash, entry.checksum);
}

BlockKey KeyPrefix::First() const {
  return {kind, a.value_or(0), b.value_or(0), 0};
}

BlockKey KeyPrefix::Last() const {
  return {kind,
          a.value_or(kMaxComponent),
          b.value_or(kMaxComponent),
          kMaxComponent};
}

void CreateTables(Database& database) {
  database.Execute(
      "CREATE TABLE meta("
      "  name TEXT PRIMARY KEY, value BLOB NOT NULL,"
      "  checksum INTEGER NOT NULL) WITHOUT ROWID;"
      "CREATE TABLE catalogue("
      "  kind INTEGER NOT NULL, a INTEGER NOT NULL, b INTEGER NOT NULL,"
      "  c INTEGER NOT NULL, frame INTEGER NOT NULL,"
      "  content_bytes INTEGER NOT NULL, frame_bytes INTEGER NOT NULL,"
      "  checksum INTEGER NOT NULL,"
      "  PRIMARY KEY(kind, a, b, c)) WITHOUT ROWID;"
      "CREATE TABLE frame(id INTEGER PRIMARY KEY, bytes BLOB NOT NULL);"
      "CREATE TABLE digest(id INTEGER PRIMARY KEY, sum INTEGER NOT NULL);"
      "INSERT INTO digest VALUES(1, 0);");
}

BlockCatalogue::BlockCatalogue(Database& database)
    : database_(&database),
      find_(database,
            "SELECT frame, content_bytes, frame_bytes, checksum FROM catalogue"
            " WHERE kind = ?1 AND a = ?2 AND b = ?3 AND c = ?4"),
      range_(database,
             RangeSql("a, b, c, frame, content_bytes, frame_bytes, checksum",
                      " ORDER BY a, b, c LIMIT ?8")
                 .c_str()),
      totals_(database, RangeSql("count(*), total(frame_bytes)", "").c_str()),
      all_entries_(database, "SELECT kind, a, b, c, checksum FROM catalogue"),
      add_frame_(database, "INSERT INTO frame(bytes) VALUES(?1)"),
      replace_frame_(database, "UPDATE frame SET bytes = ?2 WHERE id = ?1"),
      erase_frame_(database, "DELETE FROM frame WHERE id = ?1"),
      put_entry_(database,
                 "INSERT OR REPLACE INTO catalogue"
                 " VALUES(?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)"),
      erase_entry_(database,
                   "DELETE FROM catalogue"
                   " WHERE kind = ?1 AND a = ?2 AND b = ?3 AND c = ?4"),
      put_meta_(database, "INSERT OR REPLACE INTO meta VALUES(?1, ?2, ?3)"),
      find_meta_(database, "SELECT value, checksum FROM meta WHERE name = ?1"),
      all_meta_(database, "SELECT name, value, checksum FROM meta"),
      find_digest_(database, "SELECT sum FROM digest WHERE id = 1"),
      put_digest_(database, "UPDATE digest SET sum = ?1 WHERE id = 1") {}

std::optional<BlockEntry> BlockCatalogue::Find(const BlockKey& key) {
  const ResetAtEnd reset(find_);
  BindKey(find_, key);
  if (!find_.Step()) {
    return std::nullopt;
  }
  return BlockEntry{key,
                    find_.Integer(0),
                    static_cast<uint64_t>(find_.Integer(1)),
                    static_cast<uint64_t>(find_.Integer(2)),
                    static_cast<uint64_t>(find_.Integer(3))};
}

std::vector<BlockEntry> BlockCatalogue::Range(const BlockKey& first,
                                              const BlockKey& last,
                                              size_t limit) {
  const ResetAtEnd reset(range_);
  BindRange(range_, first, last);
  range_.Bind(8, static_cast<int64_t>(limit));
  std::vector<BlockEntry> entries;
  while (range_.Step()) {
    const BlockKey key{first.kind,
                       static_cast<uint32_t>(range_.Integer(0)),
                       static_cast<uint32_t>(range_.Integer(1)),
                       static_cast<uint32_t>(range_.Integer(2))};
    entries.push_back({key,
                       range_.Integer(3),
                       static_cast<uint64_t>(range_.Integer(4)),
                       static_cast<uint64_t>(range_.Integer(5)),
                       static_cast<uint64_t>(range_.Integer(6))});
  }
  return entries;
}

BlockTotals BlockCatalogue::Totals(const KeyPrefix& prefix) {
  const ResetAtEnd reset(totals_);
  BindRange(totals_, prefix.First(), prefix.Last());
  BlockTotals totals;
  if (totals_.Step()) {
    totals.blocks = static_cast<uint64_t>(totals_.Integer(0));
    totals.frame_bytes = static_cast<uint64_t>(totals_.Integer(1));
  }
  return totals;
}

void BlockCatalogue::Put(const BlockEntry& entry,
                         std::span<const std::byte> frame) {
  const auto old = Find(entry.key);
  int64_t row = 0;
  if (old) {
    row = old->frame;
    const ResetAtEnd reset(replace_frame_);
    replace_frame_.Bind(1, row).Bind(2, frame).Run();
  } else {
    const ResetAtEnd reset(add_frame_);
    add_frame_.Bind(1, frame).Run();
    row = sqlite3_last_insert_rowid(database_->Handle());
  }
  const ResetAtEnd reset(put_entry_);
  BindKey(put_entry_, entry.key);
  put_entry_.Bind(5, row)
      .Bind(6, static_cast<int64_t>(entry.content_bytes))
      .Bind(7, static_cast<int64_t>(frame.size()))
      .Bind(8, static_cast<int64_t>(entry.checksum))
      .Run();
  const uint64_t without = StoredDigest() - (old ? EntryHash(*old) : 0);
  StoreDigest(without + EntryHash(entry));
}

void BlockCatalogue::Erase(const BlockEntry& entry) {
  const ResetAtEnd reset(erase_entry_);
  BindKey(erase_entry_, entry.key);
  erase_entry_.Run();
  const ResetAtEnd reset_frame(erase_frame_);
  erase_frame_.Bind(1, entry.frame).Run();
  StoreDigest(StoredDigest() - EntryHash(entry));
}

void BlockCatalogue::SetMeta(std::string_view name, std::string_view value) {
  const ResetAtEnd reset(put_meta_);
  put_meta_.Bind(1, name)
      .Bind(2, std::as_bytes(std::span(value)))
      .Bind(3, static_cast<int64_t>(MetaChecksum(name, value)))
      .Run();
}

std::optional<std::string> BlockCatalogue::Meta(std::string_view name) {
  const ResetAtEnd reset(find_meta_);
  find_meta_.Bind(1, name);
  if (!find_meta_.Step()) {
    return std::nullopt;
  }
  std::string value(find_meta_.Text(0));
  CheckMeta(name, value, static_cast<uint64_t>(find_meta_.Integer(1)));
  return value;
}

void BlockCatalogue::VerifyMeta() {
  const ResetAtEnd reset(all_meta_);
  while (all_meta_.Step()) {
    CheckMeta(all_meta_.Text(0),
              all_meta_.Text(1),
              static_cast<uint64_t>(all_meta_.Integer(2)));
  }
}

void BlockCatalogue::VerifyEntries() {
  const ResetAtEnd reset(all_entries_);
  uint64_t digest = 0;
  while (all_entries_.Step()) {
    BlockEntry entry;
    entry.key = {static_cast<BlockKind>(all_entries_.Integer(0)),
                 static_cast<uint32_t>(all_entries_.Integer(1)),
                 static_cast<uint32_t>(all_entries_.Integer(2)),
                 static_cast<uint32_t>(all_entries_.Integer(3))};
    entry.checksum = static_cast<uint64_t>(all_entries_.Integer(4));
    digest += EntryHash(entry);
  }
  if (digest != StoredDigest()) {
    throw DamagedStoreError(
        "the store's catalogue is damaged: blocks are missing or changed; "
        "restore the store from a copy or solve the scene again");
  }
}

uint64_t BlockCatalogue::StoredDigest() {
  const ResetAtEnd reset(find_digest_);
  return find_digest_.Step() ? static_cast<uint64_t>(find_digest_.Integer(0))
                             : 0;
}

void BlockCatalogue::StoreDigest(uint64_t digest) {
  const ResetAtEnd reset(put_digest_);
  put_digest_.Bind(1, static_cast<int64_t>(digest)).Run();
}

}  // namespace enfilade::internal
