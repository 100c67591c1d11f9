#include "tools/cost_estimate.h"

#include "partition/partition.h"
#include "partition/partition_store.h"
#include "solver/least_memory.h"

#include <algorithm>
#include <cmath>

#include "tools/pipeline_limits.h"
#include "tools/pipeline_state.h"
#include "tools/progress.h"
#include <fmt/format.h>

namespace enfilade {

namespace {

// The links per patch that basis M2 needs at an error of kErrorOfLinks. Links
// grow with the power kLinksPerError of the inverse of the error.
constexpr double kErrorOfLinks = 0.1;
constexpr double kLinksPerPatch = 150;
constexpr double kLinksPerError = 1.7;
// Haar needs more links than M2 for the same error, but each takes fewer bytes.
constexpr double kHaarLinks = 3;
constexpr double kElementsPerLink = 0.2;
// Bytes of the whole store per link, elements included.
constexpr double kM2BytesPerLink = 28;
constexpr double kHaarBytesPerLink = 20;
// Seconds of one core. The rays that measure the error of the rounds take some
// time however little there is to refine.
constexpr double kSecondsPerLink = 25e-6;
constexpr double kSecondsOfRays = 8;

// A count to two digits: 1900, 53000000.
std::string RoundedText(double count) {
  if (!(count >= 1)) {
    return "0";
  }
  const double unit =
      std::pow(10.0, std::max(0.0, std::floor(std::log10(count)) - 1));
  return fmt::format("{:.0f}", std::round(count / unit) * unit);
}

// The factor by which links grow from `error` to `smaller_error`.
double Growth(double error, double smaller_error) {
  return std::pow(error / smaller_error, kLinksPerError);
}

// The bytes of the blocks that a solve makes. One from its beginning makes them
// anew.
double BytesOfSolve(const BlockStorage& store) {
  double bytes = 0;
  for (const BlockKind kind : {BlockKind::kCellTree,
                               BlockKind::kLinks,
                               BlockKind::kSolveCells,
                               BlockKind::kCellCare,
                               BlockKind::kReceived,
                               BlockKind::kCellDelta,
                               BlockKind::kSourceWeights}) {
    bytes += static_cast<double>(store.StoredBytes(kind));
  }
  return bytes;
}

// The wall time of all runs less that of the stages before the solve.
double SecondsOfSolve(const RunRecord& record) {
  return record.wall_seconds - record.import_seconds -
         record.partition_seconds - record.visibility_seconds;
}

// Scales the estimate from the store's own solve, which says more than rules of
// thumb, both about this scene and, rays included, about this machine.
void LearnFromItself(const BlockStorage& store,
                     const SolveOptions& options,
                     uint64_t threads,
                     CostEstimate* estimate) {
  const SolveSummary solved = LoadSolveSummary(store);
  if (solved.links == 0 || !(solved.estimated_error > 0)) {
    return;
  }
  const double growth =
      std::max(1.0, Growth(solved.estimated_error, options.error));
  const RunRecord record = LoadRunRecord(store);
  const double cores = static_cast<double>(record.threads) /
                       static_cast<double>(std::max<uint64_t>(threads, 1));
  estimate->links = growth * static_cast<double>(solved.links);
  estimate->elements = growth * static_cast<double>(solved.elements);
  estimate->solve_seconds = std::max(estimate->solve_seconds,
                                     growth * cores * SecondsOfSolve(record));
}

}  // namespace

CostEstimate EstimateCost(const BlockStorage& store,
                          const SolveOptions& options,
                          uint64_t threads,
                          MemoryBudget& budget) {
  const uint64_t cores = std::min(threads, HardwareThreads());
  const auto patches = static_cast<double>(PatchCount(LoadCells(store)));
  const bool haar = options.basis == "haar";
  CostEstimate estimate;
  estimate.links = kLinksPerPatch * patches *
                   Growth(kErrorOfLinks, options.error) *
                   (haar ? kHaarLinks : 1);
  estimate.elements = patches + kElementsPerLink * estimate.links;
  estimate.solve_seconds = (estimate.links * kSecondsPerLink + kSecondsOfRays) /
                           static_cast<double>(cores);
  LearnFromItself(store, options, cores, &estimate);
  estimate.store_bytes =
      static_cast<double>(store.FileBytes()) - BytesOfSolve(store) +
      estimate.links * (haar ? kHaarBytesPerLink : kM2BytesPerLink);
  const LeastMemories least = FindLeastMemory(store, options, budget);
  estimate.cap_to_begin_bytes = least.first.cap_bytes;
  estimate.least_cap_bytes = least.last.cap_bytes;
  return estimate;
}

CostEstimate CostEstimate::WithCap(uint64_t cap_bytes) const {
  CostEstimate all = *this;
  all.least_cap_bytes = std::max(least_cap_bytes, cap_bytes);
  all.cap_to_begin_bytes = std::max(cap_to_begin_bytes, cap_bytes);
  return all;
}

Json EstimateReport(const CostEstimate& estimate) {
  return {{"links", std::round(estimate.links)},
          {"elements", std::round(estimate.elements)},
          {"store_bytes", std::round(estimate.store_bytes)},
          {"solve_seconds", estimate.solve_seconds},
          {"least_cap_bytes", estimate.least_cap_bytes},
          {"cap_to_begin_bytes", estimate.cap_to_begin_bytes},
          {"factor", kEstimateFactor}};
}

std::string EstimateText(const CostEstimate& estimate,
                         const SolveOptions& options) {
  const std::string begins =
      estimate.cap_to_begin_bytes < estimate.least_cap_bytes
          ? fmt::format(" (a solve begins from {}M on, and may have to stop)",
                        estimate.cap_to_begin_bytes >> 20)
          : "";
  return fmt::format(
      "estimate  about {} links, {} elements, store {}, {} for error {} by {}\n"
      "          (within a factor of {} either way, of more where lamps hang "
      "in small\n"
      "          white fixtures or below white coffers; time of {})\n"
      "least     --memory {}M{}\n",
      RoundedText(estimate.links),
      RoundedText(estimate.elements),
      FormatBytes(estimate.store_bytes),
      FormatDuration(estimate.solve_seconds),
      options.error,
      options.basis,
      kEstimateFactor,
      2 * kEstimateFactor,
      estimate.least_cap_bytes >> 20,
      begins);
}

}  // namespace enfilade
