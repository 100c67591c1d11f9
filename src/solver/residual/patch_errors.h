// What the probes of the residual say of single patches: the integral of its
// square over each.

#pragma once

#include "base/ids.h"
#include "base/memory.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

class PatchErrors {
 public:
  PatchErrors() = default;

  // What it takes.
  static uint64_t BytesFor(size_t cells, size_t most_probes);

  // `first_patch`, by cell: patches are counted through all cells. Grows with
  // the probes, for which it takes room now, and not with the patches.
  PatchErrors(std::span<const uint32_t> first_patch,
              size_t most_probes,
              MemoryBudget& budget);

  // A probe on a patch: an estimate of the integral of r^2 over all patches,
  // W^2/m2. `share`: of all probes, those that fall on this patch.
  void Add(CellId cell, PatchId patch, double share, double square);

  // After the last probe.
  void Sort();

  // The integral over each of a cell's patches, as many as asked for, less its
  // standard deviation: 0 where too few probes were to know of it. After
  // Sort().
  [[nodiscard]] std::vector<float> Of(CellId cell, size_t patches) const;

  // Upper bound of the patches with a known error; each needs two probes.
  [[nodiscard]] size_t MostKnown() const { return probes_.size() / 2; }

  // The integral over all.
  [[nodiscard]] double OfAll() const;

 private:
  struct Probe {
    uint32_t patch = 0;
    float square = 0;  // over the patch
  };

  MemoryCharge charge_;
  std::vector<uint32_t> first_patch_;
  std::vector<Probe> probes_;
  double sum_ = 0;
};

}  // namespace enfilade
