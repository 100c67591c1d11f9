// XXH3 hashes of bytes, for block checksums and digests.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace enfilade {

uint64_t HashBytes(std::span<const std::byte> bytes, uint64_t seed = 0);

// The 16 hex digits of a hash, lower case.
std::string HexDigits(uint64_t hash);

}  // namespace enfilade
