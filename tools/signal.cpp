#include "tools/signal.h"

#include "base/stop.h"

#include <atomic>
#include <csignal>
#include <cstdint>
#include <ctime>

namespace enfilade {
namespace {

// A sender may signal both the process and its group. Signals within this many
// nanoseconds of the first count as the same request.
constexpr int64_t kSameRequestNs = 1'000'000'000;

// A signal handler can reach nothing but a global.
// NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables)
std::atomic<int64_t> requested_at_ns{0};  // 0: not yet
static_assert(std::atomic<int64_t>::is_always_lock_free,
              "it is set inside a signal handler");

int64_t NowNs() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);  // may be called in a handler
  return int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

extern "C" void StopOrDie(int signal) {
  const int64_t now = NowNs();
  int64_t first = 0;
  if (requested_at_ns.compare_exchange_strong(first, now)) {
    RequestStop();
  } else if (now - first > kSameRequestNs) {
    std::signal(signal, SIG_DFL);
    static_cast<void>(std::raise(signal));
  }
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
  Handle(SIGINT, StopOrDie);
  Handle(SIGTERM, StopOrDie);
  Handle(SIGXFSZ, SIG_IGN);
}

}  // namespace enfilade
