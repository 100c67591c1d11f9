// What is open of a shell when some of its polygons are left out, without
// looking at all of it for each.

#pragma once

#include "scene/figure_cut.h"

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace enfilade {

class ShellTrial {
 public:
  // The tolerance is that of SpaceShell::OpenLength, in metres.
  explicit ShellTrial(double tolerance) : tolerance_(tolerance) {}

  // Edges that stay, before the first polygon.
  void AddEdges(std::span<const Edge3> edges);
  // A polygon that may be left out; they are numbered from 0.
  void AddPolygon(std::span<const Point3> polygon);
  // Looks for the edges that run along each other. Nothing is added after that.
  void Begin();

  // The bits of SpaceShell::OpenLength for a shell of the same edges in the
  // same order, without the polygons that are left out.
  [[nodiscard]] double OpenLength() const;
  // The same without one more polygon.
  [[nodiscard]] double OpenLengthWithout(uint32_t polygon);
  // About how much more is open without one more polygon; negative if less is.
  [[nodiscard]] double ChangeWithout(uint32_t polygon);

  void LeaveOut(uint32_t polygon);

 private:
  struct Change {
    uint32_t edge = 0;
    double open = 0;
  };

  struct Polygon {
    uint32_t first_edge = 0, end_edge = 0;
    bool is_out = false;
    // What leaving it out makes of other edges, in their order; nothing if that
    // is not known.
    std::optional<std::vector<Change>> changes;
  };

  [[nodiscard]] std::span<const uint32_t> NearEdges(uint32_t edge) const;
  void FindNearEdges();
  [[nodiscard]] bool Covers(uint32_t other, uint32_t edge) const;
  [[nodiscard]] bool IsIn(uint32_t edge) const;
  [[nodiscard]] double OpenOf(uint32_t edge, uint32_t without) const;
  [[nodiscard]] std::vector<uint32_t> EdgesBeside(uint32_t polygon) const;
  const std::vector<Change>& ChangesWithout(uint32_t polygon);

  double tolerance_;
  std::vector<Edge3> edges_;
  std::vector<uint32_t> owners_;  // by edge, the polygon, or kStays
  std::vector<double> open_;      // by edge, 0 if it is left out
  std::vector<Polygon> polygons_;
  // By edge: those that may cover part of it, and itself.
  std::vector<std::vector<uint32_t>> near_;
  std::vector<uint32_t> all_;  // in place of near_, if that would be too long
};

}  // namespace enfilade
