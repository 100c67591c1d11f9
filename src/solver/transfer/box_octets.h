// Boxes in a tree with eight children per node. The children's boxes lie side
// by side, so that a query tests all eight at once.

#pragma once

#include "solver/elements/geometry.h"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace enfilade {

// The points p with normal . p > offset.
struct HalfSpace {
  Vec3f normal;  // of any length
  float offset = 0;
};

// The half-space in the direction of `normal` that holds no point within
// `bounds` with normal . p <= offset, however these numbers were rounded. Nor
// does a box that reaches beyond `bounds` lie in it for rounding: the rounded
// sum never falls as a coordinate moves along the normal.
HalfSpace HalfSpaceBeyond(Vec3f normal, float offset, const Box& bounds);

// Eight boxes. A box that is not set overlaps nothing within Box::kFar.
struct BoxOctet {
  static constexpr size_t kCount = 8;
  using Lanes = std::array<float, kCount>;
  static constexpr std::array<uint32_t, kCount> kBits = {
      1, 2, 4, 8, 16, 32, 64, 128};

  std::array<Lanes, 3> low{};  // by axis
  std::array<Lanes, 3> high{};

  BoxOctet();

  void Set(size_t i, const Box& box);

  // Bit i of the result: box i overlaps `box`.
  [[nodiscard]] uint32_t Overlapping(const Box& box) const {
    uint32_t bits = 0;
    for (size_t i = 0; i < kCount; ++i) {  // becomes vector code
      bits |= kBits[i] & (low[0][i] <= box.high.x ? ~0U : 0U) &
              (box.low.x <= high[0][i] ? ~0U : 0U) &
              (low[1][i] <= box.high.y ? ~0U : 0U) &
              (box.low.y <= high[1][i] ? ~0U : 0U) &
              (low[2][i] <= box.high.z ? ~0U : 0U) &
              (box.low.z <= high[2][i] ? ~0U : 0U);
    }
    return bits;
  }

  // Bit i of the result: box i lies wholly in one of the half-spaces.
  [[nodiscard]] uint32_t WithinAny(std::span<const HalfSpace> spaces) const {
    // How far boxes lie beyond a border, at most.
    Four first_half{};
    Four second_half{};
    for (const HalfSpace& beyond : spaces) {
      const Vec3f n = beyond.normal;
      // Of the corner that lies least far beyond.
      const Lanes& x = n.x > 0 ? low[0] : high[0];
      const Lanes& y = n.y > 0 ? low[1] : high[1];
      const Lanes& z = n.z > 0 ? low[2] : high[2];
      const auto deepen = [&](size_t first, Four* farthest) {
        const Four reach = n.x * FourOf(x, first) + n.y * FourOf(y, first) +
                           n.z * FourOf(z, first) - beyond.offset;
        *farthest = reach > *farthest ? reach : *farthest;
      };
      deepen(0, &first_half);
      deepen(kCount / 2, &second_half);
    }
    return BitsOf(first_half > 0) | BitsOf(second_half > 0) << kCount / 2;
  }

 private:
  // Four lanes as one vector. The compiler unrolls a plain loop over lanes
  // within a loop over half-spaces, and then makes no vector code of it.
  using Four [[gnu::vector_size(kCount / 2 * sizeof(float))]] = float;
  using FourBits [[gnu::vector_size(kCount / 2 * sizeof(float))]] = int32_t;

  static Four FourOf(const Lanes& lanes, size_t first) {
    Four four;
    std::memcpy(&four, &lanes[first], sizeof(four));
    return four;
  }

  // Bit i of the result: lane i is set.
  static uint32_t BitsOf(FourBits lanes) {
    lanes &= FourBits{1, 2, 4, 8};
    return static_cast<uint32_t>(lanes[0] | lanes[1] | lanes[2] | lanes[3]);
  }
};

// A tree over boxes that are given in spatial order, neighbours together.
class BoxOctets {
 public:
  explicit BoxOctets(std::span<const Box> boxes);

  // Calls visit(i) for each box that `reaches` selects, until a call returns
  // false; returns whether none did. reaches(octet) returns one bit per box of
  // an octet, and may set too many bits.
  template <typename Reaches, typename Visit>
  bool VisitAll(const Reaches& reaches, const Visit& visit) const {
    return levels_.empty() || VisitNode(levels_.size() - 1, 0, reaches, visit);
  }

  [[nodiscard]] uint64_t SizeBytes() const;

  // What SizeBytes() of a tree of so many boxes will be.
  static uint64_t BytesFor(size_t boxes);

 private:
  // The octets of one level. They hold boxes at level 0, and the unions of the
  // octets of the level below otherwise.
  struct Level {
    size_t first = 0;  // index of the level's first octet
    size_t count = 0;  // boxes or unions in the level's octets
  };

  template <typename Reaches, typename Visit>
  bool VisitNode(size_t level,
                 size_t node,
                 const Reaches& reaches,
                 const Visit& visit) const {
    const Level& of = levels_[level];
    const size_t first = BoxOctet::kCount * node;
    uint32_t bits = reaches(octets_[of.first + node]);
    if (of.count - first < BoxOctet::kCount) {
      bits &= (1U << (of.count - first)) - 1;
    }
    for (; bits != 0; bits &= bits - 1) {
      const size_t i = first + static_cast<size_t>(std::countr_zero(bits));
      if (level == 0 ? !visit(i) : !VisitNode(level - 1, i, reaches, visit)) {
        return false;
      }
    }
    return true;
  }

  std::vector<BoxOctet> octets_;
  std::vector<Level> levels_;  // the root's last
};

}  // namespace enfilade
