// A part of a Refiner's work while it is being done; shared by the files that
// implement Refiner.

#pragma once

#include "solver/refine/refiner.h"
#include "solver/transfer/transfer_sample.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <tuple>
#include <type_traits>

namespace enfilade {

// Rays that are traced together.
constexpr size_t kPacketRays =
    std::tuple_size_v<decltype(SegmentPacket::from_x)>;

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

// The state of a part of an item of work.
struct Refiner::Task {
  // Whether one of the item's receivers [first, first + count) is in the part.
  [[nodiscard]] bool Meets(uint32_t first, uint32_t count) const {
    return part.Meets(first - first_receiver, count);
  }

  RawLinks* out = nullptr;
  WorkPart part;
  LinkLimit limit;
  // The item's receivers and its current sources, made when first asked for.
  uint32_t first_receiver = 0;
  uint32_t first_source = 0;
  Slots<Receiver, kItemReceivers> receivers;
  Slots<Source, kItemSources> sources;
  RayCount rays;
  // What blocked transfers from the current sources would add to the squared
  // error if half of all rays to them were blocked, and the ray counts before
  // these sources.
  double blocked_squared = 0;
  RayCount rays_before;
  // Weak links wait for their rays until the packet is full.
  SegmentPacket packet{};
  Slots<PendingLink, kPacketRays> pending;
};

}  // namespace enfilade
