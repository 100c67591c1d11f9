// Where surfaces touch: a cupboard stands on the floor, its door closes its
// frame, a worktop lies on its boards, a picture hangs on the wall.
//
// All light ends at the rim of such a contact. An element that the rim crosses
// is wrong whatever falls on it, and so is every link to it, all in the same
// way; and where the contact closes a gap between white boards, the light that
// such an element brings in is reflected there ten times. So patches are cut
// along contacts before there are elements. docs/decisions/contacts.md.

#pragma once

#include "partition/patch.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace enfilade {

struct ContactCounts {
  uint64_t cut = 0;       // patches
  double covered_m2 = 0;  // of parts that lie behind other patches
};

// Cuts the patches of a cell along the rims of what stands or lies on their
// fronts; what lies behind another patch is enclosed. After SeparateOverlaps.
// Patches that are not cut keep their order, parts stand where the patch was.
// What they take when they become more than they were is told to `grow`, unless
// that is empty, before they do.
ContactCounts CutAlongContacts(
    std::vector<Patch>& patches,
    const std::function<void(uint64_t bytes)>& grow = {});

// What CutAlongContacts takes for so many patches while it works, if they do
// not become more.
uint64_t CutAlongContactsBytes(size_t patches);

}  // namespace enfilade
