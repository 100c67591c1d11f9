// The input of a solve, and the summary of its outcome.

#pragma once

#include "solver/state/solve_method.h"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace enfilade {

// The method that computes the light, and options of the reference methods.
struct MethodOptions {
  SolveMethod kind = SolveMethod::kWavelet;
  std::string linear_solver = "cg";  // of matrix: gs, sor or cg
  // Of the reference methods: exact, point, polygon, switch, hemicube or
  // montecarlo (reference/form_factor_kinds.h).
  std::string form_factors = "exact";
  std::string projection = "galerkin";  // of matrix: or collocation
  // If not 0: the finest dicing with at most so many elements, whatever its
  // error. 0: as fine as the requested error demands.
  uint64_t elements = 0;
  // Progressive and substructuring: whether to add the unshot light, evenly.
  bool ambient = false;
  // Of hierarchical (reference/hierarchical_options.h); 0 and empty: the choice
  // of the study of 1997 for the basis.
  double epsilon = 0;
  std::string visibility;
  std::string singular;
  std::string oracle;

  friend bool operator==(const MethodOptions&, const MethodOptions&) = default;
};

// The outcome of a round of refinement.
struct RoundSummary {
  size_t round = 0;  // from 1, over all runs
  uint64_t elements = 0;
  uint64_t links = 0;
  double estimated_error = 0;
  // ResidualEstimate::lit_share; 1 if no rays were traced.
  double lit_share = 1;
  // False: the error is the oracle's prediction, which rays may yet contradict.
  bool is_seen_by_rays = false;
};

// How far a part of a solve has come. How many rounds follow is not known
// beforehand.
struct SolveProgress {
  std::string_view part;    // a sweep of a round, or its rays: "round 2 refine"
  double fraction = 0;      // of the part's estimated work, in [0, 1]
  std::string_view detail;  // "error 0.310 so far, 0.1 asked", or empty
};

struct SolveOptions {
  double error = 0.05;       // requested relative error (docs/error-measure.md)
  std::string basis = "m2";  // haar, m2, m3, m4, f2 or f3
  uint64_t seed = 1;         // of the visibility samples
  MethodOptions method;
  // The least seconds of work between two commits. The work also takes some
  // twenty times as long as a commit, up to a minute. 0: a commit after every
  // step.
  double commit_seconds = 0.5;
  // Called from time to time and after each commit, from the solving thread.
  std::function<void(const SolveProgress&)> progress;
  // Called from the solving thread after each round.
  std::function<void(const RoundSummary&)> round_ended;
  // Called before the solve begins if it may exceed the budget, with the memory
  // cap of the process under which the solve should finish.
  std::function<void(uint64_t cap_bytes)> may_not_fit;
  // Set by a signal handler: Solve commits and throws InterruptedError.
  const std::atomic<bool>* stop = nullptr;

  // Throws UsageError, which says what is wrong.
  void Validate() const;
};

// The outcome of a solve over all its runs (resumes included).
struct SolveSummary {
  double asked_error = 0;  // that `converged` and `exhausted` are judged by
  bool converged = false;
  bool exhausted = false;          // done without convergence
  bool ran_out_of_rounds = false;  // exhausted because its rounds are used up
  uint64_t patches = 0;
  uint64_t elements = 0;
  uint64_t links = 0;
  uint64_t rays = 0;           // traced while links were refined
  uint64_t sweeps = 0;         // over all receiver cells
  double residual = 0;         // of the linear system, relative
  double estimated_error = 0;  // same measure as SolveOptions::error
  // The largest error that rays allow with 95 % certainty; 0: no rays were
  // traced.
  double most_error_by_rays = 0;
  double refine_seconds = 0;
  double gather_seconds = 0;
  double push_pull_seconds = 0;
  double store_seconds = 0;
  double check_seconds = 0;
  double link_bytes_per_link = 0;
  uint64_t bytes_read = 0;  // by the rounds, without the residual's rays
  uint64_t bytes_belady = 0;
  uint64_t bytes_compulsory = 0;
};

}  // namespace enfilade
