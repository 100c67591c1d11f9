#include "solver/residual/patch_errors.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace enfilade {

uint64_t PatchErrors::BytesFor(size_t cells, size_t most_probes) {
  return (cells + 1) * sizeof(uint32_t) + most_probes * sizeof(Probe);
}

PatchErrors::PatchErrors(std::span<const uint32_t> first_patch,
                         size_t most_probes,
                         MemoryBudget& budget)
    : charge_(budget,
              BytesFor(first_patch.size(), most_probes),
              "the errors of patches"),
      first_patch_(first_patch.begin(), first_patch.end()) {
  probes_.reserve(most_probes);
}

void PatchErrors::Add(CellId cell, PatchId patch, double share, double square) {
  probes_.push_back({first_patch_[cell.Index()] + patch.value,
                     static_cast<float>(share * square)});
  sum_ += square;
}

void PatchErrors::Sort() {
  std::sort(probes_.begin(), probes_.end(), [](const Probe& a, const Probe& b) {
    return std::tie(a.patch, a.square) < std::tie(b.patch, b.square);
  });
}

std::vector<float> PatchErrors::Of(CellId cell, size_t patches) const {
  std::vector<float> squares(patches);
  const uint32_t first = first_patch_[cell.Index()];
  auto probe = std::lower_bound(
      probes_.begin(), probes_.end(), first, [](const Probe& p, uint32_t at) {
        return p.patch < at;
      });
  for (size_t i = 0; i < patches; ++i) {
    double sum = 0;
    double scatter = 0;
    int count = 0;
    for (; probe != probes_.end() && probe->patch == first + i; ++probe) {
      const auto square = static_cast<double>(probe->square);
      sum += square;
      scatter += square * square;
      ++count;
    }
    squares[i] = static_cast<float>(std::max(sum - std::sqrt(scatter), 0.0) /
                                    std::max(count, 1));
  }
  return squares;
}

double PatchErrors::OfAll() const {
  return probes_.empty()
             ? 0
             : std::max(sum_ / static_cast<double>(probes_.size()), 0.0);
}

}  // namespace enfilade
