// The peak of the memory of what a test does, whatever ran before it in the
// same process.

#pragma once

#include "base/memory.h"

#include <cstdint>
#include <fstream>

namespace enfilade {

// Gives back what was freed and lets the peak begin anew: afterwards,
// PeakResidentBytes() is that of what follows. Returns what is resident now.
inline uint64_t BeginPeak() {
  ReleaseFreedMemory();
  std::ofstream("/proc/self/clear_refs") << 5;  // proc(5): resets VmHWM
  return PeakResidentBytes();
}

}  // namespace enfilade
