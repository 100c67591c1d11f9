#include "solver/state/solve_state.h"

#include "base/error.h"

#include <type_traits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace enfilade {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RoundRecord,
                                   tau,
                                   predicted_error,
                                   observed_change,
                                   residual_error,
                                   most_by_rays,
                                   estimated_error,
                                   cared_for,
                                   late,
                                   links,
                                   complete)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SolveTimes,
                                   refine_seconds,
                                   gather_seconds,
                                   push_pull_seconds,
                                   store_seconds,
                                   check_seconds,
                                   bytes_read,
                                   bytes_belady,
                                   bytes_compulsory)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(WorkPart, item, depth, part)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PairCursor, source, work, chunk, cycle)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SolveState,
                                   basis,
                                   seed,
                                   error,
                                   first_round,
                                   phase,
                                   round,
                                   tau,
                                   mean_reflected,
                                   residual,
                                   converged,
                                   published_in_sweep,
                                   next_cell,
                                   cursor,
                                   tick,
                                   sweeps_in_round,
                                   sweeps,
                                   rays,
                                   rounds)

namespace {

constexpr const char* kMetaName = "solve";
constexpr const char* kTimesName = "solve_times";
constexpr BlockKey kCellsKey = {BlockKind::kSolveCells, 0, 0, 0};

}  // namespace

void SaveSolveState(const SolveState& state, BlockStorage& store) {
  static_assert(std::is_trivially_copyable_v<CellRow>);
  store.SetMeta(kMetaName, nlohmann::json(state).dump());
  store.SetMeta(kTimesName, nlohmann::json(state.times).dump());
  ByteWriter rows;
  rows.PutArray(std::span<const CellRow>(state.cells));
  store.Put(kCellsKey, rows.View());
}

bool LoadSolveState(const BlockStorage& store, SolveState* state) {
  const auto text = store.Meta(kMetaName);
  if (!text) {
    return false;
  }
  try {
    *state = nlohmann::json::parse(*text).get<SolveState>();
    const auto times = store.Meta(kTimesName);
    if (times) {
      state->times = nlohmann::json::parse(*times).get<SolveTimes>();
    }
  } catch (const nlohmann::json::exception& e) {
    ThrowDamaged(store,
                 std::string("has a solve state that cannot be read (") +
                     e.what() + ")");
  }
  state->cells = ReadBlock(
      store, kCellsKey, [](ByteReader& in) { return in.GetArray<CellRow>(); });
  return true;
}

void RequireSense(const SolveState& state, size_t cells) {
  if (state.cells.size() != cells || state.next_cell > cells) {
    throw DamagedStoreError(fmt::format(
        "the store's solve state has {} cells and is at cell {}, where the "
        "partition has {} cells; restore the store from a copy, or solve anew",
        state.cells.size(),
        state.next_cell,
        cells));
  }
}

}  // namespace enfilade
