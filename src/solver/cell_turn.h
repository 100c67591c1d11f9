// One cell's turn in a sweep: it receives light from all that it sees, and its
// own light is balanced.

#pragma once

#include "base/ids.h"
#include "solver/cell_balance.h"
#include "solver/checkpoints.h"
#include "solver/receiver_cell.h"
#include "solver/solve_context.h"

#include <cstdint>

namespace enfilade {

// A turn goes on where the state's cursor is, moves it, and ends with the
// balance; the caller then goes on to the next cell. At each commit in between,
// all that was done is in the store or the state, so that a run that resumes
// yields the same bits.
class CellTurn {
 public:
  CellTurn(SolveContext& context, Checkpoints& checkpoints, CellId cell);
  ~CellTurn();
  CellTurn(const CellTurn&) = delete;
  CellTurn& operator=(const CellTurn&) = delete;

  // Makes the cell's links anew and gathers over them. Requires the phase
  // kRefine.
  void Refine();

  // Gathers what sources have sent since the cell's last turn. Requires the
  // phase kPropagate.
  void Propagate();

  // Whether a turn of Propagate would find anything new.
  static bool HasNews(SolveContext& context, CellId cell);

 private:
  void BeginRefinement();
  void RefinePairs(bool begins);
  // Returns the number of rays traced.
  uint64_t FindReceivers();
  void GatherPair(CellId source);
  // Balances the light within the cell and updates its row.
  void Settle();
  CellBalance::Light Balance(CoefficientArray* delta);
  void RecordLight(const CellBalance::Light& light, CellRow* row) const;
  void KeepForReaders();

  SolveContext* context_;
  Checkpoints* checkpoints_;
  ReceiverCell cell_;
};

}  // namespace enfilade
