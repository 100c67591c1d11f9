#include "solver/links/node_gather.h"

#include "solver/transfer/link_rays.h"
#include "solver/transfer/node_transfer.h"

namespace enfilade {
namespace {

// The layout of an element's coefficients, [channel][node].
struct Channels {
  size_t count;
  size_t stride;
};

void AddConstant(Channels channels,
                 float coefficient,
                 const ShapeBasis& source,
                 const float* radiosity,
                 size_t receiver_nodes,
                 float* gathered) {
  for (size_t c = 0; c < channels.count; ++c) {
    float mean = 0;
    for (size_t q = 0; q < source.NodeCount(); ++q) {
      mean += static_cast<float>(source.Weight(q)) *
              radiosity[c * channels.stride + q];
    }
    for (size_t g = 0; g < receiver_nodes; ++g) {
      gathered[c * channels.stride + g] += coefficient * mean;
    }
  }
}

void AddKernel(Channels channels,
               const NodeKernel& kernel,
               const NodeEnd& receiver,
               const NodeEnd& source,
               const float* radiosity,
               float* gathered) {
  for (size_t c = 0; c < channels.count; ++c) {
    const float* b = radiosity + c * channels.stride;
    float* h = gathered + c * channels.stride;
    for (size_t g = 0; g < receiver.count; ++g) {
      float sum = 0;
      for (size_t q = 0; q < source.count; ++q) {
        sum += kernel[g * kMaxNodes + q] * b[q];
      }
      h[g] += sum;
    }
  }
}

}  // namespace

void GatherAtNodes(const LinkBlock& block,
                   LinkRange range,
                   const GatherSide& receiver,
                   const GatherSide& source,
                   const CoefficientArray& radiosity,
                   CoefficientArray& gathered) {
  const TreeShape& shape = receiver.tree->Shape();
  const Basis& basis = *shape.basis;
  const Channels channels{shape.channels, shape.NodeStride()};
  NodeEnd r;
  uint32_t r_id = UINT32_MAX;
  for (size_t i = range.first; i < range.last; ++i) {
    const Link& link = block.links[i];
    const Element& re = receiver.tree->At(ElementId(link.receiver));
    const Element& se = source.tree->At(ElementId(link.source));
    const PatchGeometry& rp = receiver.patches[re.patch];
    const PatchGeometry& sp = source.patches[se.patch];
    const float* b = radiosity.At(link.source);
    float* h = gathered.At(link.receiver);
    if (link.kind == LinkKind::kWeak) {
      AddConstant(channels,
                  DecodeCoefficient(link.value),
                  basis.On(sp.shape),
                  b,
                  basis.On(rp.shape).NodeCount(),
                  h);
      continue;
    }
    if (link.receiver != r_id) {
      r = MakeNodeEnd(basis.On(rp.shape), rp, re.frame);
      r_id = link.receiver;
    }
    const NodeEnd s = MakeNodeEnd(basis.On(sp.shape), sp, se.frame);
    NodeKernel kernel = TransferKernel(r, s);
    const auto visible = static_cast<uint16_t>(link.more);
    if (visible != AllPairs(r.end, s.end)) {
      MaskNodeKernel(visible,
                     basis.SamplesOn(rp.shape),
                     basis.SamplesOn(sp.shape),
                     &kernel);
    }
    AddKernel(channels, kernel, r, s, b, h);
  }
}

}  // namespace enfilade
