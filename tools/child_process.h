// Runs this program as a child process, which has its own peak of memory.

#pragma once

#include "base/error.h"

#include <string>
#include <vector>

namespace enfilade {

struct ChildResult {
  int exit_code = -1;  // 128 + signal if a signal ended it
  bool timed_out = false;
  std::string err;  // standard error
};

// Runs the program with the arguments `words`. Discards its standard output.
// Keeps its standard error in memory rather than in a file, because the child
// may have to report a full disk. Sends the child SIGTERM after `most_seconds`,
// or when a stop of this process is requested; in the latter case throws
// InterruptedError once the child has ended.
ChildResult RunOwnProgram(const std::vector<std::string>& words,
                          double most_seconds);

// The error that ended the child, for the caller to throw: the child's exit
// code, and its message without the program's name in front.
Error ErrorOfChild(const ChildResult& result);

}  // namespace enfilade
