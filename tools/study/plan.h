// The seven experiments of Willmott and Heckbert 1997, section 3.1, as runs of
// the program: scene x parameter x method x setting. And five that compare one
// choice within the hierarchical method, beside the wavelet solver.

#pragma once

#include <string>
#include <vector>

namespace enfilade {

// One solve: by which method, how fine.
struct StudySetting {
  std::string method;              // haar, m2, matrix, ..., ray-haar, cc-m3
  double setting = 0;              // requested error, elements, or epsilon
  std::vector<std::string> words;  // for `enfilade solve`
};

struct Experiment {
  std::string name;
  std::string about;
  std::string scene;   // of `enfilade scene`
  std::string option;  // of that scene, for the parameter
  std::vector<double> few_values;
  std::vector<double> all_values;
  // What is compared with each other, by verify, and with a finer solution.
  std::vector<StudySetting> settings;
  StudySetting reference;
  // Points on each patch at which solutions are compared, at least.
  int samples = 64;
  double equal_seconds = 1;  // the curve at equal time is of this one

  [[nodiscard]] const std::vector<double>& Values(bool all) const {
    return all ? all_values : few_values;
  }
};

// By wavelets: its setting is an error, or an epsilon. By anything else:
// elements.
bool IsWavelet(const std::string& method);

// The same method at twice the error, or half the elements.
StudySetting Coarser(const StudySetting& setting);

const std::vector<Experiment>& Experiments();

// `complex` is another name of chairs. UsageError names the known ones.
const Experiment& FindExperiment(const std::string& name);

// Bytes by the accounting of the paper, appendix A: of a run's patches,
// elements and links.
double PaperBytes(const std::string& method,
                  double patches,
                  double elements,
                  double links);

}  // namespace enfilade
