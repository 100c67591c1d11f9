#include "base/stop.h"

#include "base/error.h"

namespace enfilade {
namespace {

// A global, because a signal handler can reach nothing else.
// NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables)
std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free,
              "the flag is set inside a signal handler");

}  // namespace

const std::atomic<bool>& StopRequested() {
  return stop_requested;
}

bool RequestStop() {
  return stop_requested.exchange(true);
}

void ThrowIfStopRequested() {
  if (stop_requested.load(std::memory_order_relaxed)) {
    throw InterruptedError("stopped on request");
  }
}

}  // namespace enfilade
