#include "solver/link_block.h"

#include <algorithm>
#include <bit>
#include <tuple>

namespace enfilade {
namespace {

constexpr int kExponentBias = 127 - 47;
constexpr int kDroppedBits = 13;  // of the 23 fraction bits of a float

uint64_t ZigZag(int64_t v) {
  return static_cast<uint64_t>(v) << 1 ^ static_cast<uint64_t>(v >> 63);
}

int64_t UnZigZag(uint64_t v) {
  return static_cast<int64_t>(v >> 1) ^ -static_cast<int64_t>(v & 1);
}

}  // namespace

uint16_t EncodeCoefficient(float value) {
  if (!(value > 0)) {
    return 0;
  }
  const uint32_t rounded =
      std::bit_cast<uint32_t>(value) + (1U << (kDroppedBits - 1));
  const int64_t code = static_cast<int64_t>(rounded >> kDroppedBits) -
                       (int64_t{kExponentBias} << (23 - kDroppedBits));
  return static_cast<uint16_t>(std::clamp<int64_t>(code, 0, 0xFFFF));
}

void SortLinks(LinkBlock* block) {
  std::sort(block->links.begin(),
            block->links.end(),
            [](const Link& a, const Link& b) {
              return std::tie(a.receiver, a.source, a.kind, a.value) <
                     std::tie(b.receiver, b.source, b.kind, b.value);
            });
  std::vector<NearCoefficients> near;
  near.reserve(block->near.size());
  for (Link& link : block->links) {
    if (link.kind == LinkKind::kNear) {
      near.push_back(block->near[link.near_index]);
      link.near_index = static_cast<uint32_t>(near.size() - 1);
    }
  }
  block->near = std::move(near);
}

Bytes EncodeLinks(const LinkBlock& block) {
  ByteWriter out;
  out.PutVarint(block.links.size());
  uint32_t receiver = 0;
  uint32_t source = 0;
  for (const Link& link : block.links) {
    const uint64_t step = link.receiver - receiver;
    out.PutVarint(step << 2 | static_cast<uint64_t>(link.kind));
    out.PutVarint(ZigZag(int64_t{link.source} - int64_t{source}));
    receiver = link.receiver;
    source = link.source;
  }
  for (const Link& link : block.links) {
    if (link.kind != LinkKind::kNear) {
      out.Put(link.value);
    }
  }
  for (const NearCoefficients& n : block.near) {
    out.Put(n);
  }
  return out.Take();
}

LinkBlock DecodeLinks(std::span<const std::byte> bytes,
                      size_t receiver_elements,
                      size_t source_elements) {
  ByteReader in(bytes);
  LinkBlock block;
  const uint64_t count = in.GetVarint();
  if (count > in.Remaining()) {
    throw DamagedStoreError("a link block is shorter than its number of links");
  }
  block.links.resize(count);
  uint64_t receiver = 0;
  int64_t source = 0;
  uint32_t near = 0;
  for (Link& link : block.links) {
    const uint64_t step = in.GetVarint();
    receiver += step >> 2;
    source += UnZigZag(in.GetVarint());
    link.kind = static_cast<LinkKind>(step & 3);
    if (receiver >= receiver_elements || source < 0 ||
        source >= static_cast<int64_t>(source_elements) ||
        link.kind > LinkKind::kNear) {
      throw DamagedStoreError(
          "a link block names an element that is not there");
    }
    link.receiver = static_cast<uint32_t>(receiver);
    link.source = static_cast<uint32_t>(source);
    if (link.kind == LinkKind::kNear) {
      link.near_index = near++;
    }
  }
  for (Link& link : block.links) {
    if (link.kind != LinkKind::kNear) {
      link.value = in.Get<uint16_t>();
    }
  }
  block.near.resize(near);
  for (NearCoefficients& n : block.near) {
    n = in.Get<NearCoefficients>();
  }
  return block;
}

}  // namespace enfilade
