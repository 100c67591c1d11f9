// What bench_store's layouts leave behind when their writer is killed.

#pragma once

#include <cstdint>
#include <filesystem>

#include "bench/store_layout.h"

namespace enfilade::bench {

struct CrashOutcome {
  uint64_t kills = 0;
  uint64_t commits = 0;
  // Opened with an error, a commit lost, or anything else visible.
  uint64_t failures = 0;
  uint64_t most_files_left = 0;
  // On the disk beyond the live frames: before opening and after closing, at
  // most over the kills.
  uint64_t most_garbage_left = 0;
  uint64_t most_garbage_after = 0;
  double open_seconds = 0;  // median
};

// Kills a child process that writes, `kills` times at random moments of a fixed
// seed, each time going on with what the one before left; checks every block
// after each. SIGKILL leaves the system's cache alone: this is no power loss.
CrashOutcome KillWriters(LayoutKind kind,
                         const std::filesystem::path& parent,
                         uint64_t kills);

}  // namespace enfilade::bench
