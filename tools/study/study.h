// Runs an experiment and keeps one JSON line per finished run, so that a study
// that was killed goes on where it stopped.

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/study/lines.h"
#include "tools/study/plan.h"

namespace enfilade {

struct StudyOptions {
  std::filesystem::path folder = "study";
  std::vector<double> values;        // of the parameter; empty: a few
  std::vector<std::string> methods;  // empty: all
  bool all_values = false;     // the parameter as often as the paper varied it
  double most_seconds = 60;    // of one run; then it is stopped, and counts
  double verify_seconds = 10;  // that verify has for a run; 0: none
  std::string memory = "1G";   // cap of a run
  std::string threads = "1";
};

// Runs what folder/EXPERIMENT.jsonl lacks; returns all its lines. Keys of a
// line: docs/study.md.
std::vector<Json> RunStudy(const Experiment& experiment,
                           const StudyOptions& options);

}  // namespace enfilade
