// Little-endian byte encoding for everything that is stored: fixed-width
// numbers, varints, strings and arrays of trivially copyable values. A reader
// that runs off its end throws DamagedStoreError and reads nothing.

#pragma once

#include "base/error.h"
#include "base/packed.h"

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace enfilade {

static_assert(std::endian::native == std::endian::little,
              "stored numbers are little-endian and copied as they are");

using Bytes = std::vector<std::byte>;

// Appends values to an owned buffer.
class ByteWriter {
 public:
  template <typename T>
  void Put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T> && kIsPacked<T>);
    PutRaw(&value, sizeof value);
  }

  // LEB128: seven bits a byte, low bits first.
  void PutVarint(uint64_t value) {
    while (value >= 0x80) {
      Put(static_cast<uint8_t>(value | 0x80));
      value >>= 7;
    }
    Put(static_cast<uint8_t>(value));
  }

  void PutString(std::string_view text) {
    PutVarint(text.size());
    PutRaw(text.data(), text.size());
  }

  // Writes the count, then the values.
  template <typename T>
  void PutArray(std::span<const T> values) {
    static_assert(std::is_trivially_copyable_v<T> && kIsPacked<T>);
    PutVarint(values.size());
    PutRaw(values.data(), values.size_bytes());
  }

  [[nodiscard]] size_t Size() const { return bytes_.size(); }

  [[nodiscard]] const Bytes& View() const { return bytes_; }

  [[nodiscard]] Bytes Take() { return std::move(bytes_); }

  void Clear() { bytes_.clear(); }

  // Reserves room for `bytes` in all, so that growing does not double it.
  void Reserve(size_t bytes) { bytes_.reserve(bytes); }

 private:
  void PutRaw(const void* data, size_t size) {
    const auto* first = static_cast<const std::byte*>(data);
    bytes_.insert(bytes_.end(), first, first + size);
  }

  Bytes bytes_;
};

// Reads what ByteWriter wrote. Borrows the bytes.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <typename T>
  T Get() {
    static_assert(std::is_trivially_copyable_v<T>);
    T value{};
    std::memcpy(&value, Take(sizeof value).data(), sizeof value);
    return value;
  }

  uint64_t GetVarint() {
    uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      const auto byte = Get<uint8_t>();
      value |= static_cast<uint64_t>(byte & 0x7f) << shift;
      if ((byte & 0x80) == 0) {
        return value;
      }
    }
    throw DamagedStoreError("a number in it is longer than 64 bits");
  }

  // The number of things that follow, of at least `bytes_each` bytes: room can
  // be made for them, because no more are counted than there are bytes for.
  uint64_t GetCount(uint64_t bytes_each) {
    const uint64_t count = GetVarint();
    if (count > Remaining() / bytes_each) {
      throw DamagedStoreError("a list in it is longer than all of it");
    }
    return count;
  }

  std::string GetString() {
    const auto raw = Take(GetVarint());
    std::string text(raw.size(), '\0');
    if (!raw.empty()) {
      std::memcpy(text.data(), raw.data(), raw.size());
    }
    return text;
  }

  template <typename T>
  std::vector<T> GetArray() {
    static_assert(std::is_trivially_copyable_v<T>);
    const uint64_t count = GetCount(sizeof(T));
    std::vector<T> values(count);
    const auto raw = Take(count * sizeof(T));
    if (count > 0) {
      std::memcpy(values.data(), raw.data(), raw.size());
    }
    return values;
  }

  [[nodiscard]] size_t Remaining() const { return bytes_.size(); }

  [[nodiscard]] bool AtEnd() const { return bytes_.empty(); }

  // The bytes that are left, which count as read.
  std::span<const std::byte> TakeRest() { return Take(bytes_.size()); }

  // Throws DamagedStoreError if there is more to read.
  void RequireEnd() const {
    if (!AtEnd()) {
      throw DamagedStoreError("it goes on behind its end");
    }
  }

 private:
  std::span<const std::byte> Take(uint64_t size) {
    if (size > bytes_.size()) {
      throw DamagedStoreError("it ends too early");
    }
    const auto taken = bytes_.first(static_cast<size_t>(size));
    bytes_ = bytes_.subspan(static_cast<size_t>(size));
    return taken;
  }

  std::span<const std::byte> bytes_;
};

}  // namespace enfilade
