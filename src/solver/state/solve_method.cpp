#include "solver/state/solve_method.h"

#include <array>
#include <cstddef>

namespace enfilade {
namespace {

constexpr std::array<MethodTraits, 5> kMethods = {{
    {.method = SolveMethod::kWavelet, .name = "wavelet"},
    {.method = SolveMethod::kMatrix,
     .name = "matrix",
     .is_reference = true,
     .has_panels = true,
     .has_matrix = true},
    {.method = SolveMethod::kProgressive,
     .name = "progressive",
     .is_reference = true,
     .has_panels = true},
    {.method = SolveMethod::kSubstructuring,
     .name = "substructuring",
     .is_reference = true,
     .has_panels = true},
    {.method = SolveMethod::kHierarchical,
     .name = "hierarchical",
     .is_reference = true,
     .knows_error = false,
     .keeps_work = false},
}};

// Whether each method is at its own place.
constexpr bool AreInOrder() {
  for (size_t i = 0; i < kMethods.size(); ++i) {
    if (kMethods[i].method != static_cast<SolveMethod>(i)) {
      return false;
    }
  }
  return true;
}

static_assert(AreInOrder());

}  // namespace

std::span<const MethodTraits> AllMethods() {
  return kMethods;
}

const MethodTraits& TraitsOf(SolveMethod method) {
  return kMethods.at(static_cast<size_t>(method));
}

std::optional<SolveMethod> MethodNamed(std::string_view name) {
  for (const MethodTraits& traits : kMethods) {
    if (name == traits.name) {
      return traits.method;
    }
  }
  return std::nullopt;
}

}  // namespace enfilade
