#include "tools/signal.h"

#include "base/error.h"

#include <csignal>

namespace enfilade {
namespace {

// A signal handler can reach nothing but a global.
// NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables)
std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free,
              "the flag is set inside a signal handler");

extern "C" void RequestStop(int /*signal*/) {
  stop_requested.store(true);
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

void Handle(int signal, void (*handler)(int)) {
  struct sigaction action {};

  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigaction(signal, &action, nullptr);
}

}  // namespace

void InstallStopHandlers() {
  Handle(SIGINT, RequestStop);
  Handle(SIGTERM, RequestStop);
  Handle(SIGXFSZ, SIG_IGN);
}

const std::atomic<bool>& StopRequested() {
  return stop_requested;
}

void ThrowIfStopRequested() {
  if (stop_requested.load()) {
    throw InterruptedError("stopped on request");
  }
}

}  // namespace enfilade
