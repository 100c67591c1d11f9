// Runs the program under test as its users do: a process of its own.

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tests/temporary_folder.h"
#include <sys/types.h>

namespace enfilade {

struct ProgramResult {
  int exit_code = -1;  // 128 + signal if a signal ended it
  std::string out;     // standard output
  std::string err;     // standard error
  // By the kernel's account, which begins with what this process had resident
  // when it started the program, whatever it had before.
  uint64_t peak_rss_bytes = 0;
};

// The program, started with these arguments and not waited for yet.
class RunningProgram {
 public:
  explicit RunningProgram(const std::vector<std::string>& arguments);

  // Waits for the program if nobody did.
  ~RunningProgram();
  RunningProgram(const RunningProgram&) = delete;
  RunningProgram& operator=(const RunningProgram&) = delete;

  void Signal(int signal) const;

  ProgramResult Wait();

 private:
  TemporaryFolder folder_;  // of the output
  pid_t pid_ = -1;
  std::optional<ProgramResult> result_;
};

ProgramResult RunProgram(const std::vector<std::string>& arguments);

// Solves a.obj of a folder into its NAME.enf, with the report NAME.json.
ProgramResult SolveScene(const std::filesystem::path& folder,
                         const std::string& name,
                         const std::vector<std::string>& more);

// Whether the text has this part.
inline bool Contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

// The cap in MiB that the message of a refusal tells to go on with; 0 if none.
int NamedCapMiB(const std::string& message);

// The content of a file; empty if there is none.
std::string ReadFile(const std::filesystem::path& path);
void WriteFile(const std::filesystem::path& path, const std::string& text);

// Writes `path` (.obj) and its .mtl: a closed room of 4 x 4 x 3 m with a lamp
// below the ceiling and `boxes` boxes of different sizes on the floor.
void WriteRoomScene(const std::filesystem::path& path, int boxes);

}  // namespace enfilade
