// What rays leave unknown of the light of a transfer, as a share of the
// transfer without occlusion. docs/decisions/0011-oracle.md has the
// measurements of the constants.
//
//   share of rays seen    unknown share
//   p in (0, 1)           kMixedVisibility sqrt(p (1 - p)) + that of 1
//   1                     kUnprovenClear
//   0                     kUnprovenBlocked, quartered by each split on the way
//                         of a transfer whose rays were all blocked
//   four rays that agree  kUnprovenByFour, in place of the two above

#pragma once

#include <cmath>

namespace enfilade {

// If sixteen rays are traced.
inline constexpr float kMixedVisibility = 0.5F;
inline constexpr float kUnprovenBlocked = 0.04F;
inline constexpr float kUnprovenClear = 0.03F;
// Each split of a transfer whose rays are all blocked reduces the unknown share
// to a quarter: this many halvings.
inline constexpr int kBlockedHalvings = 2;
// If four rays are traced and agree. They decide alone if that leaves at most
// kDecidedByFour of tau unknown.
inline constexpr float kUnprovenByFour = 0.15F;
inline constexpr float kDecidedByFour = 0.25F;

// Of a transfer of which the share `visible` gets through, by that alone.
inline float MixedShare(float visible) {
  return kMixedVisibility * std::sqrt(visible * (1 - visible));
}

// If all rays are blocked. `few`: only four were traced. `blocked`: how many of
// the transfers split on the way to this one had all of their rays blocked.
inline float UnknownBlocked(bool few, int blocked) {
  return std::ldexp(few ? kUnprovenByFour : kUnprovenBlocked,
                    -kBlockedHalvings * blocked);
}

// If the share `visible` of the rays gets through.
inline float UnknownShare(float visible, bool few, int blocked) {
  return visible <= 0
             ? UnknownBlocked(few, blocked)
             : MixedShare(visible) + (few ? kUnprovenByFour : kUnprovenClear);
}

// Whether four rays that agree leave so little of a transfer unknown that they
// decide alone. `transfer`: weighted, W/m, as tau is.
inline bool FewDecide(float transfer, int blocked, float tau) {
  return transfer * UnknownBlocked(true, blocked) <= kDecidedByFour * tau;
}

}  // namespace enfilade
