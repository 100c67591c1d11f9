#include "solver/links/link_block.h"

#include <algorithm>
#include <tuple>

namespace enfilade {
namespace {

// The steps of receiver and source, and a value.
constexpr size_t kTypicalLinkBytes = 6;
constexpr int kKindBits = 3;
constexpr uint64_t kKindMask = (1U << kKindBits) - 1;

uint64_t ZigZag(int64_t v) {
  return static_cast<uint64_t>(v) << 1 ^ static_cast<uint64_t>(v >> 63);
}

int64_t UnZigZag(uint64_t v) {
  return static_cast<int64_t>(v >> 1) ^ -static_cast<int64_t>(v & 1);
}

bool HasValue(LinkKind kind) {
  return kind == LinkKind::kWeak || kind == LinkKind::kNear ||
         kind == LinkKind::kShaped;
}

bool HasVisibility(LinkKind kind) {
  return kind == LinkKind::kFar || kind == LinkKind::kNear;
}

// How far a block is decoded.
struct Place {
  uint64_t receiver = 0;
  int64_t source = 0;
  size_t shapes = 0;
  size_t groups = 0;
};

// Sets the link's ends and kind.
void DecodePlace(ByteReader& in, const LinkEnds& ends, Place* at, Link* link) {
  const uint64_t step = in.GetVarint();
  at->receiver += step >> kKindBits;
  // A damaged step may be of any size.
  at->source =
      static_cast<int64_t>(static_cast<uint64_t>(at->source) +
                           static_cast<uint64_t>(UnZigZag(in.GetVarint())));
  link->kind = static_cast<LinkKind>(step & kKindMask);
  if (link->kind > LinkKind::kShaped) {
    throw DamagedStoreError("it has a link of no known kind");
  }
  const size_t sources =
      link->kind == LinkKind::kGroup ? ends.groups : ends.sources;
  if (at->receiver >= ends.receivers || at->source < 0 ||
      at->source >= static_cast<int64_t>(sources)) {
    throw DamagedStoreError("it has a link of an element that is not there");
  }
  link->receiver = static_cast<uint32_t>(at->receiver);
  link->source = static_cast<uint32_t>(at->source);
}

}  // namespace

void SortLinks(LinkBlock* block) {
  std::sort(block->links.begin(),
            block->links.end(),
            [](const Link& a, const Link& b) {
              return std::tie(a.receiver, a.source, a.kind, a.value) <
                     std::tie(b.receiver, b.source, b.kind, b.value);
            });
  LinkBlock sorted;
  sorted.shapes.reserve(block->shapes.size());
  sorted.group.reserve(block->group.size());
  for (Link& link : block->links) {
    link.more = sorted.TakeCoefficients(*block, link);
  }
  block->shapes = std::move(sorted.shapes);
  block->group = std::move(sorted.group);
}

void LinkBlock::AppendFrom(const LinkBlock& other, size_t i) {
  Link link = other.links[i];
  link.more = TakeCoefficients(other, link);
  links.push_back(link);
}

uint32_t LinkBlock::TakeCoefficients(const LinkBlock& other, const Link& link) {
  if (link.kind == LinkKind::kShaped) {
    shapes.push_back(other.shapes[link.more]);
    return static_cast<uint32_t>(shapes.size() - 1);
  }
  if (link.kind == LinkKind::kGroup) {
    group.push_back(other.group[link.more]);
    return static_cast<uint32_t>(group.size() - 1);
  }
  return link.more;
}

Bytes EncodeLinks(const LinkBlock& block) {
  ByteWriter out;
  out.Reserve(block.links.size() * kTypicalLinkBytes +
              block.shapes.size() * sizeof(KernelShape) +
              block.group.size() * sizeof(GroupCoefficients));
  out.PutVarint(block.links.size());
  uint32_t receiver = 0;
  uint32_t source = 0;
  for (const Link& link : block.links) {
    const uint64_t step = link.receiver - receiver;
    out.PutVarint(step << kKindBits | static_cast<uint64_t>(link.kind));
    out.PutVarint(ZigZag(int64_t{link.source} - int64_t{source}));
    receiver = link.receiver;
    source = link.source;
  }
  for (const Link& link : block.links) {
    if (HasValue(link.kind)) {
      out.Put(link.value);
    }
  }
  for (const Link& link : block.links) {
    if (HasVisibility(link.kind)) {
      out.Put(static_cast<uint16_t>(link.more));
    }
  }
  for (const KernelShape& s : block.shapes) {
    out.Put(s);
  }
  for (const GroupCoefficients& g : block.group) {
    out.Put(g);
  }
  return out.Take();
}

LinkBlock DecodeLinks(std::span<const std::byte> bytes, const LinkEnds& ends) {
  ByteReader in(bytes);
  LinkBlock block;
  const uint64_t count = in.GetVarint();
  if (count > in.Remaining()) {
    throw DamagedStoreError("it is shorter than its number of links");
  }
  block.links.resize(count);
  Place at;
  for (Link& link : block.links) {
    DecodePlace(in, ends, &at, &link);
    if (link.kind == LinkKind::kShaped) {
      link.more = static_cast<uint32_t>(at.shapes++);
    } else if (link.kind == LinkKind::kGroup) {
      link.more = static_cast<uint32_t>(at.groups++);
    }
  }
  for (Link& link : block.links) {
    if (HasValue(link.kind)) {
      link.value = in.Get<uint16_t>();
    }
  }
  for (Link& link : block.links) {
    if (HasVisibility(link.kind)) {
      link.more = in.Get<uint16_t>();
    }
  }
  block.shapes.resize(at.shapes);
  for (KernelShape& s : block.shapes) {
    s = in.Get<KernelShape>();
  }
  block.group.resize(at.groups);
  for (GroupCoefficients& g : block.group) {
    g = in.Get<GroupCoefficients>();
  }
  in.RequireEnd();
  return block;
}

}  // namespace enfilade
