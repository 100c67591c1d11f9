// The seven experiments of Willmott and Heckbert 1997, section 3.1, as runs of
// the program: scene x parameter x method x setting. Five more experiments
// compare the alternatives of one choice in the hierarchical method with each
// other and with the wavelet solver.

#pragma once

#include <string>
#include <vector>

namespace enfilade {

// The method and the fineness of one solve.
struct StudySetting {
  std::string method;              // haar, m2, matrix, ..., ray-haar, cc-m3
  double setting = 0;              // requested error, elements, or epsilon
  std::vector<std::string> words;  // arguments of `enfilade solve`
};

struct Experiment {
  std::string name;
  std::string about;
  std::string scene;   // of `enfilade scene`
  std::string option;  // of that scene, which sets the parameter
  std::vector<double> few_values;
  std::vector<double> all_values;
  // The runs that are compared. verify measures the error of each, and compare
  // measures it against `reference`, a finer solution.
  std::vector<StudySetting> settings;
  StudySetting reference;
  // The least number of points on each patch at which solutions are compared.
  int samples = 64;
  double equal_seconds = 1;  // the time of the curve at equal time

  [[nodiscard]] const std::vector<double>& Values(bool all) const {
    return all ? all_values : few_values;
  }
};

// Whether the method is by wavelets. Its setting is then a requested error or
// an epsilon; the setting of any other method is a number of elements.
bool IsWavelet(const std::string& method);

// The same method at twice the error, or half the elements.
StudySetting Coarser(const StudySetting& setting);

const std::vector<Experiment>& Experiments();

// Throws UsageError, which lists the known experiments, if `name` is none.
// `complex` is another name of `chairs`.
const Experiment& FindExperiment(const std::string& name);

// The memory of a run by the formulas of the paper's appendix A, from its
// patches, elements and links.
double PaperBytes(const std::string& method,
                  double patches,
                  double elements,
                  double links);

}  // namespace enfilade
