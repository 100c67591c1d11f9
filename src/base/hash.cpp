#include "base/hash.h"

#include <new>

#include <fmt/format.h>
#include <xxhash.h>

namespace enfilade {

uint64_t HashBytes(std::span<const std::byte> bytes, uint64_t seed) {
  return XXH3_64bits_withSeed(bytes.data(), bytes.size(), seed);
}

StreamingHash::StreamingHash(uint64_t seed) : state_(XXH3_createState()) {
  if (state_ == nullptr) {
    throw std::bad_alloc();
  }
  XXH3_64bits_reset_withSeed(state_.get(), seed);
}

void StreamingHash::Add(std::span<const std::byte> bytes) {
  XXH3_64bits_update(state_.get(), bytes.data(), bytes.size());
}

uint64_t StreamingHash::Value() const {
  return XXH3_64bits_digest(state_.get());
}

void StreamingHash::FreeState::operator()(XXH3_state_s* state) const {
  XXH3_freeState(state);
}

std::string HexDigits(uint64_t hash) {
  return fmt::format("{:016x}", hash);
}

}  // namespace enfilade
