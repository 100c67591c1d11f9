// The solve's steps on cells and cell pairs, and the loop over them.
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
#include "base/memory.h"
#include "partition/partition.h"
#include "scene/scene_store.h"
#include "solver/elements/cell_care.h"
#include "solver/links/link_store.h"
#include "solver/paging/cell_pager.h"
#include "solver/paging/cells_between.h"
#include "solver/refine/pair_work.h"
#include "solver/refine/refiner.h"
#include "solver/refine/source_weights.h"
#include "solver/residual/patch_errors.h"
#include "solver/solve.h"
#include "solver/state/commit_clock.h"
#include "solver/state/solve_state.h"
#include "visibility/visible_set.h"

#include <chrono>
#include <memory>
#include <string>
#include <vector>

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
  // A receiver cell while it is processed.
  struct Receiver {
    CellId id;
    std::vector<VisibleCell> sources;  // the cell itself comes last
    MemoryCharge sources_charge;
    std::shared_ptr<const CellGeometry> geometry;
    std::shared_ptr<CellTree> tree;
    std::shared_ptr<ReceivedLight> received;
    // During refinement: the elements at which refinement begins.
    std::unique_ptr<ClusterTree> receivers;
    std::vector<float> weights;  // ReceiverWeights of the receivers
    MemoryCharge receivers_charge;
  };

  // A source cell while links from it are made.
  struct Sender {
    CellId id;
    std::shared_ptr<const CellGeometry> geometry;
    std::shared_ptr<CellTree> tree;
  };

  void Start();
  void StartRound(double tau);
  void RefineCell(CellId cell);
  void RefinePairs(Receiver* receiver, bool begins);
  void PropagateCell(CellId cell);
  void NextCell();
  void FinishSweep();
  void FinishRound();
  void TakeReads();
  void CheckResidual();
  void CareFor(const PatchErrors& errors);
  MemoryCharge ReserveWorkspace();

  template <typename Read>
  auto ReadOnce(const Read& read);
  Receiver Load(CellId cell);
  VisibleSet SourcesOf(CellId cell, MemoryCharge* charge);
  // Returns the number of rays traced.
  uint64_t FindReceivers(Receiver* r);
  void Unlink(const Receiver& r, CellId source);
  void RefinePair(const Receiver& r, const VisibleCell& source);
  PairWork WorkOf(const Receiver& r,
                  const Sender& s,
                  const VisibleCell& source,
                  const SourceWeights& weights);
  void WriteLinks(const Receiver& r,
                  const Sender& s,
                  const Refiner& refiner,
                  CellsBetween* between,
                  LinkWriter* writer);
  void GatherNew(const Receiver& r, const Sender& s, const LinkBlock& links);
  void ApplyPart(const RawLinks& part,
                 const Receiver& r,
                 const Sender& s,
                 LinkBlock* block);
  void GatherPair(const Receiver& r, CellId source);
  void Settle(const Receiver& r);
  void KeepForReaders();
  void Commit();
  // Commits if it is time to; throws InterruptedError if asked to stop.
  void CheckPoint();
  // The share of the sweep that is done, as if all cells and all pairs took
  // equally long.
  [[nodiscard]] double ShareOfSweep() const;
  [[nodiscard]] double ShareOfCell(const Receiver& r, size_t items) const;
  [[nodiscard]] bool IsTimeToTell() const;
  void Tell(double fraction, const std::string& phase);
  void TellOfRound() const;
  [[nodiscard]] bool IsLit(CellId cell) const;

  BlockStorage* store_;
  SolveOptions options_;
  MemoryBudget* budget_;
  SceneInfo scene_;
  MemoryCharge scene_charge_;
  GrowingCharge portals_charge_;
  Partition partition_;
  MemoryCharge cells_charge_;
  Basis basis_;
  TreeShape shape_;
  SurfaceTable surfaces_;
  OcclusionDevice device_;
  CellPager pager_;
  ChunkWriter chunks_;
  MemoryCharge workspace_;
  SolveState state_;
  double area_ = 0;  // of reflecting patches, or of all if none reflects, m2
  // True if nothing reflects: Engine then solves for the irradiance and
  // measures its error as if all surfaces had kLeastWeightReflectance.
  bool is_black_ = false;
  // RefineSide::least_reflectance of all receivers.
  float least_reflectance_ = kLeastWeightReflectance;
  CellCare care_;             // of the cell being refined; else empty
  double share_of_cell_ = 0;  // done share of the current cell
  CommitClock commits_;
  std::chrono::steady_clock::time_point last_told_;  // last report of progress
};

}  // namespace enfilade
