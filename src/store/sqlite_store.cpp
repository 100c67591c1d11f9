#include "store/sqlite_store.h"

#include "base/check.h"
#include "base/error.h"
#include "store/block_catalogue.h"
#include "store/frame_codec.h"
#include "store/sqlite_db.h"
#include "store/store_database.h"
#include "store/write_lock.h"

#include <atomic>
#include <mutex>
#include <system_error>
#include <utility>

#include <fmt/format.h>

namespace enfilade {
namespace {

using internal::Beside;
using internal::BlockCatalogue;
using internal::BlockEntry;
using internal::Database;
using internal::FrameCodec;
using internal::KeyPrefix;
using internal::WriteLock;

// How many keys are listed or erased at a time, to bound the memory.
constexpr size_t kKeysAtATime = 1024;

struct Parts {
  std::filesystem::path path;  // empty for a store in memory
  StoreAccess access = StoreAccess::kRead;
  std::unique_ptr<WriteLock> lock;
  std::unique_ptr<Database> database;
};

// mutex_ guards database_ and catalogue_; compression and decompression run
// outside the lock.
class SqliteStore final : public BlockStorage {
 public:
  explicit SqliteStore(Parts parts)
      : path_(std::move(parts.path)),
        access_(parts.access),
        lock_(std::move(parts.lock)),
        database_(std::move(parts.database)),
        catalogue_(std::make_unique<BlockCatalogue>(*database_)) {}

  ~SqliteStore() override;
  SqliteStore(const SqliteStore&) = delete;
  SqliteStore& operator=(const SqliteStore&) = delete;

  [[nodiscard]] std::string Name() const override {
    return path_.empty() ? BlockStorage::Name() : path_.string();
  }

  void SetMeta(std::string_view name, std::string_view value) override;
  std::optional<std::string> Meta(std::string_view name) const override;
  uint64_t Put(const BlockKey& key,
               std::span<const std::byte> content) override;
  std::optional<Bytes> Get(const BlockKey& key) const override;
  void Erase(const BlockKey& key) override;

  void EraseAll(BlockKind kind) override { EraseAll(KeyPrefix{kind, {}, {}}); }

  void EraseAll(BlockKind kind, uint32_t a) override {
    EraseAll(KeyPrefix{kind, a, {}});
  }

  void EraseAll(BlockKind kind, uint32_t a, uint32_t b) override {
    EraseAll(KeyPrefix{kind, a, b});
  }

  uint64_t Count(BlockKind kind) const override {
    return Totals(KeyPrefix{kind, {}, {}}).blocks;
  }

  uint64_t StoredBytes(BlockKind kind) const override {
    return Totals(KeyPrefix{kind, {}, {}}).frame_bytes;
  }

  uint64_t Count(BlockKind kind, uint32_t a, uint32_t b) const override {
    return Totals(KeyPrefix{kind, a, b}).blocks;
  }

  void ForEachKey(
      BlockKind kind,
      const std::function<void(const BlockKey&)>& visit) const override;
  void Commit() override;
  uint64_t VerifyAll(
      const std::function<void(double fraction)>& progress) const override;

  // Checks that no block was lost, without reading any; throws
  // DamagedStoreError.
  void VerifyCatalogue() const;

  StoreStats Stats() const override {
    return {bytes_read_.load(), bytes_written_.load()};
  }

  uint64_t FileBytes() const override;

 private:
  // Runs `change` inside the open transaction; begins one if needed. If
  // `change` fails, the store drops everything since the last commit and
  // refuses to write and to read blocks from then on, so that no part of a
  // transaction is ever committed or missed.
  template <typename Change>
  void Write(const Change& change);

  // Throws DiskError if no read can be trusted. Requires that the caller holds
  // `mutex_`.
  void ThrowIfFailed() const;

  // Returns what work() does; an error about damage gets the store's path.
  template <typename Work>
  auto NamingFile(const Work& work) const;

  void EraseAll(const KeyPrefix& prefix);
  [[nodiscard]] internal::BlockTotals Totals(const KeyPrefix& prefix) const;

  // Calls visit(entry) for all entries of a kind in order, without the lock.
  template <typename Visit>
  void ForEachEntry(BlockKind kind, const Visit& visit) const;

  // The content of an entry. Releases the lock of mutex_ once the frame is
  // read. Requires that nothing was written since the entry was found.
  [[nodiscard]] Bytes Fetch(const BlockEntry& entry,
                            std::unique_lock<std::mutex> lock) const;

  std::filesystem::path path_;
  StoreAccess access_;
  std::unique_ptr<WriteLock> lock_;
  std::unique_ptr<Database> database_;
  std::unique_ptr<BlockCatalogue> catalogue_;
  mutable std::mutex mutex_;
  std::optional<std::string> failure_;  // why nothing can be written any more
  mutable FrameCodec codec_;
  mutable std::atomic<uint64_t> bytes_read_{0};
  std::atomic<uint64_t> bytes_written_{0};
};

SqliteStore::~SqliteStore() {
  catalogue_.reset();
  try {
    if (database_->InTransaction()) {
      database_->Execute("ROLLBACK");
    }
  } catch (const std::exception&) {
    // If the rollback fails, SQLite rolls back when the file is opened next.
  }
}

template <typename Change>
void SqliteStore::Write(const Change& change) {
  const std::lock_guard lock(mutex_);
  ENFILADE_CHECK(access_ == StoreAccess::kWrite,
                 "{} was opened for reading",
                 path_.string());
  ThrowIfFailed();
  try {
    if (!database_->InTransaction()) {
      database_->Execute("BEGIN IMMEDIATE");
    }
    change();
  } catch (const std::exception& e) {
    failure_ = e.what();
    if (database_->InTransaction()) {
      sqlite3_exec(database_->Handle(), "ROLLBACK", nullptr, nullptr, nullptr);
    }
    throw;
  }
}

// After a failure all that was written since the last commit is gone, so that
// what is read no longer fits what the caller knows.
void SqliteStore::ThrowIfFailed() const {
  if (failure_) {
    throw DiskError(fmt::format(
        "{}: nothing can be read or written after an earlier failure ({}); "
        "the last commit is kept: open the store again",
        path_.string(),
        *failure_));
  }
  database_->RequireStillFrozen();
}

template <typename Work>
auto SqliteStore::NamingFile(const Work& work) const {
  try {
    return work();
  } catch (const DamagedStoreError& error) {
    database_->RequireStillFrozen();
    if (path_.empty()) {
      throw;  // a store in memory
    }
    throw DamagedStoreError(
        fmt::format("{}: {}", path_.string(), error.what()));
  }
}

void SqliteStore::SetMeta(std::string_view name, std::string_view value) {
  Write([&] { catalogue_->SetMeta(name, value); });
}

std::optional<std::string> SqliteStore::Meta(std::string_view name) const {
  const std::lock_guard lock(mutex_);
  ThrowIfFailed();
  return NamingFile([&] { return catalogue_->Meta(name); });
}

uint64_t SqliteStore::Put(const BlockKey& key,
                          std::span<const std::byte> content) {
  if (content.size() > internal::kMaxContentBytes) {
    throw DoesNotFitError(fmt::format(
        "block '{}' of the store would have {} bytes, and may have {}: the "
        "scene is too large to be solved whole under any cap; solve it in "
        "parts",
        ToString(key),
        content.size(),
        internal::kMaxContentBytes));
  }
  const auto frame = codec_.Compress(content);
  const BlockEntry entry{key,
                         0,
                         content.size(),
                         frame.View().size(),
                         internal::BlockChecksum(key, content)};
  Write([&] { catalogue_->Put(entry, frame.View()); });
  bytes_written_ += entry.frame_bytes;
  return entry.frame_bytes;
}

std::optional<Bytes> SqliteStore::Get(const BlockKey& key) const {
  std::unique_lock lock(mutex_);
  ThrowIfFailed();
  const auto entry = catalogue_->Find(key);
  if (!entry) {
    return std::nullopt;
  }
  return NamingFile([&] { return Fetch(*entry, std::move(lock)); });
}

Bytes SqliteStore::Fetch(const BlockEntry& entry,
                         std::unique_lock<std::mutex> lock) const {
  if (entry.frame_bytes > 2 * internal::kMaxContentBytes) {
    internal::ThrowDamagedBlock(entry.key, "its catalogue entry is impossible");
  }
  internal::RawBuffer frame(entry.frame_bytes);
  try {
    internal::ReadBlob(*database_, "frame", "bytes", entry.frame, frame.All());
  } catch (const DamagedStoreError&) {
    internal::ThrowDamagedBlock(entry.key, "its frame cannot be read");
  }
  lock.unlock();
  bytes_read_ += entry.frame_bytes;
  return codec_.Decompress(
      entry.key, frame.View(), entry.content_bytes, entry.checksum);
}

void SqliteStore::Erase(const BlockKey& key) {
  Write([&] {
    if (const auto entry = catalogue_->Find(key)) {
      catalogue_->Erase(*entry);
    }
  });
}

void SqliteStore::EraseAll(const KeyPrefix& prefix) {
  Write([&] {
    while (true) {
      const auto entries =
          catalogue_->Range(prefix.First(), prefix.Last(), kKeysAtATime);
      for (const BlockEntry& entry : entries) {
        catalogue_->Erase(entry);
      }
      if (entries.size() < kKeysAtATime) {
        return;
      }
    }
  });
}

internal::BlockTotals SqliteStore::Totals(const KeyPrefix& prefix) const {
  const std::lock_guard lock(mutex_);
  ThrowIfFailed();
  return catalogue_->Totals(prefix);
}

template <typename Visit>
void SqliteStore::ForEachEntry(BlockKind kind, const Visit& visit) const {
  BlockKey first = KeyPrefix{kind, {}, {}}.First();
  const BlockKey last = KeyPrefix{kind, {}, {}}.Last();
  while (true) {
    std::unique_lock lock(mutex_);
    ThrowIfFailed();
    // One entry more than is visited: the first one of the next round.
    auto entries = catalogue_->Range(first, last, kKeysAtATime + 1);
    lock.unlock();
    const bool more = entries.size() > kKeysAtATime;
    if (more) {
      first = entries.back().key;
      entries.pop_back();
    }
    for (const BlockEntry& entry : entries) {
      visit(entry);
    }
    if (!more) {
      return;
    }
  }
}

void SqliteStore::ForEachKey(
    BlockKind kind, const std::function<void(const BlockKey&)>& visit) const {
  ForEachEntry(kind, [&](const BlockEntry& entry) { visit(entry.key); });
}

void SqliteStore::Commit() {
  Write([&] { database_->Execute("COMMIT"); });
}

void SqliteStore::VerifyCatalogue() const {
  const std::lock_guard lock(mutex_);
  NamingFile([&] { catalogue_->VerifyEntries(); });
}

uint64_t SqliteStore::VerifyAll(
    const std::function<void(double fraction)>& progress) const {
  const std::string report = [&] {
    const std::lock_guard lock(mutex_);
    return database_->QueryText("PRAGMA quick_check(1)");
  }();
  if (report != "ok") {
    database_->RequireStillFrozen();
    throw DamagedStoreError(fmt::format(
        "{}: the store's file is damaged ({}); restore it from a copy or solve "
        "the scene again",
        path_.string(),
        report));
  }
  NamingFile([&] {
    const std::lock_guard lock(mutex_);
    catalogue_->VerifyMeta();
    catalogue_->VerifyEntries();
  });
  uint64_t all = 0;
  for (int kind = 0; kind <= 255; ++kind) {
    all += Count(static_cast<BlockKind>(kind));
  }
  uint64_t done = 0;
  for (int kind = 0; kind <= 255; ++kind) {
    ForEachEntry(static_cast<BlockKind>(kind), [&](const BlockEntry& entry) {
      NamingFile([&] { return Fetch(entry, std::unique_lock(mutex_)); });
      ++done;
      if (progress) {
        progress(static_cast<double>(done) / static_cast<double>(all));
      }
    });
  }
  return done;
}

uint64_t SqliteStore::FileBytes() const {
  if (path_.empty()) {
    const std::lock_guard lock(mutex_);
    return static_cast<uint64_t>(database_->QueryInteger("PRAGMA page_count") *
                                 database_->QueryInteger("PRAGMA page_size"));
  }
  uint64_t bytes = 0;
  for (const char* suffix : {"", "-wal"}) {
    std::error_code absent;
    const auto size = std::filesystem::file_size(Beside(path_, suffix), absent);
    bytes += absent ? 0 : size;
  }
  return bytes;
}

}  // namespace

std::unique_ptr<BlockStorage> CreateStore(const std::filesystem::path& path) {
  auto lock = std::make_unique<WriteLock>(path);
  auto database = internal::CreateDatabase(path);
  return std::make_unique<SqliteStore>(
      Parts{path, StoreAccess::kWrite, std::move(lock), std::move(database)});
}

std::unique_ptr<BlockStorage> OpenStore(const std::filesystem::path& path,
                                        StoreAccess access) {
  internal::RequireFile(path);
  // SQLite puts its files beside the target of a link; the lock must be there
  // too.
  const auto file = std::filesystem::is_symlink(path)
                        ? std::filesystem::canonical(path)
                        : path;
  auto lock = access == StoreAccess::kWrite ? std::make_unique<WriteLock>(file)
                                            : nullptr;
  auto database = internal::OpenDatabase(file, access);
  auto store = std::make_unique<SqliteStore>(
      Parts{file, access, std::move(lock), std::move(database)});
  store->VerifyCatalogue();
  return store;
}

std::unique_ptr<BlockStorage> CreateStoreInMemory() {
  return std::make_unique<SqliteStore>(Parts{
      {}, StoreAccess::kWrite, nullptr, internal::CreateDatabaseInMemory()});
}

}  // namespace enfilade
