#include "visibility/set_agreement.h"

#include "base/error.h"
#include "base/stop.h"

#include <algorithm>
#include <bit>
#include <iterator>
#include <numeric>
#include <span>
#include <string_view>
#include <utility>

namespace enfilade {
namespace {

constexpr uint64_t kMostCachedBytes = 8 << 20;
constexpr std::string_view kWhat = "agreeing on what cells see";
// Memory holds a block both as it is stored and as it is decoded.
constexpr uint64_t kBlockCopies = 2;
// A growing amount is charged in steps of this factor.
constexpr uint64_t kChargeGrowth = 2;
// The most cells whose agreements are sought together. The sets of the cells
// that they see are read once for all of them.
constexpr size_t kCellsAgreedAtOnce = 32;
// Kinds of scratch blocks, by the second number of their key.
constexpr uint32_t kSeenBlock = 0;
constexpr uint32_t kAgreedBlock = 1;

void PutAscending(const std::vector<CellId>& cells, ByteWriter& writer) {
  writer.PutVarint(cells.size());
  uint32_t last = 0;
  for (const CellId cell : cells) {
    writer.PutVarint(cell.value - last);
    last = cell.value;
  }
}

size_t CountBits(std::span<const std::byte> bytes) {
  size_t count = 0;
  for (const std::byte byte : bytes) {
    count += static_cast<size_t>(std::popcount(std::to_integer<uint8_t>(byte)));
  }
  return count;
}

std::vector<CellId> GetAscending(ByteReader& reader) {
  const uint64_t count = reader.GetVarint();
  if (count > reader.Remaining()) {
    throw DamagedStoreError("it ends too early");
  }
  std::vector<CellId> cells(count);
  uint32_t last = 0;
  for (CellId& cell : cells) {
    last += static_cast<uint32_t>(reader.GetVarint());
    cell = CellId(last);
  }
  return cells;
}

Bytes EncodeSeen(const std::vector<SeenCell>& seen) {
  ByteWriter writer;
  writer.PutVarint(seen.size());
  for (const SeenCell& s : seen) {
    writer.PutVarint(s.cell.value);
    writer.PutVarint(s.is_loose ? 1 : 0);
    PutAscending(s.between, writer);
    writer.Put(s.part);
    writer.Put(s.of_source);
  }
  return writer.Take();
}

std::vector<SeenCell> DecodeSeen(const Bytes& bytes) {
  ByteReader reader(bytes);
  std::vector<SeenCell> seen(reader.GetVarint());
  for (SeenCell& s : seen) {
    s.cell = CellId(static_cast<uint32_t>(reader.GetVarint()));
    s.is_loose = reader.GetVarint() != 0;
    s.between = GetAscending(reader);
    s.part = reader.Get<CellPart>();
    s.of_source = reader.Get<CellPart>();
  }
  return seen;
}

const SeenCell* Find(const std::vector<SeenCell>& seen, CellId cell) {
  const auto found = std::lower_bound(
      seen.begin(), seen.end(), cell, [](const SeenCell& a, CellId b) {
        return a.cell < b;
      });
  return found != seen.end() && found->cell == cell ? &*found : nullptr;
}

std::vector<CellId> Common(const std::vector<CellId>& a,
                           const std::vector<CellId>& b) {
  std::vector<CellId> common;
  std::set_intersection(
      a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(common));
  return common;
}

uint64_t BytesOf(const SeenCell& seen) {
  return sizeof(SeenCell) + kAllocationHeaderBytes +
         seen.between.size() * sizeof(CellId);
}

uint64_t BytesOf(const std::vector<SeenCell>& seen) {
  return std::accumulate(
      seen.begin(), seen.end(), uint64_t{0}, [](uint64_t sum, const auto& s) {
        return sum + BytesOf(s);
      });
}

// Combines what two ends see of each other.
SeenCell Both(const SeenCell& there, const SeenCell& back) {
  SeenCell both{there.cell, there.is_loose && back.is_loose};
  both.part = there.part;
  both.of_source = back.part;
  if (there.is_loose || back.is_loose) {
    both.between = there.is_loose ? back.between : there.between;
  } else {
    both.between = Common(there.between, back.between);
  }
  return both;
}

// The most bytes of an encoded set of so many sources.
uint64_t EncodedSetBytes(size_t sources) {
  constexpr uint64_t kMostPerId = 5;
  return sources * (kMostPerId + 2 * sizeof(CellPart) + (sources + 7) / 8) +
         2 * kMostPerId;
}

}  // namespace

SetAgreement::SetAgreement(std::span<const CellInfo> cells,
                           MemoryBudget& budget,
                           BlockStorage& store)
    : cells_(cells),
      budget_(&budget),
      store_(&store),
      own_charge_(budget, cells.size() * 2 * sizeof(uint64_t), kWhat),
      seen_bytes_(cells.size()),
      agreed_bytes_(cells.size()) {}

void SetAgreement::Put(CellId cell, const std::vector<SeenCell>& seen) {
  seen_bytes_[cell.Index()] = BytesOf(seen);
  const MemoryCharge charge = ChargeFor(seen_bytes_[cell.Index()]);
  store_->Put({BlockKind::kScratch, cell.value, kSeenBlock}, EncodeSeen(seen));
}

std::vector<SeenCell> SetAgreement::Load(CellId cell, uint32_t kind) const {
  return DecodeSeen(
      store_->GetOrThrow({BlockKind::kScratch, cell.value, kind}));
}

MemoryCharge SetAgreement::ChargeFor(uint64_t bytes) const {
  return {*budget_, bytes, kWhat};
}

std::shared_ptr<const std::vector<CellId>> SetAgreement::AgreedBy(CellId cell) {
  if (const auto found = agreed_.find(cell); found != agreed_.end()) {
    return found->second;
  }
  constexpr uint64_t kBytesPerEntry = 160;  // entry of the map
  const MemoryCharge charge =
      ChargeFor(kBlockCopies * agreed_bytes_[cell.Index()]);
  const std::vector<SeenCell> agreed = Load(cell, kAgreedBlock);
  const uint64_t bytes = kBytesPerEntry + agreed.size() * sizeof(CellId);
  if (cached_bytes_ + bytes > cache_charge_.Bytes()) {
    agreed_.clear();
    cached_bytes_ = 0;
  }
  if (cache_charge_.Bytes() < bytes) {
    cache_charge_.Reset();
    cache_charge_ = ChargeFor(
        std::max(bytes, std::min(kMostCachedBytes, budget_->FreeBytes() / 4)));
  }
  Ids ids;
  ids.reserve(agreed.size());
  for (const SeenCell& seen : agreed) {
    ids.push_back(seen.cell);
  }
  cached_bytes_ += bytes;
  return agreed_[cell] = std::make_shared<const Ids>(std::move(ids));
}

void SetAgreement::Agree() {
  for (size_t first = 0; first < cells_.size();) {
    first = AgreeBatch(first);
  }
}

std::vector<SetAgreement::Asking> SetAgreement::LoadBatch(size_t first) const {
  const size_t end = std::min(cells_.size(), first + kCellsAgreedAtOnce);
  const uint64_t most = budget_->FreeBytes() / 2;
  uint64_t bytes = 0;
  std::vector<Asking> batch;
  for (size_t i = first; i < end; ++i) {
    bytes += kBlockCopies * seen_bytes_[i];
    if (i > first && bytes > most) {
      break;
    }
    Asking asking;
    asking.charge = ChargeFor(kBlockCopies * seen_bytes_[i]);
    asking.mine = Load(CellId(i), kSeenBlock);
    asking.agreed.reserve(asking.mine.size());
    batch.push_back(std::move(asking));
  }
  return batch;
}

std::vector<CellId> SetAgreement::SourcesOf(const std::vector<Asking>& batch) {
  Ids sources;
  for (const Asking& asking : batch) {
    for (const SeenCell& seen : asking.mine) {
      sources.push_back(seen.cell);
    }
  }
  std::sort(sources.begin(), sources.end());
  sources.erase(std::unique(sources.begin(), sources.end()), sources.end());
  return sources;
}

void SetAgreement::ChargeAgreed(size_t at, std::vector<Asking>* batch) const {
  while (at < batch->size()) {
    Asking& asking = (*batch)[at];
    const uint64_t bytes = BytesOf(asking.mine) + asking.agreed_bytes;
    if (bytes <= asking.charge.Bytes() + asking.more.Bytes()) {
      return;
    }
    const uint64_t more = kChargeGrowth * (bytes - asking.charge.Bytes());
    asking.more.Reset();
    if (more <= budget_->FreeBytes() || batch->size() == 1) {
      asking.more = ChargeFor(more);
      return;
    }
    batch->pop_back();
  }
}

size_t SetAgreement::AgreeBatch(size_t first) {
  std::vector<Asking> batch = LoadBatch(first);
  for (const CellId source : SourcesOf(batch)) {
    ThrowIfStopRequested();
    const MemoryCharge charge =
        ChargeFor(kBlockCopies * seen_bytes_[source.Index()]);
    const std::vector<SeenCell> theirs = Load(source, kSeenBlock);
    for (size_t i = 0; i < batch.size(); ++i) {
      const SeenCell* there = Find(batch[i].mine, source);
      const SeenCell* back = Find(theirs, CellId(first + i));
      if (there == nullptr || back == nullptr) {
        continue;
      }
      SeenCell both = Both(*there, *back);
      batch[i].agreed_bytes += BytesOf(both);
      ChargeAgreed(i, &batch);
      if (i < batch.size()) {
        batch[i].agreed.push_back(std::move(both));
      }
    }
  }
  for (size_t i = 0; i < batch.size(); ++i) {
    FreeVector(&batch[i].mine);
    agreed_bytes_[first + i] = batch[i].agreed_bytes;
    store_->Put(
        {BlockKind::kScratch, static_cast<uint32_t>(first + i), kAgreedBlock},
        EncodeSeen(batch[i].agreed));
  }
  return first + batch.size();
}

size_t SetAgreement::Finish(CellId receiver) {
  const auto cells = cells_;
  const MemoryCharge charge =
      ChargeFor(kBlockCopies * agreed_bytes_[receiver.Index()] + cells.size());
  const std::vector<SeenCell> agreed = Load(receiver, kAgreedBlock);
  const MemoryCharge set_charge = ChargeFor(VisibleSetBytes(agreed.size(), 0) +
                                            EncodedSetBytes(agreed.size()));
  std::vector<bool> is_mine(cells.size());
  VisibleSet set;
  set.reserve(agreed.size());
  for (const SeenCell& pair : agreed) {
    is_mine[pair.cell.Index()] = true;
    set.push_back({pair.cell, {}, pair.of_source, pair.part});
  }
  Ids between;
  const auto between_of = [&](size_t source) -> std::span<const CellId> {
    const SeenCell& pair = agreed[source];
    const Box3& here = cells[receiver.Index()].bounds;
    const Box3& there = cells[pair.cell.Index()].bounds;
    between.clear();
    const auto theirs = AgreedBy(pair.cell);
    for (const CellId cell : *theirs) {
      const bool lies_between =
          is_mine[cell.Index()] &&
          (pair.is_loose ? MeetsHull(cells[cell.Index()].bounds, here, there)
                         : std::binary_search(
                               pair.between.begin(), pair.between.end(), cell));
      if (lies_between) {
        between.push_back(cell);
      }
    }
    return between;
  };
  store_->Put({BlockKind::kVisibleSet, receiver.value},
              EncodeVisibleSet(set, between_of));
  return set.size();
}

Bytes EncodeVisibleSet(
    const VisibleSet& set,
    const std::function<std::span<const CellId>(size_t source)>& between_of) {
  std::vector<CellId> sources;
  sources.reserve(set.size());
  for (const VisibleCell& v : set) {
    sources.push_back(v.source);
  }
  ByteWriter writer;
  writer.Reserve(EncodedSetBytes(set.size()));
  PutAscending(sources, writer);
  for (const VisibleCell& v : set) {
    writer.Put(v.of_receiver);
    writer.Put(v.of_source);
  }
  for (size_t i = 0; i < set.size(); ++i) {
    std::vector<uint8_t> bits((sources.size() + 7) / 8);
    for (const CellId cell : between_of(i)) {
      const auto at = static_cast<size_t>(
          std::lower_bound(sources.begin(), sources.end(), cell) -
          sources.begin());
      bits[at / 8] |= static_cast<uint8_t>(1U << (at % 8));
    }
    for (const uint8_t byte : bits) {
      writer.Put(byte);
    }
  }
  return writer.Take();
}

std::vector<CellId> DecodeVisibleSources(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  return GetAscending(reader);
}

VisibleSet DecodeVisibleSet(std::span<const std::byte> bytes,
                            const std::function<void(uint64_t)>& reserve) {
  ByteReader reader(bytes);
  const std::vector<CellId> sources = GetAscending(reader);
  const size_t width = (sources.size() + 7) / 8;
  if (reader.Remaining() != (2 * sizeof(CellPart) + width) * sources.size()) {
    throw DamagedStoreError("it has the wrong length");
  }
  const std::span<const std::byte> rows = bytes.last(width * sources.size());
  if (reserve) {
    reserve(VisibleSetBytes(sources.size(), CountBits(rows)));
  }
  VisibleSet set;
  set.reserve(sources.size());
  for (const CellId source : sources) {
    const auto bits = rows.subspan(set.size() * width, width);
    VisibleCell visible{source, {}};
    visible.of_receiver = reader.Get<CellPart>();
    visible.of_source = reader.Get<CellPart>();
    visible.between.reserve(CountBits(bits));
    for (size_t i = 0; i < sources.size(); ++i) {
      if ((std::to_integer<uint32_t>(bits[i / 8]) >> (i % 8) & 1) != 0) {
        visible.between.push_back(sources[i]);
      }
    }
    set.push_back(std::move(visible));
  }
  return set;
}

}  // namespace enfilade
