// The building at the level of convex regions, of which cells are made, and the
// doorways out of a cell in groups that are looked through together. Internal
// to src/visibility.

#pragma once

#include "base/ids.h"
#include "base/memory.h"
#include "base/vec.h"
#include "visibility/portal_graph.h"

#include <vector>

namespace enfilade {

// Doorways out of one cell; not empty.
using DoorwayGroup = std::vector<const Doorway*>;

// The building at the level of convex regions, many of which may be one cell.
class RegionGraph {
 public:
  // `cell_of`: by region. What it takes is charged.
  RegionGraph(size_t cells,
              std::vector<CellId> cell_of,
              const PortalSource& openings,
              MemoryBudget& budget);

  [[nodiscard]] const PortalGraph& Graph() const { return graph_; }

  [[nodiscard]] CellId CellOf(CellId region) const {
    return cell_of_[region.Index()];
  }

  // The openings out of a cell to other cells.
  [[nodiscard]] DoorwayGroup DoorwaysOut(CellId cell) const;

 private:
  MemoryCharge charge_;  // of what is beside the graph
  PortalGraph graph_;
  std::vector<CellId> cell_of_;               // by region
  std::vector<std::vector<CellId>> regions_;  // by cell
};

// Splits the doorways into a dozen groups, or fewer, of those that lie near
// each other and look the same way; the largest first, which are the likeliest
// to take too many tests.
std::vector<DoorwayGroup> GroupDoorways(const DoorwayGroup& doorways);

Box3 BoundsOf(const DoorwayGroup& group);

}  // namespace enfilade
