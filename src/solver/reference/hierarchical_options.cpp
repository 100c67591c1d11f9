#include "solver/reference/hierarchical_options.h"

#include "base/error.h"

#include <array>
#include <span>
#include <utility>

#include <fmt/format.h>

namespace enfilade {
namespace {

template <typename Kind>
using Name = std::pair<const char*, Kind>;

constexpr double kUsualEpsilon = 0.001;

constexpr std::array<Name<VisibilityMode>, 5> kVisibilities = {{
    {"ray", VisibilityMode::kRay},
    {"fractional", VisibilityMode::kFractional},
    {"triage", VisibilityMode::kTriage},
    {"quadrature", VisibilityMode::kQuadrature},
    {"stratified", VisibilityMode::kStratified},
}};

constexpr std::array<Name<SingularRule>, 4> kSingularRules = {{
    {"none", SingularRule::kNone},
    {"switch", SingularRule::kSwitch},
    {"cc", SingularRule::kFlatlets},
    {"near", SingularRule::kNear},
}};

constexpr std::array<Name<OracleKind>, 4> kOracles = {{
    {"form-factor", OracleKind::kFormFactor},
    {"power", OracleKind::kPower},
    {"polynomial", OracleKind::kPolynomial},
    {"transfer", OracleKind::kTransfer},
}};

// Returns `usual` if the name is empty.
template <typename Kind>
Kind KindNamed(const char* option,
               const std::string& name,
               std::span<const Name<Kind>> kinds,
               Kind usual) {
  if (name.empty()) {
    return usual;
  }
  std::string known;
  for (const auto& [word, kind] : kinds) {
    if (name == word) {
      return kind;
    }
    known += known.empty() ? word : fmt::format(", {}", word);
  }
  throw UsageError(fmt::format("{} {}: give one of {}", option, name, known));
}

bool IsMultiwavelet(BasisKind basis) {
  return !basis.flat && basis.order > 1;
}

bool HasFlatlets(BasisKind basis) {
  return !basis.flat && basis.order <= 3;
}

SingularRule UsualRule(BasisKind basis) {
  if (!IsMultiwavelet(basis)) {
    return SingularRule::kSwitch;
  }
  return HasFlatlets(basis) ? SingularRule::kFlatlets : SingularRule::kNone;
}

void RefuseWhatCannotBe(SingularRule rule,
                        BasisKind kind,
                        const std::string& basis) {
  if (rule == SingularRule::kSwitch && IsMultiwavelet(kind)) {
    throw UsageError(fmt::format(
        "--singular switch has one form factor for two constant boxes (haar, "
        "f2, f3), and --basis {} has none; use --singular cc or near",
        basis));
  }
  if (rule == SingularRule::kFlatlets && !HasFlatlets(kind)) {
    throw UsageError(fmt::format(
        "--singular cc goes over to the flatlets of the same order, from haar, "
        "m2 or m3; --basis {} {}",
        basis,
        kind.flat ? "is of flatlets: use --singular switch"
                  : "has none: use --singular near or none"));
  }
}

}  // namespace

HierarchicalOptions HierarchicalOptionsOf(const MethodOptions& method,
                                          const std::string& basis) {
  const BasisKind kind = BasisNamed(basis);
  HierarchicalOptions options;
  options.epsilon = method.epsilon == 0 ? kUsualEpsilon : method.epsilon;
  if (!(options.epsilon > 0)) {
    throw UsageError(
        fmt::format("--epsilon {}: give a number above 0", method.epsilon));
  }
  options.visibility = KindNamed<VisibilityMode>("--visibility",
                                                 method.visibility,
                                                 kVisibilities,
                                                 VisibilityMode::kTriage);
  options.singular = KindNamed<SingularRule>(
      "--singular", method.singular, kSingularRules, UsualRule(kind));
  options.oracle = KindNamed<OracleKind>(
      "--oracle",
      method.oracle,
      kOracles,
      IsMultiwavelet(kind) ? OracleKind::kPolynomial : OracleKind::kPower);
  RefuseWhatCannotBe(options.singular, kind, basis);
  return options;
}

}  // namespace enfilade
