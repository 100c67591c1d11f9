// A part of an item of refinement: the links to some of its receivers. An item
// that makes too many links at once is done in parts, one after the other:
//
//   depth 0        the item, kItemReceivers receivers
//   depth 1        one of them
//   depth 1 + n    an element of one, n levels below the receiver
//
// Links to elements above that one belong to the first of its parts. Where an
// item is cut depends on its links alone, so it is the same in every run.

#pragma once

#include <cstddef>
#include <cstdint>

namespace enfilade {

// Receivers of an item: as many as bits can tell apart.
inline constexpr uint32_t kReceiverBits = 3;
inline constexpr size_t kItemReceivers = size_t{1} << kReceiverBits;

struct WorkPart {
  // Deeper parts are not cut again.
  static constexpr uint32_t kMostDepth = 1 + 10;

  uint64_t item = 0;
  uint32_t depth = 0;
  uint64_t part = 0;  // from 0, of all at this depth

  bool operator==(const WorkPart&) const = default;

  // The first of the parts that it is cut into.
  [[nodiscard]] WorkPart Narrowed() const {
    return {item, depth + 1, part << BitsAt(depth + 1)};
  }

  // What comes after it, as wide as can be.
  [[nodiscard]] WorkPart Next() const {
    WorkPart next = *this;
    while (next.depth > 0) {
      const uint64_t last = (uint64_t{1} << BitsAt(next.depth)) - 1;
      if ((next.part & last) != last) {
        ++next.part;
        return next;
      }
      next.part >>= BitsAt(next.depth);
      --next.depth;
    }
    return {item + 1, 0, 0};
  }

  // Levels below a receiver to the part's element.
  [[nodiscard]] uint32_t Levels() const { return depth > 1 ? depth - 1 : 0; }

  // The part's receivers among those of the item: [first, first + count).
  [[nodiscard]] uint32_t FirstReceiver() const {
    return static_cast<uint32_t>(part >> 2 * Levels()) * ReceiverCount();
  }

  [[nodiscard]] uint32_t ReceiverCount() const {
    return depth > 0 ? 1U : uint32_t{kItemReceivers};
  }

  // The child on the way from an element `level` levels below the receiver to
  // the part's element.
  [[nodiscard]] size_t ChildAt(uint32_t level) const {
    return part >> 2 * (Levels() - 1 - level) & 3;
  }

  // Whether the links to an element so many levels below the receiver, on the
  // way to the part's element or below it, belong to this part.
  [[nodiscard]] bool Owns(uint32_t level) const {
    return level >= Levels() ||
           (part & ((uint64_t{1} << 2 * (Levels() - level)) - 1)) == 0;
  }

 private:
  static uint32_t BitsAt(uint32_t depth) {
    return depth > 1 ? 2 : kReceiverBits;
  }
};

}  // namespace enfilade
