#include "base/memory.h"

#include "base/check.h"
#include "base/error.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <fstream>
#include <limits>
#include <string>
#include <string_view>

#include <fcntl.h>
#include <fmt/format.h>
#include <link.h>
#include <sys/mman.h>
#include <unistd.h>

#ifdef ENFILADE_JEMALLOC
#include <jemalloc/jemalloc.h>

// jemalloc declares this variable and reads it before the program begins. With
// these settings jemalloc keeps freed memory until ReleaseFreedMemory, and
// serves arrays of any size from it: docs/decisions/allocator.md.
// NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables)
const char* malloc_conf =
    "narenas:1,dirty_decay_ms:-1,muzzy_decay_ms:0,lg_extent_max_active_fit:32";
#endif

namespace enfilade {
namespace {

// Resident size of the program before it has read any model: measured at
// 14 MiB with Embree's device and scenes, oneTBB on two threads and an SQLite
// store with its page cache (`solve -v` of a small scene tells peak and
// budget), plus 7 MiB for the allocator's slack.
constexpr uint64_t kFixedBytes = 21ULL << 20;
// Each thread beyond kMeasuredThreads adds its stack, its working data and the
// freed memory that it keeps. Sixteen threads took 2 to 4.6 MiB more than two.
constexpr uint64_t kMeasuredThreads = 2;
constexpr uint64_t kBytesPerThread = 384ULL << 10;
// One part in kSlackParts of the rest is left to the allocator, whose slack
// grows with what it holds because it rounds sizes up. (glibc rounds to pages:
// under a cap of 256M duplex took 255.97 MiB with 100 parts, and a townhouse of
// thirty million links took a few pages more than 256 MiB with 40.)
constexpr uint64_t kSlackParts = 32;
// A charge that fails will be followed by others: the cap that its message
// names has one part in kMoreParts on top.
constexpr uint64_t kMoreParts = 4;
constexpr uint64_t kLeastBudgetBytes = 8ULL << 20;
// The resident size should stay below the cap by kLeastResidentSlack and one
// part in kResidentSlackParts of the budget, but by kMostResidentSlack at most.
// What takes this room between two looks at the resident size is charged: links
// on their way to the store, pages of SQLite.
constexpr uint64_t kLeastResidentSlack = 2ULL << 20;
constexpr uint64_t kMostResidentSlack = 8ULL << 20;
constexpr uint64_t kResidentSlackParts = 24;
// At most so many coming bytes count as fitting into freed memory, which lies
// in pieces.
constexpr uint64_t kMostReused = 2ULL << 20;

std::atomic<uint64_t>& Threads() {
  static std::atomic<uint64_t> threads = kMeasuredThreads;
  return threads;
}

// The bytes of the threads beyond those that kFixedBytes includes.
uint64_t BytesOfThreads() {
  return (std::max(Threads().load(), kMeasuredThreads) - kMeasuredThreads) *
         kBytesPerThread;
}

// The bytes of the process that nobody charges.
uint64_t FixedBytes() {
  return kFixedBytes + BytesOfThreads();
}

// The cap that leaves a budget of `budget_bytes`.
uint64_t CapOf(uint64_t budget_bytes) {
  return FixedBytes() + budget_bytes + budget_bytes / (kSlackParts - 1) + 1;
}

}  // namespace

uint64_t ResidentBytes() {
  // The file stays open because every load near the cap reads it.
  static const int file = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  std::array<char, 128> text{};
  if (file < 0 || pread(file, text.data(), text.size() - 1, 0) <= 0) {
    return 0;
  }
  const std::string_view fields(text.data());
  const size_t second = fields.find(' ') + 1;  // the first: virtual memory
  uint64_t pages = 0;
  std::from_chars(fields.data() + second, fields.data() + fields.size(), pages);
  return pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

// ru_maxrss would not do: it includes the peak of the process before its exec,
// which after a vfork is the size of its parent.
uint64_t PeakResidentBytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    uint64_t kilobytes = 0;
    if (word == "VmHWM:" && status >> kilobytes) {
      return kilobytes * 1024;
    }
  }
  return 0;
}

// Releases only pages of files, from segments that are never written to.
void ReleaseCode() {
  const auto release = [](dl_phdr_info* object, size_t /*size*/, void*) {
    const std::string_view file = object->dlpi_name;
    if (!file.empty() && file.front() != '/') {
      return 0;  // the kernel's vDSO; the program itself has an empty name
    }
    const auto page = static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
    for (size_t i = 0; i < object->dlpi_phnum; ++i) {
      const auto& segment = object->dlpi_phdr[i];
      if (segment.p_type == PT_LOAD && segment.p_flags == (PF_R | PF_X)) {
        const uint64_t begin = object->dlpi_addr + segment.p_vaddr;
        const uint64_t first = begin / page * page;
        // NOLINTNEXTLINE(performance-no-int-to-ptr): addresses are numbers here
        madvise(reinterpret_cast<void*>(first),
                begin + segment.p_memsz - first,
                MADV_DONTNEED);
      }
    }
    return 0;
  };
  dl_iterate_phdr(release, nullptr);
}

#ifdef ENFILADE_JEMALLOC

void ReleaseFreedMemory() {
  std::array<size_t, 3> name{};  // arena.N.purge
  size_t parts = name.size();
  ENFILADE_CHECK(mallctlnametomib("arena.0.purge", name.data(), &parts) == 0,
                 "the allocator does not know how to purge");
  name[1] = MALLCTL_ARENAS_ALL;
  mallctlbymib(name.data(), parts, nullptr, nullptr, nullptr, 0);
}

uint64_t AllocatedBytes(uint64_t bytes) {
  return bytes > 0 ? nallocx(bytes, 0) : 0;
}

uint64_t FreedBytes() {
  uint64_t epoch = 1;
  mallctl("epoch", nullptr, nullptr, &epoch, sizeof(epoch));  // new counts
  std::array<size_t, 4> name{};  // stats.arenas.N.pdirty
  size_t parts = name.size();
  ENFILADE_CHECK(
      mallctlnametomib("stats.arenas.0.pdirty", name.data(), &parts) == 0,
      "the allocator does not count");
  name[2] = MALLCTL_ARENAS_ALL;
  size_t pages = 0;
  size_t size = sizeof(pages);
  mallctlbymib(name.data(), parts, &pages, &size, nullptr, 0);
  return pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

#else

void ReleaseFreedMemory() {}

uint64_t AllocatedBytes(uint64_t bytes) {
  return bytes;
}

uint64_t FreedBytes() {
  return 0;
}

#endif

// The most that the resident size should be, which is that of the whole process
// even if this budget is a share. The bytes of the threads are subtracted,
// because threads take them between two looks at the size.
uint64_t MemoryBudget::MostResident() const {
  const auto whole =
      static_cast<uint64_t>(static_cast<double>(limit_bytes_) / share_);
  return CapOf(whole) - BytesOfThreads() -
         std::min(kLeastResidentSlack + whole / kResidentSlackParts,
                  kMostResidentSlack);
}

uint64_t MemoryBudget::ResidentExcess(uint64_t coming_bytes) const {
  if (!IsLimited()) {
    return 0;
  }
  const uint64_t resident = ResidentBytes();
  const uint64_t most = MostResident();
  if (resident + coming_bytes <= most) {
    return 0;
  }
  const uint64_t reused =
      coming_bytes > 0 ? std::min(FreedBytes(), kMostReused) : 0;
  const uint64_t coming = coming_bytes - std::min(coming_bytes, reused);
  return resident + coming > most ? resident + coming - most : 0;
}

uint64_t MemoryBudget::InUseExcess(uint64_t coming_bytes) const {
  if (!IsLimited()) {
    return 0;
  }
  const uint64_t resident = ResidentBytes();
  const uint64_t in_use = resident - std::min(resident, FreedBytes());
  const uint64_t most = MostResident();
  return in_use + coming_bytes > most ? in_use + coming_bytes - most : 0;
}

uint64_t MemoryBudget::ResidentBeyondCharges() const {
  const uint64_t counted = FixedBytes() + UsedBytes();
  const uint64_t resident = IsLimited() ? ResidentBytes() : 0;
  return resident > counted ? resident - counted : 0;
}

void MemoryBudget::SetThreads(uint64_t threads) {
  Threads() = threads;
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
  const uint64_t rest = cap_bytes - FixedBytes();
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
  GiveBackNearTheCap(bytes);
  return true;
}

// Memory that was charged and freed before may still be resident. A look at the
// resident size takes a system call, so it waits until charges add up.
void MemoryBudget::GiveBackNearTheCap(uint64_t coming_bytes) {
  constexpr uint64_t kWorthALook = 1 << 20;
  if (!IsLimited() ||
      unlooked_bytes_.fetch_add(coming_bytes) + coming_bytes < kWorthALook) {
    return;
  }
  unlooked_bytes_ = 0;
  if (ResidentExcess(coming_bytes) > 0) {
    ReleaseFreedMemory();
  }
}

void MemoryBudget::Charge(uint64_t bytes,
                          std::string_view what,
                          uint64_t coming_bytes) {
  if (!TryCharge(bytes)) {
    constexpr double kMostNamed = 0x1p60;  // a share may be nearly 0
    const auto all = static_cast<uint64_t>(std::min(
        static_cast<double>(UsedBytes() + bytes + coming_bytes) / share_,
        kMostNamed));
    const uint64_t enough = CapForBudget(all + all / kMoreParts);
    const uint64_t lacking = bytes - std::min(bytes, FreeBytes());
    throw NoRoomError(fmt::format(
        "no room for {}: {:.1f} {} more than the memory cap "
        "leaves; run again with --memory {}M or more",
        what,
        static_cast<double>(lacking) / (lacking < 1 << 20 ? 1 << 10 : 1 << 20),
        lacking < 1 << 20 ? "KiB" : "MiB",
        enough >> 20));
  }
}

uint64_t ComingBytes(uint64_t bytes, double share) {
  constexpr double kLeastShare = 0.02;  // less is too little to predict from
  return share > kLeastShare && share < 1
             ? static_cast<uint64_t>(static_cast<double>(bytes) *
                                     (1 / share - 1))
             : 0;
}

}  // namespace enfilade
