#include "partition/space_cutter.h"

#include "partition/artificial_walls.h"
#include "partition/partition_store.h"
#include "partition/polygon.h"
#include "partition/portal_maker.h"
#include "partition/space_shells.h"
#include "partition/walls.h"

#include <algorithm>
#include <deque>
#include <optional>
#include <utility>

namespace enfilade {
namespace {

constexpr double kMarginShare = 0.01;
constexpr double kMarginM = 0.1;

// The scene's bounds, enlarged so that nothing in the scene lies in a side of
// the box.
Box3 BoxAround(const Box3& bounds) {
  if (bounds.IsEmpty()) {
    return {{-1, -1, -1}, {1, 1, 1}};
  }
  const double margin = kMarginM + kMarginShare * Length(bounds.Extent());
  const Vec3 by{margin, margin, margin};
  return {bounds.low - by, bounds.high + by};
}

std::vector<CellInfo> DescribeCells(const BuiltTree& built,
                                    const LeafCells& joined) {
  std::vector<CellInfo> cells(joined.cell_count);
  for (size_t leaf = 0; leaf < built.leaves.size(); ++leaf) {
    cells[joined.cell_of_leaf[leaf].Index()].bounds.Include(
        built.leaves[leaf].bounds);
  }
  for (size_t i = 0; i < cells.size(); ++i) {
    cells[i].space = joined.space[i];
  }
  return cells;
}

}  // namespace

void SpaceCutter::CutRegions() {
  ScratchShelf shelf(*store_, *budget_, "the walls while cells are found");
  Walls walls = GatherWalls(*store_, *info_, *budget_, shelf);
  all_split_ = walls.rules.all_split;
  ReachProgress(0.1);
  built_ =
      BuildTree(BoxAround(info_->bounds), std::move(walls), shelf, *budget_);
  shelf.Clear();
  ReachProgress(0.4);
}

void SpaceCutter::JoinRegions(GrowingCharge& portals_charge,
                              Partition* partition) {
  const FaceSurvey survey = RelieveCrowdedLeaves(
      *store_, options_->max_cell_patches, *budget_, built_);
  built_.charge.Reset();
  built_.charge =
      MemoryCharge(*budget_, BytesOf(built_), "the tree of splitting planes");
  ScratchShelf shelf(*store_, *budget_, "the openings between convex regions");
  MakeCells(survey, shelf, portals_charge, partition);
  shelf.Clear();
  DropLeaves();
  ReachProgress(0.7);
  SaveTree(built_.tree, cell_of_leaf_, *store_);
}

void SpaceCutter::MakeCells(const FaceSurvey& survey,
                            ScratchShelf& shelf,
                            GrowingCharge& portals_charge,
                            Partition* partition) {
  GrowingCharge charge(*budget_, "the borders between convex regions");
  // Where coordinates were rounded, cracks beside oblique edges are wider.
  constexpr double kStepsOfCrack = 1.5;
  const double oblique_crack_m =
      std::max(kCrackM, kStepsOfCrack * info_->coordinate_step_m);
  const OpenBorders borders = FindOpenBorders(
      {*store_, built_, survey, oblique_crack_m}, shelf, *budget_, charge);
  DropOutlines();
  charge.ShrinkTo(borders.Bytes());
  ReachProgress(0.6);
  const LeafCells joined = Join(survey, borders.All());
  cell_of_leaf_ = joined.cell_of_leaf;
  partition->cells = DescribeCells(built_, joined);
  constexpr uint64_t kCopies = 3;  // sorted, joined, a hull
  const MemoryCharge at_once(*budget_,
                             kCopies * borders.MostBytesOfNode(),
                             "the openings in one plane");
  MakePortals(borders, portals_charge, partition);
  SaveOpenings(borders);
}

LeafCells SpaceCutter::Join(const FaceSurvey& survey,
                            const LeafBorders& borders) const {
  std::vector<std::optional<SpaceId>> spaces;
  if (!info_->spaces.empty()) {
    spaces = SpacesOfLeaves(*store_, *info_, built_.leaves, *budget_);
  }
  const MemoryCharge charge(*budget_,
                            BytesToJoin(built_.leaves.size(), borders.size()),
                            "convex regions that are joined");
  return JoinLeaves({built_, survey, borders, spaces, all_split_}, *options_);
}

void SpaceCutter::MakePortals(const OpenBorders& borders,
                              GrowingCharge& portals_charge,
                              Partition* partition) const {
  uint64_t portal_bytes = 0;
  ForEachPortal(built_.tree, borders, cell_of_leaf_, [&](Portal portal) {
    portal_bytes += BytesOf(portal);
    portals_charge.GrowTo(portal_bytes);
    partition->portals.push_back(std::move(portal));
  });
}

void SpaceCutter::SaveOpenings(const OpenBorders& borders) const {
  // Each leaf is a cell of its own.
  const auto itself = FirstIds<CellId>(built_.leaves.size());
  const PortalSource openings =
      [&](const std::function<void(const Portal&)>& visit) {
        ForEachPortal(built_.tree, borders, itself, visit);
      };
  SaveRegions(cell_of_leaf_, openings, *store_);
}

void SpaceCutter::DropOutlines() {
  std::deque<Polygon>().swap(built_.sections);
  for (LeafShape& leaf : built_.leaves) {
    FreeVector(&leaf.corners);
  }
  built_.charge.ShrinkTo(BytesOf(built_));
}

void SpaceCutter::DropLeaves() {
  LeafShapes().swap(built_.leaves);
  built_.charge.ShrinkTo(BytesOf(built_));
}

void SpaceCutter::ReachProgress(double fraction) const {
  if (options_->progress) {
    options_->progress(fraction);
  }
}

}  // namespace enfilade
