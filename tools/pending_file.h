// A file that gets its name only when it is complete.

#pragma once

#include <filesystem>
#include <functional>
#include <iosfwd>

namespace enfilade {

// A regular file is written as `path`.part, and Keep() renames it to `path`. A
// file that was at `path` before stays until then. Without Keep() the
// destructor removes the .part file. Symbolic links are followed. A device or a
// pipe (/dev/stdout) is written directly, because it can be neither replaced
// nor sought in.
//
// The owner opens, writes and closes the file at Path().
class PendingFile {
 public:
  // Throws DiskError if no file can be written there, however much space the
  // disk has left: the folder is missing or not writable, or the path is itself
  // a folder.
  explicit PendingFile(const std::filesystem::path& path);
  ~PendingFile();
  PendingFile(const PendingFile&) = delete;
  PendingFile& operator=(const PendingFile&) = delete;

  // The path to open.
  [[nodiscard]] const std::filesystem::path& Path() const { return part_; }

  // Whether the path is a device or a pipe.
  [[nodiscard]] bool IsStream() const { return part_ == target_; }

  // Makes the content durable and gives the file its name. The file must be
  // complete and closed. Throws DiskError.
  void Keep();

 private:
  std::filesystem::path target_;
  std::filesystem::path part_;
  bool kept_ = false;
};

// Calls write(stream) on a file that appears under `path` only if complete.
// Throws DiskError.
void WriteFileInOneStep(const std::filesystem::path& path,
                        const std::function<void(std::ostream&)>& write);

// Throws as the constructor of PendingFile does, but touches no file. A long
// run calls this at its start for a file that it writes at its end.
void RequireWritable(const std::filesystem::path& path);

}  // namespace enfilade
