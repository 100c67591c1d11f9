// The peak of the memory of what a test does, whatever ran before it in the
// same process.

#pragma once

#include "base/memory.h"

#include <cstdint>
#include <fstream>

namespace enfilade {

// Lets the peak begin anew: afterwards, PeakResidentBytes() is that of what
// follows. Returns false where the kernel does not let a process do so; the
// peak is then that of the whole process, of which each test has one under
// ctest.
inline bool ResetPeak() {
  std::ofstream reset("/proc/self/clear_refs");
  reset << 5 << std::flush;  // proc(5): resets VmHWM
  return static_cast<bool>(reset);
}

// Gives back what was freed and lets the peak begin anew. Returns what is
// resident now.
inline uint64_t BeginPeak() {
  ReleaseFreedMemory();
  ResetPeak();
  return PeakResidentBytes();
}

}  // namespace enfilade
