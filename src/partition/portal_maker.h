// Makes the portals between cells of the open borders between their leaves.

#pragma once

#include "partition/cell_merge.h"
#include "partition/leaf_graph.h"
#include "partition/partition.h"

#include <functional>
#include <vector>

namespace enfilade {

// Openings of one plane between the same two cells are joined where their
// convex hull is hardly larger than they are, so that an opening that the tree
// or its neighbours' outlines have cut up is one portal again. Covers every
// open border between different cells. The portals come in the order of the
// borders' nodes, then by their cells. Takes OpenBorders::MostBytesOfNode() a
// few times over.
void ForEachPortal(const BspTree& tree,
                   const OpenBorders& borders,
                   const std::vector<CellId>& cell_of_leaf,
                   const std::function<void(Portal)>& visit);

}  // namespace enfilade
