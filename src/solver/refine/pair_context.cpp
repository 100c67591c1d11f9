#include "solver/refine/pair_context.h"

#include <algorithm>
#include <array>
#include <utility>

namespace enfilade {
namespace {

// On the larger elements of higher-order bases, shadows cost more than rays
// tell. Measured: docs/decisions/0017-higher-orders.md.
constexpr std::array<float, 5> kShadowsOfOrder = {1, 1, 1, 1.25F, 1.4F};

}  // namespace

PairContext::PairContext(PairWork work_of_pair,
                         const CellTree& source_tree,
                         const Blockers& between)
    : work(std::move(work_of_pair)),
      sources(Source().patches, source_tree),
      blockers(&between),
      basis(source_tree.Shape().basis),
      tau(static_cast<float>(work.Options().tau)),
      tau_weak(static_cast<float>(work.Options().tau_weak)),
      shadows(basis->kind.flat ? 1 : kShadowsOfOrder[basis->kind.order]),
      constant_basis(source_tree.Shape().NodeStride() == 1),
      is_partial(!Receiver().part.IsEverything() ||
                 !Source().part.IsEverything()) {}

float PairContext::TrueError(const ReceiverElement& r, float weighted) const {
  const float reflectance = r.end.patch->max_reflectance;
  const float share =
      work.Options().counts_black
          ? 1.0F
          : std::min(1.0F, reflectance / Receiver().least_reflectance);
  return weighted / r.care * share;
}

}  // namespace enfilade
