#include "solver/paging/item_key.h"

namespace enfilade {

CachedThing ThingOf(const ItemKey& key) {
  switch (key.kind) {
    case ItemKind::kTree:
    case ItemKind::kElements:
      return {{BlockKind::kCellTree, key.cell},
              static_cast<uint32_t>(key.kind)};
    case ItemKind::kWeights:
      return {{BlockKind::kSourceWeights, key.cell}};
    case ItemKind::kDelta:
      return {{BlockKind::kCellDelta, key.cell}};
    case ItemKind::kReceived:
      return {{BlockKind::kReceived, key.cell}};
    case ItemKind::kLinks:
      return {{BlockKind::kLinks, key.cell, key.Source().value, key.chunk}};
    case ItemKind::kGeometry:
    case ItemKind::kShaftBlockers:
    case ItemKind::kRayBlockers:
      break;
  }
  return {{BlockKind::kCellPatches, key.cell}, static_cast<uint32_t>(key.kind)};
}

}  // namespace enfilade
