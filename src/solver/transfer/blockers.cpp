#include "solver/transfer/blockers.h"

#include <algorithm>

namespace enfilade {

uint32_t Blockers::Occlude(const SegmentPacket& packet) const {
  const uint32_t blocked = Occluded(rays, packet);
  return distant == nullptr ? blocked : distant->Occlude(packet, blocked);
}

bool Blockers::Separate(const ShaftEnds& ends) const {
  if (gates.empty()) {
    return false;
  }
  const Shaft across(AcrossPortals(ends));
  return std::any_of(
      gates.begin(), gates.end(), [&](const ShaftBlockers* portals) {
        return portals->LeaveEmpty(across);
      });
}

bool Blockers::LeaveEmpty(const ShaftEnds& ends) const {
  const Shaft shaft(ends);
  return std::all_of(shafts.begin(),
                     shafts.end(),
                     [&](const ShaftBlockers* cell) {
                       return cell->LeaveEmpty(shaft);
                     }) &&
         (distant == nullptr || distant->LeaveEmpty(shaft));
}

float Blockers::SumOfShadows(const CastShadow& shadow, float most) const {
  constexpr auto kWhole = static_cast<float>(CastShadow::kWhole);
  const auto enough = static_cast<uint64_t>(most * kWhole);
  ShadowSum sum;
  for (const ShaftBlockers* cell : shafts) {
    sum.Add(cell->SumOfShadows(shadow, enough));
  }
  // The result does not depend on the order of the cells: if one cell's sum
  // reaches `enough`, so does the total.
  if (distant != nullptr && sum.Larger() < enough) {
    sum.Add(distant->SumOfShadows(shadow, enough));
  }
  return static_cast<float>(std::min(sum.Larger(), enough)) / kWhole;
}

}  // namespace enfilade
