// The building as a graph of the convex regions that cells are joined of, and
// the doorways out of a cell in groups that are looked through together.
// Internal to src/visibility.

#pragma once

#include "base/ids.h"
#include "base/memory.h"
#include "base/vec.h"
#include "visibility/portal_graph.h"

#include <vector>

namespace enfilade {

// Doorways out of one cell; not empty.
using DoorwayGroup = std::vector<const Doorway*>;

// The building as a graph of convex regions. Many regions may form one cell.
class RegionGraph {
 public:
  // `cell_of` is indexed by region. Charges the memory of the graph.
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
  MemoryCharge charge_;  // of all but the graph
  PortalGraph graph_;
  std::vector<CellId> cell_of_;               // by region
  std::vector<std::vector<CellId>> regions_;  // by cell
};

// Splits the doorways into at most a dozen groups of doorways that lie near
// each other and face the same way. The largest groups come first, because they
// are the likeliest to take too many tests.
std::vector<DoorwayGroup> GroupDoorways(const DoorwayGroup& doorways);

Box3 BoundsOf(const DoorwayGroup& group);

}  // namespace enfilade
