// Coefficients of the elements of a cell: a fixed number of floats per element,
// stored in pages so that growing neither moves nor doubles existing data.

#pragma once

#include "base/bytes.h"
#include "base/ids.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

class CoefficientArray {
 public:
  // Elements per page, and per stored part of a tree.
  static constexpr size_t kPageElements = 4096;

  // `stride`: floats per element, more than 0.
  explicit CoefficientArray(size_t stride) : stride_(stride) {}

  // Appends elements of zeros.
  void GrowTo(size_t elements);

  // Removes all elements and frees their memory.
  void Clear();

  [[nodiscard]] size_t Size() const { return size_; }

  [[nodiscard]] size_t Stride() const { return stride_; }

  [[nodiscard]] uint64_t SizeBytes() const;

  // The bytes that an array of so many elements takes.
  static uint64_t BytesFor(size_t elements, size_t stride) {
    return elements * stride * sizeof(float);
  }

  float* At(size_t element) {
    return &pages_[element / kPageElements][element % kPageElements * stride_];
  }

  [[nodiscard]] const float* At(size_t element) const {
    return &pages_[element / kPageElements][element % kPageElements * stride_];
  }

  std::span<float> operator[](ElementId e) { return {At(e.Index()), stride_}; }

  std::span<const float> operator[](ElementId e) const {
    return {At(e.Index()), stride_};
  }

  // The values of a page in order, for operations that treat all elements
  // alike.
  [[nodiscard]] size_t PageCount() const { return pages_.size(); }

  std::span<float> Page(size_t i) { return pages_[i]; }

  [[nodiscard]] std::span<const float> Page(size_t i) const {
    return pages_[i];
  }

  void SetZero();
  // Requires arrays of the same size and stride.
  void Add(const CoefficientArray& other);
  void Subtract(const CoefficientArray& other);

  // this = a * other + b * this.
  void Blend(float a, const CoefficientArray& other, float b);

  // The largest absolute value; 0 for an empty array.
  [[nodiscard]] float MaxAbs() const;
  [[nodiscard]] bool IsFinite() const;

 private:
  size_t stride_;
  size_t size_ = 0;
  std::vector<std::vector<float>> pages_;
};

// Writes floats with their bytes grouped by significance, which compresses
// well.
void PutShuffled(std::span<const float> values, ByteWriter* out);

// Reads `values`; throws DamagedStoreError if their number differs.
void GetShuffled(ByteReader* in, std::span<float> values);

}  // namespace enfilade
