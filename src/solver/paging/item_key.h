// Names the things that a solve holds in memory and may evict.

#pragma once

#include "base/ids.h"
#include "solver/paging/access_trace.h"
#include "solver/paging/next_use.h"

#include <compare>
#include <cstdint>

namespace enfilade {

enum class ItemKind : uint8_t {
  kGeometry,
  kShaftBlockers,
  kRayBlockers,
  kTree,
  kElements,
  kDelta,
  kReceived,
  kWeights,
  kLinks  // last
};

struct ItemKey {
  ItemKind kind{};
  uint32_t cell = 0;
  uint32_t source = 0;  // for links; may be NextUse::kItself
  uint32_t chunk = 0;   // for links

  [[nodiscard]] CellId Cell() const { return CellId(cell); }

  [[nodiscard]] CellId Source() const {
    return CellId(source == NextUse::kItself ? cell : source);
  }

  // NOLINTNEXTLINE(modernize-use-nullptr): see base/ids.h
  friend auto operator<=>(const ItemKey&, const ItemKey&) = default;
};

// What the trace calls the item.
CachedThing ThingOf(const ItemKey& key);

}  // namespace enfilade
