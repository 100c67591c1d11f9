// The order in which the paths of many receivers are traced, in batches.

#pragma once

#include "base/vec.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tools/building_view.h"
#include "tools/verify/geometry.h"

namespace enfilade {

enum class GatherMode {
  kPaths,  // follows light through all its reflections
  kField,  // takes the view's radiosity for reflected light at the first hit
};

// Where a path begins: at a receiver, in one of its strata^2 strata.
struct PathStart {
  uint32_t receiver = 0;
  uint32_t strata = 1;
  uint32_t stratum = 0;
};

// Hands out the paths of all receivers. If the building does not fit into
// memory, the receivers of a batch are near each other, so that its rays meet
// few chunks. The paths of a receiver come in the order of their strata.
class PathQueue {
 public:
  // `strata`, by receiver, must outlive this.
  PathQueue(std::span<const Receiver> receivers,
            std::span<const uint32_t> strata,
            const BuildingView& view,
            GatherMode mode);

  // The number of paths of all receivers.
  [[nodiscard]] uint64_t Paths() const;

  // Replaces `starts` by the next paths, at most `most`.
  void TakeBatch(size_t most, std::vector<PathStart>* starts);

 private:
  void SortInSpace(std::span<const Receiver> receivers, const Box3& bounds);

  std::span<const uint32_t> strata_;
  std::vector<uint32_t> order_;  // receivers
  size_t most_receivers_;        // of a batch
  size_t next_ = 0;              // in the order
  uint32_t stratum_ = 0;         // the next of that receiver
};

}  // namespace enfilade
