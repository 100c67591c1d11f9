#include "scene/shell_trial.h"

#include "base/stop.h"
#include "base/vec.h"
#include "scene/edge_cover.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace enfilade {
namespace {

constexpr uint32_t kStays = std::numeric_limits<uint32_t>::max();
// If more edges than this run along each edge on average, what they take is not
// kept.
constexpr size_t kMostNear = 16;

Box3 BoxAround(const Edge3& edge, double tolerance) {
  Box3 box;
  box.Include(edge.from);
  box.Include(edge.to);
  const Vec3 wider = {tolerance, tolerance, tolerance};
  return {box.low + wider * -1.0, box.high + wider};
}

bool Meet(const Box3& a, const Box3& b) {
  return a.low.x <= b.high.x && b.low.x <= a.high.x && a.low.y <= b.high.y &&
         b.low.y <= a.high.y && a.low.z <= b.high.z && b.low.z <= a.high.z;
}

}  // namespace

void ShellTrial::AddEdges(std::span<const Edge3> edges) {
  edges_.insert(edges_.end(), edges.begin(), edges.end());
  owners_.resize(edges_.size(), kStays);
}

void ShellTrial::AddPolygon(std::span<const Point3> polygon) {
  const auto first = static_cast<uint32_t>(edges_.size());
  for (size_t i = 0; i < polygon.size(); ++i) {
    edges_.push_back({polygon[i], polygon[(i + 1) % polygon.size()]});
  }
  owners_.resize(edges_.size(), static_cast<uint32_t>(polygons_.size()));
  polygons_.push_back(
      {first, static_cast<uint32_t>(edges_.size()), false, std::nullopt});
}

void ShellTrial::Begin() {
  FindNearEdges();
  open_.resize(edges_.size());
  for (uint32_t e = 0; e < edges_.size(); ++e) {
    ThrowIfStopRequested();
    open_[e] = OpenOf(e, kStays);
  }
}

// Goes through the edges by where they begin along x.
void ShellTrial::FindNearEdges() {
  const auto count = static_cast<uint32_t>(edges_.size());
  std::vector<Box3> boxes;
  for (const Edge3& edge : edges_) {
    boxes.push_back(BoxAround(edge, tolerance_));
  }
  std::vector<uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return boxes[a].low.x < boxes[b].low.x;
  });
  near_.resize(count);
  size_t kept = 0;
  for (size_t i = 0; i < count && kept <= kMostNear * count; ++i) {
    ThrowIfStopRequested();
    const uint32_t a = order[i];
    near_[a].push_back(a);
    for (size_t k = i + 1;
         k < count && boxes[order[k]].low.x <= boxes[a].high.x;
         ++k) {
      const uint32_t b = order[k];
      if (Meet(boxes[a], boxes[b]) && (Covers(a, b) || Covers(b, a))) {
        near_[a].push_back(b);
        near_[b].push_back(a);
        kept += 2;
      }
    }
  }
  if (kept > kMostNear * count) {
    near_.clear();
    all_ = std::move(order);
  }
}

// Whether part of an edge that counts runs beside the other one.
bool ShellTrial::Covers(uint32_t other, uint32_t edge) const {
  return Length(edges_[edge].to - edges_[edge].from) > 2 * tolerance_ &&
         StretchBeside(edges_[edge], edges_[other], tolerance_).has_value();
}

std::span<const uint32_t> ShellTrial::NearEdges(uint32_t edge) const {
  return near_.empty() ? all_ : near_[edge];
}

bool ShellTrial::IsIn(uint32_t edge) const {
  return owners_[edge] == kStays || !polygons_[owners_[edge]].is_out;
}

// How much of an edge is open, as far as polygons are left out, and without the
// polygon `without` (or kStays).
double ShellTrial::OpenOf(uint32_t edge, uint32_t without) const {
  const double length = Length(edges_[edge].to - edges_[edge].from);
  if (length <= 2 * tolerance_ || !IsIn(edge)) {
    return 0;
  }
  std::vector<EdgeStretch> stretches;
  for (const uint32_t other : NearEdges(edge)) {
    if (!IsIn(other) || (without != kStays && owners_[other] == without)) {
      continue;
    }
    if (const auto stretch =
            StretchBeside(edges_[edge], edges_[other], tolerance_)) {
      stretches.push_back(*stretch);
    }
  }
  return LengthOfOdd(length, stretches, tolerance_);
}

// The edges of others that those of the polygon may cover, in order.
std::vector<uint32_t> ShellTrial::EdgesBeside(uint32_t polygon) const {
  const Polygon& p = polygons_[polygon];
  std::vector<uint32_t> beside;
  for (uint32_t e = p.first_edge; e < p.end_edge; ++e) {
    for (const uint32_t other : NearEdges(e)) {
      if (owners_[other] != polygon && IsIn(other)) {
        beside.push_back(other);
      }
    }
  }
  std::sort(beside.begin(), beside.end());
  beside.erase(std::unique(beside.begin(), beside.end()), beside.end());
  return beside;
}

const std::vector<ShellTrial::Change>& ShellTrial::ChangesWithout(
    uint32_t polygon) {
  std::optional<std::vector<Change>>& changes = polygons_[polygon].changes;
  if (!changes) {
    ThrowIfStopRequested();
    changes.emplace();
    for (const uint32_t edge : EdgesBeside(polygon)) {
      const double open = OpenOf(edge, polygon);
      if (open != open_[edge]) {
        changes->push_back({edge, open});
      }
    }
  }
  return *changes;
}

double ShellTrial::OpenLength() const {
  return std::accumulate(open_.begin(), open_.end(), 0.0);
}

// Sums in the order of the edges, so that the sum has the bits of a whole one.
double ShellTrial::OpenLengthWithout(uint32_t polygon) {
  const std::vector<Change>& changes = ChangesWithout(polygon);
  const Polygon& p = polygons_[polygon];
  double sum = 0;
  auto change = changes.begin();
  for (uint32_t e = 0; e < edges_.size(); ++e) {
    if (change != changes.end() && change->edge == e) {
      sum += change->open;
      ++change;
    } else if (e < p.first_edge || e >= p.end_edge) {
      sum += open_[e];
    }
  }
  return sum;
}

double ShellTrial::ChangeWithout(uint32_t polygon) {
  const Polygon& p = polygons_[polygon];
  double sum = 0;
  for (const Change& change : ChangesWithout(polygon)) {
    sum += change.open - open_[change.edge];
  }
  for (uint32_t e = p.first_edge; e < p.end_edge; ++e) {
    sum -= open_[e];
  }
  return sum;
}

void ShellTrial::LeaveOut(uint32_t polygon) {
  for (const Change& change : ChangesWithout(polygon)) {
    open_[change.edge] = change.open;
  }
  for (const uint32_t edge : EdgesBeside(polygon)) {
    for (const uint32_t other : NearEdges(edge)) {
      if (owners_[other] != kStays) {
        polygons_[owners_[other]].changes.reset();
      }
    }
  }
  Polygon& p = polygons_[polygon];
  p.is_out = true;
  std::fill(open_.begin() + p.first_edge, open_.begin() + p.end_edge, 0.0);
}

}  // namespace enfilade
