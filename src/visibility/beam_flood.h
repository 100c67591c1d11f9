// What can be seen through some doorways of a cell, without trying sequences
// one by one: each doorway is looked through once or twice, from all the first
// doorways together. Internal to src/visibility.

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

// What was reached of each cell: a box of it, or nothing.
class ReachedParts {
 public:
  // `bounds`: by cell.
  explicit ReachedParts(std::vector<Box3> bounds)
      : bounds_(std::move(bounds)), parts_(bounds_.size()) {}

  static uint64_t BytesFor(size_t cells) { return 2 * cells * sizeof(Box3); }

  [[nodiscard]] const Box3& BoundsOf(CellId cell) const {
    return bounds_[cell.Index()];
  }

  // Empty: nothing.
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

// Floods from doorway to doorway. A doorway is reached when some part of it
// lies beyond a reached doorway, within the beam through the reached part of
// that. The beam holds what passes the hull of the first doorways and every
// doorway without which none was reached so far (the dominators of the flow
// graph of reached doorways). Finds every cell that a line through a first
// doorway can reach, and some more: the doorways between one dominator and the
// next are forgotten.
class BeamFlood {
 public:
  explicit BeamFlood(const RegionGraph& regions);

  // What a flood through these regions may take in memory.
  static uint64_t MostBytes(const RegionGraph& regions);

  // Adds what is reached; everything, if telling would take too many tests or
  // doorways, and then returns false.
  bool Run(const DoorwayGroup& firsts, ReachedParts* reached);

 private:
  // A doorway that was reached, and the part of it that was.
  struct Node {
    const Doorway* door = nullptr;
    std::vector<Point3> region;
    uint32_t dominator = 0;   // the nearest, a node; kNone for a first doorway
    uint32_t growths = 0;     // of the region
    uint64_t changed_at = 0;  // its region or dominator; by clock_
    uint64_t passed_at = 0;
    bool is_first = false;  // whole, and nothing before it: it never changes
    bool is_waiting = false;
  };

  // A node to be looked through, and how far it is from the first doorways.
  struct Waiting {
    double distance = 0;
    uint32_t node = 0;

    friend bool operator<(const Waiting& a, const Waiting& b) {
      return std::pair(b.distance, b.node) < std::pair(a.distance, a.node);
    }
  };

  void Begin(const DoorwayGroup& firsts);
  // From the node `from`, or kNone.
  void Reach(const Doorway& door, std::vector<Point3> region, uint32_t from);
  void Wait(uint32_t number);
  uint32_t TakeNearest();
  // Whether a dominator has changed since the node was last passed.
  [[nodiscard]] bool IsOutdated(const Node& node) const;
  // The nearest node that is a dominator of both, or one of them; or kNone.
  [[nodiscard]] uint32_t CommonDominator(uint32_t a, uint32_t b) const;
  [[nodiscard]] bool IsFirst(const Doorway& door) const;
  // Whether a line through the passed doorway, held by these planes of it, may
  // pass the next one: all that is cheap to tell.
  static bool CanPass(const Node& passed,
                      std::span<const DoorPlane> planes,
                      const Doorway& next);
  // Finds planes_ and ahead_ of the beam through a node and its dominators.
  void LookThrough(uint32_t number);
  [[nodiscard]] Box3 PartOf(const Box3& bounds) const;
  // Whether the planes leave some part of the doorway, which is part_ then.
  bool FindPart(const Doorway& next);

  const RegionGraph* regions_;
  std::vector<uint32_t> node_of_;  // by doorway
  std::vector<Node> nodes_;
  std::vector<Waiting> waiting_;  // a heap: the nearest first
  uint64_t clock_ = 0;
  std::vector<Point3> source_;     // corners of a hull of the first doorways
  Box3 source_bounds_;             // of the first doorways
  std::vector<DoorPlane> planes_;  // what lines can reach lies beyond
  std::vector<const Doorway*> ahead_;  // where they may go on to
  std::vector<Point3> part_, clipped_;
};

}  // namespace enfilade
