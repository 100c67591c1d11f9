// Types without padding. Only these may be stored as they are: the bytes of
// padding are undefined and would differ from run to run.

#pragma once

#include <array>
#include <cstddef>
#include <type_traits>

namespace enfilade {

// Whether every byte of a T belongs to its value. The standard trait answers
// for integers; structs with floating-point members specialize kIsPacked and
// compare their size with the sum of their members' sizes.
template <typename T>
inline constexpr bool kIsPacked =
    std::has_unique_object_representations_v<T> || std::is_floating_point_v<T>;

template <typename T, size_t kSize>
inline constexpr bool kIsPacked<std::array<T, kSize>> = kIsPacked<T>;

}  // namespace enfilade
