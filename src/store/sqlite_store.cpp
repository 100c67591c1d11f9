#include "store/sqlite_store.h"

#include "base/check.h"
#include "base/error.h"
#include "store/block_catalogue.h"
#include "store/frame_codec.h"
#include "store/sqlite_db.h"
#include "store/store_files.h"
#include "store/write_lock.h"

#include <atomic>
#include <cerrno>
#include <mutex>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace enfilade {
namespace {

using internal::Beside;
using internal::BlockCatalogue;
using internal::BlockEntry;
using internal::Database;
using internal::FrameCodec;
using internal::KeyPrefix;
using internal::OpenMode;
using internal::WriteLock;

// How many keys are listed or erased at a time: bounds the memory of a walk.
constexpr size_t kKeysAtATime = 1024;

struct Parts {
  std::filesystem::path path;  // empty: in memory
  StoreAccess access = StoreAccess::kRead;
  std::unique_ptr<WriteLock> lock;
  std::unique_ptr<Database> database;
};

// mutex_ guards database_ and catalogue_; frames are made and unpacked
// outside it.
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

  void SetMeta(std::string_view name, std::string_view value) override;
  std::optional<std::string> Meta(std::string_view name) const override;
  void Put(const BlockKey& key, std::span<const std::byte> content) override;
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
  void VerifyAll() const override;

  StoreStats Stats() const override {
    return {bytes_read_.load(), bytes_written_.load()};
  }

  uint64_t FileBytes() const override;

 private:
  // Runs `change` inside the open transaction, beginning one if needed. If it
  // fails, everything since the last commit is dropped and the store only
  // reads from then on, so that no half of a transaction is ever committed.
  template <typename Change>
  void Write(const Change& change);

  void EraseAll(const KeyPrefix& prefix);
  [[nodiscard]] internal::BlockTotals Totals(const KeyPrefix& prefix) const;

  // Calls visit(entry) for all entries of a kind in order, unlocked.
  template <typename Visit>
  void ForEachEntry(BlockKind kind, const Visit& visit) const;

  [[nodiscard]] Bytes Fetch(const BlockEntry& entry) const;

  std::filesystem::path path_;
  StoreAccess access_;
  std::unique_ptr<WriteLock> lock_;
  std::unique_ptr<Database> database_;
  std::unique_ptr<BlockCatalogue> catalogue_;
  mutable std::mutex mutex_;
  bool failed_ = false;
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
  if (failed_) {
    throw DiskError(
        fmt::format("{}: nothing can be written after an earlier failure; the "
                    "last commit is kept: open the store again",
                    path_.string()));
  }
  try {
    if (!database_->InTransaction()) {
      database_->Execute("BEGIN IMMEDIATE");
    }
    change();
  } catch (...) {
    failed_ = true;
    if (database_->InTransaction()) {
      sqlite3_exec(database_->Handle(), "ROLLBACK", nullptr, nullptr, nullptr);
    }
    throw;
  }
}

void SqliteStore::SetMeta(std::string_view name, std::string_view value) {
  Write([&] { catalogue_->SetMeta(name, value); });
}

std::optional<std::string> SqliteStore::Meta(std::string_view name) const {
  const std::lock_guard lock(mutex_);
  return catalogue_->Meta(name);
}

void SqliteStore::Put(const BlockKey& key, std::span<const std::byte> content) {
  ENFILADE_CHECK(content.size() <= internal::kMaxContentBytes,
                 "block {} has {} bytes",
                 ToString(key),
                 content.size());
  const auto frame = codec_.Compress(content);
  const BlockEntry entry{key,
                         0,
                         content.size(),
                         frame.View().size(),
                         internal::BlockChecksum(key, content)};
  Write([&] { catalogue_->Put(entry, frame.View()); });
  bytes_written_ += entry.frame_bytes;
}

std::optional<Bytes> SqliteStore::Get(const BlockKey& key) const {
  std::unique_lock lock(mutex_);
  const auto entry = catalogue_->Find(key);
  lock.unlock();
  if (!entry) {
    return std::nullopt;
  }
  return Fetch(*entry);
}

Bytes SqliteStore::Fetch(const BlockEntry& entry) const {
  if (entry.frame_bytes > 2 * internal::kMaxContentBytes) {
    internal::ThrowDamagedBlock(entry.key, "its catalogue entry is impossible");
  }
  internal::RawBuffer frame(entry.frame_bytes);
  {
    const std::lock_guard lock(mutex_);
    try {
      internal::ReadBlob(
          *database_, "frame", "bytes", entry.frame, frame.All());
    } catch (const DamagedStoreError&) {
      internal::ThrowDamagedBlock(entry.key, "its frame cannot be read");
    }
  }
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
  return catalogue_->Totals(prefix);
}

template <typename Visit>
void SqliteStore::ForEachEntry(BlockKind kind, const Visit& visit) const {
  BlockKey first = KeyPrefix{kind, {}, {}}.First();
  const BlockKey last = KeyPrefix{kind, {}, {}}.Last();
  while (true) {
    std::unique_lock lock(mutex_);
    // One more than is visited: the first of the next round.
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

void SqliteStore::VerifyAll() const {
  std::unique_lock lock(mutex_);
  const std::string report = database_->QueryText("PRAGMA quick_check(1)");
  if (report != "ok") {
    throw DamagedStoreError(fmt::format(
        "{}: the store's file is damaged ({}); restore it from a copy or solve "
        "the scene again",
        path_.string(),
        report));
  }
  catalogue_->VerifyMeta();
  const uint64_t stored_digest = catalogue_->StoredDigest();
  lock.unlock();
  uint64_t digest = 0;
  for (int kind = 0; kind <= 255; ++kind) {
    ForEachEntry(static_cast<BlockKind>(kind), [&](const BlockEntry& entry) {
      digest += internal::EntryHash(entry);
      static_cast<void>(Fetch(entry));
    });
  }
  if (digest != stored_digest) {
    throw DamagedStoreError(
        fmt::format("{}: the store's catalogue is damaged: blocks are missing "
                    "or changed; restore the store from a copy or solve the "
                    "scene again",
                    path_.string()));
  }
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

// Settings of a connection; page size and journal mode belong to the file.
void Configure(Database& database) {
  database.Execute(
      "PRAGMA mmap_size = 0;"
      "PRAGMA cache_size = -2048;"  // KiB
      "PRAGMA cache_spill = ON;"
      "PRAGMA secure_delete = OFF;"
      "PRAGMA cell_size_check = ON;"
      "PRAGMA trusted_schema = OFF;"
      // Every commit reaches the disk: they are seconds apart.
      "PRAGMA synchronous = FULL;"
      "PRAGMA wal_autocheckpoint = 512;"         // pages: 16 MiB
      "PRAGMA journal_size_limit = 67108864;");  // bytes kept for reuse
}

void CreateSchema(Database& database) {
  database.Execute("BEGIN IMMEDIATE");
  database.Execute(fmt::format("PRAGMA application_id = {};"
                               "PRAGMA user_version = {};",
                               internal::kApplicationId,
                               internal::kFormatVersion)
                       .c_str());
  internal::CreateTables(database);
  database.Execute("COMMIT");
}

// Makes an empty file, or throws DiskError if the path is taken.
void CreateFile(const std::filesystem::path& path) {
  const int file =
      open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (file < 0) {
    const int error = errno;
    throw DiskError(
        error == EEXIST
            ? fmt::format("{}: exists already; name another store, resume this "
                          "one or delete it",
                          path.string())
            : fmt::format("{}: cannot create the store: {}",
                          path.string(),
                          std::generic_category().message(error)));
  }
  close(file);
}

void CheckFormat(Database& database, const std::filesystem::path& path) {
  int64_t application = 0;
  int64_t version = 0;
  try {
    application = database.QueryInteger("PRAGMA application_id");
    version = database.QueryInteger("PRAGMA user_version");
  } catch (const DamagedStoreError& error) {
    throw DamagedStoreError(
        fmt::format("{} (or it never was a store)", error.what()));
  }
  if (application != internal::kApplicationId) {
    throw InputError(fmt::format(
        "{}: is not an Enfilade store; name a file that 'enfilade solve' made",
        path.string()));
  }
  if (version != internal::kFormatVersion) {
    throw InputError(
        fmt::format("{}: the store has format {}, this program reads format "
                    "{}; use the program that wrote it, or solve again",
                    path.string(),
                    version,
                    internal::kFormatVersion));
  }
}

void CheckIsFile(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    throw DiskError(fmt::format("{}: there is no such store", path.string()));
  }
  if (!std::filesystem::is_regular_file(status)) {
    throw InputError(fmt::format("{}: is not a file", path.string()));
  }
  const auto size = std::filesystem::file_size(path, error);
  if (error) {
    throw DiskError(fmt::format("{}: {}", path.string(), error.message()));
  }
  if (size == 0) {
    throw InputError(
        fmt::format("{}: the file is empty, not an Enfilade store; delete it "
                    "and solve the scene again",
                    path.string()));
  }
}

// Readers take part in the journal's locking where they may write beside the
// store; on a read-only medium nobody writes, unless a journal was left.
OpenMode ReadMode(const std::filesystem::path& path) {
  const auto folder = std::filesystem::absolute(path).parent_path();
  if (access(path.c_str(), W_OK) == 0 && access(folder.c_str(), W_OK) == 0) {
    return OpenMode::kReadWrite;
  }
  return std::filesystem::exists(Beside(path, "-wal"))
             ? OpenMode::kReadOnly
             : OpenMode::kReadOnlyFrozen;
}

}  // namespace

std::unique_ptr<BlockStorage> CreateStore(const std::filesystem::path& path) {
  Parts parts{path, StoreAccess::kWrite, nullptr, nullptr};
  parts.lock = std::make_unique<WriteLock>(path);
  CreateFile(path);
  internal::RemoveJournals(path);
  parts.database = std::make_unique<Database>(path, OpenMode::kReadWrite);
  parts.database->Execute("PRAGMA page_size = 32768");
  Configure(*parts.database);
  parts.database->Execute("PRAGMA journal_mode = WAL");
  CreateSchema(*parts.database);
  parts.database->Execute("PRAGMA wal_checkpoint(TRUNCATE)");
  return std::make_unique<SqliteStore>(std::move(parts));
}

std::unique_ptr<BlockStorage> OpenStore(const std::filesystem::path& path,
                                        StoreAccess access) {
  CheckIsFile(path);
  Parts parts{path, access, nullptr, nullptr};
  if (access == StoreAccess::kWrite) {
    parts.lock = std::make_unique<WriteLock>(path);
  }
  parts.database = std::make_unique<Database>(
      path,
      access == StoreAccess::kWrite ? OpenMode::kReadWrite : ReadMode(path));
  CheckFormat(*parts.database, path);
  Configure(*parts.database);
  if (access == StoreAccess::kRead) {
    // One snapshot for the whole life of the reader.
    parts.database->Execute("PRAGMA query_only = ON; BEGIN");
    static_cast<void>(
        parts.database->QueryInteger("SELECT count(*) FROM digest"));
  }
  return std::make_unique<SqliteStore>(std::move(parts));
}

std::unique_ptr<BlockStorage> CreateStoreInMemory() {
  Parts parts{{}, StoreAccess::kWrite, nullptr, nullptr};
  parts.database =
      std::make_unique<Database>(std::filesystem::path(), OpenMode::kMemory);
  Configure(*parts.database);
  parts.database->Execute("PRAGMA journal_mode = MEMORY");
  CreateSchema(*parts.database);
  return std::make_unique<SqliteStore>(std::move(parts));
}

}  // namespace enfilade
