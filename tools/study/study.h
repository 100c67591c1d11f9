// Runs an experiment and keeps one JSON line per finished run, so that a study
// that was killed continues with the next run.

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/progress.h"
#include "tools/study/lines.h"
#include "tools/study/plan.h"

namespace enfilade {

struct StudyOptions {
  std::filesystem::path folder = "study";
  std::vector<double> values;        // of the parameter; empty: the default
  std::vector<std::string> methods;  // empty: all
  bool all_values = false;     // by default all values of the paper, not a few
  double most_seconds = 60;    // limit of a solve; its line says if it was cut
  double verify_seconds = 10;  // time of verify for a run; 0: no verify
};

// Makes the runs that folder/EXPERIMENT.jsonl lacks, each on one thread under a
// cap of 1G, prints the key of each when it is done, and returns all lines of
// that file. docs/study.md describes the keys of a line.
std::vector<Json> RunStudy(const Experiment& experiment,
                           const StudyOptions& options,
                           Progress& progress);

}  // namespace enfilade
