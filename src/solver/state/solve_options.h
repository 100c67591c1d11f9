// What is asked of a solve, and what it says it did.

#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

namespace enfilade {

// Which method computes the light, and what only the reference methods take.
struct MethodOptions {
  // Or matrix, progressive, substructuring, hierarchical.
  std::string name = "wavelet";
  std::string linear_solver = "cg";  // of matrix: gs, sor or cg
  // Of the reference methods: exact, point, polygon, switch, hemicube or
  // montecarlo (reference/form_factor_kinds.h).
  std::string form_factors = "exact";
  std::string projection = "galerkin";  // of matrix: or collocation
  // The finest dicing with at most so many elements, whatever its error; 0: as
  // fine as the error asks.
  uint64_t elements = 0;
  // Progressive and substructuring: add the light still to come, evenly.
  bool ambient = false;
  // Of hierarchical (reference/hierarchical_options.h); 0 and empty: what the
  // study of 1997 had for the basis.
  double epsilon = 0;
  std::string visibility;
  std::string singular;
  std::string oracle;

  friend bool operator==(const MethodOptions&, const MethodOptions&) = default;
};

// What a round of refinement has come to.
struct RoundSummary {
  size_t round = 0;  // from 1, over all runs
  uint64_t elements = 0;
  uint64_t links = 0;
  double estimated_error = 0;
  // False: it is what the oracle predicts, which rays may yet contradict.
  bool is_seen_by_rays = false;
};

struct SolveOptions {
  double error = 0.05;       // requested relative error (docs/error-measure.md)
  std::string basis = "m2";  // haar, m2, m3, m4, f2 or f3
  uint64_t seed = 1;         // of the visibility samples
  MethodOptions method;
  // Of work between two commits, at least, and some twenty times as long as a
  // commit takes, up to a minute. 0: one after every step.
  double commit_seconds = 0.5;
  // Called now and then, and after each commit, from the solving thread;
  // fraction in [0,1] of the work as estimated so far, and a few words on what
  // is being done.
  std::function<void(double fraction, const std::string& phase)> progress;
  // Called from the solving thread after each round.
  std::function<void(const RoundSummary&)> round_ended;
  // Called before the solve begins if it may outgrow the budget, with a cap of
  // the process under which it should end.
  std::function<void(uint64_t cap_bytes)> may_not_fit;
  // Set by a signal handler: Solve commits and throws InterruptedError.
  const std::atomic<bool>* stop = nullptr;

  // Throws UsageError with what is wrong.
  void Validate() const;
};

// What a solve did, over all its runs (resumes included).
struct SolveSummary {
  bool converged = false;
  bool exhausted = false;          // ended without: more links do not help,
  bool ran_out_of_rounds = false;  // or a request is given no more of them
  uint64_t patches = 0;
  uint64_t elements = 0;
  uint64_t links = 0;
  uint64_t rays = 0;           // traced while links were refined
  uint64_t sweeps = 0;         // over all receiver cells
  double residual = 0;         // of the linear system, relative
  double estimated_error = 0;  // same measure as requested_error
  // Up to which rays leave it open, with 95 % certainty; 0: none have looked.
  double most_error_by_rays = 0;
  double refine_seconds = 0;
  double gather_seconds = 0;
  double push_pull_seconds = 0;
  double store_seconds = 0;
  double link_bytes_per_link = 0;
  uint64_t bytes_read = 0;  // by the rounds, without the residual's rays
  uint64_t bytes_belady = 0;
  uint64_t bytes_compulsory = 0;
};

}  // namespace enfilade
