// Links: couplings of a receiver element with a source element, stored in
// chunks of one cell pair. The M^2 x M^2 coefficients of a link are not stored.
// Its visibility, one bit per pair of nodes, is stored because it is expensive
// to recompute. The gather rebuilds the kernel from the geometry (gather.h).
//
//   kind    stored             meaning
//   weak    one coefficient    constant transfer of the mean radiosity
//   far     16 bits V_gq       K_gq V_gq, K by plain quadrature
//   near    16 bits V_gq,      as far, scaled to the sum of the true K_gq V_gq:
//           their sum          quadrature is crude if the ends are close
//   shaped  their sum, and     K_gq V_gq itself, if the error of the scaled
//           8 bits each        quadrature would be seen
//   group   4 coefficients     F_g V_g of a group of patches, which sends its
//                              mean radiosity (source_group.h)
//
// link_codes.h describes how coefficients are encoded.

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
  uint32_t source = 0;    // an element or, for kGroup, a group
  LinkKind kind{};
  // Weak: the coefficient; near and shaped: the sum of the coefficients.
  uint16_t value = 0;
  // Far and near: visibility bits; shaped: index into the block's `shapes`;
  // group: index into the block's `group`.
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

  // Appends the coefficients of a link of another block, if the link has any;
  // returns the value of `more` for the link in this block.
  uint32_t TakeCoefficients(const LinkBlock& other, const Link& link);
};

// The upper limits of the ids in a block's links: the numbers of elements of
// the two cells, and of groups of the source cell.
struct LinkEnds {
  size_t receivers = 0;
  size_t sources = 0;
  size_t groups = 0;
};

// Sorts the links, and reorders their coefficients likewise.
void SortLinks(LinkBlock* block);

// Requires a sorted block. Receivers and sources are delta-coded.
Bytes EncodeLinks(const LinkBlock& block);

// Throws DamagedStoreError unless all ids are below their limits in `ends`.
LinkBlock DecodeLinks(std::span<const std::byte> bytes, const LinkEnds& ends);

}  // namespace enfilade
