// Chooses where the residual of a solution is measured: at random points, one
// in each stratum of a line along which every leaf of every element tree has
// the length of its weight. The weight of a leaf is the light that it reflects
// plus a share of the mean, for light that the solution may have missed there.
// A spot of light so gets probes by its brightness, not by the size of its
// wall.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
#include "base/photometry.h"
#include "base/vec.h"
#include "partition/partition.h"
#include "partition/patch.h"
#include "solver/solution/solution.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

struct ResidualProbe {
  PatchPoint on;
  Patch patch;
  Vec3 normal;
  Point3 origin;      // of its rays
  double weight = 0;  // m2: the area that it stands for
  uint64_t key = 0;
  uint32_t visible = 0;  // index into ProbeBatch::visible
};

struct ProbeBatch {
  std::vector<ResidualProbe> probes;
  std::vector<std::vector<CellId>> visible;  // what the cells of probes see
  std::vector<MemoryCharge> charges;         // of the lists of `visible`
};

// Some of the strata of a round.
struct ProbeStrata {
  uint32_t first = 0;
  uint32_t count = 0;
  uint32_t all = 0;
};

class ProbeChooser {
 public:
  // The bytes that choosing takes for each probe, beside the probe itself.
  static constexpr uint64_t kWorkBytesPerProbe = 32;

  // The bytes that the chooser takes.
  static uint64_t BytesFor(size_t patches, size_t cells) {
    return (patches + 1) * sizeof(double) + (cells + 1) * sizeof(uint32_t);
  }

  // Reads every cell once. Store, solution and budget must outlive the chooser.
  // `mean_reflected` is in W/m2.
  ProbeChooser(const BlockStorage& store,
               std::span<const CellInfo> cells,
               const Solution& solution,
               double mean_reflected,
               MemoryBudget& budget);

  // Whether nothing reflects.
  [[nodiscard]] bool IsEmpty() const { return !(weights_.back() > 0); }

  // By cell, the number of its first patch, counted through all cells; at the
  // end the number of all patches.
  [[nodiscard]] std::span<const uint32_t> FirstPatches() const {
    return first_patch_;
  }

  // The share of all probes that fall on a patch.
  [[nodiscard]] double ShareOf(CellId cell, PatchId patch) const {
    const size_t i = first_patch_[cell.Index()] + patch.Index();
    return (weights_[i + 1] - weights_[i]) / weights_.back();
  }

  // The area of all reflecting sides, m2.
  [[nodiscard]] double ReflectingArea() const { return area_; }

  // ResidualEstimate::lit_share.
  [[nodiscard]] double LitShare() const;

  // The distance from their surface at which rays start, m.
  [[nodiscard]] double Offset() const { return offset_; }

  // Chooses one probe in each of the strata. Requires !IsEmpty().
  [[nodiscard]] ProbeBatch Choose(uint64_t key, ProbeStrata strata) const;

 private:
  // A probe's place on the line, measured from the beginning of its patch.
  // kWorkBytesPerProbe has room for one Place and one PatchId.
  struct Place {
    size_t probe = 0;  // index into the batch
    PatchId patch;
    double along = 0;
  };

  // The probes of a batch in one cell, their places in ascending order.
  struct ProbesInCell {
    CellId cell;
    std::vector<Place> places;
  };

  // Integrals of the reflected radiosity and of its square.
  struct Light {
    double sum = 0;     // W
    double square = 0;  // W^2/m2
  };

  void Weigh(std::span<const CellInfo> infos);
  void WeighCells(std::span<const CellId> cells);
  [[nodiscard]] double ReflectedOf(const Patch& p, const Rgb& irradiance) const;
  [[nodiscard]] double DensityOf(const Patch& p, const Rgb& irradiance) const;
  [[nodiscard]] size_t PatchAt(double at) const;
  void AddVisible(CellId cell, ProbeBatch* batch) const;
  void SetOnLeaves(const SolvedCell& cell,
                   std::span<const Place> places,
                   ProbeBatch* batch) const;
  void SetOnLeaf(const Patch& patch,
                 const LeafMean& leaf,
                 ResidualProbe* probe) const;

  const BlockStorage* store_;
  const Solution* solution_;
  MemoryBudget* budget_;
  double mean_reflected_;
  MemoryCharge charge_;
  std::vector<double> weights_;        // sums over the patches before; 1 more
  std::vector<uint32_t> first_patch_;  // by cell; one more
  double area_ = 0;
  Light light_;
  double offset_;  // m
};

// Term k of an additive recurrence, shifted. The terms are spread evenly over
// [0, 1); pairs of the terms of powers 1 and 2 are spread evenly over the unit
// square (Roberts' R2, by the plastic number).
double EvenlySpread(size_t k, int power, double shift);

}  // namespace enfilade
