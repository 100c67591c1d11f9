#include "base/bytes.h"

#include "base/error.h"
#include "base/vec.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

Bytes SampleBytes() {
  ByteWriter writer;
  writer.Put(uint16_t{0x1234});
  writer.PutVarint(300);
  writer.PutString("Flur");
  writer.PutArray(std::span<const double>(std::vector<double>{1.5, -2.0}));
  return writer.Take();
}

void ReadSample(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  EXPECT_EQ(reader.Get<uint16_t>(), 0x1234);
  EXPECT_EQ(reader.GetVarint(), 300U);
  EXPECT_EQ(reader.GetString(), "Flur");
  EXPECT_EQ(reader.GetArray<double>(), (std::vector<double>{1.5, -2.0}));
  EXPECT_TRUE(reader.AtEnd());
}

// A type with padding cannot be written: it is not packed.
struct Padded {
  uint32_t a = 0;
  uint64_t b = 0;
};

static_assert(kIsPacked<uint64_t> && kIsPacked<double> &&
              kIsPacked<std::array<float, 3>> && kIsPacked<Box3>);
static_assert(!kIsPacked<Padded> && !kIsPacked<std::array<Padded, 2>>);

TEST(Bytes, ReadersReturnWhatWasWritten) {
  ReadSample(SampleBytes());
}

TEST(Bytes, EveryTruncatedPrefixIsDamaged) {
  const Bytes bytes = SampleBytes();
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_THROW(ReadSample(std::span(bytes).first(size)), DamagedStoreError)
        << size << " bytes";
  }
}

TEST(Bytes, VarintsOfAllLengthsComeBack) {
  for (int bit = 0; bit < 64; ++bit) {
    for (const uint64_t offset : {uint64_t{0}, uint64_t{1}}) {
      const uint64_t value = (uint64_t{1} << bit) - offset;
      ByteWriter writer;
      writer.PutVarint(value);
      EXPECT_LE(writer.Size(), 10U);
      EXPECT_EQ(ByteReader(writer.View()).GetVarint(), value);
    }
  }
}

TEST(Bytes, ImpossibleArrayLengthIsDamagedBeforeItIsAllocated) {
  ByteWriter writer;
  writer.PutVarint(std::numeric_limits<uint64_t>::max());
  EXPECT_THROW(ByteReader(writer.View()).GetArray<double>(), DamagedStoreError);
}

TEST(Bytes, CountsAreBoundedByTheBytesThatAreLeft) {
  ByteWriter writer;
  writer.PutVarint(3);
  for (uint8_t i = 0; i < 7; ++i) {
    writer.Put(i);
  }
  EXPECT_EQ(ByteReader(writer.View()).GetCount(2), 3U);
  EXPECT_THROW(ByteReader(writer.View()).GetCount(3), DamagedStoreError);
}

}  // namespace
}  // namespace enfilade
