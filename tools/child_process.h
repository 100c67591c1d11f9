// This very program as a child process: a run of its own, with its own peak of
// memory.

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

// Runs the program with these words, standard output discarded; standard error
// is kept in memory, for it has something to say when the disk is full. After
// `most_seconds` the child is asked to stop, and so it is when a stop of this
// process was requested; then InterruptedError.
ChildResult RunOwnProgram(const std::vector<std::string>& words,
                          double most_seconds);

// The error that ended it, to be thrown: its exit code, and what it said
// without the program's name in front.
Error ErrorOfChild(const ChildResult& result);

}  // namespace enfilade
