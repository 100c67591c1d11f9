#include "solver/solve.h"

#include "base/error.h"
#include "partition/partition.h"
#include "partition/partition_store.h"
#include "solver/elements/basis.h"
#include "solver/engine.h"
#include "solver/error_control.h"
#include "solver/least_memory.h"
#include "solver/reference/form_factor_kinds.h"
#include "solver/reference/hierarchical_options.h"
#include "solver/reference/hierarchical_solve.h"
#include "solver/reference/reference_solve.h"
#include "solver/state/solve_state.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include <fmt/format.h>

namespace enfilade {

namespace {

bool IsOneOf(const std::string& word, std::initializer_list<const char*> all) {
  return std::find(all.begin(), all.end(), word) != all.end();
}

// Throws UsageError if the form factors do not fit the method or its linear
// solver.
void ValidateFormFactors(const MethodOptions& method) {
  const FormFactorOptions form_factors = FormFactorOptionsOf(method);
  const MethodTraits& traits = TraitsOf(method.kind);
  if (!traits.has_panels &&
      (form_factors.kind != FormFactorKind::kExact ||
       form_factors.projection != Projection::kGalerkin)) {
    throw UsageError(fmt::format(
        "--form-factors and --projection are of matrix, progressive and "
        "substructuring; --method {} has its own",
        traits.name));
  }
  if (!traits.has_matrix &&
      form_factors.projection == Projection::kCollocation) {
    throw UsageError(fmt::format(
        "--projection collocation is of --method matrix alone; --method {} "
        "shoots",
        traits.name));
  }
  if (traits.has_matrix && method.linear_solver == "cg" &&
      !form_factors.AreSymmetric()) {
    throw UsageError(fmt::format(
        "--linear-solver cg needs a symmetric matrix, and --form-factors {} "
        "with --projection {} makes one that is not: what i sees of j is not "
        "what j sees of i. Use --linear-solver gs or sor",
        method.form_factors,
        method.projection));
  }
}

// Throws UsageError if the options that only the hierarchical method takes are
// given to another method, or the other way round.
void ValidateHierarchical(const MethodOptions& method,
                          const std::string& basis) {
  if (method.kind == SolveMethod::kHierarchical) {
    if (method.elements != 0 || method.ambient) {
      throw UsageError(
          "--elements and --ambient are of the methods with one mesh; --method "
          "hierarchical takes --epsilon");
    }
    HierarchicalOptionsOf(method, basis);
  } else if (method.epsilon != 0 || !method.visibility.empty() ||
             !method.singular.empty() || !method.oracle.empty()) {
    throw UsageError(fmt::format(
        "--epsilon, --visibility, --singular and --oracle are of --method "
        "hierarchical; --method {} has its own",
        TraitsOf(method.kind).name));
  }
}

void ValidateMethod(const MethodOptions& method, const std::string& basis) {
  if (!IsOneOf(method.linear_solver, {"gs", "sor", "cg"})) {
    throw UsageError(fmt::format("--linear-solver {}: give gs, sor or cg",
                                 method.linear_solver));
  }
  if (method.kind == SolveMethod::kWavelet &&
      (method.elements != 0 || method.ambient)) {
    throw UsageError(
        "--elements and --ambient are of the reference methods; "
        "--method wavelet takes --error alone");
  }
  const MethodTraits& traits = TraitsOf(method.kind);
  if (traits.has_panels && BasisNamed(basis) != BasisKind{1, false}) {
    throw UsageError(fmt::format(
        "--method {} has constant elements: --basis {} is of wavelet and "
        "hierarchical",
        traits.name,
        basis));
  }
  ValidateFormFactors(method);
  ValidateHierarchical(method, basis);
}

// Throws UsageError if the solve that has begun is of another basis or seed.
void RequireSameSolve(const SolveState& state, const SolveOptions& options) {
  if (state.basis != options.basis || state.seed != options.seed) {
    throw UsageError(
        fmt::format("the store's solution is of basis {} and seed {}; those "
                    "cannot be changed: solve into another store",
                    state.basis,
                    state.seed));
  }
}

// Whether the solution meets a request for this error, or cannot be improved.
bool HasNothingToDo(SolveState state, double error) {
  return state.phase == SolvePhase::kDone &&
         TakeRequest(error, &state) == RequestStep::kGoOn;
}

void SolveByWavelets(BlockStorage& store,
                     const SolveOptions& options,
                     MemoryBudget& budget) {
  SolveState state;
  const bool has_begun = LoadSolveState(store, &state);
  if (has_begun) {
    RequireSameSolve(state, options);
  }
  if (has_begun && HasNothingToDo(state, options.error)) {
    TakeRequest(options.error, &state);  // alone is kept
    SaveSolveState(state, store);
    store.Commit();
    return;
  }
  if (budget.IsLimited()) {
    RequireLeastMemory(store, options, budget);
  }
  Engine(store, options, budget).Run();
}

}  // namespace

void SolveOptions::Validate() const {
  if (!(error > 0 && error < 1)) {
    throw UsageError(fmt::format(
        "--error {}: give a relative error between 0 and 1, such as 0.05",
        error));
  }
  BasisNamed(basis);
  ValidateMethod(method, basis);
}

SolveSummary Solve(BlockStorage& store,
                   const SolveOptions& options,
                   MemoryBudget& budget) {
  options.Validate();
  switch (options.method.kind) {
    case SolveMethod::kWavelet:
      SolveByWavelets(store, options, budget);
      break;
    case SolveMethod::kMatrix:
    case SolveMethod::kProgressive:
    case SolveMethod::kSubstructuring:
      SolveByReference(store, options, budget);
      break;
    case SolveMethod::kHierarchical:
      SolveHierarchically(store, options, budget);
      break;
  }
  return LoadSolveSummary(store);
}

SolveSummary LoadSolveSummary(const BlockStorage& store) {
  SolveSummary summary;
  SolveState state;
  if (!LoadSolveState(store, &state)) {
    return summary;
  }
  summary.asked_error = state.error;
  summary.converged = state.converged;
  summary.exhausted = state.phase == SolvePhase::kDone && !state.converged;
  summary.ran_out_of_rounds =
      summary.exhausted && HasSpentItsRounds(state) && !IsExhausted(state);
  summary.rays = state.rays;
  summary.sweeps = state.sweeps;
  summary.residual = state.residual;
  summary.refine_seconds = state.times.refine_seconds;
  summary.gather_seconds = state.times.gather_seconds;
  summary.push_pull_seconds = state.times.push_pull_seconds;
  summary.store_seconds = state.times.store_seconds;
  summary.check_seconds = state.times.check_seconds;
  summary.bytes_read = state.times.bytes_read;
  summary.bytes_belady = state.times.bytes_belady;
  summary.bytes_compulsory = state.times.bytes_compulsory;
  for (const CellRow& row : state.cells) {
    summary.elements += row.elements;
    summary.links += row.links;
  }
  if (!state.rounds.empty()) {
    summary.estimated_error = state.rounds.back().estimated_error;
    summary.most_error_by_rays = state.rounds.back().most_by_rays;
  }
  summary.patches = PatchCount(LoadCells(store));
  if (summary.links > 0) {
    summary.link_bytes_per_link =
        static_cast<double>(store.StoredBytes(BlockKind::kLinks)) /
        static_cast<double>(summary.links);
  }
  return summary;
}

}  // namespace enfilade
