#include "solver/blockers.h"

#include "solver/paged_blockers.h"

#include <algorithm>

namespace enfilade {

uint32_t Blockers::Occlude(const SegmentPacket& packet) const {
  const uint32_t blocked = Occluded(occluders, packet);
  return paged == nullptr ? blocked : paged->Occlude(packet, blocked);
}

bool Blockers::Separate(const Shaft& shaft) const {
  return std::any_of(
      gates.begin(), gates.end(), [&](const ShaftBlockers* portals) {
        return portals->LeaveEmpty(shaft);
      });
}

bool Blockers::LeaveEmpty(const Shaft& shaft) const {
  return std::all_of(shafts.begin(),
                     shafts.end(),
                     [&](const ShaftBlockers* cell) {
                       return cell->LeaveEmpty(shaft);
                     }) &&
         (paged == nullptr || paged->LeaveEmpty(shaft));
}

float Blockers::SumOfShadows(const Shaft& shaft,
                             const CastShadow& shadow) const {
  uint64_t sum = paged == nullptr ? 0 : paged->SumOfShadows(shaft, shadow);
  for (const ShaftBlockers* cell : shafts) {
    sum += cell->SumOfShadows(shaft, shadow);
  }
  return static_cast<float>(sum) / static_cast<float>(CastShadow::kWhole);
}

}  // namespace enfilade
