// Finds what can be seen through some doorways of a cell without trying
// sequences of doorways one by one: each doorway is looked through once or
// twice, from all the first doorways together. Internal to src/visibility.

#pragma once

#include "base/ids.h"
#include "base/vec.h"
#include "visibility/portal_graph.h"
#include "visibility/region_graph.h"

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace enfilade {

// The part of each cell that was reached: a box, empty if nothing was reached.
class ReachedParts {
 public:
  // `bounds` is indexed by cell.
  explicit ReachedParts(std::vector<Box3> bounds)
      : bounds_(std::move(bounds)), parts_(bounds_.size()) {}

  static uint64_t BytesFor(size_t cells) { return 2 * cells * sizeof(Box3); }

  [[nodiscard]] const Box3& BoundsOf(CellId cell) const {
    return bounds_[cell.Index()];
  }

  // The reached box of a cell; empty if nothing was reached.
  [[nodiscard]] const Box3& Of(CellId cell) const {
    return parts_[cell.Index()];
  }

  [[nodiscard]] bool Holds(CellId cell) const { return !Of(cell).IsEmpty(); }

  void Add(CellId cell, const Box3& box) { parts_[cell.Index()].Include(box); }

  void AddAllOf(CellId cell) { parts_[cell.Index()] = BoundsOf(cell); }

  void AddEverything() { parts_ = bounds_; }

 private:
  std::vector<Box3> bounds_;
  std::vector<Box3> parts_;
};

// Floods from doorway to doorway. A doorway is reached if some part of it lies
// beyond a reached doorway, inside the beam through the reached part of that
// doorway. The beam holds the lines that pass the hull of the first doorways,
// the doorway itself and its seven nearest dominators (doorways without which
// it was not reached so far, in the flow graph of reached doorways). Finds
// every cell that a line through a first doorway can reach, and some more,
// because the doorways between one dominator and the next are forgotten.
class BeamFlood {
 public:
  explicit BeamFlood(const RegionGraph& regions);

  // The most memory that a flood through these regions takes.
  static uint64_t MostBytes(const RegionGraph& regions);

  // Adds what is reached and returns true. If the flood would take too many
  // tests or doorways, adds everything and returns false.
  bool Run(const DoorwayGroup& firsts, ReachedParts* reached);

 private:
  // Some of kept_planes_, if the epoch is still epoch_.
  struct KeptPlanes {
    uint64_t epoch = 0;
    size_t first = 0;
    size_t count = 0;
  };

  // A reached doorway and the reached part of it.
  struct Node {
    const Doorway* door = nullptr;
    std::vector<Point3> region;
    // The nearest dominator, a node; kNone for a first doorway.
    uint32_t dominator = 0;
    uint32_t growths = 0;  // times that the region grew
    // The clock_ when the region or the dominator last changed.
    uint64_t changed_at = 0;
    uint64_t passed_at = 0;
    // A first doorway is reached as a whole from nowhere, and never changes.
    bool is_first = false;
    bool is_waiting = false;
    KeptPlanes kept = {};
  };

  // A node to be looked through, and its distance from the first doorways.
  struct Waiting {
    double distance = 0;
    uint32_t node = 0;

    friend bool operator<(const Waiting& a, const Waiting& b) {
      return std::pair(b.distance, b.node) < std::pair(a.distance, a.node);
    }
  };

  void Begin(const DoorwayGroup& firsts);
  // Notes that `region` of a doorway was reached from the node `from`, or from
  // the source cell (kNone).
  void Reach(const Doorway& door, std::vector<Point3> region, uint32_t from);
  void Wait(uint32_t number);
  uint32_t TakeNearest();
  // Whether a dominator of the node has changed since the node was last passed.
  [[nodiscard]] bool IsOutdated(const Node& node) const;
  // The nearest node that is a dominator of both a and b, or is one of them and
  // dominates the other; kNone if there is none.
  [[nodiscard]] uint32_t CommonDominator(uint32_t a, uint32_t b) const;
  [[nodiscard]] bool IsFirst(const Doorway& door) const;
  // Whether a line through the passed doorway, held by the given planes of that
  // doorway, may pass the next one. Makes only cheap tests.
  static bool CanPass(const Node& passed,
                      std::span<const Plane> planes,
                      const Doorway& next);
  std::span<const Plane> SupportsOf(uint32_t number);
  void ForgetPlanes();
  // Sets planes_ and ahead_ to those of the beam through a node and its
  // dominators.
  void LookThrough(uint32_t number);
  [[nodiscard]] Box3 PartOf(const Box3& bounds) const;
  // Whether the planes leave some part of the doorway; if so, sets part_ to it.
  bool FindPart(const Doorway& next);

  const RegionGraph* regions_;
  std::vector<uint32_t> node_of_;  // by doorway
  std::vector<Node> nodes_;
  std::vector<Waiting> waiting_;  // a heap: the nearest first
  uint64_t clock_ = 0;
  std::vector<Point3> source_;  // corners of a hull of the first doorways
  Box3 source_bounds_;          // of the first doorways
  std::vector<Plane> kept_planes_;
  size_t most_kept_planes_;
  uint64_t epoch_ = 1;
  // The lines of the beam reach only what lies beyond all these planes.
  std::vector<Plane> planes_;
  // The doorways that the lines may pass next.
  std::vector<const Doorway*> ahead_;
  std::vector<Point3> part_, clipped_;
};

}  // namespace enfilade
