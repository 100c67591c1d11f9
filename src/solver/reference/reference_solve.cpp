#include "solver/reference/reference_solve.h"

#include "base/error.h"
#include "base/stopwatch.h"
#include "partition/partition.h"
#include "solver/reference/form_factors.h"
#include "solver/reference/matrix_method.h"
#include "solver/reference/panel_solution.h"
#include "solver/reference/reference_store.h"
#include "solver/reference/shooting_method.h"
#include "solver/state/solve_state.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace enfilade {
namespace {

// The number of the first fineness whose estimate counts: symmetric scenes look
// converged while a patch is one panel or four.
constexpr size_t kFirstFinenesses = 4;
// Shares of the requested error that unshot light and steepness may take.
constexpr double kUnshotShare = 0.05;
constexpr double kGradientShare = 1;
// The ratio of the error to the error at twice the edge: 1/2 where radiosity is
// smooth (the error is proportional to the edge), sqrt(1/2) where the edges of
// shadows dominate.
constexpr double kSmoothRate = 0.5;
constexpr double kShadowRate = 0.70710678;

// The trees of a fineness, by cell.
struct ChargedTrees {
  MemoryCharge charge;
  std::vector<CellTree> trees;
};

class ReferenceSolve {
 public:
  ReferenceSolve(BlockStorage& store,
                 const SolveOptions& options,
                 MemoryBudget& budget)
      : store_(store),
        options_(options),
        budget_(budget),
        scene_(store, options.seed, budget),
        form_factors_(
            scene_, FormFactorOptionsOf(options.method), store, budget) {
    control_.stop = options.stop;
    control_.progress = [this](const SolveProgress& progress) {
      if (options_.progress) {
        options_.progress(progress);
      }
    };
  }

  void Run();

 private:
  [[nodiscard]] bool IsMet() const;
  [[nodiscard]] double EdgeOf(size_t fineness) const;
  [[nodiscard]] size_t FinestByPanels(size_t most) const;
  [[nodiscard]] MemoryCharge ChargeTrees(size_t elements) const;
  [[nodiscard]] std::optional<ChargedTrees> StoredTrees() const;
  PanelSolution SolveAt(size_t fineness);
  void Record(const PanelSolution& solution,
              const std::vector<CellTree>& trees,
              const std::vector<CellTree>* coarser);
  [[nodiscard]] uint32_t PanelsOfCell(const PanelSolution& solution,
                                      size_t cell) const;
  void Write(const TreeSolution& solution);

  BlockStorage& store_;
  SolveOptions options_;
  MemoryBudget& budget_;
  ReferenceScene scene_;
  FormFactors form_factors_;
  RunControl control_;
  Basis haar_{1};
  SolveState state_;
  double area_ = 0;  // reflecting, m2
};

void ReferenceSolve::Run() {
  const bool resumed = LoadSolveState(store_, &state_);
  const size_t asked = options_.method.elements;
  const size_t last = FinestByPanels(asked != 0 ? asked : kMostPanels);
  const size_t first = asked != 0 ? last - std::min<size_t>(last, 1) : 0;
  state_.error = options_.error;
  state_.converged =
      resumed && (asked != 0 ? first + state_.rounds.size() > last : IsMet());
  std::optional<ChargedTrees> coarser = StoredTrees();
  for (size_t fineness = first + state_.rounds.size();
       !state_.converged && fineness <= last;
       ++fineness) {
    const PanelSolution solution = SolveAt(fineness);
    // Quartering panels makes a third more elements, and a strip may be some.
    MemoryCharge charge = ChargeTrees(2 * solution.panels.size());
    TreeSolution made = MakeTrees(scene_, haar_, solution);
    Record(solution, made.trees, coarser ? &coarser->trees : nullptr);
    state_.converged = asked != 0 ? fineness == last : IsMet();
    state_.phase = state_.converged || fineness == last ? SolvePhase::kDone
                                                        : SolvePhase::kRefine;
    Write(made);
    coarser = {std::move(charge), std::move(made.trees)};
  }
  state_.phase = SolvePhase::kDone;  // also if there was nothing to do
  SaveSolveState(state_, store_);
  store_.Commit();
}

bool ReferenceSolve::IsMet() const {
  return state_.rounds.size() >= kFirstFinenesses &&
         state_.rounds.back().complete &&
         state_.rounds.back().estimated_error <= state_.error;
}

double ReferenceSolve::EdgeOf(size_t fineness) const {
  return scene_.LongestEdge() * std::pow(0.5, static_cast<double>(fineness));
}

size_t ReferenceSolve::FinestByPanels(size_t most) const {
  size_t fineness = 0;
  while (fineness < kMaxLevel &&
         scene_.DiceCount(EdgeOf(fineness)) <
             scene_.DiceCount(EdgeOf(fineness + 1)) &&
         scene_.DiceCount(EdgeOf(fineness + 1)) <= most) {
    ++fineness;
  }
  return fineness;
}

PanelSolution ReferenceSolve::SolveAt(size_t fineness) {
  const Stopwatch watch(&state_.times.refine_seconds);
  const uint64_t rays = TracedRays() + form_factors_.Rays();
  PanelSolution solution;
  if (TraitsOf(options_.method.kind).has_matrix) {
    LinearOptions linear;
    linear.solver = options_.method.linear_solver;
    linear.check_stop = [&] { control_.Check(1, "linear system"); };
    solution = SolveByMatrix(scene_,
                             form_factors_,
                             scene_.Dice(EdgeOf(fineness)),
                             linear,
                             control_,
                             budget_);
  } else {
    ShootingOptions shooting;
    shooting.source_edge = EdgeOf(fineness);
    shooting.still_to_come = kUnshotShare * options_.error;
    shooting.ambient = options_.method.ambient;
    if (options_.method.kind == SolveMethod::kSubstructuring) {
      shooting.gradient = kGradientShare * options_.error;
      if (options_.method.elements != 0) {
        shooting.source_edge *= 2;  // receivers start at half of that
        shooting.most_receivers = options_.method.elements;
      }
    }
    solution =
        SolveByShooting(scene_, form_factors_, shooting, control_, budget_);
  }
  state_.rays += TracedRays() + form_factors_.Rays() - rays;
  return solution;
}

void ReferenceSolve::Record(const PanelSolution& solution,
                            const std::vector<CellTree>& trees,
                            const std::vector<CellTree>* coarser) {
  area_ = TakeCellRows(scene_, trees, &state_);
  for (size_t c = 0; c < trees.size(); ++c) {
    state_.cells[c].elements = PanelsOfCell(solution, c);
  }
  if (!state_.cells.empty()) {
    state_.cells[0].links = solution.form_factors;
  }
  state_.basis = options_.basis;
  state_.seed = options_.seed;
  state_.residual = solution.residual;
  state_.sweeps += solution.steps;
  RoundRecord record;
  record.links = solution.form_factors;
  record.complete = solution.complete;
  record.estimated_error = 1;
  if (coarser != nullptr) {
    const double change =
        std::sqrt(SquaredDifference(scene_, trees, *coarser) / area_) /
        state_.mean_reflected;
    const double before =
        state_.rounds.empty() ? 0 : state_.rounds.back().observed_change;
    const double rate =
        before > 0 ? std::clamp(change / before, kSmoothRate, kShadowRate)
                   : kShadowRate;
    record.observed_change = change;
    record.predicted_error = change * rate / std::sqrt(1 - rate * rate);
    record.estimated_error =
        std::hypot(record.predicted_error, solution.seen_error) +
        solution.residual;
  }
  state_.rounds.push_back(record);
}

uint32_t ReferenceSolve::PanelsOfCell(const PanelSolution& solution,
                                      size_t cell) const {
  uint32_t count = 0;
  for (const Panel& panel : solution.panels) {
    count += panel.patch >= scene_.CellBegin(cell) &&
                     panel.patch < scene_.CellBegin(cell + 1)
                 ? 1U
                 : 0U;
  }
  return count;
}

void ReferenceSolve::Write(const TreeSolution& solution) {
  const Stopwatch watch(&state_.times.store_seconds);
  WriteSolution(solution.trees, solution.gathered, state_, store_);
}

// For trees of so many elements and what they have gathered.
MemoryCharge ReferenceSolve::ChargeTrees(size_t elements) const {
  const TreeShape shape{&haar_, kRgbChannels};
  return {budget_,
          CellTree::BytesFor(elements, shape) +
              CoefficientArray::BytesFor(elements, shape.Stride()),
          "the elements of a dicing"};
}

// The trees of the last fineness that was committed; nothing if there is none.
std::optional<ChargedTrees> ReferenceSolve::StoredTrees() const {
  if (state_.rounds.empty()) {
    return std::nullopt;
  }
  size_t elements = 0;
  for (size_t c = 0; c < scene_.CellCount(); ++c) {
    elements += CellTree::StoredSize(store_, CellId(c));
  }
  ChargedTrees stored{ChargeTrees(elements), {}};
  for (size_t c = 0; c < scene_.CellCount(); ++c) {
    auto tree = CellTree::Load(
        store_, CellId(c), {&haar_, kRgbChannels}, scene_.PatchesOf(c));
    if (!tree) {
      ThrowDamaged(store_, fmt::format("lacks the element tree of cell {}", c));
    }
    stored.trees.push_back(std::move(*tree));
  }
  return stored;
}

}  // namespace

void SolveByReference(BlockStorage& store,
                      const SolveOptions& options,
                      MemoryBudget& budget) {
  ReferenceSolve(store, options, budget).Run();
}

}  // namespace enfilade
