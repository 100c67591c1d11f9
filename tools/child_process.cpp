#include "tools/child_process.h"

#include "base/error.h"
#include "base/stopwatch.h"

#include <chrono>
#include <fstream>
#include <sstream>
#include <thread>

#include "tools/signal.h"
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace enfilade {
namespace {

using Clock = std::chrono::steady_clock;

constexpr const char* kOwnProgram = "/proc/self/exe";
constexpr auto kPoll = std::chrono::milliseconds(10);

pid_t Start(const std::vector<std::string>& words,
            const std::filesystem::path& err_path) {
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
  posix_spawn_file_actions_addopen(
      &actions, 2, err_path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
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
                          const std::filesystem::path& err_path,
                          double most_seconds) {
  const pid_t pid = Start(words, err_path);
  const auto begin = Clock::now();
  ChildResult result;
  bool asked = false;
  int status = 0;
  while (waitpid(pid, &status, WNOHANG) == 0) {
    const double seconds = SecondsSince(begin);
    result.timed_out = result.timed_out || seconds > most_seconds;
    if (!asked && (result.timed_out || StopRequested().load())) {
      kill(pid, SIGTERM);
      asked = true;
    }
    std::this_thread::sleep_for(kPoll);
  }
  ThrowIfStopRequested();
  result.exit_code =
      WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  std::ostringstream text;
  text << std::ifstream(err_path).rdbuf();
  result.err = text.str();
  return result;
}

}  // namespace enfilade
