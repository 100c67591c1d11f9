// Refinement: from two patches down to the pairs of elements whose transfer is
// accurate enough to be a link.
//
//   paper          here
//   oracle         Refiner::Judge: error of the transferred radiosity on the
//                  receiver, W/m2 (RMS over the element)
//   epsilon        tau: a link is accepted when its error, weighted by the
//                  root of the receiver's area, is at most tau, W/m
//   link           Link, in element paths until ids are given (RawLink)
//
// The error of a link has three parts: what the basis cannot follow on the
// receiver, what the nodes cannot see of the source's radiosity, and occlusion
// that the rays leave unknown. The end that contributes most is split.
// Transfers below tau as a whole become weak links: each is kept with the
// probability that its bound has of tau, and is then divided by it, so that
// their sum is unbiased and their number follows the light and not the square
// of the patches.

#pragma once

#include "solver/cover.h"
#include "solver/element_tree.h"
#include "solver/form_factor.h"
#include "solver/link_block.h"
#include "solver/shaft.h"
#include "visibility/occlusion.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

struct RefineOptions {
  double tau = 1;                 // W/m: largest weighted error of a link
  double tau_weak = 1;            // W/m: transfers below are sampled
  uint64_t seed = 0;              // of the visibility samples
  float least_diameter = 0.005F;  // m; smaller elements are not split
};

// A cell as refinement sees it.
struct RefineSide {
  CellId id;
  std::span<const PatchGeometry> patches;
  const CellTree* tree = nullptr;
};

// A link before its elements have ids.
struct RawLink {
  uint32_t receiver_patch = 0;
  ElementPath receiver_path = kRootPath;
  uint32_t source_patch = 0;
  ElementPath source_path = kRootPath;
  LinkKind kind{};
  uint16_t value = 0;
  uint32_t near_index = 0;
};

struct RawLinks {
  std::vector<RawLink> links;
  std::vector<NearCoefficients> near;
  double squared_error = 0;  // sum of squared weighted errors, (W/m)^2
  uint64_t rays = 0;
};

// What stands between two cells.
struct Blockers {
  std::vector<const CellBlockers*> occluders;  // for rays
  std::vector<const ShaftBlockers*> shafts;    // for proofs
  // The portals of two different cells: light between them must cross one of
  // each. Empty within a cell.
  std::vector<const ShaftBlockers*> gates;
};

// Appends raw links to a block, making the elements that they name.
void ApplyLinks(const RawLinks& raw,
                std::span<const PatchGeometry> receiver_patches,
                CellTree& receiver,
                std::span<const PatchGeometry> source_patches,
                CellTree& source,
                LinkBlock* block);

// Refines the transfers from one source cell to one receiver cell.
class Refiner {
 public:
  // All arguments are borrowed. `cover`: of the receiver; may be null.
  Refiner(const RefineOptions& options,
          const RefineSide& receiver,
          const RefineSide& source,
          const Blockers& blockers,
          const CoverMap* cover);

  // Appends the links of one receiver patch with the sources [first, last).
  // Thread-safe: touches nothing but `out`.
  void Refine(PatchId receiver,
              size_t first_source,
              size_t last_source,
              RawLinks* out) const;

 private:
  // The source's end of a candidate, with its radiosity at the nodes: the
  // largest channel of each, W/m2.
  struct Source {
    TransferEnd end;
    uint32_t patch = 0;
    ElementPath path = kRootPath;
    ElementId element;   // the deepest that exists
    bool exists = true;  // `element` is this very one
    std::array<float, kTransferNodes> radiosity{};
    float detail = 0;
  };

  struct Receiver {
    TransferEnd end;
    uint32_t patch = 0;
    ElementPath path = kRootPath;
    float weight = 0;  // reflectance times root of area
  };

  // Estimated parts of the error on the receiver, W/m2 of irradiance.
  struct Judgement {
    Kernel kernel{};
    bool near = false;
    float transfer = 0;        // mean irradiance if nothing were in between
    float receiver_error = 0;  // beyond the receiver's basis
    float source_error = 0;    // beyond the source's nodes
  };

  struct Visibility {
    uint16_t bits = 0;   // per pair of nodes
    float fraction = 1;  // weighted by the kernel and the radiosity
    bool proven = false;
  };

  struct Task;  // one call of Refine: output and pending weak links

  [[nodiscard]] Source RootSource(size_t patch) const;
  [[nodiscard]] Source ChildSource(const Source& parent, size_t child) const;
  [[nodiscard]] Receiver ChildReceiver(const Receiver& parent,
                                       size_t child) const;
  void SetRadiosity(Source* source) const;

  // `blocked`: how many splits ago no ray got through any more.
  void Visit(const Receiver& r, const Source& s, int blocked, Task* task) const;
  void SplitReceiver(const Receiver& r,
                     const Source& s,
                     int blocked,
                     Task* task) const;
  void SplitSource(const Receiver& r,
                   const Source& s,
                   int blocked,
                   Task* task) const;
  [[nodiscard]] bool MissesAGate(const TransferEnd& r,
                                 const TransferEnd& s) const;

  [[nodiscard]] Judgement Judge(const TransferEnd& r, const Source& s) const;
  [[nodiscard]] Visibility Look(const Receiver& r,
                                const Source& s,
                                const Judgement& judgement,
                                Task* task) const;

  void AddWeak(const Receiver& r,
               const Source& s,
               float form_factor_bound,
               float bound,
               Task* task) const;
  void FlushWeak(Task* task) const;
  void Accept(const Receiver& r,
              const Source& s,
              const Judgement& judgement,
              const Visibility& visibility,
              float error,
              Task* task) const;

  [[nodiscard]] uint64_t KeyOf(const Receiver& r, const Source& s) const;

  RefineOptions options_;
  RefineSide receiver_;
  RefineSide source_;
  const Blockers* blockers_;
  const CoverMap* cover_;
  bool constant_basis_;
};

}  // namespace enfilade
