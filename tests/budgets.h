// Memory budgets that tests share.

#pragma once

#include <cstdint>

namespace enfilade {

// More than any scene of a test takes.
inline constexpr uint64_t kRoomy = uint64_t{1} << 30;

// Enough for a building that a test puts together by hand.
inline constexpr uint64_t kModest = 64ULL << 20;

}  // namespace enfilade
