// Finds by rays what the reflecting sides of each cell look at. Every search
// for what is worth a path's sample in a cell begins with this survey.

#pragma once

#include "base/ids.h"

#include <cstdint>
#include <utility>
#include <vector>

#include "tools/building_view.h"
#include "tools/verify/geometry.h"

namespace enfilade {

struct CellSurvey {
  CellId cell{0U};
  uint64_t key = 0;  // of the cell, for more random numbers; 0 and 1 are used
  // Uniform over the reflecting sides, in strata of equal area.
  std::vector<Receiver> points;
  // The cell itself, the cells beyond its portals (a bulb may reach through),
  // and the cells that one ray from each point meets; ascending.
  std::vector<CellId> cells;
};

class CellSurveyor {
 public:
  static constexpr uint64_t kMostPoints = 128;  // of a cell

  // The view must outlive this.
  explicit CellSurveyor(const BuildingView& view);

  // What this takes, in bytes.
  static uint64_t Bytes(const BuildingView& view);

  // Surveys `count` cells from `first` on, or as many as there are. A survey is
  // a pure function of the cell, the scene and `key`.
  [[nodiscard]] std::vector<CellSurvey> Survey(size_t first,
                                               size_t count,
                                               uint64_t key) const;

 private:
  [[nodiscard]] std::vector<CellId> WithNeighbours(CellId cell) const;
  void TraceFromPoints(std::vector<CellSurvey>& group) const;

  const BuildingView* view_;
  size_t points_;  // of a cell
  // Pairs of a cell and a cell beyond one of its portals, ascending.
  std::vector<std::pair<CellId, CellId>> neighbours_;
};

}  // namespace enfilade
