#include "base/hash.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

// The hash of the parts is that of the whole, so that digests of existing
// stores stay valid.
TEST(StreamingHash, OfPartsIsThatOfTheWhole) {
  std::vector<std::byte> bytes(1000);
  for (size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<std::byte>(i * 7);
  }
  const std::span<const std::byte> all(bytes);
  for (const uint64_t seed : {uint64_t{0}, uint64_t{5}}) {
    for (const size_t part : {1U, 4U, 300U, 1000U}) {
      StreamingHash hash(seed);
      for (size_t i = 0; i < all.size(); i += part) {
        hash.Add(all.subspan(i, std::min(part, all.size() - i)));
      }
      EXPECT_EQ(hash.Value(), HashBytes(all, seed)) << part;
    }
  }
}

}  // namespace
}  // namespace enfilade
