#include "scene/default_luminaires.h"

#include "base/stop.h"
#include "scene/plan_index.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

namespace enfilade {
namespace {

constexpr double kPanelMetres = 0.6;
constexpr double kMarginMetres = 0.05;   // from a panel to a wall
constexpr double kHangMetres = 0.03;     // from a ceiling to its panel
constexpr double kBeamMetres = 0.4;      // how far below a lamp walls count
constexpr double kSpacingMetres = 2.4;   // from panel to panel
constexpr double kCoarseSteps = 8;       // fine steps in a spacing
constexpr double kFineStepMetres = 0.3;  // rooms of 0.6 + 0.3 m are not missed
constexpr double kLeastClearMetres = 1.2;
constexpr double kLeastRoomMetres = 1.8;
constexpr double kMostRoomMetres = 15.0;
constexpr double kSameCeilingMetres = 0.5;
constexpr double kExitanceWPerM2 = 320.0;    // 20 x spacing^2 / panel area
constexpr double kExitanceLmPerM2 = 8000.0;  // 500 x the same
constexpr double kLevelCosine = 0.94;        // 20 degrees
constexpr double kLevelCosineInSpaces = 0.5;

// A panel that is laid, or a candidate.
struct Lamp {
  Point2 center;
  double height = 0;
  std::optional<SpaceId> space;
};

// A rectangle in plan; empty if `low` is not at most `high`.
struct Extent {
  static constexpr double kFar = std::numeric_limits<double>::infinity();

  Point2 low{kFar, kFar};
  Point2 high{-kFar, -kFar};

  [[nodiscard]] bool IsEmpty() const {
    return !(low.x <= high.x && low.y <= high.y);
  }

  [[nodiscard]] std::array<Point2, 4> Corners() const {
    return {{low, {high.x, low.y}, high, {low.x, high.y}}};
  }
};

Extent Common(const Extent& a, const Extent& b) {
  return {{std::max(a.low.x, b.low.x), std::max(a.low.y, b.low.y)},
          {std::min(a.high.x, b.high.x), std::min(a.high.y, b.high.y)}};
}

// A little wider than the face is.
Extent ExtentOf(const LevelFace& face) {
  constexpr double kRoundingMetres = 1e-3;
  Extent extent;
  for (const Point2 p : face.outline) {
    extent.low = {std::min(extent.low.x, p.x - kRoundingMetres),
                  std::min(extent.low.y, p.y - kRoundingMetres)};
    extent.high = {std::max(extent.high.x, p.x + kRoundingMetres),
                   std::max(extent.high.y, p.y + kRoundingMetres)};
  }
  return extent;
}

// Whether the floor is anywhere in the extent as far below the ceiling as a
// room is high. A lamp hangs from the lowest point that the ceiling has over
// it.
bool MayBeRoom(const LevelFace& ceiling,
               const LevelFace& floor,
               const Extent& extent) {
  constexpr double kSlackMetres = 0.1;
  const double over_lamp =
      0.5 * kPanelMetres *
      (std::abs(ceiling.slope.x) + std::abs(ceiling.slope.y));
  double least = Extent::kFar;
  double most = -Extent::kFar;
  for (const Point2 p : extent.Corners()) {
    const double height = ceiling.HeightAt(p) - floor.HeightAt(p);
    least = std::min(least, height);
    most = std::max(most, height);
  }
  return most >= kLeastRoomMetres - kSlackMetres &&
         least - over_lamp <= kMostRoomMetres + kSlackMetres;
}

// The stretches of a column of the plan that some extents cover, as the column
// moves on: each extent is looked at only while the column is over it.
class ColumnStretches {
 public:
  explicit ColumnStretches(std::vector<Extent> extents)
      : extents_(std::move(extents)) {
    std::sort(
        extents_.begin(), extents_.end(), [](const Extent& a, const Extent& b) {
          return a.low.x < b.low.x;
        });
  }

  // In order, and apart from each other. Requires an x not below those before.
  [[nodiscard]] const std::vector<std::pair<double, double>>& At(double x) {
    for (; next_ < extents_.size() && extents_[next_].low.x <= x; ++next_) {
      open_.push_back(extents_[next_]);
    }
    open_.erase(std::remove_if(open_.begin(),
                               open_.end(),
                               [x](const Extent& e) { return e.high.x < x; }),
                open_.end());
    std::sort(open_.begin(), open_.end(), [](const Extent& a, const Extent& b) {
      return a.low.y < b.low.y;
    });
    stretches_.clear();
    for (const Extent& e : open_) {
      if (stretches_.empty() || stretches_.back().second < e.low.y) {
        stretches_.emplace_back(e.low.y, e.high.y);
      } else {
        stretches_.back().second = std::max(stretches_.back().second, e.high.y);
      }
    }
    return stretches_;
  }

 private:
  std::vector<Extent> extents_;
  size_t next_ = 0;
  std::vector<Extent> open_;
  std::vector<std::pair<double, double>> stretches_;
};

class LampLayer {
 public:
  LampLayer(const PlanIndex& plan,
            const LuminaireInput& input,
            MemoryBudget& budget)
      : plan_(plan), input_(input), charge_(budget, "the default luminaires") {}

  const std::vector<Lamp>& Run() {
    for (const double step :
         {kCoarseSteps * kFineStepMetres, kFineStepMetres}) {
      for (size_t i = 0; i < plan_.Levels().size(); ++i) {
        if (!input_.has_spaces || plan_.Levels()[i].below) {
          TryGrid(i, step);
        }
      }
    }
    return lamps_;
  }

 private:
  // Where floors may be under a ceiling.
  [[nodiscard]] std::vector<Extent> FloorsUnder(size_t ceiling) const {
    const LevelFace& above = plan_.Levels()[ceiling];
    const Extent whole = ExtentOf(above);
    std::vector<Extent> floors;
    for (const uint32_t i : plan_.LevelsIn(whole.low, whole.high)) {
      const LevelFace& below = plan_.Levels()[i];
      const Extent common = Common(whole, ExtentOf(below));
      if (i != ceiling && !common.IsEmpty() &&
          MayBeRoom(above, below, common)) {
        floors.push_back(common);
      }
    }
    return floors;
  }

  void TryGrid(size_t index, double step) {
    const LevelFace& ceiling = plan_.Levels()[index];
    std::vector<Extent> floors = FloorsUnder(index);
    if (floors.empty()) {
      return;
    }
    const auto first = [&](double value) {
      return static_cast<int64_t>(std::ceil(value / step - 0.5));
    };
    const auto at = [&](int64_t i) {
      return (static_cast<double>(i) + 0.5) * step;
    };
    double low = Extent::kFar;
    double high = -Extent::kFar;
    for (const Extent& floor : floors) {
      low = std::min(low, floor.low.x);
      high = std::max(high, floor.high.x);
    }
    ColumnStretches columns(std::move(floors));
    for (int64_t i = first(low); at(i) <= high; ++i) {
      ThrowIfStopRequested();
      for (const auto& [from, to] : columns.At(at(i))) {
        for (int64_t j = first(from); at(j) <= to; ++j) {
          TryPlace(ceiling, {at(i), at(j)});
        }
      }
    }
  }

  void TryPlace(const LevelFace& ceiling, Point2 center) {
    if (!ceiling.Covers(center)) {
      return;
    }
    const double reach = 0.5 * kPanelMetres;
    const std::array<Point2, 4> corners{{{center.x - reach, center.y - reach},
                                         {center.x + reach, center.y - reach},
                                         {center.x + reach, center.y + reach},
                                         {center.x - reach, center.y + reach}}};
    double lowest = ceiling.HeightAt(center);
    for (const Point2 p : corners) {
      lowest = std::min(lowest, ceiling.HeightAt(p));
    }
    const Lamp lamp{center, lowest - kHangMetres, ceiling.below};
    // Where there is no room is known much sooner than where there is a lamp.
    if (!IsRoomBelow(lamp, center) || IsServed(lamp) ||
        !std::all_of(corners.begin(), corners.end(), [&](Point2 p) {
          return IsUnderCeiling(lamp, p) && IsRoomBelow(lamp, p);
        })) {
      return;
    }
    const double wall_reach = reach + kMarginMetres;
    if (plan_.WallInBox({center.x - wall_reach, center.y - wall_reach},
                        {center.x + wall_reach, center.y + wall_reach},
                        lamp.height - kBeamMetres,
                        lamp.height)) {
      return;
    }
    // A growing vector, and an entry of the map with a vector of its own.
    constexpr uint64_t kBytesPerLamp = 3 * sizeof(Lamp) + 160;
    charge_.GrowTo(kBytesPerLamp * (lamps_.size() + 1));
    near_[CellOf(center)].push_back(lamps_.size());
    lamps_.push_back(lamp);
  }

  // Whether a lamp of the same room is nearer than the spacing.
  [[nodiscard]] bool IsServed(const Lamp& lamp) const {
    const auto [x, y] = CellOf(lamp.center);
    for (int64_t i = x - 1; i <= x + 1; ++i) {
      for (int64_t j = y - 1; j <= y + 1; ++j) {
        const auto it = near_.find({i, j});
        if (it != near_.end() &&
            std::any_of(it->second.begin(), it->second.end(), [&](size_t k) {
              return Serves(lamps_[k], lamp);
            })) {
          return true;
        }
      }
    }
    return false;
  }

  [[nodiscard]] bool Serves(const Lamp& other, const Lamp& lamp) const {
    constexpr double kRoundingMetres = 1e-6;
    constexpr double kSameStoreyMetres = 1.5;
    const double apart = std::hypot(other.center.x - lamp.center.x,
                                    other.center.y - lamp.center.y);
    if (apart >= kSpacingMetres - kRoundingMetres ||
        std::abs(other.height - lamp.height) >= kSameStoreyMetres) {
      return false;
    }
    return input_.has_spaces
               ? other.space == lamp.space
               : !plan_.WallBetween(
                     other.center, lamp.center, lamp.height - kBeamMetres / 2);
  }

  // Whether a ceiling of the room is over p, not far above the lamp.
  [[nodiscard]] bool IsUnderCeiling(const Lamp& lamp, Point2 p) const {
    bool under = false;
    plan_.ForLevelsAt(p, [&](const LevelFace& face) {
      const double above = face.HeightAt(p) - lamp.height;
      under =
          under || (above >= 0 && above <= kSameCeilingMetres + kHangMetres &&
                    (!input_.has_spaces || face.below == lamp.space));
    });
    return under;
  }

  // Whether there is free height under the lamp at p, and a floor below.
  [[nodiscard]] bool IsRoomBelow(const Lamp& lamp, Point2 p) const {
    bool is_free = true;
    bool has_floor = false;
    plan_.ForLevelsAt(p, [&](const LevelFace& face) {
      const double depth = lamp.height + kHangMetres / 2 - face.HeightAt(p);
      is_free = is_free && !(depth >= 0 && depth < kLeastClearMetres);
      has_floor =
          has_floor || (depth >= kLeastRoomMetres && depth <= kMostRoomMetres);
    });
    return is_free && has_floor;
  }

  static std::pair<int64_t, int64_t> CellOf(Point2 p) {
    return {static_cast<int64_t>(std::floor(p.x / kSpacingMetres)),
            static_cast<int64_t>(std::floor(p.y / kSpacingMetres))};
  }

  const PlanIndex& plan_;
  const LuminaireInput& input_;
  GrowingCharge charge_;
  std::vector<Lamp> lamps_;
  std::map<std::pair<int64_t, int64_t>, std::vector<size_t>> near_;
};

Face PanelOf(const Lamp& lamp, const PlanIndex& plan, MaterialId material) {
  const double r = 0.5 * kPanelMetres;
  const Point2 c = lamp.center;
  Face face;
  face.material = material;
  face.front_space = lamp.space;
  face.back_space = lamp.space;
  for (const Point2 p : {Point2{c.x - r, c.y - r},
                         Point2{c.x - r, c.y + r},
                         Point2{c.x + r, c.y + r},
                         Point2{c.x + r, c.y - r}}) {
    face.vertices.push_back(plan.ToWorld(p, lamp.height));
  }
  return face;
}

}  // namespace

Material DefaultLuminaireMaterial(bool photometric) {
  Material material;
  material.name = "default luminaire";
  material.exitance.fill(photometric ? kExitanceLmPerM2 : kExitanceWPerM2);
  material.sides = 1;
  return material;
}

uint64_t LayDefaultLuminaires(const BlockStorage& store,
                              const LuminaireInput& input,
                              MemoryBudget& budget,
                              const FaceVisitor& lay) {
  PlanIndex plan(input.y_is_up ? 1 : 2,
                 input.has_spaces ? kLevelCosineInSpaces : kLevelCosine,
                 budget);
  ForEachFace(store, [&](FaceId, const Face& face) {
    plan.Add(face.vertices, face.front_space, face.back_space);
  });
  for (const Opening& opening : input.openings) {
    plan.Add(opening.vertices, opening.front_space, opening.back_space);
  }
  LampLayer layer(plan, input, budget);
  const std::vector<Lamp>& lamps = layer.Run();
  for (const Lamp& lamp : lamps) {
    lay(PanelOf(lamp, plan, input.material));
  }
  return lamps.size();
}

}  // namespace enfilade
