// Where surfaces touch: a cupboard stands on the floor, a door closes its
// frame, a worktop lies on its boards, a picture hangs on the wall.
//
// Irradiance drops to zero at the rim of such a contact. An element that the
// rim crosses is wrong whatever light falls on it, and every link to the
// element carries the same error. Where the contact closes a gap between white
// boards, the light that the element brings into the gap is reflected there ten
// times. Patches are therefore cut along contacts before they get elements.
// docs/decisions/contacts.md.

#pragma once

#include "partition/patch.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace enfilade {

struct ContactCounts {
  uint64_t cut = 0;       // patches
  double covered_m2 = 0;  // of parts that are behind other patches
};

// Cuts the patches of a cell along the rims of the surfaces that stand or lie
// on their fronts. A part that lies behind another patch becomes enclosed. To
// be called after SeparateOverlaps. Patches that are not cut keep their order;
// the parts of a cut patch take its place. Before the list of patches grows,
// `grow`, unless empty, is told the bytes of the old and the new list together.
ContactCounts CutAlongContacts(
    std::vector<Patch>& patches,
    const std::function<void(uint64_t bytes)>& grow = {});

// The memory that CutAlongContacts takes for so many patches while it works, if
// the number of patches does not grow.
uint64_t CutAlongContactsBytes(size_t patches);

}  // namespace enfilade
