#include "tests/tools/run_program.h"

#include "base/check.h"

#include <array>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "tests/memory_peak.h"
#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace enfilade {
namespace {

namespace fs = std::filesystem;

// One axis-parallel box as six quads that face outward, or inward.
void WriteBox(std::ostream& out,
              const std::array<double, 3>& low,
              const std::array<double, 3>& high,
              bool inward) {
  for (int corner = 0; corner < 8; ++corner) {
    out << fmt::format("v {} {} {}\n",
                       (corner & 1) != 0 ? high[0] : low[0],
                       (corner & 2) != 0 ? high[1] : low[1],
                       (corner & 4) != 0 ? high[2] : low[2]);
  }
  // Corners of the sides, counter-clockwise from outside.
  constexpr int kSides[6][4] = {{0, 4, 6, 2},
                                {1, 3, 7, 5},
                                {0, 1, 5, 4},
                                {2, 6, 7, 3},
                                {0, 2, 3, 1},
                                {4, 5, 7, 6}};
  for (const auto& side : kSides) {
    out << "f";
    for (int i = 0; i < 4; ++i) {
      out << ' ' << side[inward ? 3 - i : i] - 8;
    }
    out << '\n';
  }
}

}  // namespace

RunningProgram::RunningProgram(const std::vector<std::string>& arguments) {
  std::vector<std::string> words = {ENFILADE_PROGRAM};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) {
    argv.push_back(word.data());
  }
  argv.push_back(nullptr);

  BeginPeak();  // which the child takes over
  constexpr int kWrite = O_WRONLY | O_CREAT | O_TRUNC;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(
      &actions, 1, (folder_ / "out").c_str(), kWrite, 0600);
  posix_spawn_file_actions_addopen(
      &actions, 2, (folder_ / "err").c_str(), kWrite, 0600);
  const int failed = posix_spawn(
      &pid_, ENFILADE_PROGRAM, &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ENFILADE_CHECK(failed == 0, "cannot start {}", ENFILADE_PROGRAM);
}

RunningProgram::~RunningProgram() {
  Wait();
}

void RunningProgram::Signal(int signal) const {
  if (!result_) {
    kill(pid_, signal);
  }
}

ProgramResult RunningProgram::Wait() {
  if (!result_) {
    int status = 0;
    rusage usage{};
    ENFILADE_CHECK(wait4(pid_, &status, 0, &usage) == pid_, "pid {}", pid_);
    ProgramResult result;
    result.exit_code =
        WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    result.out = ReadFile(folder_ / "out");
    result.err = ReadFile(folder_ / "err");
    result.peak_rss_bytes = static_cast<uint64_t>(usage.ru_maxrss) * 1024;
    result_ = result;
  }
  return *result_;
}

ProgramResult RunProgram(const std::vector<std::string>& arguments) {
  return RunningProgram(arguments).Wait();
}

ProgramResult SolveScene(const std::filesystem::path& folder,
                         const std::string& name,
                         const std::vector<std::string>& more) {
  std::vector<std::string> words = {"solve",
                                    folder / "a.obj",
                                    "-o",
                                    folder / (name + ".enf"),
                                    "--report",
                                    folder / (name + ".json")};
  words.insert(words.end(), more.begin(), more.end());
  return RunProgram(words);
}

int NamedCapMiB(const std::string& message) {
  const std::string words = "with --memory ";
  const size_t at = message.rfind(words);
  return at == std::string::npos ? 0
                                 : std::stoi(message.substr(at + words.size()));
}

std::string ReadFile(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

void WriteFile(const fs::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

void WriteRoomScene(const fs::path& path, int boxes) {
  fs::path materials = path;
  materials.replace_extension(".mtl");
  WriteFile(materials,
            "newmtl wall\nKd 0.6 0.5 0.4\nnewmtl box\nKd 0.3 0.4 0.5\n"
            "newmtl lamp\nKd 0 0 0\nKe 40 40 36\n");
  std::ofstream out(path);
  out << "mtllib " << materials.filename().string() << "\nusemtl wall\n";
  WriteBox(out, {0, 0, 0}, {4, 4, 3}, true);
  out << "usemtl lamp\n"
         "v 1.5 1.5 2.9\nv 1.5 2.5 2.9\nv 2.5 2.5 2.9\nv 2.5 1.5 2.9\n"
         "f -4 -3 -2 -1\n"
         "usemtl box\n";
  for (int i = 0; i < boxes; ++i) {
    const double x = 0.3 + 0.9 * (i % 4);
    const double y = 0.3 + 0.9 * (i / 4 % 4);
    const double size = 0.3 + 0.02 * i;
    WriteBox(out, {x, y, 0.1}, {x + size, y + 0.4, 0.1 + 2 * size}, false);
  }
}

}  // namespace enfilade
