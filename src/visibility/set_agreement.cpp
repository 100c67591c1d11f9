#include "visibility/set_agreement.h"

#include "base/error.h"

#include <algorithm>
#include <bit>
#include <iterator>
#include <span>
#include <utility>

namespace enfilade {
namespace {

constexpr uint64_t kMostCachedBytes = 8 << 20;
// Cells whose agreements are sought together: the sets of those that they see
// are read once for all of them.
constexpr size_t kCellsAgreedAtOnce = 32;
// Kinds of scratch blocks, by their second number.
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
    throw DamagedStoreError("a stored visible set ends too early");
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

// What two ends make of each other.
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

}  // namespace

void SetAgreement::Put(CellId cell, const std::vector<SeenCell>& seen) {
  store_->Put({BlockKind::kScratch, cell.value, kSeenBlock}, EncodeSeen(seen));
}

std::vector<SeenCell> SetAgreement::Load(CellId cell, uint32_t kind) const {
  return DecodeSeen(
      store_->GetOrThrow({BlockKind::kScratch, cell.value, kind}));
}

std::shared_ptr<const std::vector<CellId>> SetAgreement::AgreedBy(CellId cell) {
  if (const auto found = agreed_.find(cell); found != agreed_.end()) {
    return found->second;
  }
  if (agreed_bytes_ > kMostCachedBytes) {
    agreed_.clear();
    agreed_bytes_ = 0;
  }
  Ids ids;
  for (const SeenCell& agreed : Load(cell, kAgreedBlock)) {
    ids.push_back(agreed.cell);
  }
  agreed_bytes_ += sizeof(Ids) + ids.size() * sizeof(CellId);
  return agreed_[cell] = std::make_shared<const Ids>(std::move(ids));
}

void SetAgreement::Agree() {
  const size_t count = partition_->cells.size();
  for (size_t first = 0; first < count; first += kCellsAgreedAtOnce) {
    AgreeBatch(first, std::min(count, first + kCellsAgreedAtOnce));
  }
}

void SetAgreement::AgreeBatch(size_t first, size_t end) {
  std::vector<std::vector<SeenCell>> mine;
  std::vector<std::vector<SeenCell>> agreed(end - first);
  Ids sources;
  for (size_t i = first; i < end; ++i) {
    mine.push_back(Load(CellId(i), kSeenBlock));
    for (const SeenCell& seen : mine.back()) {
      sources.push_back(seen.cell);
    }
  }
  std::sort(sources.begin(), sources.end());
  sources.erase(std::unique(sources.begin(), sources.end()), sources.end());
  for (const CellId source : sources) {
    const std::vector<SeenCell> theirs = Load(source, kSeenBlock);
    for (size_t i = first; i < end; ++i) {
      const SeenCell* there = Find(mine[i - first], source);
      const SeenCell* back = Find(theirs, CellId(i));
      if (there != nullptr && back != nullptr) {
        agreed[i - first].push_back(Both(*there, *back));
      }
    }
  }
  for (size_t i = first; i < end; ++i) {
    store_->Put({BlockKind::kScratch, static_cast<uint32_t>(i), kAgreedBlock},
                EncodeSeen(agreed[i - first]));
  }
}

VisibleSet SetAgreement::Finish(CellId receiver) {
  const auto& cells = partition_->cells;
  const std::vector<SeenCell> agreed = Load(receiver, kAgreedBlock);
  std::vector<bool> is_mine(cells.size());
  for (const SeenCell& pair : agreed) {
    is_mine[pair.cell.Index()] = true;
  }
  VisibleSet set;
  for (const SeenCell& pair : agreed) {
    const Box3& here = cells[receiver.Index()].bounds;
    const Box3& there = cells[pair.cell.Index()].bounds;
    VisibleCell visible{pair.cell, {}, pair.of_source, pair.part};
    const auto theirs = AgreedBy(pair.cell);
    for (const CellId cell : *theirs) {
      const bool lies_between =
          is_mine[cell.Index()] &&
          (pair.is_loose ? MeetsHull(cells[cell.Index()].bounds, here, there)
                         : std::binary_search(
                               pair.between.begin(), pair.between.end(), cell));
      if (lies_between) {
        visible.between.push_back(cell);
      }
    }
    set.push_back(std::move(visible));
  }
  return set;
}

Bytes EncodeVisibleSet(const VisibleSet& set) {
  std::vector<CellId> sources;
  for (const VisibleCell& v : set) {
    sources.push_back(v.source);
  }
  ByteWriter writer;
  PutAscending(sources, writer);
  for (const VisibleCell& v : set) {
    writer.Put(v.of_receiver);
    writer.Put(v.of_source);
  }
  for (const VisibleCell& v : set) {
    std::vector<uint8_t> bits((sources.size() + 7) / 8);
    for (const CellId cell : v.between) {
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

VisibleSet DecodeVisibleSet(const Bytes& bytes,
                            const std::function<void(uint64_t)>& reserve) {
  ByteReader reader(bytes);
  const std::vector<CellId> sources = GetAscending(reader);
  const size_t width = (sources.size() + 7) / 8;
  if (reader.Remaining() != (2 * sizeof(CellPart) + width) * sources.size()) {
    throw DamagedStoreError("a stored visible set has the wrong length");
  }
  const std::span<const std::byte> rows =
      std::span(bytes).last(width * sources.size());
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
