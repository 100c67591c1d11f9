// The receiver's end of a transfer that is being refined: an element at which
// refinement begins, or one below it.

#pragma once

#include "solver/elements/element_tree.h"
#include "solver/refine/refine_receiver.h"
#include "solver/transfer/cluster_tree.h"
#include "solver/transfer/form_factor.h"

#include <cstddef>
#include <cstdint>

namespace enfilade {

struct ReceiverElement {
  TransferEnd end;
  uint32_t patch = 0;
  ElementPath path = kRootPath;
  uint32_t level = 0;  // below the element where refinement begins
  float care = 1;      // of its patch
  float weight = 0;    // reflectance times root of area, times care
};

// An element at which refinement begins.
ReceiverElement RootReceiver(const RefineReceiver& receiver,
                             const ClusterItem& item);

ReceiverElement ChildReceiver(const ReceiverElement& parent, size_t child);

}  // namespace enfilade
