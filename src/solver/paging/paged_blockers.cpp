#include "solver/paging/paged_blockers.h"

#include <algorithm>
#include <array>

namespace enfilade {
namespace {

// Some segments of a packet, and their lanes in that packet.
struct Part {
  SegmentPacket packet;
  std::array<uint8_t, 16> lane{};

  void Add(const SegmentPacket& all, uint32_t i) {
    const uint32_t k = packet.count++;
    packet.from_x[k] = all.from_x[i];
    packet.from_y[k] = all.from_y[i];
    packet.from_z[k] = all.from_z[i];
    packet.to_x[k] = all.to_x[i];
    packet.to_y[k] = all.to_y[i];
    packet.to_z[k] = all.to_z[i];
    lane[k] = static_cast<uint8_t>(i);
  }
};

// The parameters at which a segment enters and leaves a box.
struct Passage {
  float begin = 0;
  float end = 1;

  // Clips the passage to the part between two planes across an axis.
  void Clip(float from, float to, float low, float high) {
    const float d = to - from;
    if (d == 0) {
      end = from < low || from > high ? -1 : end;
      return;
    }
    const float a = (low - from) / d;
    const float b = (high - from) / d;
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
};

bool Meets(const SegmentPacket& p, uint32_t i, const Box& box) {
  Passage passage;
  passage.Clip(p.from_x[i], p.to_x[i], box.low.x, box.high.x);
  passage.Clip(p.from_y[i], p.to_y[i], box.low.y, box.high.y);
  passage.Clip(p.from_z[i], p.to_z[i], box.low.z, box.high.z);
  return passage.begin <= passage.end;
}

}  // namespace

void PagedBlockers::Assign(const std::vector<CellId>& cells) {
  cells_.clear();
  for (const CellId id : cells) {
    cells_.push_back({id, pager_->BoundsOf(id)});
  }
}

uint32_t PagedBlockers::Occlude(const SegmentPacket& packet, uint32_t blocked) {
  for (const Cell& cell : cells_) {
    Part part;
    for (uint32_t i = 0; i < packet.count; ++i) {
      if ((blocked >> i & 1) == 0 && Meets(packet, i, cell.box)) {
        part.Add(packet, i);
      }
    }
    if (part.packet.count == 0) {
      continue;
    }
    const std::lock_guard lock(mutex_);
    const auto held = pager_->RayBlockersOf(cell.id);
    const RayBlockers* const blockers[] = {held.get()};
    const uint32_t hit = Occluded(blockers, part.packet);
    for (uint32_t k = 0; k < part.packet.count; ++k) {
      blocked |= (hit >> k & 1) << part.lane[k];
    }
  }
  return blocked;
}

bool PagedBlockers::LeaveEmpty(const Shaft& shaft) {
  return std::all_of(cells_.begin(), cells_.end(), [&](const Cell& cell) {
    if (!shaft.hull.Overlaps(cell.box)) {
      return true;
    }
    const std::lock_guard lock(mutex_);
    return pager_->ShaftBlockersOf(cell.id)->LeaveEmpty(shaft);
  });
}

ShadowSum PagedBlockers::SumOfShadows(const CastShadow& shadow,
                                      uint64_t enough) {
  ShadowSum sum;
  for (const Cell& cell : cells_) {
    if (sum.Larger() < enough && !shadow.Misses(cell.box)) {
      const std::lock_guard lock(mutex_);
      sum.Add(pager_->ShaftBlockersOf(cell.id)->SumOfShadows(shadow, enough));
    }
  }
  return sum;
}

}  // namespace enfilade
