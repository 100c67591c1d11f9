#include "tools/study/plan.h"

#include "base/error.h"
#include "solver/state/solve_method.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace enfilade {
namespace {

StudySetting Wavelet(const std::string& basis, double error) {
  return {
      basis, error, {"--basis", basis, "--error", fmt::format("{}", error)}};
}

StudySetting Reference(const std::string& method, double elements) {
  return {method,
          elements,
          {"--method", method, "--elements", fmt::format("{}", elements)}};
}

// The hierarchical method with `choice` for `option`, in a basis. Its name in
// tables ends in the name of the basis, from which PaperBytes takes the order.
StudySetting Hierarchical(const std::string& option,
                          const std::string& choice,
                          const std::string& basis,
                          double epsilon) {
  return {fmt::format("{}-{}", choice, basis),
          epsilon,
          {"--method",
           "hierarchical",
           "--" + option,
           choice,
           "--basis",
           basis,
           "--epsilon",
           fmt::format("{}", epsilon)}};
}

// One choice of an option. ChoicesOf runs each choice at its `epsilon`, at a
// quarter and at a sixteenth of it, and then the wavelet solver.
struct Choice {
  std::string name;
  std::string basis;
  double epsilon = 0;
};

std::vector<StudySetting> ChoicesOf(const std::string& option,
                                    const std::vector<Choice>& choices,
                                    double finest_error) {
  std::vector<StudySetting> settings;
  for (const Choice& c : choices) {
    for (const double finer : {1.0, 4.0, 16.0}) {
      settings.push_back(
          Hierarchical(option, c.name, c.basis, c.epsilon / finer));
    }
  }
  for (const char* basis : {"haar", "m2"}) {
    for (const double coarser : {4.0, 2.0, 1.0}) {
      settings.push_back(Wavelet(basis, coarser * finest_error));
    }
  }
  return settings;
}

// M2 gets a smaller epsilon than Haar, because its polynomial oracle is less
// strict on a link at the same epsilon than the power oracle of Haar.
std::vector<StudySetting> Visibilities(double epsilon, double finest_error) {
  constexpr double kSecondOrder = 0.1;
  std::vector<Choice> choices;
  for (const char* mode :
       {"ray", "fractional", "triage", "quadrature", "stratified"}) {
    choices.push_back({mode, "haar", epsilon});
    choices.push_back({mode, "m2", kSecondOrder * epsilon});
  }
  return ChoicesOf("visibility", choices, finest_error);
}

std::vector<StudySetting> SingularRules() {
  return ChoicesOf("singular",
                   {{"none", "haar", 1e-3},
                    {"switch", "haar", 1e-3},
                    {"cc", "haar", 1e-3},
                    {"near", "haar", 1e-3},
                    {"switch", "f3", 1e-4},
                    {"none", "m3", 1e-4},
                    {"cc", "m3", 1e-4},
                    {"near", "m3", 1e-4}},
                   0.02);
}

// The epsilons make about the same number of links with every oracle.
std::vector<StudySetting> Oracles() {
  std::vector<Choice> choices;
  for (const char* basis : {"haar", "m2"}) {
    choices.push_back({"form-factor", basis, 0.8});
    choices.push_back({"power", basis, 3e-3});
    choices.push_back({"polynomial", basis, 1e-3});
    choices.push_back({"transfer", basis, 0.05});
  }
  return ChoicesOf("oracle", choices, 0.05);
}

// The experiments on one choice within the hierarchical method.
std::vector<Experiment> MakeChoiceExperiments() {
  std::vector<Experiment> list = {
      {"visibility",
       "ways to find visibility, behind a blocker",
       "blocker",
       "--height",
       {0.7},
       {0.7, 1.4},
       Visibilities(4e-3, 0.05),
       {}},
      {"visibility-complex",
       "ways to find visibility, among chairs",
       "chairs",
       "--count",
       {4},
       {4, 9},
       Visibilities(1e-3, 0.1),
       {}},
      {"singular",
       "what to do where two squares touch",
       "perpendicular",
       "--separation",
       {0},
       {0, 0.1},
       SingularRules(),
       {}},
      {"singular-box",
       "what to do where the walls of a box touch",
       "box",
       "--reflectance",
       {0.9},
       {0.5, 0.9},
       SingularRules(),
       {}},
      {"oracles",
       "what says that a link is good enough, in a box",
       "box",
       "--reflectance",
       {0.5},
       {0.5, 0.9},
       Oracles(),
       {}}};
  for (Experiment& e : list) {
    e.reference = Wavelet("m2",
                          e.scene == "chairs"    ? 0.04
                          : e.scene == "blocker" ? 0.015
                                                 : 0.01);
    e.samples = 1024;
  }
  return list;
}

// The bases of the study at three errors, and the other methods at two sizes.
std::vector<StudySetting> SettingsOf(double finest_error,
                                     double most_elements) {
  std::vector<StudySetting> settings;
  for (const char* basis : {"haar", "f2", "f3", "m2", "m3"}) {
    for (const double coarser : {4.0, 2.0, 1.0}) {
      settings.push_back(Wavelet(basis, coarser * finest_error));
    }
  }
  for (const MethodTraits& method : AllMethods()) {
    for (const double smaller : {4.0, 1.0}) {
      if (method.has_panels) {
        settings.push_back(
            Reference(std::string(method.name), most_elements / smaller));
      }
    }
  }
  return settings;
}

std::vector<Experiment> MakeExperiments() {
  std::vector<Experiment> list = {
      {"parallel",
       "two squares face to face, by their separation",
       "parallel",
       "--separation",
       {0.25, 1},
       {0.1, 0.25, 0.5, 1, 2},
       {},
       {}},
      {"perpendicular",
       "two squares at a right angle, by their separation",
       "perpendicular",
       "--separation",
       {0, 0.5},
       {0, 0.1, 0.25, 0.5, 1},
       {},
       {}},
      {"blocker",
       "a shadow, by the height of the blocker",
       "blocker",
       "--height",
       {0.7, 1.4},
       {0.2, 0.4, 0.7, 1, 1.333, 1.6},
       {},
       {}},
      {"box",
       "a box, by the reflectance of its walls",
       "box",
       "--reflectance",
       {0.3, 0.9},
       {0.3, 0.5, 0.7, 0.9},
       {},
       {}},
      {"tube",
       "a long tube, by the reflectance of its walls",
       "tube",
       "--reflectance",
       {0.3, 0.9},
       {0.3, 0.5, 0.7, 0.9},
       {},
       {}},
      {"lights",
       "a room with 12 chairs, by the number of lights",
       "lights",
       "--lights",
       {1, 4},
       {1, 4, 9, 16},
       {},
       {}},
      {"chairs",
       "a room, by the number of chairs",
       "chairs",
       "--count",
       {4, 16, 36},
       {4, 6, 9, 12, 16, 20, 25, 30, 36},
       {},
       {}}};
  for (Experiment& e : list) {
    const bool furnished = e.scene == "chairs" || e.scene == "lights";
    e.settings = SettingsOf(furnished ? 0.1 : 0.05, furnished ? 2500 : 2000);
    // Finer references would take minutes in the tube and among chairs.
    const bool slow = furnished || e.scene == "tube";
    e.reference = Wavelet("m2", slow ? 0.04 : 0.01);
    e.equal_seconds = slow ? 10 : 1;
  }
  for (Experiment& e : MakeChoiceExperiments()) {
    list.push_back(std::move(e));
  }
  return list;
}

}  // namespace

bool IsWavelet(const std::string& method) {
  const auto known = MethodNamed(method);
  return !known || !TraitsOf(*known).has_panels;
}

StudySetting Coarser(const StudySetting& setting) {
  return IsWavelet(setting.method)
             ? Wavelet(setting.method, 2 * setting.setting)
             : Reference(setting.method, std::floor(setting.setting / 2));
}

const std::vector<Experiment>& Experiments() {
  static const std::vector<Experiment> experiments = MakeExperiments();
  return experiments;
}

const Experiment& FindExperiment(const std::string& name) {
  std::string known;
  for (const Experiment& e : Experiments()) {
    if (e.name == name || (e.name == "chairs" && name == "complex")) {
      return e;
    }
    known += " " + e.name;
  }
  throw UsageError(
      fmt::format("there is no experiment '{}'; there are:{}", name, known));
}

double PaperBytes(const std::string& method,
                  double patches,
                  double elements,
                  double links) {
  const auto known = MethodNamed(method);
  if (known == SolveMethod::kMatrix) {
    return 24 * elements + 28 * links;
  }
  if (known == SolveMethod::kProgressive) {
    return 96 * elements;
  }
  if (known == SolveMethod::kSubstructuring) {
    return 24 * patches + 52 * elements;
  }
  const double order = method.ends_with("haar") ? 1 : method.back() - '0';
  const double square = order * order;
  return (16 + 24 * square * square) * links + (20 + 24 * square) * elements;
}

}  // namespace enfilade
