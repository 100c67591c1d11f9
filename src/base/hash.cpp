#include "base/hash.h"

#include <fmt/format.h>
#include <xxhash.h>

namespace enfilade {

uint64_t HashBytes(std::span<const std::byte> bytes, uint64_t seed) {
  return XXH3_64bits_withSeed(bytes.data(), bytes.size(), seed);
}

std::string HexDigits(uint64_t hash) {
  return fmt::format("{:016x}", hash);
}

}  // namespace enfilade
