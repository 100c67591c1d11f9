// Records of one size in a temporary file.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace enfilade {

// The file has no name, and its space is free again when the spool goes, or the
// process. It lies in the folder that the environment variable TMPDIR names,
// or in /tmp. All members throw DiskError.
class Spool {
 public:
  explicit Spool(size_t record_bytes);
  ~Spool();
  Spool(Spool&& other) noexcept;
  Spool& operator=(Spool&&) = delete;
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;

  // Writes whole records, the first of which gets the number `first`.
  void Write(uint64_t first, std::span<const std::byte> records);
  void Read(uint64_t first, std::span<std::byte> records) const;

 private:
  size_t record_bytes_;
  int descriptor_ = -1;
};

}  // namespace enfilade
