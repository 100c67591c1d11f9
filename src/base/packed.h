// Types without padding, which alone may be stored as they are: padding would
// bring into a store what happened to be in memory, other bits in every run.

#pragma once

#include <array>
#include <cstddef>
#include <type_traits>

namespace enfilade {

// Whether all bytes of a T are of its value. The language tells it of integers;
// structs with floating-point members say it themselves, by the sizes of these.
template <typename T>
inline constexpr bool kIsPacked =
    std::has_unique_object_representations_v<T> || std::is_floating_point_v<T>;

template <typename T, size_t kSize>
inline constexpr bool kIsPacked<std::array<T, kSize>> = kIsPacked<T>;

}  // namespace enfilade
