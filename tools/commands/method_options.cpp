#include "tools/commands/method_options.h"

#include "base/error.h"
#include "solver/reference/form_factor_kinds.h"

#include <map>
#include <string>

#include "tools/commands/options.h"
#include <fmt/format.h>

namespace enfilade {
namespace {

std::map<std::string, SolveMethod> MethodsByName() {
  std::map<std::string, SolveMethod> methods;
  for (const MethodTraits& traits : AllMethods()) {
    methods.emplace(traits.name, traits.method);
  }
  return methods;
}

void AddFormFactorOptions(CLI::App& command, MethodOptions& method) {
  command
      .add_option("--form-factors",
                  method.form_factors,
                  "With matrix, progressive and substructuring: exact, point, "
                  "polygon, switch, hemicube "
                  "or montecarlo (docs/reference-methods.md)")
      ->check(
          CLI::IsMember(
              {"exact", "point", "polygon", "switch", "hemicube", "montecarlo"})
              .description(""))
      ->type_name("KIND")
      ->capture_default_str();
  command
      .add_option("--projection",
                  method.projection,
                  "With --method matrix: galerkin (irradiance averaged over an "
                  "element) or collocation (at its centre)")
      ->check(CLI::IsMember({"galerkin", "collocation"}).description(""))
      ->type_name("PROJECTION")
      ->capture_default_str();
}

void AddHierarchicalOptions(CLI::App& command, MethodOptions& method) {
  const auto add = [&](const char* name, std::string& value, const char* what) {
    command.add_option(name, value, what)->type_name("NAME");
  };
  command
      .add_option(
          "--epsilon",
          method.epsilon,
          "With --method hierarchical: the error by its oracle above which "
          "a link is refined (0.001 if not given)")
      ->check(AboveZero())
      ->type_name("EPS");
  add("--visibility",
      method.visibility,
      "With --method hierarchical: ray, fractional, triage, quadrature or "
      "stratified");
  add("--singular",
      method.singular,
      "With --method hierarchical, where surfaces touch: none, switch, cc or "
      "near");
  add("--oracle",
      method.oracle,
      "With --method hierarchical: form-factor, power, polynomial or transfer");
}

}  // namespace

void AddMethodOptions(CLI::App& command, MethodOptions& method) {
  command
      .add_option("--method",
                  method.kind,
                  "matrix, progressive, substructuring, hierarchical or "
                  "wavelet: all but wavelet are for comparison, and hold the "
                  "scene whole (docs/reference-methods.md)")
      ->transform(OneOf(MethodsByName()))
      ->type_name("METHOD")
      ->default_str(std::string(TraitsOf(method.kind).name));
  command
      .add_option(
          "--linear-solver",
          method.linear_solver,
          "With --method matrix: gs (Gauss-Seidel), sor or cg (conjugate "
          "gradients, for symmetric form factors; for others the default "
          "is gs)")
      ->check(CLI::IsMember({"gs", "sor", "cg"}).description(""))
      ->type_name("SOLVER")
      ->capture_default_str();
  AddFormFactorOptions(command, method);
  AddHierarchicalOptions(command, method);
  command
      .add_option("--elements",
                  method.elements,
                  "With matrix, progressive and substructuring: dice as finely "
                  "as this number of elements "
                  "allows, whatever the error")
      ->check(WholeAboveZero())
      ->type_name("N");
  command.add_flag("--ambient",
                   method.ambient,
                   "Progressive and substructuring: add the light still to "
                   "come as an even ambient term");
}

void ChooseByMethod(const CLI::App& given, SolveSettings& settings) {
  const auto has = [&](const char* option) { return given.count(option) > 0; };
  MethodOptions& method = settings.method;
  const MethodTraits& traits = TraitsOf(method.kind);
  if (!traits.has_panels && (has("--form-factors") || has("--projection"))) {
    throw UsageError(
        "--form-factors and --projection are of the reference methods; give "
        "--method matrix, progressive or substructuring");
  }
  if (!traits.knows_error && has("--error")) {
    throw UsageError(fmt::format(
        "--method {} does not know its error: give --epsilon", traits.name));
  }
  if (traits.is_reference && !has("--basis")) {
    settings.basis = "haar";
  }
  if (!has("--linear-solver") && !FormFactorOptionsOf(method).AreSymmetric()) {
    method.linear_solver = "gs";
  }
}

}  // namespace enfilade
