// The integral of the squared residual over each single patch, estimated from
// the probes of the residual.

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

  // The bytes that a PatchErrors takes.
  static uint64_t BytesFor(size_t cells, size_t most_probes);

  // `first_patch` holds, by cell, the number of the cell's first patch, counted
  // through all cells. The memory is proportional to `most_probes`, for which
  // it is reserved here, and not to the patches.
  PatchErrors(std::span<const uint32_t> first_patch,
              size_t most_probes,
              MemoryBudget& budget);

  // Adds a probe on a patch. `square` is the probe's estimate of the integral
  // of r^2 over all patches, W^2/m2; `share` is the share of all probes that
  // fall on this patch.
  void Add(CellId cell, PatchId patch, double share, double square);

  // Must be called after the last Add().
  void Sort();

  // For each of the cell's first `patches` patches, the integral of r^2 less
  // its standard deviation; 0 if too few probes fell on the patch to tell.
  // Requires Sort().
  [[nodiscard]] std::vector<float> Of(CellId cell, size_t patches) const;

  // Upper bound of the patches with a known error; each needs two probes.
  [[nodiscard]] size_t MostKnown() const { return probes_.size() / 2; }

  // The integral of r^2 over all patches, W^2/m2.
  [[nodiscard]] double OfAll() const;

 private:
  struct Probe {
    uint32_t patch = 0;
    float square = 0;  // integral over the patch
  };

  MemoryCharge charge_;
  std::vector<uint32_t> first_patch_;
  std::vector<Probe> probes_;
  double sum_ = 0;
};

}  // namespace enfilade
