// XXH3 hashes of bytes, for block checksums and digests.

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

// NOLINTNEXTLINE(readability-identifier-naming): the library's
struct XXH3_state_s;

namespace enfilade {

uint64_t HashBytes(std::span<const std::byte> bytes, uint64_t seed = 0);

// Hashes bytes that come in parts; the parts' borders do not change the hash.
class StreamingHash {
 public:
  explicit StreamingHash(uint64_t seed = 0);

  void Add(std::span<const std::byte> bytes);
  [[nodiscard]] uint64_t Value() const;

 private:
  struct FreeState {
    void operator()(XXH3_state_s* state) const;
  };

  std::unique_ptr<XXH3_state_s, FreeState> state_;
};

// The 16 hex digits of a hash, lower case.
std::string HexDigits(uint64_t hash);

}  // namespace enfilade
