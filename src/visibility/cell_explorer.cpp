#include "visibility/cell_explorer.h"

#include "base/stop.h"
#include "visibility/beam_flood.h"

#include <algorithm>
#include <bit>
#include <optional>
#include <utility>

namespace enfilade {
namespace {

constexpr uint32_t kUnseen = ~0U;

// A doorway of the current sequence, clipped to what lies beyond the doorways
// before it.
struct Passed {
  const Doorway* door = nullptr;
  std::vector<Point3> polygon;
  size_t rows_before = 0;  // rows of the doorways before
};

// Numbers the cells that were seen, and notes for each which other seen cells
// lie between the source and the cell.
class SeenCells {
 public:
  explicit SeenCells(size_t cells) : number_(cells, kUnseen) {}

  uint32_t NumberOf(CellId cell) {
    uint32_t& number = number_[cell.Index()];
    if (number == kUnseen) {
      number = static_cast<uint32_t>(cells_.size());
      cells_.push_back(cell);
      between_.emplace_back();
      is_loose_.push_back(false);
    }
    return number;
  }

  void AddLoose(CellId target) { is_loose_[NumberOf(target)] = true; }

  // Notes that every cell of the path lies between source and target. The path
  // holds numbers of seen cells and ends with the target.
  void Add(CellId target, const std::vector<uint32_t>& path) {
    std::vector<uint64_t>& bits = between_[NumberOf(target)];
    for (const uint32_t cell : path) {
      bits.resize(std::max(bits.size(), size_t{cell / 64} + 1));
      bits[cell / 64] |= uint64_t{1} << (cell % 64);
    }
  }

  // The memory that the result of Sorted takes.
  [[nodiscard]] uint64_t SortedBytes() const {
    uint64_t bytes =
        cells_.size() * (sizeof(SeenCell) + kAllocationHeaderBytes);
    for (size_t i = 0; i < cells_.size(); ++i) {
      bytes += is_loose_[i] ? 0 : CountBits(between_[i]) * sizeof(CellId);
    }
    return bytes;
  }

  // The seen cells that were reached, in ascending order. Their lists of cells
  // between also hold reached cells only, ascending.
  [[nodiscard]] std::vector<SeenCell> Sorted(
      const ReachedParts& reached) const {
    std::vector<SeenCell> sorted;
    sorted.reserve(cells_.size());
    for (size_t i = 0; i < cells_.size(); ++i) {
      const CellId cell = cells_[i];
      if (reached.Holds(cell)) {
        SeenCell seen{cell, is_loose_[i]};
        seen.part = PartOf(reached.BoundsOf(cell), reached.Of(cell));
        if (!seen.is_loose) {
          ListBetween(between_[i], reached, seen.between);
        }
        sorted.push_back(std::move(seen));
      }
    }
    std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
      return a.cell < b.cell;
    });
    return sorted;
  }

 private:
  static size_t CountBits(const std::vector<uint64_t>& bits) {
    size_t count = 0;
    for (const uint64_t word : bits) {
      count += static_cast<size_t>(std::popcount(word));
    }
    return count;
  }

  void ListBetween(const std::vector<uint64_t>& bits,
                   const ReachedParts& reached,
                   std::vector<CellId>& between) const {
    between.reserve(CountBits(bits));
    for (size_t k = 0; k < 64 * bits.size(); ++k) {
      if ((bits[k / 64] >> (k % 64) & 1) != 0 && reached.Holds(cells_[k])) {
        between.push_back(cells_[k]);
      }
    }
    std::sort(between.begin(), between.end());
  }

  std::vector<uint32_t> number_;  // by cell
  std::vector<CellId> cells_;     // by number
  std::vector<std::vector<uint64_t>> between_;
  std::vector<bool> is_loose_;
};

// The next doorway of a sequence, which a line may pass.
struct NextStep {
  std::vector<Point3> polygon;        // clipped
  std::optional<PluckerRow> witness;  // a line through all doorways, if known
};

class Explorer {
 public:
  Explorer(CellId source,
           std::span<const CellInfo> cells,
           const PortalGraph& graph,
           const RegionGraph& regions)
      : source_(source),
        cells_(cells),
        graph_(&graph),
        regions_(&regions),
        origin_(cells[source.Index()].bounds.Center()),
        seen_(graph.CellCount()) {}

  Exploration Run(uint32_t max_steps, MemoryBudget& budget) {
    Exploration result;
    const auto doors = graph_->Doorways(source_);
    path_ = {seen_.NumberOf(source_)};
    seen_.Add(source_, path_);
    const uint64_t share =
        std::max<uint64_t>(1, max_steps / std::max<size_t>(1, doors.size()));
    for (const Doorway& first : doors) {
      steps_left_ = share;
      is_spent_ = false;
      Walk(first, {first.polygon.Copy(), std::nullopt});
      result.steps += share - steps_left_;
      result.budget_spent = result.budget_spent || is_spent_;
    }
    const ReachedParts reached = Flood();
    if (result.budget_spent) {
      AddLoose(reached);
    }
    result.charge =
        MemoryCharge(budget, seen_.SortedBytes(), "what a cell sees");
    result.seen = seen_.Sorted(reached);
    return result;
  }

 private:
  // Passes a doorway that the sequence can pass, and walks on from there.
  void Walk(const Doorway& door, NextStep step) {
    passed_.push_back({&door, std::move(step.polygon), rows_.size()});
    if (!door.is_sliver) {
      AppendEdgeRows(passed_.back().polygon, door.plane.normal, origin_, rows_);
    }
    path_.push_back(seen_.NumberOf(door.to));
    seen_.Add(door.to, path_);
    for (const Doorway& next : graph_->Doorways(door.to)) {
      ThrowIfStopRequested();
      if (is_spent_) {
        break;
      }
      if (auto next_step = Stab(next, step.witness)) {
        Walk(next, std::move(*next_step));
      }
    }
    path_.pop_back();
    rows_.resize(passed_.back().rows_before);
    passed_.pop_back();
  }

  // The step through `next`, if a line may pass all doorways of the sequence
  // and then this one. nullopt only if no line can, or if the steps are spent.
  std::optional<NextStep> Stab(const Doorway& next,
                               const std::optional<PluckerRow>& witness) {
    NextStep step{next.polygon.Copy(), witness};
    if (!IsAhead(next, step.polygon)) {
      return std::nullopt;
    }
    if (steps_left_ == 0) {
      is_spent_ = true;
      return std::nullopt;
    }
    --steps_left_;
    if (next.is_sliver) {
      return step;
    }
    const size_t rows_before = rows_.size();
    AppendEdgeRows(step.polygon, next.plane.normal, origin_, rows_);
    const bool still_stabs =
        witness &&
        std::all_of(rows_.begin() + static_cast<ptrdiff_t>(rows_before),
                    rows_.end(),
                    [&](const PluckerRow& r) { return Dot(r, *witness) > 0; });
    if (!still_stabs && !rows_.empty()) {
      step.witness = InteriorOfCone(rows_);
    }
    const bool may_stab = step.witness || rows_.empty();
    rows_.resize(rows_before);
    return may_stab ? std::optional(std::move(step)) : std::nullopt;
  }

  // Tests cheap necessary conditions: the doorway is not on the sequence yet,
  // some part of it lies beyond every doorway passed (`polygon` is clipped to
  // that part), and some part of every doorway passed lies before it.
  bool IsAhead(const Doorway& next, std::vector<Point3>& polygon) const {
    for (const Passed& p : passed_) {
      if (p.door->portal == next.portal) {
        return false;
      }
    }
    for (const Passed& p : passed_) {
      if (!next.is_sliver && !ReachesBefore(p.polygon, next.plane)) {
        return false;
      }
      if (!p.door->is_sliver) {
        polygon = ClipBeyond(polygon, p.door->plane);
      }
      if (polygon.empty()) {
        return false;
      }
    }
    return true;
  }

  // The source, and all that a line through any opening of the source may
  // reach.
  [[nodiscard]] ReachedParts Flood() const {
    std::vector<Box3> bounds;
    for (const CellInfo& cell : cells_) {
      bounds.push_back(cell.bounds);
    }
    ReachedParts reached(std::move(bounds));
    BeamFlood flood(*regions_);
    for (const DoorwayGroup& group :
         GroupDoorways(regions_->DoorwaysOut(source_))) {
      if (!flood.Run(group, &reached)) {
        break;
      }
    }
    reached.AddAllOf(source_);
    return reached;
  }

  void AddLoose(const ReachedParts& reached) {
    for (size_t i = 0; i < graph_->CellCount(); ++i) {
      if (reached.Holds(CellId(i))) {
        seen_.AddLoose(CellId(i));
      }
    }
  }

  CellId source_;
  std::span<const CellInfo> cells_;
  const PortalGraph* graph_;
  const RegionGraph* regions_;
  Point3 origin_;  // origin of the rows' coordinates
  SeenCells seen_;
  std::vector<Passed> passed_;    // the sequence
  std::vector<PluckerRow> rows_;  // of the sequence
  std::vector<uint32_t> path_;    // numbers of the cells along the sequence
  uint64_t steps_left_ = 0;
  bool is_spent_ = false;
};

}  // namespace

Exploration ExploreFrom(CellId source,
                        std::span<const CellInfo> cells,
                        const PortalGraph& graph,
                        const RegionGraph& regions,
                        uint32_t max_steps,
                        MemoryBudget& budget) {
  return Explorer(source, cells, graph, regions).Run(max_steps, budget);
}

// Each cell takes a number and an entry of the lists. Each cell that a step
// went to also takes a row of bits, one bit per such cell.
uint64_t BytesToNoteSeen(size_t cells, uint32_t max_steps) {
  constexpr uint64_t kBytesPerCell = 2 * sizeof(uint32_t) +
                                     sizeof(std::vector<uint64_t>) +
                                     kAllocationHeaderBytes;
  const uint64_t rows = std::min<uint64_t>(cells, max_steps);
  return cells * kBytesPerCell + rows * (rows / 8);
}

}  // namespace enfilade
