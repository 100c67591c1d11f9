// Links: couplings of a receiver element with a source element, in chunks of
// one cell pair. The M^2 x M^2 coefficients of a link are not stored; what is
// expensive to recompute is: the visibility, one bit per pair of nodes. The
// kernel is rebuilt from the geometry while streaming (gather.h).
//
//   kind    stored                       meaning
//   weak    one coefficient    constant transfer of the mean radiosity
//   far     16 bits V_gq       K_gq V_gq, K by plain quadrature
//   near    16 bits V_gq,      the same, scaled to the sum of the true ones:
//           their sum          quadrature is crude where ends are close
//   shaped  their sum, and     K_gq V_gq, where what scaled quadrature leaves
//           8 bits each        would be seen
//   group   4 coefficients     F_g V_g of a group of patches, which sends its
//                              mean radiosity (source_group.h)
//
// Coefficients are written as in link_codes.h.

#pragma once

#include "base/bytes.h"
#include "solver/links/link_codes.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

enum class LinkKind : uint8_t {
  kWeak = 0,
  kFar = 1,
  kNear = 2,
  kGroup = 3,
  kShaped = 4
};

using GroupCoefficients = std::array<uint16_t, kTransferNodes>;

// A link of a cell pair; ids are local to the two cells.
struct Link {
  uint32_t receiver = 0;  // an element
  uint32_t source = 0;    // an element; group: a group
  LinkKind kind{};
  // Weak: the coefficient; near and shaped: the sum.
  uint16_t value = 0;
  // Far and near: visibility bits; shaped: which of the block's shapes; group:
  // which of the block's coefficients.
  uint32_t more = 0;
};

// A chunk of links in memory, ascending by receiver, then source.
struct LinkBlock {
  std::vector<Link> links;
  std::vector<KernelShape> shapes;
  std::vector<GroupCoefficients> group;

  [[nodiscard]] uint64_t SizeBytes() const {
    return links.capacity() * sizeof(Link) +
           shapes.capacity() * sizeof(KernelShape) +
           group.capacity() * sizeof(GroupCoefficients);
  }

  // Appends link `i` of another block, with its coefficients.
  void AppendFrom(const LinkBlock& other, size_t i);

  // Appends the coefficients of a link of another block, if it has any;
  // returns what is `more` of it then.
  uint32_t TakeCoefficients(const LinkBlock& other, const Link& link);
};

// What the ids of a block's links count: elements of the two cells, and groups
// of the source's.
struct LinkEnds {
  size_t receivers = 0;
  size_t sources = 0;
  size_t groups = 0;
};

// Sorts the links (and renumbers their coefficients in their order).
void SortLinks(LinkBlock* block);

// Requires a sorted block. Receivers and sources are delta-coded.
Bytes EncodeLinks(const LinkBlock& block);

// Throws DamagedStoreError unless all ids are below what they count.
LinkBlock DecodeLinks(std::span<const std::byte> bytes, const LinkEnds& ends);

}  // namespace enfilade
