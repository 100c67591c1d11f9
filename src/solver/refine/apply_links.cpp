#include "solver/refine/apply_links.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>

namespace enfilade {
namespace {

// Adds gains at transfer nodes to those at the nodes of a basis.
void AddGain(const TreeShape& shape,
             PatchShape patch_shape,
             const std::array<float, kTransferNodes>& from,
             float* to) {
  if (!shape.basis->HasOwnNodes()) {
    for (size_t g = 0; g < shape.NodeStride(); ++g) {
      to[g] += from[g];
    }
    return;
  }
  const auto& rows = shape.basis->SamplesOn(patch_shape).from_samples;
  for (size_t g = 0; g < shape.basis->On(patch_shape).NodeCount(); ++g) {
    to[g] +=
        std::inner_product(from.begin(), from.end(), rows[g].begin(), 0.0F);
  }
}

GroupCoefficients EncodedGain(const std::array<float, kTransferNodes>& gain) {
  GroupCoefficients coefficients{};
  std::transform(
      gain.begin(), gain.end(), coefficients.begin(), EncodeCoefficient);
  return coefficients;
}

}  // namespace

void ApplyLinks(const RawLinks& raw,
                const GrowingSide& receiver,
                const GrowingSide& source,
                ReceivedLight* received,
                LinkBlock* block) {
  for (const RawLink& link : raw.links) {
    Link out;
    out.receiver = receiver.tree
                       ->FindOrCreate(PatchId(link.receiver_patch),
                                      link.receiver_path,
                                      receiver.patches)
                       .value;
    if (link.kind == LinkKind::kGroup) {
      out.source = link.source_patch;
    } else {
      out.source =
          source.tree
              ->FindOrCreate(
                  PatchId(link.source_patch), link.source_path, source.patches)
              .value;
    }
    out.kind = link.kind;
    out.value = link.value;
    received->GrowTo(receiver.tree->Size());
    AddGain(receiver.tree->Shape(),
            receiver.patches[link.receiver_patch].shape,
            link.gain,
            received->gain.At(out.receiver));
    if (link.kind == LinkKind::kShaped) {
      out.more = static_cast<uint32_t>(block->shapes.size());
      block->shapes.push_back(raw.shapes[link.more]);
    } else if (link.kind == LinkKind::kGroup) {
      out.more = static_cast<uint32_t>(block->group.size());
      block->group.push_back(EncodedGain(link.gain));
    } else {
      out.more = link.more;
    }
    block->links.push_back(out);
  }
}

}  // namespace enfilade
