// What the probes of the residual say of single patches: the integral of its
// square over each.

#pragma once

#include "base/ids.h"
#include "base/memory.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

// The share of the probes that each patch gets, patches counted through all
// cells.
struct ProbeShares {
  std::span<const uint32_t> first_patch;  // by cell
  std::span<const double> sums;  // weights of the patches before; one more
};

class PatchErrors {
 public:
  PatchErrors() = default;

  // `shares` is read now.
  PatchErrors(const ProbeShares& shares, MemoryBudget& budget);

  // A probe on a patch: an estimate of the integral of r^2 over all patches,
  // W^2/m2.
  void Add(CellId cell, PatchId patch, double square);

  // The integral over each patch of a cell, W^2/m2, less its standard
  // deviation: 0 where too few probes were to know of it. And over all.
  [[nodiscard]] std::vector<float> Of(CellId cell) const;
  [[nodiscard]] double OfAll() const;

 private:
  struct Patch {
    float share = 0;
    float sum = 0;
    float squares = 0;
    uint32_t probes = 0;
  };

  MemoryCharge charge_;
  std::vector<uint32_t> first_patch_;  // by cell; one more
  std::vector<Patch> patches_;
  double sum_ = 0;
  uint64_t probes_ = 0;
};

}  // namespace enfilade
