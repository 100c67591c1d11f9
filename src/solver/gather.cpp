#include "solver/gather.h"

#include "base/parallel.h"
#include "solver/node_gather.h"

#include <array>

namespace enfilade {
namespace {

// Links per task; a task ends where a receiver ends.
constexpr size_t kTaskLinks = 4096;

// What one receiver element collects, [channel][node].
struct Collector {
  size_t channels;
  size_t stride;  // nodes per channel
  float* target;

  void AddConstant(size_t channel, float value, size_t nodes) const {
    for (size_t g = 0; g < nodes; ++g) {
      target[channel * stride + g] += value;
    }
  }
};

float MeanOf(const float* nodes, size_t count) {
  float sum = 0;
  for (size_t q = 0; q < count; ++q) {
    sum += nodes[q];
  }
  return sum / static_cast<float>(count);
}

void GatherWeak(const Collector& to,
                size_t receiver_nodes,
                float coefficient,
                const float* radiosity,
                size_t source_nodes) {
  for (size_t c = 0; c < to.channels; ++c) {
    to.AddConstant(
        c,
        coefficient * MeanOf(radiosity + c * to.stride, source_nodes),
        receiver_nodes);
  }
}

void GatherKernel(const Collector& to,
                  const Kernel& k,
                  const float* radiosity) {
  for (size_t c = 0; c < to.channels; ++c) {
    const float* b = radiosity + c * to.stride;
    float* h = to.target + c * to.stride;
    for (size_t g = 0; g < kTransferNodes; ++g) {
      const float* row = &k[g * kTransferNodes];
      h[g] += (row[0] * b[0] + row[1] * b[1]) + (row[2] * b[2] + row[3] * b[3]);
    }
  }
}

void GatherGroup(const Collector& to,
                 size_t receiver_nodes,
                 const GroupCoefficients& coefficients,
                 const GroupRadiosity& radiosity) {
  for (size_t c = 0; c < to.channels; ++c) {
    float* h = to.target + c * to.stride;
    for (size_t g = 0; g < receiver_nodes; ++g) {
      h[g] += DecodeCoefficient(coefficients[g]) * radiosity.mean[c];
    }
  }
}

// What the groups that the links of a block name send, by their index.
std::vector<GroupRadiosity> GroupsOf(const LinkBlock& block,
                                     const GatherSide& source,
                                     const CoefficientArray& radiosity) {
  std::vector<GroupRadiosity> groups;
  if (!block.group.empty()) {
    for (const SourceGroup& group : source.groups->All()) {
      groups.push_back(RadiosityOf(*source.groups,
                                   group,
                                   source.patches,
                                   source.tree->Shape(),
                                   radiosity));
    }
  }
  return groups;
}

Kernel StoredKernel(const LinkBlock& block, const Link& link) {
  const KernelShape* shape = &block.shapes[link.index];
  return link.kind == LinkKind::kFine
             ? DecodeFineKernel(link.value, shape[0], shape[1])
             : DecodeKernel(link.value, shape[0]);
}

// What a source sends: its elements, and its groups.
struct SentLight {
  const CoefficientArray* radiosity;
  std::vector<GroupRadiosity> groups;
};

void GatherRange(const LinkBlock& block,
                 LinkRange range,
                 const GatherSide& receiver,
                 const GatherSide& source,
                 const SentLight& sent,
                 CoefficientArray& gathered) {
  const CoefficientArray& radiosity = *sent.radiosity;
  const TreeShape& shape = receiver.tree->Shape();
  if (shape.basis->HasOwnNodes()) {
    GatherAtNodes(block, range, receiver, source, radiosity, gathered);
    return;
  }
  const bool constant = shape.NodeStride() == 1;
  TransferEnd r;
  uint32_t r_id = UINT32_MAX;
  for (size_t i = range.first; i < range.last; ++i) {
    const Link& link = block.links[i];
    const Element& re = receiver.tree->At(ElementId(link.receiver));
    const Collector to{
        shape.channels, shape.NodeStride(), gathered.At(link.receiver)};
    const size_t receiver_nodes =
        shape.basis->On(receiver.patches[re.patch].shape).NodeCount();
    if (link.kind == LinkKind::kGroup) {
      GatherGroup(to,
                  receiver_nodes,
                  block.group[link.index],
                  sent.groups[link.source]);
      continue;
    }
    const Element& se = source.tree->At(ElementId(link.source));
    const PatchGeometry& sp = source.patches[se.patch];
    const float* b = radiosity.At(link.source);
    if (link.kind == LinkKind::kWeak) {
      const size_t source_nodes = shape.basis->On(sp.shape).NodeCount();
      GatherWeak(
          to, receiver_nodes, DecodeCoefficient(link.value), b, source_nodes);
      continue;
    }
    if (constant) {
      continue;  // a constant basis has weak links only
    }
    if (ShapesOf(link.kind) > 0) {
      GatherKernel(to, StoredKernel(block, link), b);
      continue;
    }
    if (link.receiver != r_id) {
      r = MakeTransferEnd(receiver.patches[re.patch], re.frame);
      r_id = link.receiver;
    }
    Kernel kernel = QuadratureKernel(r, MakeTransferEnd(sp, se.frame));
    MaskKernel(link.value, &kernel);
    GatherKernel(to, kernel, b);
  }
}

// Cuts the links where a receiver ends, every kTaskLinks or a little later.
std::vector<size_t> TaskBounds(const LinkBlock& block) {
  std::vector<size_t> bounds = {0};
  for (size_t i = 1; i < block.links.size(); ++i) {
    if (i - bounds.back() >= kTaskLinks &&
        block.links[i].receiver != block.links[i - 1].receiver) {
      bounds.push_back(i);
    }
  }
  bounds.push_back(block.links.size());
  return bounds;
}

}  // namespace

void Gather(const LinkBlock& block,
            const GatherSide& receiver,
            const GatherSide& source,
            const CoefficientArray& radiosity,
            CoefficientArray& gathered) {
  const auto bounds = TaskBounds(block);
  const SentLight sent{&radiosity, GroupsOf(block, source, radiosity)};
  ParallelFor(bounds.size() - 1, [&](size_t task) {
    GatherRange(block,
                {bounds[task], bounds[task + 1]},
                receiver,
                source,
                sent,
                gathered);
  });
}

}  // namespace enfilade
