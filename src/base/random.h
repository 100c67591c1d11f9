// Counter-based random numbers: a value is a pure function of what it samples
// (a key such as a link or a path, and a counter), never of a thread, the time
// or the order of the work. Mixing: the finaliser of MurmurHash3 in Stafford's
// variant 13, applied twice over key and counter.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace enfilade {

constexpr uint64_t MixBits(uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

// Folds another word into a key, given MixBits of the word.
constexpr uint64_t MixKeyWithMixed(uint64_t key, uint64_t mixed_word) {
  return MixBits(key + 0x9e3779b97f4a7c15ULL + mixed_word);
}

// Folds another word into a key.
constexpr uint64_t MixKey(uint64_t key, uint64_t word) {
  return MixKeyWithMixed(key, MixBits(word));
}

// MixBits of the first counters, which suffice for most streams.
inline constexpr auto kMixedCounters = [] {
  std::array<uint64_t, 256> mixed{};
  for (size_t i = 0; i < mixed.size(); ++i) {
    mixed[i] = MixBits(i);
  }
  return mixed;
}();

// The stream of random numbers that belongs to one key.
class Random {
 public:
  explicit constexpr Random(uint64_t key) : key_(key) {}

  // MixKey of the key and the counter.
  constexpr uint64_t NextBits() {
    const uint64_t word = counter_ < kMixedCounters.size()
                              ? kMixedCounters[counter_]
                              : MixBits(counter_);
    ++counter_;
    return MixKeyWithMixed(key_, word);
  }

  // Uniform in [0, 1), 53 bits.
  constexpr double Next() {
    return static_cast<double>(NextBits() >> 11) * 0x1.0p-53;
  }

  // Two at once, uniform in [0, 1), 24 bits each.
  constexpr std::array<float, 2> NextTwo() {
    const uint64_t bits = NextBits();
    const auto first = static_cast<int32_t>(bits >> 40);
    const auto second = static_cast<int32_t>(bits >> 16 & 0xffffff);
    return {static_cast<float>(first) * 0x1.0p-24F,
            static_cast<float>(second) * 0x1.0p-24F};
  }

  // Uniform in {0, ..., count - 1}; requires 0 < count < 2^32.
  constexpr uint32_t NextBelow(uint32_t count) {
    return static_cast<uint32_t>(((NextBits() >> 32) * count) >> 32);
  }

 private:
  uint64_t key_;
  uint64_t counter_ = 0;
};

}  // namespace enfilade
