#include "solver/links/gather.h"

#include "base/parallel.h"
#include "solver/links/link_codes.h"
#include "solver/links/node_gather.h"
#include "solver/transfer/form_factor.h"

#include <array>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

namespace enfilade {
namespace {

// Links per task; a task ends where a receiver ends.
constexpr size_t kTaskLinks = 4096;

// One lane per transfer node of an element. Compilers do not vectorise plain
// loops over nodes inside a loop over channels.
using Lanes [[gnu::vector_size(kTransferNodes * sizeof(float))]] = float;
using LaneBits [[gnu::vector_size(kTransferNodes * sizeof(float))]] = int32_t;

Lanes LoadLanes(const float* from) {
  Lanes lanes;
  std::memcpy(&lanes, from, sizeof(lanes));
  return lanes;
}

void StoreLanes(Lanes lanes, float* to) {
  std::memcpy(to, &lanes, sizeof(lanes));
}

// The irradiance that one receiver element collects, [channel][node].
struct Collector {
  size_t channels;
  size_t stride;  // nodes per channel
  float* target;
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
    const float value =
        coefficient * MeanOf(radiosity + c * to.stride, source_nodes);
    float* h = to.target + c * to.stride;
    if (receiver_nodes == kTransferNodes) {
      StoreLanes(LoadLanes(h) + value, h);
      continue;
    }
    for (size_t g = 0; g < receiver_nodes; ++g) {
      h[g] += value;
    }
  }
}

// The kernel of a second-order basis, whose own nodes are the transfer nodes.
// The kernel is stored by columns, so that all operations run over the
// receiver's nodes side by side.
using KernelLanes = std::array<Lanes, kTransferNodes>;

void GatherKernel(const Collector& to,
                  const KernelLanes& k,
                  const float* radiosity) {
  for (size_t c = 0; c < to.channels; ++c) {
    const float* b = radiosity + c * kTransferNodes;
    float* h = to.target + c * kTransferNodes;
    const Lanes sum = (k[0] * b[0] + k[1] * b[1]) + (k[2] * b[2] + k[3] * b[3]);
    StoreLanes(LoadLanes(h) + sum, h);
  }
}

KernelLanes InLanes(const KernelColumns& columns) {
  KernelLanes lanes;
  for (size_t q = 0; q < kTransferNodes; ++q) {
    lanes[q] = LoadLanes(columns[q].data());
  }
  return lanes;
}

// An element as one end of a kernel.
struct KernelEnd {
  TransferNodes nodes;
  Vec3f normal;
  float area = 0;
};

KernelEnd MakeKernelEnd(const PatchGeometry& patch, ElementFrame frame) {
  return {NodesOf(patch, frame), patch.normal, AreaOf(patch, frame)};
}

// QuadratureKernel with zeros for invisible pairs of nodes.
KernelLanes SeenQuadrature(const KernelEnd& r,
                           const KernelEnd& s,
                           int32_t visible) {
  // For each receiver node, the visibility bit of its pair with source node 0.
  constexpr LaneBits kFirstBits = {1, 1 << 4, 1 << 8, 1 << 12};
  static_assert(kTransferNodes == 4);
  const float scale = s.area * kInversePi;
  const Lanes x = LoadLanes(r.nodes.x.data());
  const Lanes y = LoadLanes(r.nodes.y.data());
  const Lanes z = LoadLanes(r.nodes.z.data());
  KernelLanes columns;
  for (size_t q = 0; q < kTransferNodes; ++q) {
    const Lanes k = PlainKernel(Lanes{} + scale * s.nodes.weight[q],
                                s.nodes.x[q] - x,
                                s.nodes.y[q] - y,
                                s.nodes.z[q] - z,
                                r.normal,
                                s.normal);
    columns[q] = (kFirstBits & (visible >> q)) != 0 ? k : Lanes{};
  }
  return columns;
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

// The radiosity of the source groups that the block's links use, by index.
std::vector<GroupRadiosity> GroupsOf(const LinkBlock& block,
                                     const GatherSide& source,
                                     const CoefficientArray& radiosity) {
  std::vector<GroupRadiosity> groups;
  if (block.group.empty()) {
    return groups;
  }
  const auto all = source.groups->All();
  std::vector<bool> is_used(all.size());
  for (const Link& link : block.links) {
    if (link.kind == LinkKind::kGroup) {
      is_used[link.source] = true;
    }
  }
  groups.resize(all.size());
  for (size_t g = 0; g < all.size(); ++g) {
    if (is_used[g]) {
      groups[g] = GroupRadiosityOf(*source.groups,
                                   all[g],
                                   source.patches,
                                   source.tree->Shape(),
                                   radiosity);
    }
  }
  return groups;
}

void ScaleKernel(uint16_t sum, KernelLanes* kernel) {
  Lanes totals = {};
  for (const Lanes& column : *kernel) {
    totals += column;
  }
  std::array<float, kTransferNodes> stored{};
  StoreLanes(totals, stored.data());
  const float scale = ScaleTo(sum, stored);
  for (Lanes& column : *kernel) {
    column *= scale;
  }
}

// The radiosity that a source cell sends: of its elements, and of its groups.
struct SentLight {
  const CoefficientArray* radiosity;
  std::vector<GroupRadiosity> groups;
};

// The receiver element of consecutive links.
struct ReceiverEnd {
  uint32_t element = UINT32_MAX;
  const Element* at = nullptr;
  const PatchGeometry* patch = nullptr;
  size_t nodes = 0;
  Collector to{};
  bool has_end = false;
  KernelEnd end;  // made when a link first needs it

  void MoveTo(uint32_t receiver,
              const GatherSide& side,
              CoefficientArray& gathered) {
    const TreeShape& shape = side.tree->Shape();
    element = receiver;
    at = &side.tree->At(ElementId(receiver));
    patch = &side.patches[at->patch];
    nodes = shape.basis->On(patch->shape).NodeCount();
    to = {shape.channels, shape.NodeStride(), gathered.At(receiver)};
    has_end = false;
  }

  const KernelEnd& End() {
    if (!std::exchange(has_end, true)) {
      end = MakeKernelEnd(*patch, at->frame);
    }
    return end;
  }
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
  const bool is_constant = shape.NodeStride() == 1;
  ReceiverEnd r;
  for (size_t i = range.first; i < range.last; ++i) {
    const Link& link = block.links[i];
    if (link.receiver != r.element) {
      r.MoveTo(link.receiver, receiver, gathered);
    }
    if (link.kind == LinkKind::kGroup) {
      GatherGroup(
          r.to, r.nodes, block.group[link.more], sent.groups[link.source]);
      continue;
    }
    if (is_constant && link.kind != LinkKind::kWeak) {
      continue;  // a constant basis has no such links
    }
    const float* b = radiosity.At(link.source);
    if (link.kind == LinkKind::kShaped) {
      GatherKernel(
          r.to, InLanes(DecodeKernel(link.value, block.shapes[link.more])), b);
      continue;
    }
    const Element& s = source.tree->At(ElementId(link.source));
    const PatchGeometry& patch = source.patches[s.patch];
    if (link.kind == LinkKind::kWeak) {
      GatherWeak(r.to,
                 r.nodes,
                 DecodeCoefficient(link.value),
                 b,
                 shape.basis->On(patch.shape).NodeCount());
      continue;
    }
    KernelLanes kernel = SeenQuadrature(r.End(),
                                        MakeKernelEnd(patch, s.frame),
                                        static_cast<int32_t>(link.more));
    if (link.kind == LinkKind::kNear) {
      ScaleKernel(link.value, &kernel);
    }
    GatherKernel(r.to, kernel, b);
  }
}

// Cuts the links into tasks of kTaskLinks links or a few more, at places where
// a receiver ends.
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
