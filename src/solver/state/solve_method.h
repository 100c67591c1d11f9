// The methods that compute the light: their names, and what each takes.

#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace enfilade {

enum class SolveMethod : uint8_t {
  kWavelet,  // Enfilade's own
  kMatrix,
  kProgressive,
  kSubstructuring,
  kHierarchical,
};

struct MethodTraits {
  SolveMethod method = SolveMethod::kWavelet;
  // As on the command line, in stores and in reports: a contract.
  std::string_view name;
  // Whether it is there to be compared with, and holds the scene whole.
  bool is_reference = false;
  // Whether it has one mesh of constant elements, and thus takes --elements,
  // --ambient and --form-factors instead of a basis.
  bool has_panels = false;
  // Whether it solves a linear system, and thus takes --linear-solver and
  // --projection collocation.
  bool has_matrix = false;
  // Whether it estimates its error, and thus takes --error; else --epsilon.
  bool knows_error = true;
  // Whether a solve that is stopped keeps its work.
  bool keeps_work = true;
};

// All methods, in the order of SolveMethod.
std::span<const MethodTraits> AllMethods();

const MethodTraits& TraitsOf(SolveMethod method);

// Nullopt if there is no such method.
std::optional<SolveMethod> MethodNamed(std::string_view name);

}  // namespace enfilade
