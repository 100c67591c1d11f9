// Links as refinement makes them, before their elements have ids: a part of the
// work names elements by their paths, because other parts may make the same
// elements at the same time.

#pragma once

#include "solver/elements/element_tree.h"
#include "solver/links/link_block.h"
#include "solver/transfer/form_factor.h"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace enfilade {

struct RawLink {
  uint32_t receiver_patch = 0;
  uint32_t source_patch = 0;  // the index of a group if kGroup
  ElementPath receiver_path = kRootPath;
  ElementPath source_path = kRootPath;
  LinkKind kind{};
  uint16_t value = 0;
  uint32_t more = 0;  // as Link::more; shaped: index into RawLinks::shapes
  // The irradiance that a source of 1 W/m2 brings to the receiver's nodes,
  // W/m2.
  std::array<float, kTransferNodes> gain{};
};

struct RawLinks {
  std::vector<RawLink> links;
  std::vector<KernelShape> shapes;
  // The sum of the squares of true errors that count, (W/m)^2.
  double squared_error = 0;
  uint64_t rays = 0;
  bool overflowed = false;  // too many links: they are of no use
};

// How many links a part of the work may make.
struct LinkLimit {
  // A part that makes more links is to be cut, if it can be.
  size_t most = SIZE_MAX;
  // Counts the links of all parts that are made at the same time. A part that
  // brings the counter above `most_together` is to be made again later.
  std::atomic<size_t>* together = nullptr;
  size_t most_together = SIZE_MAX;
};

}  // namespace enfilade
