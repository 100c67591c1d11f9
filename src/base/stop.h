// The request to stop, of the whole process: what asks for it is a signal.
//
// Long loops of the stages before the solve look at it themselves, some ten
// times a second, and leave by InterruptedError: nothing of a stage is kept
// before its end. The solve commits first: it gets the flag by its options.

#pragma once

#include <atomic>

namespace enfilade {

// Stays set as long as the process lives.
const std::atomic<bool>& StopRequested();

// Returns whether a stop was requested before. May be called in the handler of
// a signal.
bool RequestStop();

// Throws InterruptedError if a stop was requested. Costs next to nothing.
void ThrowIfStopRequested();

}  // namespace enfilade
