// A resumed solve goes on from exactly the state in which it was stopped.

#include "solver/state/solve_state.h"

#include "base/error.h"
#include "store/sqlite_store.h"

#include <cstddef>
#include <tuple>
#include <utility>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

// All fields of a struct. A field that is not named here does not compile, so
// that whoever adds one comes by and gives it a value below.
auto FieldsOf(const WorkPart& part) {
  const auto& [item, depth, number] = part;
  return std::tie(item, depth, number);
}

auto FieldsOf(const PairCursor& cursor) {
  const auto& [source, work, chunk, cycle] = cursor;
  return std::tuple_cat(std::tie(source, chunk, cycle), FieldsOf(work));
}

auto FieldsOf(const SolveTimes& times) {
  const auto& [refine, gather, push_pull, store, check, read, belady, least] =
      times;
  return std::tie(refine, gather, push_pull, store, check, read, belady, least);
}

auto FieldsOf(const RoundRecord& round) {
  const auto& [a, b, c, d, e, f, g, h, i, k] = round;
  return std::tie(a, b, c, d, e, f, g, h, i, k);
}

auto FieldsOf(const CellRow& row) {
  const auto& [a, b, c, d, e, f, g, h, i, k, l, m, n, o] = row;
  return std::tie(a, b, c, d, e, f, g, h, i, k, l, m, n, o);
}

// All but the rounds and the cells, which are lists.
auto FieldsOf(const SolveState& state) {
  const auto& [a,
               b,
               c,
               d,
               e,
               f,
               g,
               h,
               i,
               k,
               l,
               m,
               cursor,
               n,
               o,
               p,
               q,
               rounds,
               cells,
               times] = state;
  return std::tuple_cat(
      std::tie(a, b, c, d, e, f, g, h, i, k, l, m, n, o, p, q),
      FieldsOf(cursor),
      FieldsOf(times));
}

// The number of fields that two structs have in common.
template <typename Fields, size_t... kIndex>
size_t CountSame(const Fields& a,
                 const Fields& b,
                 std::index_sequence<kIndex...> /*all*/) {
  return (size_t{std::get<kIndex>(a) == std::get<kIndex>(b)} + ...);
}

template <typename T>
size_t DefaultsIn(const T& value) {
  const T defaults{};
  const auto fields = FieldsOf(value);
  return CountSame(
      fields,
      FieldsOf(defaults),
      std::make_index_sequence<std::tuple_size_v<decltype(fields)>>{});
}

// A state without a field that has its default. Its numbers differ, and no
// double among them is the shortest decimal of a float.
SolveState RichState() {
  SolveState state;
  state.basis = "m3";
  state.seed = 0xfedcba9876543210;
  state.error = 0.1 / 3;
  state.first_round = 2;
  state.phase = SolvePhase::kPropagate;
  state.round = 3;
  state.tau = 0.2 / 3;
  state.mean_reflected = 0.4 / 3;
  state.residual = 0.5 / 3;
  state.converged = true;
  state.published_in_sweep = true;
  state.next_cell = 5;
  state.cursor = {6, {uint64_t{1} << 40, 7, uint64_t{1} << 41}, 8, 9};
  state.tick = uint64_t{1} << 42;
  state.sweeps_in_round = 10;
  state.sweeps = uint64_t{1} << 43;
  state.rays = uint64_t{1} << 44;
  state.times = {11.0 / 3, 13.0 / 3, 14.0 / 3, 16.0 / 3, 17.0 / 3, 18, 19, 20};
  for (int i = 0; i < 2; ++i) {
    const double x = (20.0 + i) / 3;
    state.rounds.push_back({x,
                            x + 1,
                            x + 2,
                            x + 3,
                            x + 4,
                            x + 5,
                            x + 6,
                            x + 7,
                            (uint64_t{1} << 45) + static_cast<uint64_t>(i),
                            false});
  }
  for (uint64_t i = 0; i < 3; ++i) {
    const double x = (30.0 + static_cast<double>(i)) / 7;
    state.cells.push_back({i + 1,
                           i + 2,
                           x,
                           x + 1,
                           x + 2,
                           x + 3,
                           x + 4,
                           x + 5,
                           x + 6,
                           static_cast<float>(x + 7),
                           static_cast<HoldLevel>(i + 3),
                           i + 4,
                           i + 5,
                           i + 6});
  }
  return state;
}

TEST(SolveState, ComesBackFromTheStoreFieldByField) {
  const SolveState state = RichState();
  EXPECT_EQ(DefaultsIn(state), 0U);
  const auto store = CreateStoreInMemory();
  SaveSolveState(state, *store);
  SolveState read;
  ASSERT_TRUE(LoadSolveState(*store, &read));
  EXPECT_EQ(FieldsOf(read), FieldsOf(state));
  ASSERT_EQ(read.rounds.size(), state.rounds.size());
  for (size_t i = 0; i < state.rounds.size(); ++i) {
    EXPECT_EQ(DefaultsIn(state.rounds[i]), 0U);
    EXPECT_EQ(FieldsOf(read.rounds[i]), FieldsOf(state.rounds[i]));
  }
  ASSERT_EQ(read.cells.size(), state.cells.size());
  for (size_t i = 0; i < state.cells.size(); ++i) {
    EXPECT_EQ(DefaultsIn(state.cells[i]), 0U);
    EXPECT_EQ(FieldsOf(read.cells[i]), FieldsOf(state.cells[i]));
  }
}

TEST(SolveState, OfAStoreWithoutASolveIsNone) {
  const auto store = CreateStoreInMemory();
  SolveState state;
  EXPECT_FALSE(LoadSolveState(*store, &state));
}

TEST(SolveState, ThatCannotBeReadIsNamedAsDamage) {
  const auto store = CreateStoreInMemory();
  SaveSolveState(RichState(), *store);
  const std::string whole = store->Meta("solve").value();
  SolveState state;
  for (const std::string& text :
       {std::string(), whole.substr(0, whole.size() / 2), std::string("{}")}) {
    store->SetMeta("solve", text);
    EXPECT_THROW(LoadSolveState(*store, &state), DamagedStoreError) << text;
  }
}

}  // namespace
}  // namespace enfilade
