#include "store/sqlite_db.h"

#include "base/check.h"
#include "base/error.h"

#include <new>
#include <string>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <sys/stat.h>

namespace enfilade::internal {
namespace {

constexpr std::string_view kUnknownFormat = "unsupported file format";
constexpr std::string_view kUnknownName = "no such ";  // table or column

// How long to wait while a reader or writer briefly locks the file.
constexpr int kBusyMilliseconds = 5000;

int OpenFlags(OpenMode mode) {
  constexpr int kCommon = SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE;
  switch (mode) {
    case OpenMode::kReadWrite:
      return kCommon | SQLITE_OPEN_READWRITE;
    case OpenMode::kReadOnly:
      return kCommon | SQLITE_OPEN_READONLY;
    case OpenMode::kReadOnlyFrozen:
      return kCommon | SQLITE_OPEN_READONLY | SQLITE_OPEN_URI;
    case OpenMode::kMemory:
      return kCommon | SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE |
             SQLITE_OPEN_MEMORY;
  }
  return kCommon;
}

// file:///path?immutable=1, with the reserved characters of URIs escaped.
std::string FrozenUri(const std::filesystem::path& path) {
  std::string uri = "file://";
  for (const char c : std::filesystem::absolute(path).string()) {
    if (c == '%' || c == '?' || c == '#') {
      uri += fmt::format("%{:02x}", static_cast<unsigned char>(c));
    } else {
      uri += c;
    }
  }
  return uri + "?immutable=1";
}

std::string Reason(sqlite3* handle, int code) {
  std::string reason = handle != nullptr && sqlite3_errcode(handle) != SQLITE_OK
                           ? sqlite3_errmsg(handle)
                           : sqlite3_errstr(code);
  const int system_error = handle ? sqlite3_system_errno(handle) : 0;
  if ((code & 0xff) == SQLITE_IOERR && system_error != 0) {
    reason +=
        fmt::format(" ({})", std::generic_category().message(system_error));
  }
  return reason;
}

// Nullopt if the path names nothing.
std::optional<FileState> StateOf(const std::filesystem::path& path) {
  struct stat found {};

  if (stat(path.c_str(), &found) != 0) {
    return std::nullopt;
  }
  constexpr int64_t kNanoseconds = 1'000'000'000;
  return FileState{found.st_dev,
                   found.st_ino,
                   found.st_size,
                   found.st_mtim.tv_sec * kNanoseconds + found.st_mtim.tv_nsec};
}

}  // namespace

Database::Database(const std::filesystem::path& path, OpenMode mode)
    : name_(mode == OpenMode::kMemory ? ":memory:" : path.string()),
      frozen_(mode == OpenMode::kReadOnlyFrozen ? StateOf(path)
                                                : std::nullopt) {
  const std::string target =
      mode == OpenMode::kReadOnlyFrozen ? FrozenUri(path) : name_;
  const int code =
      sqlite3_open_v2(target.c_str(), &handle_, OpenFlags(mode), nullptr);
  if (code != SQLITE_OK) {
    const std::string reason = Reason(handle_, code);
    sqlite3_close(handle_);
    throw DiskError(
        fmt::format("{}: cannot open the store: {}", name_, reason));
  }
  sqlite3_busy_timeout(handle_, kBusyMilliseconds);
}

Database::~Database() {
  sqlite3_close_v2(handle_);
}

void Database::Execute(const char* sql) {
  const int code = sqlite3_exec(handle_, sql, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) {
    Throw(code, "use");
  }
}

int64_t Database::QueryInteger(const char* sql) {
  Statement query(*this, sql);
  return query.Step() ? query.Integer(0) : 0;
}

std::string Database::QueryText(const char* sql) {
  Statement query(*this, sql);
  return query.Step() ? std::string(query.Text(0)) : std::string();
}

bool Database::InTransaction() const {
  return sqlite3_get_autocommit(handle_) == 0;
}

void Database::RequireStillFrozen() const {
  if (!frozen_) {
    return;
  }
  const std::optional<FileState> now = StateOf(name_);
  // A file that has lost its name has no writer, either.
  const bool is_same =
      now && now->device == frozen_->device && now->file == frozen_->file;
  if (is_same && (now->bytes != frozen_->bytes ||
                  now->modified_ns != frozen_->modified_ns)) {
    throw DiskError(fmt::format(
        "{}: another program has written the store while it was read, which "
        "this reader may not lock; begin again when that program is done",
        name_));
  }
}

void Database::Throw(int code, std::string_view doing) const {
  RequireStillFrozen();
  const int primary = code & 0xff;
  if (primary == SQLITE_NOMEM) {
    throw std::bad_alloc();
  }
  const std::string reason = Reason(handle_, code);
  ENFILADE_CHECK(primary != SQLITE_MISUSE && primary != SQLITE_RANGE,
                 "{}: {}: {}",
                 name_,
                 doing,
                 reason);
  // For a header with an unknown schema format, and a schema that lacks what
  // every store has, SQLite reports only the general SQLITE_ERROR.
  const bool is_unknown = primary == SQLITE_ERROR &&
                          (reason.find(kUnknownFormat) != std::string::npos ||
                           reason.find(kUnknownName) != std::string::npos);
  if (primary == SQLITE_CORRUPT || primary == SQLITE_NOTADB ||
      code == SQLITE_IOERR_SHORT_READ || is_unknown) {
    throw DamagedStoreError(
        fmt::format("{}: the store's file is damaged ({}); restore it from a "
                    "copy or solve the scene again",
                    name_,
                    reason));
  }
  if (primary == SQLITE_BUSY || primary == SQLITE_LOCKED) {
    throw DiskError(fmt::format(
        "{}: another program is using the store ({}); wait until it is done",
        name_,
        reason));
  }
  if (primary == SQLITE_FULL) {
    throw DiskError(
        fmt::format("{}: the disk is full; everything up to the last commit is "
                    "kept: make room and resume",
                    name_));
  }
  throw DiskError(fmt::format(
      "{}: cannot {} the store: {}{}",
      name_,
      doing,
      reason,
      primary == SQLITE_IOERR
          ? "; everything up to the last commit is kept: resume when the disk, "
            "or a limit on the size of files, allows it"
          : ""));
}

Statement::Statement(Database& database, const char* sql)
    : database_(&database) {
  const int code = sqlite3_prepare_v3(
      database.Handle(), sql, -1, SQLITE_PREPARE_PERSISTENT, &handle_, nullptr);
  if (code != SQLITE_OK) {
    database.Throw(code, "read");
  }
}

Statement::~Statement() {
  sqlite3_finalize(handle_);
}

Statement& Statement::Bind(int index, int64_t value) {
  const int code = sqlite3_bind_int64(handle_, index, value);
  if (code != SQLITE_OK) {
    database_->Throw(code, "bind");
  }
  return *this;
}

Statement& Statement::Bind(int index, std::string_view text) {
  const char* data = text.empty() ? "" : text.data();
  const int code = sqlite3_bind_text64(
      handle_, index, data, text.size(), SQLITE_STATIC, SQLITE_UTF8);
  if (code != SQLITE_OK) {
    database_->Throw(code, "bind");
  }
  return *this;
}

Statement& Statement::Bind(int index, std::span<const std::byte> bytes) {
  const int code =
      bytes.empty()
          ? sqlite3_bind_zeroblob(handle_, index, 0)
          : sqlite3_bind_blob64(
                handle_, index, bytes.data(), bytes.size(), SQLITE_STATIC);
  if (code != SQLITE_OK) {
    database_->Throw(code, "bind");
  }
  return *this;
}

bool Statement::Step() {
  const int code = sqlite3_step(handle_);
  if (code == SQLITE_ROW) {
    return true;
  }
  if (code != SQLITE_DONE) {
    const bool reads = sqlite3_stmt_readonly(handle_) != 0;
    const ResetAtEnd reset(*this);
    database_->Throw(code, reads ? "read" : "write");
  }
  Reset();
  return false;
}

void Statement::Run() {
  while (Step()) {
  }
}

void Statement::Reset() noexcept {
  sqlite3_reset(handle_);
}

int64_t Statement::Integer(int column) const {
  return sqlite3_column_int64(handle_, column);
}

std::string_view Statement::Text(int column) const {
  const void* data = sqlite3_column_text(handle_, column);
  const int size = sqlite3_column_bytes(handle_, column);
  return {static_cast<const char*>(data), static_cast<size_t>(size)};
}

void ReadBlob(Database& database,
              const char* table,
              const char* column,
              int64_t row,
              std::span<std::byte> target) {
  sqlite3_blob* blob = nullptr;
  int code = sqlite3_blob_open(
      database.Handle(), "main", table, column, row, 0, &blob);
  if (code == SQLITE_ERROR ||
      (code == SQLITE_OK &&
       static_cast<size_t>(sqlite3_blob_bytes(blob)) != target.size())) {
    sqlite3_blob_close(blob);  // the row is missing, or of another size
    database.Throw(SQLITE_CORRUPT, "read");
  }
  if (code == SQLITE_OK) {
    code = sqlite3_blob_read(
        blob, target.data(), static_cast<int>(target.size()), 0);
  }
  sqlite3_blob_close(blob);
  if (code != SQLITE_OK) {
    database.Throw(code, "read");
  }
}

}  // namespace enfilade::internal
