// A vector in pages: growing never moves or doubles full pages, so that it
// takes no memory beyond the page being filled.

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

template <typename T>
class PagedVector {
 public:
  static constexpr size_t kPageItems = 4096;

  [[nodiscard]] size_t Size() const { return size_; }

  T& operator[](size_t i) { return pages_[i / kPageItems][i % kPageItems]; }

  const T& operator[](size_t i) const {
    return pages_[i / kPageItems][i % kPageItems];
  }

  void PushBack(const T& item) {
    const size_t used = size_ % kPageItems;
    if (used == 0) {
      pages_.emplace_back();
    }
    std::vector<T>& page = pages_.back();
    if (page.capacity() == used) {
      page.reserve(std::clamp(2 * used, kLeastReserved, kPageItems));
    }
    page.push_back(item);
    ++size_;
  }

  // Appends default items.
  void GrowTo(size_t items) {
    while (size_ < items) {
      PushBack({});
    }
  }

  [[nodiscard]] size_t PageCount() const { return pages_.size(); }

  // The items of a page: kPageItems, or fewer on the last page.
  [[nodiscard]] std::span<const T> Page(size_t page) const {
    return pages_[page];
  }

  [[nodiscard]] uint64_t SizeBytes() const {
    uint64_t bytes = pages_.capacity() * sizeof(std::vector<T>);
    for (const auto& page : pages_) {
      bytes += page.capacity() * sizeof(T);
    }
    return bytes;
  }

 private:
  static constexpr size_t kLeastReserved = 16;

  size_t size_ = 0;
  std::vector<std::vector<T>> pages_;
};

}  // namespace enfilade
