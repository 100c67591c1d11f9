// This very program as a child process: a run of its own, with its own peak of
// memory.

#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace enfilade {

struct ChildResult {
  int exit_code = -1;  // 128 + signal if a signal ended it
  bool timed_out = false;
  std::string err;  // standard error
};

// Runs the program with these words, standard output discarded; standard error
// goes through the file `err_path`. After `most_seconds` the child is asked to
// stop, and so it is when a stop of this process was requested; then
// InterruptedError.
ChildResult RunOwnProgram(const std::vector<std::string>& words,
                          const std::filesystem::path& err_path,
                          double most_seconds);

}  // namespace enfilade
