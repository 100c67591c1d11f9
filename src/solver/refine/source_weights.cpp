#include "solver/refine/source_weights.h"

#include "base/bytes.h"
#include "base/error.h"
#include "solver/transfer/cluster_tree.h"

#include <algorithm>
#include <cmath>
#include <span>

#include <fmt/format.h>

namespace enfilade {
namespace {

// The value at a transfer node, for a basis that has nodes of its own.
float SampleAt(size_t node,
               PatchShape patch,
               const Basis& basis,
               std::span<const float> coefficients) {
  const auto& rows = basis.SamplesOn(patch).to_samples;
  float value = 0;
  for (size_t g = 0; g < basis.On(patch).NodeCount(); ++g) {
    value += rows[g][node] * coefficients[g];
  }
  return value;
}

BlockKey KeyOf(CellId id) {
  return {BlockKind::kSourceWeights, id.value};
}

std::vector<GroupWeight> WeighGroups(const RefineSource& source,
                                     const CellTree& tree) {
  std::vector<GroupWeight> weights;
  if (source.groups == nullptr) {
    return weights;
  }
  weights.reserve(source.groups->All().size());
  for (const SourceGroup& group : source.groups->All()) {
    const GroupRadiosity b = GroupRadiosityOf(
        *source.groups, group, source.patches, tree.Shape(), tree.Sent());
    float largest = 0;
    for (const float mean : b.mean) {
      largest = std::max(largest, std::abs(mean));
    }
    weights.push_back({largest, b.spread});
  }
  return weights;
}

}  // namespace

uint64_t SourceWeights::SizeBytes() const {
  return (peaks.capacity() + fluxes.capacity()) * sizeof(float) +
         groups.capacity() * sizeof(GroupWeight);
}

// A cluster tree has its root and fewer than two further nodes per item.
uint64_t SourceWeights::BytesFor(size_t patches) {
  return 2 * sizeof(float) +
         patches * (4 * sizeof(float) + sizeof(GroupWeight));
}

SourceWeights WeighSource(const RefineSource& source, const CellTree& tree) {
  std::vector<float> peaks;
  std::vector<float> fluxes;
  peaks.reserve(source.clusters->Items().size());
  fluxes.reserve(source.clusters->Items().size());
  for (const ClusterItem& item : source.clusters->Items()) {
    const PatchGeometry& patch = source.patches[item.patch];
    const ElementId element(item.patch);
    const float peak = source.InGroup(item.patch)
                           ? 0
                           : PeakOf(NodeRadiosity(tree, element, patch.shape),
                                    tree.Detail(element));
    peaks.push_back(peak);
    fluxes.push_back(peak * patch.area);
  }
  return {source.clusters->LargestOf(peaks),
          source.clusters->LargestOf(fluxes),
          WeighGroups(source, tree)};
}

bool HasSourceWeights(const BlockStorage& store, CellId id) {
  return store.Count(BlockKind::kSourceWeights, id.value, 0) > 0;
}

SourceWeights LoadSourceWeights(const BlockStorage& store,
                                CellId id,
                                const CellGeometry& cell) {
  return ReadBlock(store, KeyOf(id), [&](ByteReader& in) {
    SourceWeights weights;
    weights.peaks = in.GetArray<float>();
    weights.fluxes = in.GetArray<float>();
    weights.groups = in.GetArray<GroupWeight>();
    const size_t clusters = cell.clusters->Clusters().size();
    const size_t groups = cell.groups.All().size();
    if (weights.peaks.size() != clusters || weights.fluxes.size() != clusters ||
        weights.groups.size() != groups) {
      throw DamagedStoreError(fmt::format(
          "it is of {} clusters and {} groups, and the cell has {} and {}",
          weights.peaks.size(),
          weights.groups.size(),
          clusters,
          groups));
    }
    return weights;
  });
}

uint64_t SaveSourceWeights(BlockStorage& store,
                           CellId id,
                           const SourceWeights& weights) {
  ByteWriter writer;
  writer.PutArray(std::span(weights.peaks));
  writer.PutArray(std::span(weights.fluxes));
  writer.PutArray(std::span(weights.groups));
  return store.Put(KeyOf(id), writer.View());
}

void EraseSourceWeights(BlockStorage& store, CellId id) {
  store.Erase(KeyOf(id));
}

std::array<float, kTransferNodes> NodeRadiosity(const CellTree& tree,
                                                ElementId element,
                                                PatchShape patch) {
  const TreeShape& shape = tree.Shape();
  const Basis& basis = *shape.basis;
  const bool is_constant = shape.NodeStride() == 1;
  const auto sent = tree.Sent()[element];
  const size_t nodes = SecondOrderBasis().On(patch).NodeCount();
  std::array<float, kTransferNodes> radiosity{};
  for (size_t c = 0; c < shape.channels; ++c) {
    const auto of_channel = sent.subspan(c * shape.NodeStride());
    for (size_t q = 0; q < nodes; ++q) {
      const float value = basis.HasOwnNodes()
                              ? SampleAt(q, patch, basis, of_channel)
                              : of_channel[is_constant ? 0 : q];
      radiosity[q] = std::max(radiosity[q], std::abs(value));
    }
  }
  return radiosity;
}

float PeakOf(const std::array<float, kTransferNodes>& radiosity, float detail) {
  return *std::max_element(radiosity.begin(), radiosity.end()) + detail;
}

}  // namespace enfilade
