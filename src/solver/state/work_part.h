// A part of an item of refinement: the links to some of the item's receivers.
// An item that makes too many links at once is done in parts, one by one:
//
//   depth 0        the whole item, kItemReceivers receivers
//   depth 1        one receiver
//   depth 1 + n    an element of one receiver, n levels below the receiver
//
// Links to an element above the elements of several parts belong to the first
// of these parts. Where an item is cut depends only on its links, so the cuts
// are the same in every run.

#pragma once

#include <cstddef>
#include <cstdint>

namespace enfilade {

// An item has as many receivers as kReceiverBits bits can number.
inline constexpr uint32_t kReceiverBits = 3;
inline constexpr size_t kItemReceivers = size_t{1} << kReceiverBits;

struct WorkPart {
  // Parts at this depth are not cut again.
  static constexpr uint32_t kMostDepth = 1 + 10;

  uint64_t item = 0;
  uint32_t depth = 0;
  uint64_t part = 0;  // from 0, among all parts at this depth

  bool operator==(const WorkPart&) const = default;

  // The first of the parts into which this part is cut.
  [[nodiscard]] WorkPart Narrowed() const {
    return {item, depth + 1, part << BitsAt(depth + 1)};
  }

  // The widest part that begins where this part ends.
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

  // The number of levels from a receiver to the part's element.
  [[nodiscard]] uint32_t Levels() const { return depth > 1 ? depth - 1 : 0; }

  // The part's receivers among those of the item: [first, first + count).
  [[nodiscard]] uint32_t FirstReceiver() const {
    return static_cast<uint32_t>(part >> 2 * Levels()) * ReceiverCount();
  }

  [[nodiscard]] uint32_t ReceiverCount() const {
    return depth > 0 ? 1U : uint32_t{kItemReceivers};
  }

  // The child on the path to the part's element, seen from the path's element
  // that lies `level` levels below the receiver.
  [[nodiscard]] size_t ChildAt(uint32_t level) const {
    return part >> 2 * (Levels() - 1 - level) & 3;
  }

  // Whether the part reaches into a child of such an element.
  [[nodiscard]] bool Enters(uint32_t level, size_t child) const {
    return level >= Levels() || ChildAt(level) == child;
  }

  // Whether one of the item's receivers [first, first + count) is in the part.
  [[nodiscard]] bool Meets(uint32_t first, uint32_t count) const {
    return depth == 0 || (first < FirstReceiver() + ReceiverCount() &&
                          FirstReceiver() < first + count);
  }

  // Whether this part owns the links to an element `level` levels below the
  // receiver; the element lies on the path to the part's element, or below it.
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
