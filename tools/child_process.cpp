#include "tools/child_process.h"

#include "base/stop.h"
#include "base/stopwatch.h"

#include <array>
#include <chrono>
#include <string_view>
#include <thread>

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

namespace enfilade {
namespace {

using Clock = std::chrono::steady_clock;

constexpr const char* kOwnProgram = "/proc/self/exe";
// How long a child may take to stop when it is asked to.
constexpr double kPatienceSeconds = 120;
constexpr auto kPoll = std::chrono::milliseconds(10);

// A file in memory; the destructor closes it.
class MemoryFile {
 public:
  MemoryFile() : descriptor_(memfd_create("stderr", MFD_CLOEXEC)) {
    if (descriptor_ < 0) {
      throw DiskError("cannot make a file in memory");
    }
  }

  ~MemoryFile() { close(descriptor_); }

  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  [[nodiscard]] int Descriptor() const { return descriptor_; }

  [[nodiscard]] std::string Text() const {
    std::string text;
    std::array<char, 4096> part{};
    ssize_t size = 0;
    while ((size = pread(descriptor_,
                         part.data(),
                         part.size(),
                         static_cast<off_t>(text.size()))) > 0) {
      text.append(part.data(), static_cast<size_t>(size));
    }
    return text;
  }

 private:
  int descriptor_;
};

pid_t Start(const std::vector<std::string>& words, const MemoryFile& err) {
  std::vector<std::string> copies = {"enfilade"};
  copies.insert(copies.end(), words.begin(), words.end());
  std::vector<char*> argv;
  argv.reserve(copies.size() + 1);
  for (std::string& word : copies) {
    argv.push_back(word.data());
  }
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, err.Descriptor(), 2);
  pid_t pid = -1;
  const int failed =
      posix_spawn(&pid, kOwnProgram, &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) {
    throw DiskError("cannot start a run of the program itself");
  }
  return pid;
}

}  // namespace

ChildResult RunOwnProgram(const std::vector<std::string>& words,
                          double most_seconds) {
  const MemoryFile err;
  const pid_t pid = Start(words, err);
  const auto begin = Clock::now();
  ChildResult result;
  bool asked = false;
  auto asked_at = begin;
  int status = 0;
  pid_t ended = 0;
  while ((ended = waitpid(pid, &status, WNOHANG)) == 0) {
    const double seconds = SecondsSince(begin);
    result.timed_out = result.timed_out || seconds > most_seconds;
    if (!asked && (result.timed_out || StopRequested().load())) {
      kill(pid, SIGTERM);
      asked = true;
      asked_at = Clock::now();
    }
    if (asked && SecondsSince(asked_at) > kPatienceSeconds) {
      kill(pid, SIGKILL);  // its store holds the last commit
    }
    std::this_thread::sleep_for(kPoll);
  }
  ThrowIfStopRequested();
  if (ended != pid) {
    throw DiskError("cannot learn how a run of the program itself ended");
  }
  result.exit_code =
      WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  result.err = err.Text();
  return result;
}

Error ErrorOfChild(const ChildResult& result) {
  constexpr std::string_view kPrefix = "enfilade: error: ";
  const size_t at = result.err.rfind(kPrefix);
  if (at == std::string::npos) {
    return {ExitCode::kBug,
            fmt::format("a run of the program itself ended with exit code {}",
                        result.exit_code)};
  }
  std::string what = result.err.substr(at + kPrefix.size());
  what.erase(what.find_last_not_of('\n') + 1);
  return {static_cast<ExitCode>(result.exit_code), what};
}

}  // namespace enfilade
