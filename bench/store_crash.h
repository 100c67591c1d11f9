// Kills writers of bench_store's layouts and checks what they leave on disk.

#pragma once

#include <cstdint>
#include <filesystem>

#include "bench/store_layout.h"

namespace enfilade::bench {

struct CrashOutcome {
  uint64_t kills = 0;
  uint64_t commits = 0;
  // Kills after which the layout did not open or did not show exactly the last
  // commit, and writers that ended on an error of their own.
  uint64_t failures = 0;
  uint64_t most_files_left = 0;
  // Bytes on the disk in excess of the live frames, before the layout is opened
  // and after it is closed; the most over all kills.
  uint64_t most_garbage_left = 0;
  uint64_t most_garbage_after = 0;
  double open_seconds = 0;  // median
};

// Starts a child process that writes and kills it at a random moment, `kills`
// times with a fixed seed. Each child continues with what the one before left.
// Checks every block after each kill. SIGKILL does not lose the system's page
// cache, so that this does not simulate a power loss.
CrashOutcome KillWriters(LayoutKind kind,
                         const std::filesystem::path& parent,
                         uint64_t kills);

}  // namespace enfilade::bench
