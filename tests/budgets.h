// Memory budgets that tests share.

#pragma once

#include <cstdint>

namespace enfilade {

// More than any scene of a test takes.
inline constexpr uint64_t kRoomy = uint64_t{1} << 30;

// The least that the program may be given, about.
inline constexpr uint64_t kModest = 64ULL << 20;

}  // namespace enfilade
