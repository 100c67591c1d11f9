// The memory cap of the process, and the count of what grows with the model.
//
// The cap bounds the peak resident size of the whole process. A fixed part of
// it (code, libraries, thread stacks, the catalogue's page cache) does not grow
// with the model; the rest is the budget, out of which every owner of growing
// memory charges its bytes before it allocates them.

#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

namespace enfilade {

// Empties a vector and frees its memory. clear() and `= {}` keep the capacity:
// the latter assigns an empty initializer list.
template <typename T>
void FreeVector(std::vector<T>* vector) {
  std::vector<T>().swap(*vector);
}

// About how many bytes the allocator adds to an array of moderate size, because
// it rounds sizes up.
inline constexpr uint64_t kAllocationHeaderBytes = 16;

// Current and peak resident size of this process in bytes.
uint64_t ResidentBytes();
uint64_t PeakResidentBytes();

// Gives freed memory back to the system. Until this call the allocator keeps
// it; a charge that would bring the process near its cap makes the call too.
void ReleaseFreedMemory();

// Gives the resident pages of the program's and its libraries' code back to the
// system. Pages that are still needed come back by themselves, from the page
// cache.
void ReleaseCode();

// How many bytes the allocator takes for an array of `bytes`.
uint64_t AllocatedBytes(uint64_t bytes);

// The freed bytes that the allocator keeps; it serves later allocations from
// them before it takes more from the system.
uint64_t FreedBytes();

// A byte count with a limit. Thread-safe.
class MemoryBudget {
 public:
  // `limit_bytes` is what may be charged in all. `share` is this budget's part
  // of the process's budget, so that a DoesNotFitError can name a cap for the
  // whole process.
  explicit MemoryBudget(uint64_t limit_bytes, double share = 1)
      : limit_bytes_(limit_bytes), share_(share) {}

  // Sets how many threads the process works with (default: two), each of which
  // takes some memory that is not charged. Call it before a budget is made.
  static void SetThreads(uint64_t threads);

  // The budget under a cap: the cap less the fixed part of the process and a
  // thirty-second of the rest, for the allocator.
  // Throws DoesNotFitError, naming the least cap, if nothing would be left.
  static uint64_t BudgetUnderCap(uint64_t cap_bytes);

  // The least cap, in whole MiB, that leaves a budget of `budget_bytes`.
  static uint64_t CapForBudget(uint64_t budget_bytes);

  [[nodiscard]] uint64_t LimitBytes() const { return limit_bytes_; }

  // False if the limit is so large that it stands for no limit.
  [[nodiscard]] bool IsLimited() const {
    return limit_bytes_ < std::numeric_limits<uint64_t>::max() / 2;
  }

  [[nodiscard]] uint64_t UsedBytes() const { return used_bytes_.load(); }

  [[nodiscard]] uint64_t PeakBytes() const { return peak_bytes_.load(); }

  [[nodiscard]] uint64_t FreeBytes() const {
    const uint64_t used = UsedBytes();
    return used < limit_bytes_ ? limit_bytes_ - used : 0;
  }

  // By how many bytes the process is too near the cap: by its resident size,
  // since nobody charges the allocator's slack, plus the part of `coming_bytes`
  // that does not fit into freed memory.
  [[nodiscard]] uint64_t ResidentExcess(uint64_t coming_bytes = 0) const;

  // ResidentExcess as it would be if all freed memory were given back.
  [[nodiscard]] uint64_t InUseExcess(uint64_t coming_bytes = 0) const;

  // The resident bytes beyond the fixed part and all charges; 0 without a
  // limit.
  [[nodiscard]] uint64_t ResidentBeyondCharges() const;

  // Charges the bytes if they fit; otherwise changes nothing, returns false.
  [[nodiscard]] bool TryCharge(uint64_t bytes);

  // Charges the bytes, or throws DoesNotFitError. The error names `what`, the
  // bytes that are missing, and a cap to go on with, which also leaves room for
  // `coming_bytes`, the charges that are foreseen.
  void Charge(uint64_t bytes, std::string_view what, uint64_t coming_bytes = 0);

  void Release(uint64_t bytes) { used_bytes_.fetch_sub(bytes); }

 private:
  [[nodiscard]] uint64_t MostResident() const;
  void GiveBackNearTheCap(uint64_t coming_bytes);

  uint64_t limit_bytes_;
  double share_;
  std::atomic<uint64_t> used_bytes_{0};
  std::atomic<uint64_t> peak_bytes_{0};
  std::atomic<uint64_t> unlooked_bytes_{0};  // charged since the last look
};

// About how many bytes will follow `bytes` if these are `share` of all, for
// example the share of a file that was read; 0 if the share tells nothing.
uint64_t ComingBytes(uint64_t bytes, double share);

// A charge that its destructor releases. The budget must outlive the charge.
class MemoryCharge {
 public:
  MemoryCharge() = default;

  MemoryCharge(MemoryBudget& budget,
               uint64_t bytes,
               std::string_view what,
               uint64_t coming_bytes = 0)
      : budget_(&budget), bytes_(bytes) {
    budget.Charge(bytes, what, coming_bytes);
  }

  // Nullopt if the bytes do not fit.
  static std::optional<MemoryCharge> IfItFits(MemoryBudget& budget,
                                              uint64_t bytes) {
    if (!budget.TryCharge(bytes)) {
      return std::nullopt;
    }
    MemoryCharge charge;
    charge.budget_ = &budget;
    charge.bytes_ = bytes;
    return charge;
  }

  MemoryCharge(MemoryCharge&& other) noexcept
      : budget_(std::exchange(other.budget_, nullptr)),
        bytes_(std::exchange(other.bytes_, 0)) {}

  MemoryCharge& operator=(MemoryCharge&& other) noexcept {
    if (this != &other) {
      Reset();
      budget_ = std::exchange(other.budget_, nullptr);
      bytes_ = std::exchange(other.bytes_, 0);
    }
    return *this;
  }

  MemoryCharge(const MemoryCharge&) = delete;
  MemoryCharge& operator=(const MemoryCharge&) = delete;

  ~MemoryCharge() { Reset(); }

  void Reset() {
    if (budget_ != nullptr) {
      budget_->Release(bytes_);
    }
    budget_ = nullptr;
    bytes_ = 0;
  }

  // Releases what exceeds `bytes`, after the memory charged for has shrunk.
  void ShrinkTo(uint64_t bytes) {
    if (bytes < bytes_) {
      budget_->Release(bytes_ - bytes);
      bytes_ = bytes;
    }
  }

  [[nodiscard]] uint64_t Bytes() const { return bytes_; }

 private:
  MemoryBudget* budget_ = nullptr;
  uint64_t bytes_ = 0;
};

// A charge that grows with the memory it stands for. The budget must outlive
// the charge.
class GrowingCharge {
 public:
  GrowingCharge(MemoryBudget& budget, std::string_view what)
      : budget_(&budget), what_(what) {}

  ~GrowingCharge() { budget_->Release(bytes_); }

  GrowingCharge(const GrowingCharge&) = delete;
  GrowingCharge& operator=(const GrowingCharge&) = delete;

  // Throws DoesNotFitError and leaves the charge unchanged if the bytes do not
  // fit. `share`: about which part of the final size `bytes` is.
  void GrowTo(uint64_t bytes, double share = 1) {
    if (bytes > bytes_) {
      budget_->Charge(bytes - bytes_, what_, ComingBytes(bytes, share));
      bytes_ = bytes;
    }
  }

  void ShrinkTo(uint64_t bytes) {
    if (bytes < bytes_) {
      budget_->Release(bytes_ - bytes);
      bytes_ = bytes;
    }
  }

 private:
  MemoryBudget* budget_;
  std::string_view what_;
  uint64_t bytes_ = 0;
};

}  // namespace enfilade
