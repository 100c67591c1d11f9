#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <type_traits>

namespace enfilade {

// Values that are made when they are first asked for. Values that are never
// asked for are not written: most parts of a large building's work ask for
// none.
template <typename T, size_t kCount>
class Slots {
  static_assert(std::is_trivially_destructible_v<T> && kCount <= 64);

 public:
  // NOLINTNEXTLINE(modernize-use-equals-default,*-member-init): writes nothing
  Slots() {}

  template <typename Make>
  const T& At(size_t i, const Make& make) {
    if ((made_ >> i & 1) == 0) {
      Put(i, make());
    }
    return (*this)[i];
  }

  void Put(size_t i, const T& value) {
    std::construct_at(reinterpret_cast<T*>(bytes_) + i, value);
    made_ |= uint64_t{1} << i;
  }

  void Clear() { made_ = 0; }

  // Requires that the value was made.
  const T& operator[](size_t i) const {
    return *std::launder(reinterpret_cast<const T*>(bytes_) + i);
  }

 private:
  uint64_t made_ = 0;
  alignas(T) std::byte bytes_[kCount * sizeof(T)];
};

}  // namespace enfilade
