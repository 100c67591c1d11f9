#include "solver/reference/hierarchical_visibility.h"

#include "base/random.h"
#include "solver/transfer/link_rays.h"
#include "solver/transfer/transfer_sample.h"

#include <array>
#include <bit>
#include <numeric>
#include <utility>

namespace enfilade {
namespace {

constexpr uint32_t kGrid = 4;  // cells along an edge of a jittered grid
constexpr uint32_t kGridCells = kGrid * kGrid;
constexpr uint64_t kPartStream = 0x9a27;

using Order = std::array<uint32_t, kGridCells>;

// The cells of the source's grid in random order: one for each cell of the
// receiver's grid.
Order RandomOrder(Random* random) {
  Order order;
  std::iota(order.begin(), order.end(), 0U);
  for (uint32_t i = kGridCells; i-- > 1;) {
    std::swap(order[i], order[random->NextBelow(i + 1)]);
  }
  return order;
}

// A random point of a cell of the grid.
Vec3f PointInCell(const TransferEnd& end, uint32_t cell, Random* random) {
  const auto jittered = [&](uint32_t k) {
    return (static_cast<float>(k) + static_cast<float>(random->Next())) /
           static_cast<float>(kGrid);
  };
  const float s = jittered(cell % kGrid);
  const float t = jittered(cell / kGrid);
  const auto [a, b] = FoldedOnto(end.patch->shape, s, t);
  return PointOn(*end.patch, end.frame, a, b);
}

bool FaceEachOther(PointPair points,
                   const TransferEnd& receiver,
                   const TransferEnd& source) {
  return PointKernel(points, receiver, source) > 0;
}

}  // namespace

SeenShare HierarchicalVisibility::Share(const Panel& receiver,
                                        const Panel& source) const {
  SegmentPacket packet;
  const auto add = [&](PointPair points) {
    if (FaceEachOther(points, receiver.end, source.end)) {
      AddSegment(points, &packet);
    }
  };
  if (mode_ == VisibilityMode::kRay) {
    add({receiver.end.center, source.end.center});
  } else {
    Random random(MixKey(scene_.KeyOf(receiver), scene_.KeyOf(source)));
    const Order order = RandomOrder(&random);
    for (uint32_t i = 0; i < kGridCells; ++i) {
      const Vec3f x = PointInCell(receiver.end, i, &random);
      add({x, PointInCell(source.end, order[i], &random)});
    }
  }
  const uint32_t rays = packet.count;
  return {rays,
          rays - static_cast<uint32_t>(std::popcount(scene_.Blocked(packet)))};
}

void HierarchicalVisibility::Mask(const Coupling& coupling,
                                  const SeenShare& share,
                                  uint64_t key,
                                  NodeKernel* kernel) const {
  switch (mode_) {
    case VisibilityMode::kQuadrature:
      MaskByNodes(coupling, kernel);
      break;
    case VisibilityMode::kStratified:
      MaskByParts(coupling, MixKey(key, kPartStream), kernel);
      break;
    default:
      for (float& k : *kernel) {
        k *= share.Value();
      }
  }
}

// Traces one ray for each pair of nodes that exchanges light.
void HierarchicalVisibility::MaskByNodes(const Coupling& coupling,
                                         NodeKernel* kernel) const {
  SegmentPacket packet;
  std::array<float*, kGridCells> lanes{};
  const auto trace = [&] {
    const uint32_t blocked = scene_.Blocked(packet);
    for (uint32_t i = 0; i < packet.count; ++i) {
      *lanes[i] *= (blocked >> i & 1) != 0 ? 0.0F : 1.0F;
    }
    packet.count = 0;
  };
  for (size_t g = 0; g < coupling.receiver.count; ++g) {
    for (size_t q = 0; q < coupling.source.count; ++q) {
      float& k = (*kernel)[g * kMaxNodes + q];
      if (k == 0) {
        continue;
      }
      lanes[packet.count] = &k;
      AddSegment({coupling.receiver.nodes.At(g), coupling.source.nodes.At(q)},
                 &packet);
      if (packet.count == kGridCells) {
        trace();
      }
    }
  }
  trace();
}

// Pairs of parts that do not face each other count as seen, since their kernel
// already says what they exchange.
void HierarchicalVisibility::MaskByParts(const Coupling& coupling,
                                         uint64_t key,
                                         NodeKernel* kernel) const {
  const TransferEnd& receiver = coupling.receiver.end;
  const TransferEnd& source = coupling.source.end;
  Random random(key);
  SegmentPacket packet;
  std::array<size_t, kGridCells> bits{};
  for (size_t g = 0; g < receiver.node_count; ++g) {
    for (size_t q = 0; q < source.node_count; ++q) {
      if (const auto pair = RandomPair(receiver, g, source, q, &random)) {
        bits[packet.count] = g * kTransferNodes + q;
        AddSegment(*pair, &packet);
      }
    }
  }
  const uint32_t blocked = scene_.Blocked(packet);
  uint16_t visible = AllPairs(receiver, source);
  for (uint32_t i = 0; i < packet.count; ++i) {
    if ((blocked >> i & 1) != 0) {
      visible = static_cast<uint16_t>(visible & ~(1U << bits[i]));
    }
  }
  MaskNodeKernel(visible,
                 coupling.basis->SamplesOn(receiver.patch->shape),
                 coupling.basis->SamplesOn(source.patch->shape),
                 kernel);
}

}  // namespace enfilade
