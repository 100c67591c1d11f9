// A thin, typed layer over SQLite's C interface: a connection and prepared
// statements that close themselves and throw the errors of base/error.h.
//
//   SQLITE_CORRUPT, _NOTADB, short read,
//   unknown schema format                 DamagedStoreError
//   SQLITE_NOMEM                          std::bad_alloc
//   SQLITE_MISUSE, _RANGE                 a failed check
//   everything else                       DiskError
//
// Not thread-safe: one thread at a time per connection and its statements.

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <sqlite3.h>
#include <sys/types.h>

namespace enfilade::internal {

enum class OpenMode {
  kReadWrite,       // an existing file
  kReadOnlyFrozen,  // a file that nobody writes: opened without locks
  kReadOnly,        // with the locks of a journal that is there
  kMemory,
};

// Which file a path names, and what changes if it is written.
struct FileState {
  dev_t device = 0;
  ino_t file = 0;
  off_t bytes = 0;
  int64_t modified_ns = 0;
};

class Database {
 public:
  // Does not read the file yet; errors in its content show at the first use.
  Database(const std::filesystem::path& path, OpenMode mode);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  [[nodiscard]] sqlite3* Handle() const { return handle_; }

  // Runs statements that return nothing of interest.
  void Execute(const char* sql);

  // The one value of a query, e.g. "PRAGMA page_count".
  [[nodiscard]] int64_t QueryInteger(const char* sql);
  [[nodiscard]] std::string QueryText(const char* sql);

  // Whether BEGIN was run and neither COMMIT nor a rollback ended it.
  [[nodiscard]] bool InTransaction() const;

  // Throws DiskError if the file was opened as frozen and has been written
  // since: what is read then may be of two commits. Costs nothing for other
  // files.
  void RequireStillFrozen() const;

  // Throws the error that `code` and the connection's message stand for.
  [[noreturn]] void Throw(int code, std::string_view doing) const;

 private:
  std::string name_;  // the path, for messages
  std::optional<FileState> frozen_;
  sqlite3* handle_ = nullptr;
};

// A prepared statement. Parameters count from 1 and columns from 0, as in SQL.
class Statement {
 public:
  Statement(Database& database, const char* sql);
  ~Statement();
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  Statement& Bind(int index, int64_t value);
  // Borrows text and bytes until the statement is reset.
  Statement& Bind(int index, std::string_view text);
  Statement& Bind(int index, std::span<const std::byte> bytes);

  // Returns true if there is a row to read; otherwise resets the statement.
  bool Step();

  // Steps to the end and resets.
  void Run();

  void Reset() noexcept;

  [[nodiscard]] int64_t Integer(int column) const;
  // Valid until the next step or reset.
  [[nodiscard]] std::string_view Text(int column) const;

 private:
  Database* database_;
  sqlite3_stmt* handle_ = nullptr;
};

// Resets a statement at the end of the scope in which Step is called.
class ResetAtEnd {
 public:
  explicit ResetAtEnd(Statement& statement) : statement_(&statement) {}

  ~ResetAtEnd() { statement_->Reset(); }

  ResetAtEnd(const ResetAtEnd&) = delete;
  ResetAtEnd& operator=(const ResetAtEnd&) = delete;

 private:
  Statement* statement_;
};

// Reads a whole blob into `target` (which has its exact size) page by page,
// without a second copy in SQLite's memory.
void ReadBlob(Database& database,
              const char* table,
              const char* column,
              int64_t row,
              std::span<std::byte> target);

}  // namespace enfilade::internal
