// Makes the portals between cells from the open borders between their leaves.

#pragma once

#include "partition/cell_merge.h"
#include "partition/open_borders.h"
#include "partition/partition.h"

#include <functional>
#include <vector>

namespace enfilade {

// Visits the portals, which cover every open border between different cells.
// Joins openings in one plane between the same two cells if their convex hull
// is hardly larger than they are, so that an opening that the tree or the
// outlines of its neighbours have cut up becomes one portal again. The portals
// come in the order of the borders' nodes, then by their cells. Takes a few
// times OpenBorders::MostBytesOfNode() of memory.
void ForEachPortal(const BspTree& tree,
                   const OpenBorders& borders,
                   const std::vector<CellId>& cell_of_leaf,
                   const std::function<void(Portal)>& visit);

}  // namespace enfilade
