#include "base/memory.h"

#include "base/error.h"

#include <algorithm>
#include <cstdio>
#include <limits>

#include <fmt/format.h>
#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

namespace enfilade {
namespace {

// Resident size of the program before it has read any model: measured at
// 14 MiB with Embree's device and scenes, oneTBB on two threads and an SQLite
// store with its page cache (`solve -v` of a small scene tells peak and
// budget), plus 7 MiB for stacks of more threads and the allocator's slack.
constexpr uint64_t kFixedBytes = 21ULL << 20;
// Of the rest, one part in so many is left to the allocator, whose slack grows
// with what it holds: blocks that are mapped of their own end in a page that is
// hardly used, which is one part in 48 of an M2 tree's pages. Duplex took
// 255.97 MiB of a cap of 256M when this was 100, and a townhouse of thirty
// million links a few pages more than that when it was 40.
constexpr uint64_t kSlackParts = 32;
// Who asks for more will need yet more later: the cap to go on with is named
// with one part in so many on top.
constexpr uint64_t kMoreParts = 4;
constexpr uint64_t kLeastBudgetBytes = 8ULL << 20;
// Room that the resident size should leave below the cap: some, and one part in
// so many of the budget. What takes it between two looks is charged: links on
// their way to the store, pages of SQLite.
constexpr uint64_t kLeastResidentSlack = 3ULL << 20;
constexpr uint64_t kMostResidentSlack = 12ULL << 20;
constexpr uint64_t kResidentSlackParts = 12;

// The cap that leaves a budget of so many bytes.
uint64_t CapOf(uint64_t budget_bytes) {
  return kFixedBytes + budget_bytes + budget_bytes / (kSlackParts - 1) + 1;
}

}  // namespace

uint64_t ResidentBytes() {
  std::FILE* file = std::fopen("/proc/self/statm", "r");
  if (file == nullptr) {
    return 0;
  }
  unsigned long long size_pages = 0;
  unsigned long long resident_pages = 0;
  const int fields =
      std::fscanf(file, "%llu %llu", &size_pages, &resident_pages);
  std::fclose(file);
  return fields == 2
             ? resident_pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE))
             : 0;
}

uint64_t PeakResidentBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<uint64_t>(usage.ru_maxrss) * 1024;
}

void ReleaseFreedMemory() {
  malloc_trim(0);
}

uint64_t MemoryBudget::ResidentExcess(uint64_t coming_bytes) const {
  if (!IsLimited()) {
    return 0;
  }
  const uint64_t slack =
      std::min(kLeastResidentSlack + limit_bytes_ / kResidentSlackParts,
               kMostResidentSlack);
  const uint64_t resident = ResidentBytes() + coming_bytes + slack;
  const uint64_t cap = CapOf(limit_bytes_);
  return resident > cap ? resident - cap : 0;
}

uint64_t MemoryBudget::ResidentBeyondCharges() const {
  const uint64_t counted = kFixedBytes + UsedBytes();
  const uint64_t resident = IsLimited() ? ResidentBytes() : 0;
  return resident > counted ? resident - counted : 0;
}

uint64_t MemoryBudget::BudgetUnderCap(uint64_t cap_bytes) {
  const uint64_t least = CapForBudget(0);
  if (cap_bytes < least) {
    throw DoesNotFitError(
        fmt::format("--memory {}M is less than the program itself needs; the "
                    "least cap for any scene is {}M",
                    cap_bytes >> 20,
                    least >> 20));
  }
  const uint64_t rest = cap_bytes - kFixedBytes;
  return rest - rest / kSlackParts;
}

uint64_t MemoryBudget::CapForBudget(uint64_t budget_bytes) {
  constexpr uint64_t kMiB = 1 << 20;
  const uint64_t cap = CapOf(std::max(budget_bytes, kLeastBudgetBytes));
  return (cap + kMiB - 1) / kMiB * kMiB;
}

bool MemoryBudget::TryCharge(uint64_t bytes) {
  uint64_t used = used_bytes_.load();
  do {
    if (bytes > limit_bytes_ || used > limit_bytes_ - bytes) {
      return false;
    }
  } while (!used_bytes_.compare_exchange_weak(used, used + bytes));
  uint64_t peak = peak_bytes_.load();
  while (peak < used + bytes &&
         !peak_bytes_.compare_exchange_weak(peak, used + bytes)) {
  }
  if (used + bytes > limit_bytes_ / 2 && once_half_is_used_ != nullptr) {
    if (auto* call = once_half_is_used_.exchange(nullptr)) {
      call();
    }
  }
  return true;
}

void MemoryBudget::Charge(uint64_t bytes, std::string_view what) {
  if (!TryCharge(bytes)) {
    const auto now = static_cast<uint64_t>(
        static_cast<double>(UsedBytes() + bytes) / share_);
    const uint64_t enough = CapForBudget(now + now / kMoreParts);
    throw DoesNotFitError(fmt::format(
        "no room for {}: {:.1f} MiB more than the memory cap "
        "leaves; run again with --memory {}M",
        what,
        static_cast<double>(bytes - std::min(bytes, FreeBytes())) / (1 << 20),
        enough >> 20));
  }
}

}  // namespace enfilade
