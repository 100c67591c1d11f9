#include "solver/patch_errors.h"

#include <algorithm>
#include <cmath>

namespace enfilade {

PatchErrors::PatchErrors(const ProbeShares& shares, MemoryBudget& budget)
    : charge_(budget,
              (shares.first_patch.size() + 1) * sizeof(uint32_t) +
                  shares.sums.size() * sizeof(Patch),
              "the errors of patches"),
      first_patch_(shares.first_patch.begin(), shares.first_patch.end()),
      patches_(shares.sums.size() - 1) {
  first_patch_.push_back(static_cast<uint32_t>(patches_.size()));
  const double all = shares.sums.back();
  for (size_t i = 0; all > 0 && i < patches_.size(); ++i) {
    patches_[i].share =
        static_cast<float>((shares.sums[i + 1] - shares.sums[i]) / all);
  }
}

void PatchErrors::Add(CellId cell, PatchId patch, double square) {
  Patch& p = patches_[first_patch_[cell.Index()] + patch.Index()];
  const auto value = static_cast<float>(square);
  p.sum += value;
  p.squares += value * value;
  ++p.probes;
  sum_ += square;
  ++probes_;
}

std::vector<float> PatchErrors::Of(CellId cell) const {
  std::vector<float> squares;
  for (size_t i = first_patch_[cell.Index()];
       i < first_patch_[cell.Index() + 1];
       ++i) {
    const Patch& p = patches_[i];
    squares.push_back(
        p.probes == 0 ? 0.0F
                      : p.share * std::max(p.sum - std::sqrt(p.squares), 0.0F) /
                            static_cast<float>(p.probes));
  }
  return squares;
}

double PatchErrors::OfAll() const {
  return probes_ == 0 ? 0 : std::max(sum_ / static_cast<double>(probes_), 0.0);
}

}  // namespace enfilade
