// The loop of a solve over rounds, sweeps and cells.
//
//   round:  [ refine all pairs of all receivers ] [ propagate until quiet ]
//
// A round makes all links anew at a new tau, from the radiosity of the
// round before. Links therefore need no history, and transfers that sampling
// has dropped get a new chance. Propagation then sends changes (residuals)
// until every cell's unsent radiosity is below a tolerance. Receivers come in
// the order of their ids. Within a receiver, its sources come in the order of
// their ids, and the balance within the cell itself comes last.
//
// Steps end at fixed places of this order. A commit may fall between any two
// steps: the result does not depend on where commits fall.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
#include "solver/checkpoints.h"
#include "solver/residual/residual_estimate.h"
#include "solver/solve.h"
#include "solver/solve_context.h"

namespace enfilade {

class Engine {
 public:
  // Reads scene, partition and state from the store.
  Engine(BlockStorage& store,
         const SolveOptions& options,
         MemoryBudget& budget);

  // Runs until the requested error is met or refinement is exhausted.
  void Run();

 private:
  void Start();
  void StartRound(double tau);
  void StartSweep();
  void RunTurn(CellId cell);
  void FinishSweep();
  void FinishRound();
  ResidualEstimate CheckRoundByRays();
  void TellOfRound(const ResidualEstimate& by_rays) const;
  void ReserveWorkspace();

  SolveContext context_;
  MemoryCharge workspace_;
  Checkpoints checkpoints_;
};

}  // namespace enfilade
