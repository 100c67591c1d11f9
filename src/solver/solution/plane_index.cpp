#include "solver/solution/plane_index.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace enfilade {
namespace {

constexpr size_t kMostSlots = 1 << 16;

// Whether the edge from a to b lies along the segment's line and the middle of
// the edge lies on the segment.
bool LiesAlong(const PlaneSegment& s,
               PlanePoint a,
               PlanePoint b,
               double tolerance_m) {
  if (DistanceFromLine(a, s) > tolerance_m ||
      DistanceFromLine(b, s) > tolerance_m) {
    return false;
  }
  const PlanePoint along = s.b - s.a;
  const PlanePoint middle = PlanePoint{(a.x + b.x) / 2, (a.y + b.y) / 2} - s.a;
  const double t = (middle.x * along.x + middle.y * along.y) /
                   (along.x * along.x + along.y * along.y);
  return t >= 0 && t <= 1;
}

std::vector<PlaneIndex::Box> BoxesOf(std::span<const PlaneSegment> segments) {
  std::vector<PlaneIndex::Box> boxes(segments.size());
  for (size_t i = 0; i < segments.size(); ++i) {
    boxes[i].Include(segments[i].a);
    boxes[i].Include(segments[i].b);
  }
  return boxes;
}

}  // namespace

double DistanceFromLine(PlanePoint p, const PlaneSegment& s) {
  return std::abs(Cross(s.b - s.a, p - s.a)) / Length(s.b - s.a);
}

void PlaneIndex::Box::Include(PlanePoint p) {
  low = {std::min(low.x, p.x), std::min(low.y, p.y)};
  high = {std::max(high.x, p.x), std::max(high.y, p.y)};
}

PlaneIndex::PlaneIndex(std::span<const Box> boxes, double margin_m) {
  std::vector<Box> wide(boxes.begin(), boxes.end());
  for (Box& box : wide) {
    box.Include({box.low.x - margin_m, box.low.y - margin_m});
    box.Include({box.high.x + margin_m, box.high.y + margin_m});
    bounds_.Include(box.low);
    bounds_.Include(box.high);
  }
  if (boxes.empty()) {
    bounds_ = {{0, 0}, {1, 1}};
  }
  // The slots are square and about as many as the boxes.
  const PlanePoint extent = bounds_.high - bounds_.low;
  const auto slots =
      static_cast<double>(std::clamp<size_t>(boxes.size(), 1, kMostSlots));
  const double side = std::max(std::sqrt(extent.x * extent.y / slots),
                               std::max(extent.x, extent.y) / slots);
  columns_ = static_cast<size_t>(extent.x / side) + 1;
  rows_ = static_cast<size_t>(extent.y / side) + 1;
  starts_.resize(columns_ * rows_ + 1);
  const auto for_each_slot = [&](const Box& box, const auto& body) {
    const auto low = SlotOf(box.low);
    const auto high = SlotOf(box.high);
    for (size_t row = low[1]; row <= high[1]; ++row) {
      for (size_t column = low[0]; column <= high[0]; ++column) {
        body(row * columns_ + column);
      }
    }
  };
  for (const Box& box : wide) {
    for_each_slot(box, [&](size_t slot) { ++starts_[slot + 1]; });
  }
  for (size_t i = 1; i < starts_.size(); ++i) {
    starts_[i] += starts_[i - 1];
  }
  items_.resize(starts_.back());
  std::vector<uint32_t> next(starts_.begin(), starts_.end() - 1);
  for (size_t i = 0; i < wide.size(); ++i) {
    for_each_slot(wide[i], [&](size_t slot) {
      items_[next[slot]++] = static_cast<uint32_t>(i);
    });
  }
}

std::array<size_t, 2> PlaneIndex::SlotOf(PlanePoint p) const {
  const auto slot = [](double x, double low, double high, size_t count) {
    const double at = (x - low) / (high - low) * static_cast<double>(count);
    return static_cast<size_t>(
        std::clamp(at, 0.0, static_cast<double>(count - 1)));
  };
  return {slot(p.x, bounds_.low.x, bounds_.high.x, columns_),
          slot(p.y, bounds_.low.y, bounds_.high.y, rows_)};
}

std::span<const uint32_t> PlaneIndex::Near(PlanePoint p) const {
  const auto at = SlotOf(p);
  const size_t slot = at[1] * columns_ + at[0];
  return std::span(items_).subspan(starts_[slot],
                                   starts_[slot + 1] - starts_[slot]);
}

PointWelder::PointWelder(double tolerance_m)
    : tolerance_m_(tolerance_m), slot_m_(16 * tolerance_m) {}

uint64_t PointWelder::Key(double x, double y) const {
  const auto column = static_cast<int64_t>(std::floor(x / slot_m_));
  const auto row = static_cast<int64_t>(std::floor(y / slot_m_));
  return static_cast<uint64_t>(column) << 32 ^
         (static_cast<uint64_t>(row) & UINT32_MAX);
}

uint32_t PointWelder::Add(PlanePoint p) {
  // Visits all slots that may hold points within the tolerance.
  for (const double dx : {-tolerance_m_, tolerance_m_}) {
    for (const double dy : {-tolerance_m_, tolerance_m_}) {
      const auto slot = slots_.find(Key(p.x + dx, p.y + dy));
      if (slot == slots_.end()) {
        continue;
      }
      uint32_t i = slot->second;
      while (Length(points_[i] - p) > tolerance_m_ && next_[i] != i) {
        i = next_[i];
      }
      if (Length(points_[i] - p) <= tolerance_m_) {
        return i;
      }
    }
  }
  const auto added = static_cast<uint32_t>(points_.size());
  points_.push_back(p);
  const auto [slot, is_new] = slots_.try_emplace(Key(p.x, p.y), added);
  next_.push_back(slot->second);
  slot->second = added;
  return added;
}

SegmentIndex::SegmentIndex(std::vector<PlaneSegment> segments,
                           double tolerance_m)
    : segments_(std::move(segments)),
      tolerance_m_(tolerance_m),
      index_(BoxesOf(segments_), 2 * tolerance_m) {}

bool SegmentIndex::Covers(PlanePoint a, PlanePoint b) const {
  const auto near = index_.Near({(a.x + b.x) / 2, (a.y + b.y) / 2});
  return std::any_of(near.begin(), near.end(), [&](uint32_t i) {
    return LiesAlong(segments_[i], a, b, tolerance_m_);
  });
}

}  // namespace enfilade
