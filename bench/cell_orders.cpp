#include "bench/cell_orders.h"

#include "base/random.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <list>
#include <numeric>
#include <tuple>
#include <utility>

namespace enfilade {
namespace {

constexpr uint64_t kSeed = 1;
constexpr uint32_t kHilbertBits = 16;
constexpr int kMostPasses = 50;

// The index of a point along the Hilbert curve through a cube of 2^kHilbertBits
// points per side (Skilling 2004, "Programming the Hilbert curve").
uint64_t HilbertIndex(std::array<uint32_t, 3> x) {
  constexpr uint32_t kTop = 1U << (kHilbertBits - 1);
  for (uint32_t q = kTop; q > 1; q >>= 1) {
    for (uint32_t& axis : x) {
      if ((axis & q) != 0) {
        x[0] ^= q - 1;
      } else {
        const uint32_t t = (x[0] ^ axis) & (q - 1);
        x[0] ^= t;
        axis ^= t;
      }
    }
  }
  x[1] ^= x[0];
  x[2] ^= x[1];
  uint32_t t = 0;
  for (uint32_t q = kTop; q > 1; q >>= 1) {
    t ^= (x[2] & q) != 0 ? q - 1 : 0;
  }
  uint64_t index = 0;
  for (uint32_t q = kTop; q > 0; q >>= 1) {
    for (const uint32_t axis : x) {
      index = index << 1 | (((axis ^ t) & q) != 0 ? 1U : 0U);
    }
  }
  return index;
}

// A cache of cells that evicts the least recently used ones.
class RecentCache {
 public:
  RecentCache(const std::vector<OrderedCell>& cells, uint64_t capacity_bytes)
      : cells_(&cells),
        capacity_bytes_(capacity_bytes),
        has_(cells.size(), false) {}

  [[nodiscard]] bool Has(uint32_t cell) const { return has_[cell]; }

  void Use(uint32_t cell) {
    if (has_[cell]) {
      recent_.remove(cell);
    } else {
      bytes_ += (*cells_)[cell].bytes;
      has_[cell] = true;
    }
    recent_.push_front(cell);
    while (bytes_ > capacity_bytes_ && recent_.size() > 1) {
      bytes_ -= (*cells_)[recent_.back()].bytes;
      has_[recent_.back()] = false;
      recent_.pop_back();
    }
  }

 private:
  const std::vector<OrderedCell>* cells_;
  uint64_t capacity_bytes_;
  uint64_t bytes_ = 0;
  std::vector<bool> has_;
  std::list<uint32_t> recent_;
};

// distances[a][b]: bytes that only one of the two cells sees.
std::vector<std::vector<uint64_t>> Distances(
    const std::vector<OrderedCell>& cells) {
  const size_t n = cells.size();
  std::vector<uint64_t> all(n, 0);
  for (size_t a = 0; a < n; ++a) {
    for (const uint32_t c : cells[a].sees) {
      all[a] += cells[c].bytes;
    }
  }
  std::vector<std::vector<uint64_t>> distances(n, std::vector<uint64_t>(n, 0));
  std::vector<bool> seen(n, false);
  for (size_t a = 0; a < n; ++a) {
    for (const uint32_t c : cells[a].sees) {
      seen[c] = true;
    }
    for (size_t b = 0; b < n; ++b) {
      uint64_t common = 0;
      for (const uint32_t c : cells[b].sees) {
        common += seen[c] ? cells[c].bytes : 0;
      }
      distances[a][b] = all[a] + all[b] - 2 * common;
    }
    seen.assign(n, false);
  }
  return distances;
}

CellOrder NearestNeighbours(
    const std::vector<std::vector<uint64_t>>& distances) {
  CellOrder order = StoreOrder(distances.size());
  for (size_t i = 1; i < order.size(); ++i) {
    const auto& from = distances[order[i - 1]];
    const auto next =
        std::min_element(order.begin() + static_cast<std::ptrdiff_t>(i),
                         order.end(),
                         [&](uint32_t a, uint32_t b) {
                           return std::pair(from[a], a) < std::pair(from[b], b);
                         });
    std::swap(order[i], *next);
  }
  return order;
}

// Reverses the part of the path after `i` whose reversal shortens the path by
// the most. Returns false and changes nothing if no reversal shortens the path.
bool TurnAfter(size_t i,
               const std::vector<std::vector<uint64_t>>& distances,
               CellOrder* order) {
  const size_t n = order->size();
  // The distance of neighbours in the path; 0 after the last cell.
  const auto length = [&](size_t a, size_t b) -> uint64_t {
    return b < n ? distances[(*order)[a]][(*order)[b]] : 0;
  };
  size_t best = 0;
  uint64_t most = 0;
  for (size_t k = i + 2; k < n; ++k) {
    const uint64_t now = length(i, i + 1) + length(k, k + 1);
    const uint64_t turned = length(i, k) + length(i + 1, k + 1);
    if (turned < now && now - turned > most) {
      most = now - turned;
      best = k;
    }
  }
  if (most > 0) {
    std::reverse(order->begin() + static_cast<std::ptrdiff_t>(i + 1),
                 order->begin() + static_cast<std::ptrdiff_t>(best + 1));
  }
  return most > 0;
}

// Reverses parts of the path as long as the path gets shorter, in at most
// kMostPasses passes.
void TwoOpt(const std::vector<std::vector<uint64_t>>& distances,
            CellOrder* order) {
  bool is_shorter = true;
  for (int pass = 0; is_shorter && pass < kMostPasses; ++pass) {
    is_shorter = false;
    for (size_t i = 0; i + 2 < order->size(); ++i) {
      is_shorter |= TurnAfter(i, distances, order);
    }
  }
}

// The bytes of the cell's visible set that are in the cache, or minus the bytes
// that are not, by `rule`.
int64_t Gain(const std::vector<OrderedCell>& cells,
             const OrderedCell& cell,
             const RecentCache& cache,
             GreedyRule rule) {
  int64_t resident = 0;
  int64_t missing = 0;
  for (const uint32_t c : cell.sees) {
    (cache.Has(c) ? resident : missing) += static_cast<int64_t>(cells[c].bytes);
  }
  return rule == GreedyRule::kMostResident ? resident : -missing;
}

}  // namespace

CellOrder StoreOrder(size_t cells) {
  CellOrder order(cells);
  std::iota(order.begin(), order.end(), 0U);
  return order;
}

CellOrder RandomOrder(size_t cells) {
  CellOrder order = StoreOrder(cells);
  Random random(kSeed);
  for (size_t i = order.size(); i > 1; --i) {
    std::swap(order[i - 1], order[random.NextBelow(static_cast<uint32_t>(i))]);
  }
  return order;
}

CellOrder HilbertOrder(const std::vector<OrderedCell>& cells) {
  Box3 box;
  for (const OrderedCell& cell : cells) {
    box.Include(cell.centre);
  }
  const Vec3 size = box.high - box.low;
  const double side = std::max({size.x, size.y, size.z, 1e-9});
  const auto on_grid = [&](double distance) {
    constexpr double kLast = (1U << kHilbertBits) - 1;
    return static_cast<uint32_t>(distance / side * kLast);
  };
  std::vector<uint64_t> index;
  index.reserve(cells.size());
  for (const OrderedCell& cell : cells) {
    const Vec3 at = cell.centre - box.low;
    index.push_back(
        HilbertIndex({on_grid(at.x), on_grid(at.y), on_grid(at.z)}));
  }
  CellOrder order = StoreOrder(cells.size());
  std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return index[a] < index[b];
  });
  return order;
}

CellOrder CuthillMcKeeOrder(const std::vector<OrderedCell>& cells) {
  const auto fewer = [&](uint32_t a, uint32_t b) {
    return std::tuple(cells[a].sees.size(), a) <
           std::tuple(cells[b].sees.size(), b);
  };
  CellOrder starts = StoreOrder(cells.size());
  std::sort(starts.begin(), starts.end(), fewer);
  std::vector<bool> seen(cells.size(), false);
  CellOrder order;
  const auto append_new = [&](const std::vector<uint32_t>& of) {
    const auto old_size = static_cast<std::ptrdiff_t>(order.size());
    std::copy_if(
        of.begin(), of.end(), std::back_inserter(order), [&](uint32_t c) {
          return !seen[c];
        });
    std::sort(order.begin() + old_size, order.end(), fewer);
    for (const uint32_t c : of) {
      seen[c] = true;
    }
  };
  size_t next = 0;
  for (const uint32_t start : starts) {
    append_new({start});
    while (next < order.size()) {
      append_new(cells[order[next++]].sees);
    }
  }
  std::reverse(order.begin(), order.end());
  return order;
}

CellOrder GreedyOrder(const std::vector<OrderedCell>& cells,
                      uint64_t capacity_bytes,
                      GreedyRule rule) {
  RecentCache cache(cells, capacity_bytes);
  CellOrder left = StoreOrder(cells.size());
  CellOrder order;
  while (!left.empty()) {
    size_t best = 0;
    int64_t best_gain = std::numeric_limits<int64_t>::min();
    for (size_t i = 0; i < left.size(); ++i) {
      const int64_t gain = Gain(cells, cells[left[i]], cache, rule);
      if (gain > best_gain) {
        best_gain = gain;
        best = i;
      }
    }
    const uint32_t cell = left[best];
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(best));
    for (const uint32_t c : cells[cell].sees) {
      cache.Use(c);
    }
    order.push_back(cell);
  }
  return order;
}

CellOrder PathOrder(const std::vector<OrderedCell>& cells) {
  const auto distances = Distances(cells);
  CellOrder order = NearestNeighbours(distances);
  TwoOpt(distances, &order);
  return order;
}

CellOrder ShortenedOrder(const std::vector<OrderedCell>& cells,
                         CellOrder order) {
  TwoOpt(Distances(cells), &order);
  return order;
}

}  // namespace enfilade
