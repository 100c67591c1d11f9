#include "partition/open_borders.h"

#include "base/stop.h"
#include "partition/face_sorter.h"
#include "scene/box_tree.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

namespace enfilade {
namespace {

// Covers get one in kCoverParts of the free budget; the rest is for the borders
// that the covers leave open.
constexpr uint64_t kCoverParts = 3;

// Collects the faces in the planes of the nodes from `first` up to, but not
// including, `end`.
class CoverCollector : public FaceSorter {
 public:
  CoverCollector(const BspTree& tree, size_t first, size_t end)
      : FaceSorter(tree), first_(first), covers_(end - first) {}

  [[nodiscard]] const std::vector<Polygon>& Of(size_t node) const {
    return covers_[node - first_];
  }

 private:
  void AddToLeaf(LeafId, const Polygon&, uint32_t) override {}

  void AddCover(NodeId node, const Polygon& piece) override {
    if (node.Index() >= first_ && node.Index() - first_ < covers_.size()) {
      covers_[node.Index() - first_].push_back(piece);
    }
  }

  size_t first_;
  std::vector<std::vector<Polygon>> covers_;
};

// The memory that the covers of a node take.
uint64_t BytesOfNode(const FaceSurvey& survey, size_t node) {
  return sizeof(std::vector<Polygon>) + survey.cover_bytes[node];
}

// A piece of a node's section on its way to the leaves.
struct SectionPiece {
  LeafId leaf;
  Polygon polygon;
};

void PushDown(const BspTree& tree,
              BspChild child,
              const Polygon& polygon,
              std::vector<SectionPiece>& pieces) {
  if (child.IsLeaf()) {
    pieces.push_back({child.Leaf(), polygon});
    return;
  }
  const BspNode& node = tree.nodes[child.Node().Index()];
  switch (Classify(polygon, node.plane, kRoundingM)) {
    case PlaneSide::kFront:
      return PushDown(tree, node.front, polygon, pieces);
    case PlaneSide::kBack:
      return PushDown(tree, node.back, polygon, pieces);
    case PlaneSide::kOn:
      // The piece may border on leaves of both sides.
      PushDown(tree, node.front, polygon, pieces);
      return PushDown(tree, node.back, polygon, pieces);
    case PlaneSide::kCut:
      break;
  }
  const SplitPolygons parts = Split(polygon, node.plane, kRoundingM);
  if (PolygonArea(parts.front) > kLeastAreaM2) {
    PushDown(tree, node.front, parts.front, pieces);
  }
  if (PolygonArea(parts.back) > kLeastAreaM2) {
    PushDown(tree, node.back, parts.back, pieces);
  }
}

// Finds the covers of one node by their place.
class CoverIndex {
 public:
  // The memory of an index of so many covers, and of a list that Near returns.
  static uint64_t BytesFor(size_t covers) {
    constexpr uint64_t kGrowth = 2;
    return BoxTree::BytesFor(covers) +
           covers * kGrowth * (sizeof(uint32_t) + sizeof(const Polygon*));
  }

  explicit CoverIndex(const std::vector<Polygon>& covers)
      : covers_(&covers), tree_(BoxesOf(covers)) {}

  // Returns the covers that are near the polygon, in their order.
  [[nodiscard]] std::vector<const Polygon*> Near(const Polygon& polygon,
                                                 double crack_m) const {
    std::vector<uint32_t> found;
    tree_.ForOverlaps(Grown(BoundsOf(polygon), crack_m / 2),
                      [&](uint32_t i) { found.push_back(i); });
    std::sort(found.begin(), found.end());
    std::vector<const Polygon*> near;
    near.reserve(found.size());
    for (const uint32_t i : found) {
      near.push_back(&(*covers_)[i]);
    }
    return near;
  }

 private:
  static std::vector<Box3> BoxesOf(const std::vector<Polygon>& covers) {
    std::vector<Box3> boxes;
    boxes.reserve(covers.size());
    for (const Polygon& cover : covers) {
      boxes.push_back(BoundsOf(cover));
    }
    return boxes;
  }

  const std::vector<Polygon>* covers_;
  BoxTree tree_;
};

// The memory that pieces take in a growing vector.
uint64_t BytesOf(const std::vector<SectionPiece>& pieces) {
  constexpr uint64_t kGrowth = 2;
  uint64_t bytes = 0;
  for (const SectionPiece& piece : pieces) {
    bytes += kGrowth * sizeof(SectionPiece) + kAllocationHeaderBytes +
             piece.polygon.capacity() * sizeof(Point3);
  }
  return bytes;
}

// Finds the borders of one node after another, and charges their memory.
class BorderFinder {
 public:
  BorderFinder(const BorderInput& input,
               ScratchShelf& shelf,
               GrowingCharge& charge)
      : oblique_crack_m_(input.oblique_crack_m),
        tree_(&input.built.tree),
        leaves_(&input.built.leaves),
        survey_(&input.survey),
        all_cover_bytes_(std::accumulate(input.survey.cover_bytes.begin(),
                                         input.survey.cover_bytes.end(),
                                         uint64_t{0})),
        charge_(&charge),
        found_(shelf) {}

  void AddNode(NodeId id,
               const Polygon& section,
               const std::vector<Polygon>& covers) {
    const auto cover_bytes =
        static_cast<double>(survey_->cover_bytes[id.Index()]);
    node_bytes_ = CoverIndex::BytesFor(covers.size());
    ChargeWith(0, 0);
    const CoverIndex index(covers);
    const BspNode& node = tree_->nodes[id.Index()];
    std::vector<SectionPiece> in_front;
    PushDown(*tree_, node.front, section, in_front);
    node_bytes_ += BytesOf(in_front);
    for (const SectionPiece& piece : in_front) {
      std::vector<SectionPiece> behind;
      PushDown(*tree_, node.back, piece.polygon, behind);
      for (const SectionPiece& common : behind) {
        ThrowIfStopRequested();
        const std::vector<Polygon> open =
            Subtract(common.polygon,
                     node.plane.normal,
                     index.Near(common.polygon, oblique_crack_m_),
                     oblique_crack_m_,
                     [&](uint64_t bytes, double share) {
                       ChargeWith(bytes, share * cover_bytes);
                     });
        if (!open.empty()) {
          found_.Add({piece.leaf,
                      common.leaf,
                      id,
                      PolygonArea(common.polygon),
                      DepthOf(piece.leaf, node.plane.normal),
                      DepthOf(common.leaf, node.plane.normal)},
                     open);
          ChargeWith(0, 0);
        }
      }
    }
    done_cover_bytes_ += cover_bytes;
  }

  OpenBorders Take() { return std::move(found_); }

 private:
  [[nodiscard]] double DepthOf(LeafId id, const Vec3& axis) const {
    const LeafShape& leaf = (*leaves_)[id.Index()];
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (const Point3& p : leaf.corners) {
      const double h = Dot(axis, p - leaf.center);
      low = std::min(low, h);
      high = std::max(high, h);
    }
    return high - low;
  }

  // Charges what was found so far, one more border, and `more_bytes` for a
  // while. `cover_bytes` is the part of the node's cover bytes that is done:
  // the pieces grow with the covers.
  void ChargeWith(uint64_t more_bytes, double cover_bytes) {
    const double done = done_cover_bytes_ + cover_bytes;
    charge_->GrowTo(
        found_.Bytes() + sizeof(LeafBorder) + node_bytes_ + more_bytes,
        done / static_cast<double>(std::max<uint64_t>(all_cover_bytes_, 1)));
  }

  double oblique_crack_m_;
  const BspTree* tree_;
  const LeafShapes* leaves_;
  const FaceSurvey* survey_;
  uint64_t all_cover_bytes_;
  double done_cover_bytes_ = 0;  // of earlier nodes
  GrowingCharge* charge_;
  OpenBorders found_;
  uint64_t node_bytes_ = 0;  // temporary memory of the current node
};

}  // namespace

void OpenBorders::Add(LeafBorder border, const std::vector<Polygon>& open) {
  constexpr uint64_t kNumbersBytes = 20;
  if (borders_.empty() || borders_.back().node != border.node) {
    node_bytes_ = 0;
  }
  for (const Polygon& opening : open) {
    border.open_m2 += PolygonArea(opening);
    ByteWriter& out =
        openings_.Append(kNumbersBytes + opening.size() * sizeof(Point3));
    out.PutVarint(borders_.size());
    out.PutArray(std::span<const Point3>(opening));
    node_bytes_ += BytesOfCover(opening);
  }
  most_node_bytes_ = std::max(most_node_bytes_, node_bytes_);
  borders_.push_back(border);
}

void OpenBorders::ForEachOpening(
    const std::function<void(const LeafBorder&, Polygon)>& visit) const {
  openings_.Visit([&](ByteReader& in) {
    const uint64_t border = in.GetVarint();
    visit(borders_.at(border), in.GetArray<Point3>());
  });
}

OpenBorders FindOpenBorders(const BorderInput& input,
                            ScratchShelf& shelf,
                            MemoryBudget& budget,
                            GrowingCharge& charge) {
  const BuiltTree& built = input.built;
  const FaceSurvey& survey = input.survey;
  BorderFinder finder(input, shelf, charge);
  const size_t nodes = built.tree.nodes.size();
  for (size_t first = 0; first < nodes;) {
    const uint64_t room = budget.FreeBytes() / kCoverParts;
    size_t end = first;
    uint64_t bytes = 0;
    do {
      bytes += BytesOfNode(survey, end++);
    } while (end < nodes && bytes + BytesOfNode(survey, end) <= room);
    const MemoryCharge covers_charge(
        budget, bytes, "the walls between the cells");
    CoverCollector covers(built.tree, first, end);
    covers.AddAll(input.store);
    for (; first < end; ++first) {
      finder.AddNode(NodeId(first), built.sections[first], covers.Of(first));
    }
  }
  return finder.Take();
}

}  // namespace enfilade
