#include "solver/source_cell.h"

#include <utility>

namespace enfilade {
namespace {

// tau_weak over tau: docs/decisions/0011-oracle.md.
constexpr double kWeakShare = 0.5;

RefineOptions OptionsOf(const SolveContext& context) {
  RefineOptions options;
  options.tau = context.state.tau;
  options.tau_weak = kWeakShare * context.state.tau;
  options.seed = context.SeedOfRound();
  options.counts_black = context.surface.is_black;
  return options;
}

RefineReceiver ReceiverOf(const SolveContext& context,
                          const ReceiverCell& receiver,
                          const VisibleCell& seen) {
  return {.id = receiver.id,
          .part = context.pager.BoxOf(receiver.id, seen.of_receiver),
          .patches = receiver.geometry->patches,
          .clusters = receiver.receivers.get(),
          .care = receiver.care,
          .least_reflectance = context.surface.least_reflectance,
          .weights = receiver.weights};
}

RefineSource SourceOf(const SolveContext& context,
                      const SourceCell& source,
                      const VisibleCell& seen) {
  return {.id = source.id,
          .part = context.pager.BoxOf(source.id, seen.of_source),
          .patches = source.geometry->patches,
          .clusters = source.geometry->clusters.get(),
          .groups = &source.geometry->groups,
          .sent = source.weights.get()};
}

}  // namespace

SourceCell::SourceCell(SolveContext& context, CellId cell)
    : id(cell),
      geometry(context.pager.Geometry(cell)),
      weights(context.pager.Weights(cell)) {}

PairWork WorkBetween(const SolveContext& context,
                     const ReceiverCell& receiver,
                     const SourceCell& source,
                     const VisibleCell& seen) {
  return {OptionsOf(context),
          ReceiverOf(context, receiver, seen),
          SourceOf(context, source, seen)};
}

PairWork WorkBetween(const SolveContext& context,
                     const ReceiverCell& receiver,
                     const SourceCell& source,
                     const VisibleCell& seen,
                     std::vector<WorkItem> items) {
  return {OptionsOf(context),
          ReceiverOf(context, receiver, seen),
          SourceOf(context, source, seen),
          std::move(items)};
}

std::vector<const ShaftBlockers*> GatesBetween(const ReceiverCell& receiver,
                                               const SourceCell& source) {
  if (source.id == receiver.id) {
    return {};
  }
  return {receiver.geometry->portals.get(), source.geometry->portals.get()};
}

}  // namespace enfilade
