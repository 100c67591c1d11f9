// What can be seen through some doorways of a cell, without trying sequences
// one by one: each doorway is looked through once or twice, from all the first
// doorways together. Internal to src/visibility.

#pragma once

#include "base/ids.h"
#include "visibility/portal_graph.h"

#include <cstdint>
#include <vector>

namespace enfilade {

// Doorways out of one cell; not empty.
using DoorwayGroup = std::vector<const Doorway*>;

// The building at the level of convex regions, many of which may be one cell.
class RegionGraph {
 public:
  RegionGraph(size_t cells, const Regions& regions);

  [[nodiscard]] const PortalGraph& Graph() const { return graph_; }

  [[nodiscard]] CellId CellOf(CellId region) const {
    return cell_of_[region.Index()];
  }

  // The openings out of a cell to other cells.
  [[nodiscard]] DoorwayGroup DoorwaysOut(CellId cell) const;

 private:
  PortalGraph graph_;
  std::vector<CellId> cell_of_;               // by region
  std::vector<std::vector<CellId>> regions_;  // by cell
};

// Splits the doorways into a dozen groups, or fewer, of those that lie near
// each other and look the same way; the largest first, which are the likeliest
// to take too many tests.
std::vector<DoorwayGroup> GroupDoorways(const DoorwayGroup& doorways);

// Floods from doorway to doorway. A doorway is reached when some part of it
// lies beyond a reached doorway, within the beam that the hull of the first
// ones sends through the reached part of that. Finds every cell that a line
// through a first doorway can reach (and, as a line must only pass every two
// doorways in a row and the first ones, some more).
class BeamFlood {
 public:
  explicit BeamFlood(const RegionGraph& regions);

  // Sets in `reached` (by cell) what is reached; all cells, if telling would
  // take too many tests, and then returns false.
  bool Run(const DoorwayGroup& firsts, std::vector<bool>& reached);

 private:
  // A doorway that was reached, and the part of it that was.
  struct Node {
    const Doorway* door = nullptr;
    std::vector<Point3> region;
    uint32_t growths = 0;  // of the region
    bool is_whole = false;
    bool is_waiting = false;
  };

  void Begin(const DoorwayGroup& firsts);
  void Reach(const Doorway& door, std::vector<Point3> region);
  // Where lines from the source through the node's region can go.
  [[nodiscard]] std::vector<DoorPlane> BeamThrough(const Node& node) const;
  [[nodiscard]] bool IsWhole(const Doorway& door) const;
  // Whether the beam through the node reaches the doorway; its part is part_.
  bool FindPart(const Node& node,
                const std::vector<DoorPlane>& beam,
                const Doorway& next);

  const RegionGraph* regions_;
  std::vector<uint32_t> node_of_;  // by doorway
  std::vector<Node> nodes_;
  std::vector<uint32_t> waiting_;  // nodes, first come first served
  std::vector<Point3> source_;     // corners of a hull of the first doorways
  std::vector<Point3> part_, clipped_;
};

}  // namespace enfilade
