#include "solver/round_check.h"

#include "base/memory.h"
#include "base/stop.h"
#include "base/stopwatch.h"
#include "solver/elements/cell_care.h"
#include "solver/error_control.h"
#include "solver/residual/patch_errors.h"
#include "solver/residual/residual_check.h"

#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace enfilade {
namespace {

// Rays to confirm that the error is small: one per this many links, but at
// least kLeastDecidingRays.
constexpr uint64_t kLinksPerAcceptingRay = 4;
constexpr uint64_t kLeastDecidingRays = 2 << 20;
// Rays to locate the error if it is large: one per this many links, but at
// least kLeastDecidingRays. A round with fewer than kFewToLocate links costs
// less than that many rays and gets kLocatingRaysOfFewLinks.
constexpr uint64_t kLinksPerLocatingRay = 2;
constexpr uint64_t kFewToLocate = 20'000;
constexpr uint64_t kLocatingRaysOfFewLinks = 1 << 19;

DecidingRays RaysToDecide(uint64_t links) {
  return {std::max(kLeastDecidingRays, links / kLinksPerAcceptingRay),
          links < kFewToLocate
              ? kLocatingRaysOfFewLinks
              : std::max(kLeastDecidingRays, links / kLinksPerLocatingRay)};
}

std::string ResidualErrorText(const ResidualEstimate& so_far, double asked) {
  return so_far.points == 0
             ? std::string()
             : fmt::format("error {:.3f} [{:.3f}, {:.3f}] so far, {} asked",
                           so_far.value,
                           so_far.low,
                           so_far.high,
                           asked);
}

// Raises the care of the patches that have most of the error, so that the next
// round, at its tau, brings their error down to the wanted level.
void CareFor(const PatchErrors& errors, SolveContext* context) {
  RoundRecord& round = context->state.rounds.back();
  const std::vector<CellInfo>& cells = context->partition.cells;
  const MemoryCharge charge(context->budget,
                            errors.MostKnown() * sizeof(LinkErrors),
                            "the errors of patches that are known");
  std::vector<LinkErrors> known;
  known.reserve(errors.MostKnown());
  LinkErrors rest = {errors.OfAll(), static_cast<double>(round.links)};
  for (size_t i = 0; i < cells.size(); ++i) {
    ThrowIfStopRequested();  // nothing has changed yet
    const size_t patches = cells[i].patches;
    const std::vector<float> square = errors.Of(CellId(i), patches);
    const CellCare care = LoadCellCare(context->store, CellId(i), patches);
    for (size_t k = 0; k < patches; ++k) {
      if (square[k] > 0) {
        known.push_back({static_cast<double>(square[k]),
                         static_cast<double>(care[k].links)});
        rest.square -= known.back().square;
        rest.links -= known.back().links;
      }
    }
  }
  rest.square = std::max(rest.square, 0.0);
  const double level =
      LevelOfErrors(known, rest, WantedOfSquare(context->state));
  const double by_tau = RaiseOfCare(rest, level);
  double gone = 0;
  for (size_t i = 0; i < cells.size(); ++i) {
    const size_t patches = cells[i].patches;
    const std::vector<float> square = errors.Of(CellId(i), patches);
    CellCare care = LoadCellCare(context->store, CellId(i), patches);
    const double mended = RaiseCare(square, level, by_tau, &care);
    if (mended > 0) {
      SaveCellCare(care, CellId(i), context->store);
      gone += mended;
    }
  }
  round.cared_for =
      gone > 0 ? std::min(1.0, gone / std::max(errors.OfAll(), gone)) : 0.0;
}

}  // namespace

ResidualEstimate CheckRound(SolveContext& context, Checkpoints& checkpoints) {
  SolveState& state = context.state;
  const Stopwatch watch(&state.times.check_seconds);
  const uint64_t links = state.rounds.back().links;
  ResidualOptions options;
  options.seed = context.SeedOfRound();
  options.mean_reflected = state.mean_reflected;
  options.decide_at = state.error;
  options.most_rays = MostResidualRays(links);
  options.least_rays = RaysToDecide(links);
  options.unseen =
      context.shape.NodeStride() == 1 ? kUnseenErrorOfConstants : kUnseenError;
  options.stop = context.options.stop;
  options.progress = [&](double share, const ResidualEstimate& so_far) {
    if (checkpoints.IsTimeToTell()) {
      checkpoints.Tell({fmt::format("round {} residual", state.rounds.size()),
                        share,
                        ResidualErrorText(so_far, state.error)});
    }
  };
  PatchErrors by_patch;
  const ResidualEstimate residual =
      MeasureResidual(context.store, options, context.budget, &by_patch);
  TakeResidual({residual.least, residual.most, residual.high}, &state);
  if (state.rounds.size() > 1) {  // the first round is a guess
    CareFor(by_patch, &context);
  }
  return residual;
}

}  // namespace enfilade
