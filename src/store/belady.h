// What the best possible cache would have read: the yardstick for paging.
//
// Belady's MIN evicts what is used again last, which is optimal when all items
// have one size. For items of different sizes the optimum is NP-hard (Chrobak
// et al., "Caching is hard", 2012) and the same greedy rule is taken: a
// strong policy that knows the future, though no strict lower bound. The
// compulsory bytes are one.

#pragma once

#include <cstdint>
#include <span>

namespace enfilade {

struct BeladyReads {
  uint64_t optimal_bytes = 0;     // read by MIN under the capacity
  uint64_t compulsory_bytes = 0;  // every item that occurs, once
};

// `trace` holds the index of the item of each access in order, and
// `item_bytes` the size of each item. An item is read when it is accessed and
// not resident, and is resident during its access; one larger than the
// capacity is read at every access and displaces nothing. Needs 4 bytes of
// memory per access and about 60 per resident item; traces of fewer than 2^32
// accesses.
BeladyReads MeasureBelady(std::span<const uint32_t> trace,
                          std::span<const uint64_t> item_bytes,
                          uint64_t capacity_bytes);

}  // namespace enfilade
