#include "solver/solution/display_forest.h"

#include "base/check.h"
#include "base/stop.h"
#include "partition/patch_points.h"
#include "partition/polygon.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

// Balancing makes no leaves lower than this, metres. Quarters of a sliver are
// slivers: beside a crumb, they would become as narrow as atoms.
constexpr double kLeastHeightM = kCrackM;
// Rounding may make a leaf's edge exceed twice the edge of another.
constexpr double kEdgeRatio = 2 * (1 + 1e-6);
constexpr double kHeightsPerTolerance = 8;
// The approximate share of the forest in the memory that a group's mesh takes
// while it is made; typical of ceilings around many lamps.
constexpr double kShareOfMesh = 0.2;
// Element frames are exact in single precision down to this scale.
constexpr float kLeastScale = 1.0F / (1 << kMaxLevel);

double Scaled(const ElementFrame& frame, double root_m) {
  return static_cast<double>(std::abs(frame.scale)) * root_m;
}

// The number of elements in the subtree of `element`, itself included.
size_t CountFrom(const CellTree& tree, ElementId element) {
  const uint32_t first = tree.At(element).first_child;
  size_t count = 1;
  for (uint32_t c = 0; first != 0 && c < kChildren; ++c) {
    count += CountFrom(tree, ElementId(first + c));
  }
  return count;
}

}  // namespace

DisplayForest::DisplayForest(const CellTree& tree,
                             const CoplanarPatches& cell,
                             size_t group,
                             MemoryBudget& budget)
    : frame_(cell.FirstOf(group)),
      charge_(budget, "the display mesh of coplanar patches") {
  std::vector<PlaneIndex::Box> boxes;
  for (const PatchId id : cell.groups[group]) {
    const Patch& patch = cell.patches[id.Index()];
    AddRoot(patch, id);
    PlaneIndex::Box& box = boxes.emplace_back();
    const CornerList<Point3> corners = CornersOf(patch);
    for (const Point3 p : corners.View()) {
      box.Include(frame_.ToPlane(p));
    }
  }
  index_.emplace_back(boxes, 4 * kCrackM);
  CopyTree(tree);
  EndPass();
}

void DisplayForest::AddRoot(const Patch& patch, PatchId id) {
  Root root{id,
            patch.shape,
            frame_.ToPlane(patch.origin),
            frame_.ToPlane(frame_.origin + patch.u),
            frame_.ToPlane(frame_.origin + patch.v)};
  const bool triangle = patch.shape == PatchShape::kTriangle;
  root.longest_m = std::max(Length(root.u), Length(root.v));
  if (triangle) {
    root.longest_m = std::max(root.longest_m, Length(root.u - root.v));
  }
  root.height_m = std::abs(Cross(root.u, root.v)) / root.longest_m;
  roots_.push_back(root);
  DisplayElement& e = elements_.emplace_back();
  e.parent = e.root = static_cast<uint32_t>(roots_.size() - 1);
  e.source = ElementId(id.value);
}

// Copies the trees level by level, since children come behind their parents.
void DisplayForest::CopyTree(const CellTree& tree) {
  size_t count = 0;
  for (const Root& root : roots_) {
    count += CountFrom(tree, ElementId(root.patch.value));
  }
  Reserve(count);
  for (size_t e = 0; e < elements_.size(); ++e) {
    const uint32_t first = tree.At(*elements_[e].source).first_child;
    if (first == 0) {
      continue;
    }
    Split(e);
    for (size_t c = 0; c < kChildren; ++c) {
      elements_[elements_[e].first_child + c].source = ElementId(first + c);
    }
  }
}

// Includes one index per element for the list of leaves that Balance() has
// still to check.
uint64_t DisplayForest::BytesFor(size_t elements) const {
  return elements * (sizeof(DisplayElement) + sizeof(uint32_t)) +
         index_.front().SizeBytes() + roots_.capacity() * sizeof(Root);
}

// Charges the new array right before its allocation, so that memory that others
// have freed is given back in time. The old array stays charged too, since it
// lives until the new one is filled.
void DisplayForest::Reserve(size_t elements) {
  if (elements <= elements_.capacity()) {
    return;
  }
  charge_.ShrinkTo(BytesFor(elements_.capacity()));
  charge_.GrowTo(BytesFor(elements_.capacity() + elements), kShareOfMesh);
  elements_.reserve(elements);
  charge_.ShrinkTo(BytesFor(elements_.capacity()));
}

void DisplayForest::Split(size_t e) {
  if (elements_.capacity() < elements_.size() + kChildren) {
    Reserve(elements_.size() + elements_.size() / 4 + 64);
  }
  const auto first = static_cast<uint32_t>(elements_.size());
  elements_[e].first_child = first;
  const DisplayElement parent = elements_[e];
  for (size_t c = 0; c < kChildren; ++c) {
    DisplayElement& child = elements_.emplace_back();
    child.parent = static_cast<uint32_t>(e);
    child.root = parent.root;
    child.frame = ChildOf(parent.frame, ShapeOf(e), c);
  }
}

// After the last split of a pass, frees unused capacity, adjusts the charge and
// computes the tolerance.
void DisplayForest::EndPass() {
  if (elements_.capacity() > elements_.size()) {
    charge_.GrowTo(BytesFor(elements_.capacity() + elements_.size()));
    elements_.shrink_to_fit();
  }
  charge_.ShrinkTo(BytesFor(elements_.capacity()));
  double least_m = kHeightsPerTolerance * kCrackM;
  for (const DisplayElement& e : elements_) {
    if (e.first_child == 0) {
      least_m = std::min(least_m, Scaled(e.frame, roots_[e.root].height_m));
    }
  }
  tolerance_m_ = least_m / kHeightsPerTolerance;
}

void DisplayForest::Balance() {
  std::vector<uint32_t> work;
  for (size_t e = elements_.size(); e-- > 0;) {
    if (IsLeaf(e)) {
      work.push_back(static_cast<uint32_t>(e));
    }
  }
  std::vector<uint32_t> touching;
  while (!work.empty()) {
    ThrowIfStopRequested();
    const uint32_t e = work.back();
    const size_t others = work.size();
    const double most_m = kEdgeRatio * EdgeOf(e);
    for (size_t k = 0; IsLeaf(e) && k < CornerCount(e); ++k) {
      LeavesAt(PointOn(e, UnitCorner(ShapeOf(e), k)), &touching);
      for (const uint32_t other : touching) {
        SplitIfLarger(other, most_m, &work);
      }
    }
    // If neighbours were split, the leaf stays in `work` and is checked again
    // after their children.
    if (work.size() == others) {
      work.pop_back();
    }
  }
  EndPass();
}

// Splits leaf e if its longest edge exceeds `most_m` and it is not too low, and
// adds its children to `work`.
void DisplayForest::SplitIfLarger(size_t e,
                                  double most_m,
                                  std::vector<uint32_t>* work) {
  if (EdgeOf(e) <= most_m || HeightOf(e) < 2 * kLeastHeightM ||
      std::abs(elements_[e].frame.scale) <= kLeastScale) {
    return;
  }
  Split(e);
  for (uint32_t c = 0; c < kChildren; ++c) {
    work->push_back(elements_[e].first_child + c);
  }
}

void DisplayForest::SplitLeaves() {
  const size_t count = elements_.size();
  for (size_t e = 0; e < count; ++e) {
    if (IsLeaf(e)) {
      Split(e);
    }
  }
  EndPass();
}

PlanePoint DisplayForest::PointOn(size_t e, UnitPoint p) const {
  const ElementFrame& f = elements_[e].frame;
  const Root& r = roots_[elements_[e].root];
  const double a =
      static_cast<double>(f.a) + static_cast<double>(f.scale) * p.a;
  const double b =
      static_cast<double>(f.b) + static_cast<double>(f.scale) * p.b;
  return {r.origin.x + r.u.x * a + r.v.x * b,
          r.origin.y + r.u.y * a + r.v.y * b};
}

UnitPoint DisplayForest::LocalOf(size_t e, PlanePoint p) const {
  const ElementFrame& f = elements_[e].frame;
  const Root& r = roots_[elements_[e].root];
  const PlanePoint d = p - r.origin;
  const double area = Cross(r.u, r.v);
  return {(Cross(d, r.v) / area - static_cast<double>(f.a)) / f.scale,
          (Cross(r.u, d) / area - static_cast<double>(f.b)) / f.scale};
}

double DisplayForest::EdgeOf(size_t e) const {
  return Scaled(elements_[e].frame, roots_[elements_[e].root].longest_m);
}

double DisplayForest::HeightOf(size_t e) const {
  return Scaled(elements_[e].frame, roots_[elements_[e].root].height_m);
}

bool DisplayForest::Contains(size_t e, PlanePoint p, double margin_m) const {
  const Root& r = roots_[elements_[e].root];
  const UnitPoint local = LocalOf(e, p);
  // A step of 1 in a coordinate moves a point area / edge length away from the
  // edge on which the coordinate is 0.
  const double per_m =
      margin_m / (Cross(r.u, r.v) * std::abs(elements_[e].frame.scale));
  const double da = per_m * Length(r.v);
  const double db = per_m * Length(r.u);
  if (local.a < -da || local.b < -db) {
    return false;
  }
  return r.shape == PatchShape::kTriangle
             ? local.a + local.b <= 1 + per_m * Length(r.u - r.v)
             : local.a <= 1 + da && local.b <= 1 + db;
}

void DisplayForest::LeavesAt(PlanePoint p,
                             std::vector<uint32_t>* leaves) const {
  leaves->clear();
  for (const uint32_t root : index_.front().Near(p)) {
    if (Contains(root, p, 2 * tolerance_m_)) {
      DescendTo(p, root, leaves);
    }
  }
}

void DisplayForest::DescendTo(PlanePoint p,
                              size_t root,
                              std::vector<uint32_t>* leaves) const {
  // The elements from index `done` on are still to be replaced by their
  // children or kept as leaves.
  size_t done = leaves->size();
  leaves->push_back(static_cast<uint32_t>(root));
  while (done < leaves->size()) {
    const uint32_t first = elements_[(*leaves)[done]].first_child;
    if (first == 0) {
      ++done;
      continue;
    }
    (*leaves)[done] = leaves->back();
    leaves->pop_back();
    for (uint32_t c = first; c < first + kChildren; ++c) {
      if (Contains(c, p, 2 * tolerance_m_)) {
        leaves->push_back(c);
      }
    }
  }
}

size_t DisplayForest::RootOf(PatchId patch) const {
  const auto at = std::lower_bound(
      roots_.begin(), roots_.end(), patch, [](const Root& r, PatchId id) {
        return r.patch < id;
      });
  ENFILADE_CHECK(at != roots_.end() && at->patch == patch,
                 "patch {} is not of this group",
                 patch.value);
  return static_cast<size_t>(at - roots_.begin());
}

size_t DisplayForest::LeafOf(PatchId patch, UnitPoint p) const {
  size_t e = RootOf(patch);
  const PatchShape shape = ShapeOf(e);
  while (!IsLeaf(e)) {
    e = elements_[e].first_child + ChildAt(shape, &p);
  }
  return e;
}

}  // namespace enfilade
