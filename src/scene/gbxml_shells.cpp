#include "scene/gbxml_shells.h"

#include "base/planar_polygon.h"
#include "scene/figure_cut.h"
#include "scene/shell_trial.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

namespace enfilade {
namespace {

constexpr double kShellToleranceMetres = 0.01;
constexpr double kOffsetsMetres[] = {0.01, 0.05};

// The first of the polygons without which least is open, and how much is.
std::pair<std::vector<uint32_t>::const_iterator, double>
WithoutWhichLeastIsOpen(const std::vector<uint32_t>& polygons,
                        double open,
                        ShellTrial& trial) {
  const double rounding = 1e-6 * (1 + open);
  double least = std::numeric_limits<double>::infinity();
  auto best = polygons.end();
  for (auto it = polygons.begin(); it != polygons.end(); ++it) {
    if (open + trial.ChangeWithout(*it) > least + rounding) {
      continue;  // without the whole sum
    }
    const double left = trial.OpenLengthWithout(*it);
    if (left < least) {
      least = left;
      best = it;
    }
  }
  return {best, least};
}

}  // namespace

bool Separates(const GbxmlSurface& surface) {
  return surface.first && surface.first != surface.second;
}

GbxmlShells::GbxmlShells(const GbxmlModel& model)
    : model_(&model), shells_(model.spaces.size()) {
  std::vector<std::vector<size_t>> doubtful(model_->spaces.size());
  for (size_t i = 0; i < model_->surfaces.size(); ++i) {
    const GbxmlSurface& s = model_->surfaces[i];
    if (Separates(s)) {
      shells_[s.first->Index()].Add(s.polygon);
      if (s.second) {
        shells_[s.second->Index()].Add(s.polygon);
      }
    } else if (s.first) {
      doubtful[s.first->Index()].push_back(i);
    }
  }
  in_shell_.assign(model_->surfaces.size(), false);
  for (size_t i = 0; i < shells_.size(); ++i) {
    Complete(shells_[i], doubtful[i]);
  }
}

bool GbxmlShells::IsClosed(SpaceId space) const {
  return shells_[space.Index()].IsClosed(kShellToleranceMetres);
}

// Surfaces that name one Space twice are partitions inside the Space or, in
// some files, walls and floors with nothing modelled behind them. A Surface is
// taken as one of the latter if the shell needs it to be closed, or less open.
void GbxmlShells::Complete(SpaceShell& shell,
                           const std::vector<size_t>& doubtful) {
  constexpr size_t kMostTogether = 8;
  if (doubtful.size() <= kMostTogether) {
    CompleteByBest(shell, doubtful);
  } else {
    CompleteByLeavingOut(SpaceShell(shell), doubtful, &shell);
  }
}

// Tries each set of Surfaces.
void GbxmlShells::CompleteByBest(SpaceShell& shell,
                                 const std::vector<size_t>& doubtful) {
  const size_t tried = doubtful.size();
  SpaceShell best = shell;
  double best_open = shell.OpenLength(kShellToleranceMetres);
  size_t best_mask = 0;
  for (size_t mask = 1; mask < (size_t{1} << tried) && best_open > 0; ++mask) {
    SpaceShell candidate = shell;
    for (size_t bit = 0; bit < tried; ++bit) {
      if ((mask >> bit & 1U) != 0) {
        candidate.Add(model_->surfaces[doubtful[bit]].polygon);
      }
    }
    const double open = candidate.OpenLength(kShellToleranceMetres);
    if (open < best_open - kShellToleranceMetres || open == 0) {
      best = std::move(candidate);
      best_open = open;
      best_mask = mask;
    }
  }
  shell = std::move(best);
  for (size_t bit = 0; bit < tried; ++bit) {
    in_shell_[doubtful[bit]] = (best_mask >> bit & 1U) != 0;
  }
}

// Begins with all Surfaces, since a wall alone may close less than it opens,
// and leaves out the one without which least is open, again and again.
void GbxmlShells::CompleteByLeavingOut(const SpaceShell& bare,
                                       std::vector<size_t> doubtful,
                                       SpaceShell* shell) {
  ShellTrial trial(kShellToleranceMetres);
  trial.AddEdges(bare.Edges());
  for (const size_t i : doubtful) {
    trial.AddPolygon(model_->surfaces[i].polygon);
  }
  trial.Begin();
  std::vector<uint32_t> kept(doubtful.size());
  std::iota(kept.begin(), kept.end(), 0U);
  double open = trial.OpenLength();
  while (open > 0 && !kept.empty()) {
    const auto [without, least] = WithoutWhichLeastIsOpen(kept, open, trial);
    if (least >= open) {
      break;
    }
    open = least;
    trial.LeaveOut(*without);
    kept.erase(without);
  }
  if (open < bare.OpenLength(kShellToleranceMetres) - kShellToleranceMetres) {
    *shell = bare;
    for (const uint32_t k : kept) {
      shell->Add(model_->surfaces[doubtful[k]].polygon);
      in_shell_[doubtful[k]] = true;
    }
  }
}

GbxmlShells::SpacePair GbxmlShells::SidesOf(size_t index) {
  const GbxmlSurface& surface = model_->surfaces[index];
  const bool in_shell = in_shell_[index];
  if (!Separates(surface) && !in_shell) {
    return {surface.first, surface.second};
  }
  const int votes = FirstInFront(surface);
  unclear_ += votes == 0 ? 1U : 0U;
  if (in_shell) {
    return votes > 0 ? SpacePair{surface.first, std::nullopt}
                     : SpacePair{std::nullopt, surface.first};
  }
  turned_ += votes > 0 ? 1U : 0U;
  return votes > 0 ? SpacePair{surface.first, surface.second}
                   : SpacePair{surface.second, surface.first};
}

// Tests points just off the Surface: positive if its first Space is in front,
// negative if that Space is behind, 0 if the shells do not tell.
int GbxmlShells::FirstInFront(const GbxmlSurface& surface) const {
  const Vec3 area = AreaVector(surface.polygon);
  const Vec3 normal = Normalize(area);
  std::vector<Edge3> outline;
  AppendEdges(surface.polygon, false, outline);
  const std::vector<Polygon3> pieces =
      CutFigure(outline, area, kCutToleranceMetres);
  for (const double offset : kOffsetsMetres) {
    int votes = 0;
    for (const Polygon3& piece : pieces) {
      const Point3 p = VertexMean(piece);
      votes += Vote(surface, p + normal * offset, p - normal * offset);
    }
    if (votes != 0) {
      return votes;
    }
  }
  return 0;
}

int GbxmlShells::Vote(const GbxmlSurface& surface,
                      Point3 front,
                      Point3 back) const {
  const auto lean = [&](SpaceId space) {
    const SpaceShell& shell = shells_[space.Index()];
    return (shell.Contains(front) ? 1 : 0) - (shell.Contains(back) ? 1 : 0);
  };
  return lean(*surface.first) -
         (Separates(surface) && surface.second ? lean(*surface.second) : 0);
}

}  // namespace enfilade
