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

// Empties a vector and gives its memory back, which neither clear() nor `= {}`
// does: that assigns an empty list and keeps the capacity.
template <typename T>
void FreeVector(std::vector<T>* vector) {
  std::vector<T>().swap(*vector);
}

// What the allocator takes beside an array of moderate size, about: it rounds
// sizes up.
inline constexpr uint64_t kAllocationHeaderBytes = 16;

// Current and peak resident size of this process in bytes.
uint64_t ResidentBytes();
uint64_t PeakResidentBytes();

// Gives the allocator's free memory back to the system: it keeps what is freed
// until then, or until a charge would bring the process near its cap.
void ReleaseFreedMemory();

// Gives what is in memory of the program's and its libraries' code back to the
// system. What is still needed comes again by itself, from the page cache.
void ReleaseCode();

// What the allocator takes for an array of so many bytes.
uint64_t AllocatedBytes(uint64_t bytes);

// What the allocator keeps of what was freed: for what comes next, it takes no
// more from the system.
uint64_t FreedBytes();

// A byte count with a limit. Thread-safe.
class MemoryBudget {
 public:
  // `limit_bytes` is what may be charged in all. `share`: this budget's part of
  // the process's budget, so that refusals can name a cap for the whole.
  explicit MemoryBudget(uint64_t limit_bytes, double share = 1)
      : limit_bytes_(limit_bytes), share_(share) {}

  // How many threads the process works with, two if nothing is said: each takes
  // some memory that is not charged. To be said before a budget is made.
  static void SetThreads(uint64_t threads);

  // The budget under a cap: the cap less the fixed part of the process and a
  // thirty-second of the rest, for the allocator.
  // Throws DoesNotFitError, naming the least cap, if nothing would be left.
  static uint64_t BudgetUnderCap(uint64_t cap_bytes);

  // The least cap, in whole MiB, that leaves a budget of so many bytes.
  static uint64_t CapForBudget(uint64_t budget_bytes);

  [[nodiscard]] uint64_t LimitBytes() const { return limit_bytes_; }

  // False where the limit stands for none.
  [[nodiscard]] bool IsLimited() const {
    return limit_bytes_ < std::numeric_limits<uint64_t>::max() / 2;
  }

  [[nodiscard]] uint64_t UsedBytes() const { return used_bytes_.load(); }

  [[nodiscard]] uint64_t PeakBytes() const { return peak_bytes_.load(); }

  [[nodiscard]] uint64_t FreeBytes() const {
    const uint64_t used = UsedBytes();
    return used < limit_bytes_ ? limit_bytes_ - used : 0;
  }

  // How many bytes less the process should take so as not to come near the
  // cap, by its resident size (the allocator's slack is in nobody's charge) and
  // what is to come beyond what was freed for it.
  [[nodiscard]] uint64_t ResidentExcess(uint64_t coming_bytes = 0) const;

  // How many would be left of them if all that was freed were given back.
  [[nodiscard]] uint64_t InUseExcess(uint64_t coming_bytes = 0) const;

  // What the process takes beyond its fixed part and all charges; 0 without a
  // limit.
  [[nodiscard]] uint64_t ResidentBeyondCharges() const;

  // Charges if it fits; false and unchanged otherwise.
  [[nodiscard]] bool TryCharge(uint64_t bytes);

  // Charges, or throws DoesNotFitError that names `what` needs how much, and a
  // cap to go on with: one for what is coming, too, as far as that is foreseen.
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

// What is coming after so many bytes, which are a share of all, about: of a
// file that is read so far, of faces that were looked at.
uint64_t ComingBytes(uint64_t bytes, double share);

// A charge that is released with its owner. The budget must outlive it.
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

  // Nothing if it does not fit.
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

  // Of what has become smaller: releases the rest.
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

// A charge that grows with what it stands for. The budget must outlive it.
class GrowingCharge {
 public:
  GrowingCharge(MemoryBudget& budget, std::string_view what)
      : budget_(&budget), what_(what) {}

  ~GrowingCharge() { budget_->Release(bytes_); }

  GrowingCharge(const GrowingCharge&) = delete;
  GrowingCharge& operator=(const GrowingCharge&) = delete;

  // Throws DoesNotFitError; unchanged then. `share`: of all that this will grow
  // to, about.
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
