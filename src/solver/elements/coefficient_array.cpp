#include "solver/elements/coefficient_array.h"

#include "base/memory.h"
#include "base/parallel.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace enfilade {
void CoefficientArray::GrowTo(size_t elements) {
  while (size_ < elements) {
    if (size_ % kPageElements == 0) {
      pages_.emplace_back();
    }
    const size_t used = size_ % kPageElements;
    const size_t here = std::min(kPageElements, used + elements - size_);
    std::vector<float>& page = pages_.back();
    if (page.capacity() < here * stride_) {
      // The last page grows by doubling; at most one page is ever copied.
      page.reserve(std::min(kPageElements, std::max(here, 2 * used)) * stride_);
    }
    page.resize(here * stride_, 0.0F);
    size_ += here - used;
  }
}

void CoefficientArray::Clear() {
  FreeVector(&pages_);
  size_ = 0;
}

uint64_t CoefficientArray::SizeBytes() const {
  uint64_t bytes = 0;
  for (const auto& page : pages_) {
    bytes += AllocatedBytes(page.capacity() * sizeof(float));
  }
  return bytes;
}

void CoefficientArray::SetZero() {
  for (auto& page : pages_) {
    std::fill(page.begin(), page.end(), 0.0F);
  }
}

void CoefficientArray::Add(const CoefficientArray& other) {
  ParallelFor(pages_.size(), [&](size_t p) {
    for (size_t i = 0; i < pages_[p].size(); ++i) {
      pages_[p][i] += other.pages_[p][i];
    }
  });
}

void CoefficientArray::Subtract(const CoefficientArray& other) {
  ParallelFor(pages_.size(), [&](size_t p) {
    for (size_t i = 0; i < pages_[p].size(); ++i) {
      pages_[p][i] -= other.pages_[p][i];
    }
  });
}

void CoefficientArray::Blend(float a, const CoefficientArray& other, float b) {
  ParallelFor(pages_.size(), [&](size_t p) {
    for (size_t i = 0; i < pages_[p].size(); ++i) {
      pages_[p][i] = a * other.pages_[p][i] + b * pages_[p][i];
    }
  });
}

float CoefficientArray::MaxAbs() const {
  float largest = 0;
  for (const auto& page : pages_) {
    for (const float v : page) {
      largest = std::max(largest, std::abs(v));
    }
  }
  return largest;
}

bool CoefficientArray::IsFinite() const {
  return std::all_of(pages_.begin(), pages_.end(), [](const auto& page) {
    return std::all_of(
        page.begin(), page.end(), [](float v) { return std::isfinite(v); });
  });
}

void PutShuffled(std::span<const float> values, ByteWriter* out) {
  std::vector<uint8_t> bytes(values.size() * sizeof(float));
  for (size_t i = 0; i < values.size(); ++i) {
    const auto bits = std::bit_cast<uint32_t>(values[i]);
    for (size_t k = 0; k < sizeof(float); ++k) {
      bytes[k * values.size() + i] = static_cast<uint8_t>(bits >> (8 * k));
    }
  }
  out->PutArray(std::span<const uint8_t>(bytes));
}

void GetShuffled(ByteReader* in, std::span<float> values) {
  const auto bytes = in->GetArray<uint8_t>();
  const size_t count = values.size();
  if (bytes.size() != count * sizeof(float)) {
    throw DamagedStoreError("it has the wrong number of values");
  }
  for (size_t i = 0; i < count; ++i) {
    uint32_t bits = 0;
    for (size_t k = 0; k < sizeof(float); ++k) {
      bits |= static_cast<uint32_t>(bytes[k * count + i]) << (8 * k);
    }
    values[i] = std::bit_cast<float>(bits);
  }
}

}  // namespace enfilade
