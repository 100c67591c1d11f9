// The request that the whole process stop, made by a signal.
//
// Long loops of the stages before and after the solve call ThrowIfStopRequested
// some ten times a second and leave by InterruptedError, because a stage keeps
// nothing before its end. The solve gets the flag by its options and commits
// before it stops, as the reference methods do after each fineness.

#pragma once

#include <atomic>

namespace enfilade {

// The flag, which stays set as long as the process lives.
const std::atomic<bool>& StopRequested();

// Requests a stop; returns whether one was requested before. Safe in a signal
// handler.
bool RequestStop();

// Throws InterruptedError if a stop was requested. Costs next to nothing.
void ThrowIfStopRequested();

}  // namespace enfilade
