// Where a file is written until it is complete.

#pragma once

#include <filesystem>
#include <functional>
#include <iosfwd>

namespace enfilade {

// A regular file is written as `path`.part and gets its name when it is kept;
// what was there before stays until then, and if nothing is kept nothing is
// left. Links are followed. A device or a pipe (/dev/stdout) is written as it
// is: it can neither be replaced nor sought in.
//
// The owner opens, writes and closes the file at Path().
class PendingFile {
 public:
  // Throws DiskError if nothing can be written there, whatever the disk has
  // left: the folder is missing, or the path is a folder.
  explicit PendingFile(const std::filesystem::path& path);
  ~PendingFile();
  PendingFile(const PendingFile&) = delete;
  PendingFile& operator=(const PendingFile&) = delete;

  // What to open.
  [[nodiscard]] const std::filesystem::path& Path() const { return part_; }

  // A device or a pipe.
  [[nodiscard]] bool IsStream() const { return part_ == target_; }

  // The file is closed and complete. Throws DiskError.
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

// Throws as the constructor does, and touches nothing: for what is written at
// the end of a long run.
void RequireWritable(const std::filesystem::path& path);

}  // namespace enfilade
