// The light within a cell is the same whether its delta fits in memory or not.

#include "solver/cell_balance.h"

#include "partition/partition.h"
#include "scene/import.h"
#include "store/sqlite_store.h"
#include "visibility/visible_set.h"

#include <algorithm>
#include <memory>
#include <vector>

#include "tests/budgets.h"
#include "tests/tools/run_program.h"
#include "tools/scenes/floorplan.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr int kLevels = 12;

// The cell with the most patches of a floor, with fine trees that have received
// light.
class BalanceOfACell : public ::testing::Test {
 protected:
  BalanceOfACell() : store_(CreateStoreInMemory()) {
    ObjWriter writer(dir_ / "floor.obj");
    WriteFloorplan({2, 1, 1, 1}, writer);
    writer.Finish();
    MemoryBudget budget(kRoomy);
    ImportScene(dir_ / "floor.obj", {}, budget, *store_);
    scene_ = LoadSceneInfo(*store_);
    partition_ = BuildPartition(*store_, {}, budget);
    BuildVisibleSets(partition_, {}, budget, *store_);
    size_t most = 0;
    for (size_t i = 0; i < partition_.cells.size(); ++i) {
      const size_t patches = LoadCellPatches(*store_, CellId(i)).patches.size();
      cell_ = patches > most ? CellId(i) : cell_;
      most = std::max(most, patches);
    }
  }

  // Balances the cell once with `room` times the bytes of an array of its
  // coefficients free. Appends what the cell sends and its delta.
  void Balance(double room,
               std::vector<float>* sent,
               std::vector<float>* gained) {
    const Basis basis(2);
    MemoryBudget budget(kRoomy);
    const OcclusionDevice device(budget, scene_.bounds.Center());
    CellPager pager(
        *store_, scene_, partition_, {&basis, kRgbChannels}, device, budget);
    std::vector<CellRow> rows(partition_.cells.size());
    pager.Order().Watch(rows);
    pager.Order().StartSweep(SweepKind::kPropagate);
    pager.StartTurn(cell_, LoadVisibleSet(*store_, cell_));
    const auto geometry = pager.Geometry(cell_);
    const auto tree = pager.Tree(cell_);
    Grow(geometry->patches, tree.get());
    pager.MarkDirty(cell_);
    const auto delta = pager.Delta(cell_);
    const auto received = pager.Received(cell_);
    LightUp(&received->gathered);
    SolveTimes times;
    const SurfaceTable surfaces = GreySurfaces();
    CellBalance balance({cell_,
                         geometry.get(),
                         tree.get(),
                         delta.get(),
                         received.get(),
                         &rows[cell_.Index()]},
                        surfaces,
                        pager,
                        *store_,
                        &times);
    // Others have been told of half of the light that the cell sends.
    delta->Blend(0.5F, tree->Sent(), 0);
    const auto array = static_cast<double>(tree->Sent().SizeBytes());
    ASSERT_GT(array, 1e6);
    const MemoryCharge rest(
        budget,
        budget.FreeBytes() - static_cast<uint64_t>(room * array),
        "all but some room");
    balance.RunCycle(0);
    Append(tree->Sent(), sent);
    Append(*delta, gained);
    EXPECT_NEAR(balance.Sum().unsent, 0, 1e-5 * balance.Sum().leaving);
  }

  static void Grow(const std::vector<PatchGeometry>& patches, CellTree* tree) {
    ElementPath path = kRootPath;
    for (int level = 0; level < kLevels; ++level) {
      path = ChildPath(path, 1);
      for (size_t p = 0; p < patches.size(); ++p) {
        for (size_t c = 0; c < kChildren; ++c) {
          tree->FindOrCreate(PatchId(p), ChildPath(path, c), patches);
        }
      }
    }
  }

  static void LightUp(CoefficientArray* gathered) {
    for (size_t i = 0; i < gathered->Size(); ++i) {
      for (float& h : (*gathered)[ElementId(i)]) {
        h = 1 + static_cast<float>(i % 7);
      }
    }
  }

  SurfaceTable GreySurfaces() const {
    SurfaceTable surfaces;
    surfaces.reflectance.assign(scene_.materials.size() * kRgbChannels, 0.5F);
    surfaces.exitance.assign(surfaces.reflectance.size(), 0.0F);
    return surfaces;
  }

  static void Append(const CoefficientArray& from, std::vector<float>* to) {
    for (size_t page = 0; page < from.PageCount(); ++page) {
      const auto values = from.Page(page);
      to->insert(to->end(), values.begin(), values.end());
    }
  }

  TemporaryFolder dir_;
  std::unique_ptr<BlockStorage> store_;
  SceneInfo scene_;
  Partition partition_;
  CellId cell_;
};

TEST_F(BalanceOfACell, HasTheSameBitsWhereItsDeltaDoesNotFit) {
  std::vector<float> sent;
  std::vector<float> delta;
  const uint64_t before = store_->Stats().bytes_written;
  Balance(1.5, &sent, &delta);
  EXPECT_EQ(store_->Stats().bytes_written, before);
  ASSERT_FALSE(sent.empty());
  EXPECT_NE(*std::max_element(delta.begin(), delta.end()), 0);

  std::vector<float> narrow_sent;
  std::vector<float> narrow_delta;
  Balance(0.5, &narrow_sent, &narrow_delta);
  EXPECT_GT(store_->Stats().bytes_written, before);
  EXPECT_EQ(store_->Count(BlockKind::kScratch), 0U);
  EXPECT_EQ(narrow_sent, sent);
  EXPECT_EQ(narrow_delta, delta);
}

}  // namespace
}  // namespace enfilade
