#include "solver/solution/display_builder.h"

#include "base/memory.h"
#include "base/stop.h"
#include "solver/solution/plane_index.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

namespace enfilade {
namespace {

// Moves `p` a hair inside the unit shape, where every basis is defined.
UnitPoint Inside(PatchShape shape, UnitPoint p) {
  constexpr double kHair = 1e-7;
  const double most = 1 - kHair;
  p = {std::clamp(p.a, kHair, most), std::clamp(p.b, kHair, most)};
  if (shape == PatchShape::kTriangle && p.a + p.b > most) {
    const double out = (p.a + p.b - most) / 2;
    p = {std::max(p.a - out, 0.0), std::max(p.b - out, 0.0)};
  }
  return p;
}

}  // namespace

void DisplayMeshBuilder::Build(const CoplanarPatches& cell,
                               size_t group,
                               const DisplayOptions& options) {
  NumberLeaves();
  WeldCorners();
  FindHanging();
  MakeRings();
  TakeValues();
  joined_ = DisjointSets(mesh_.rings_.size());
  if (options.smooth) {
    JoinLeaves(cell, group);
  }
  MakeVertices();
  mesh_.charge_.ShrinkTo(0);
  mesh_.charge_.GrowTo(mesh_.SizeBytes());
}

void DisplayMeshBuilder::NumberLeaves() {
  size_t leaves = 0;
  for (size_t e = 0; e < forest_.Size(); ++e) {
    leaves += forest_.IsLeaf(e) ? 1U : 0U;
  }
  // By Euler's formula a mesh of faces whose vertices meet three or more edges
  // has fewer than two vertices to a face.
  constexpr uint64_t kVertexBytes =
      PointWelder::kPointBytes + sizeof(PlanePoint) + 2 * sizeof(Hanging);
  constexpr uint64_t kLeafBytes =
      sizeof(DisplayMesh::Leaf) + sizeof(corners_[0]) + 2 * kVertexBytes;
  mesh_.charge_.GrowTo(forest_.Size() * sizeof(uint32_t) + leaves * kLeafBytes);
  mesh_.leaf_of_element_.resize(forest_.Size());
  mesh_.leaves_.reserve(leaves);
  for (size_t e = 0; e < forest_.Size(); ++e) {
    if (forest_.IsLeaf(e)) {
      mesh_.leaf_of_element_[e] = static_cast<uint32_t>(mesh_.leaves_.size());
      mesh_.leaves_.push_back({static_cast<uint32_t>(e)});
    }
  }
}

void DisplayMeshBuilder::WeldCorners() {
  PointWelder welder(forest_.ToleranceM());
  corners_.reserve(mesh_.leaves_.size());
  for (const DisplayMesh::Leaf& leaf : mesh_.leaves_) {
    std::array<uint32_t, 4>& corners = corners_.emplace_back();
    for (size_t k = 0; k < forest_.CornerCount(leaf.element); ++k) {
      const UnitPoint at = UnitCorner(forest_.ShapeOf(leaf.element), k);
      corners.at(k) = welder.Add(forest_.PointOn(leaf.element, at));
    }
  }
  welded_ = welder.Points();
}

void DisplayMeshBuilder::FindHanging() {
  std::vector<uint32_t> touching;
  for (uint32_t vertex = 0; vertex < welded_.size(); ++vertex) {
    ThrowIfStopRequested();
    forest_.LeavesAt(welded_[vertex], &touching);
    for (const uint32_t element : touching) {
      AddHanging(mesh_.leaf_of_element_[element], vertex);
    }
  }
  std::sort(
      hanging_.begin(), hanging_.end(), [](const Hanging& a, const Hanging& b) {
        return std::tie(a.leaf, a.edge, a.along, a.vertex) <
               std::tie(b.leaf, b.edge, b.along, b.vertex);
      });
}

// If a vertex lies on an edge of the leaf but is none of its corners, notes it
// on the nearest edge: near a sharp corner, two edges are within the tolerance.
void DisplayMeshBuilder::AddHanging(uint32_t leaf, uint32_t vertex) {
  const size_t count = forest_.CornerCount(mesh_.leaves_[leaf].element);
  const auto corners = std::span(corners_[leaf]).first(count);
  if (std::find(corners.begin(), corners.end(), vertex) != corners.end()) {
    return;
  }
  const PlanePoint p = welded_[vertex];
  double nearest_m = 2 * forest_.ToleranceM();
  std::optional<Hanging> hanging;
  for (size_t k = 0; k < count; ++k) {
    const PlaneSegment edge{welded_[corners[k]],
                            welded_[corners[(k + 1) % count]]};
    const PlanePoint along = edge.b - edge.a;
    const PlanePoint from = p - edge.a;
    const double t = (from.x * along.x + from.y * along.y) /
                     (along.x * along.x + along.y * along.y);
    const double distance_m = DistanceFromLine(p, edge);
    if (t > 0 && t < 1 && distance_m <= nearest_m) {
      nearest_m = distance_m;
      hanging = Hanging{leaf, static_cast<uint32_t>(k), t, vertex};
    }
  }
  if (hanging) {
    hanging_.push_back(*hanging);
  }
}

void DisplayMeshBuilder::MakeRings() {
  mesh_.rings_.reserve(corners_.size() * 4 + hanging_.size());
  auto next = hanging_.begin();
  for (uint32_t leaf = 0; leaf < corners_.size(); ++leaf) {
    const size_t begin = mesh_.rings_.size();
    mesh_.leaves_[leaf].ring = static_cast<uint32_t>(begin);
    const uint32_t element = mesh_.leaves_[leaf].element;
    for (uint32_t k = 0; k < forest_.CornerCount(element); ++k) {
      PutCorner(corners_[leaf].at(k), begin);
      for (; next != hanging_.end() && next->leaf == leaf && next->edge == k;
           ++next) {
        PutCorner(next->vertex, begin);
      }
    }
    const bool plain = mesh_.rings_.size() - begin == 3;
    mesh_.leaves_[leaf].centre = plain ? DisplayMesh::kNoCentre : 0;
  }
  FreeVector(&corners_);
  FreeVector(&hanging_);
  constexpr uint64_t kPlaceBytes =
      sizeof(Value) + sizeof(float) + sizeof(uint32_t) + sizeof(RingEdge);
  Recharge(mesh_.rings_.size() * kPlaceBytes);
}

// Sets the charge to the size of the mesh so far, of the welded points and of
// the centre values, plus `more` bytes.
void DisplayMeshBuilder::Recharge(uint64_t more) {
  const uint64_t bytes = mesh_.SizeBytes() +
                         welded_.size() * sizeof(PlanePoint) +
                         mesh_.leaves_.size() * sizeof(Value) + more;
  mesh_.charge_.ShrinkTo(bytes);
  mesh_.charge_.GrowTo(bytes);
}

void DisplayMeshBuilder::PutCorner(uint32_t vertex, size_t begin) {
  const auto ring = std::span(mesh_.rings_).subspan(begin);
  if (std::find(ring.begin(), ring.end(), vertex) == ring.end()) {
    mesh_.rings_.push_back(vertex);
  }
}

void DisplayMeshBuilder::TakeValues() {
  own_.reserve(mesh_.rings_.size());
  centres_.reserve(mesh_.leaves_.size());
  weights_.reserve(mesh_.rings_.size());
  for (size_t leaf = 0; leaf < mesh_.leaves_.size(); ++leaf) {
    ThrowIfStopRequested();
    TakeLeafValues(leaf);
    WeighLeaf(leaf);
  }
}

// Evaluates the leaf's irradiance at its vertices and centre.
void DisplayMeshBuilder::TakeLeafValues(size_t leaf) {
  const uint32_t element = mesh_.leaves_[leaf].element;
  const PatchShape shape = forest_.ShapeOf(element);
  const ShapeBasis& basis = shape_.basis->On(shape);
  std::vector<uint32_t> path = {element};
  while (forest_.At(path.back()).parent != path.back()) {
    path.push_back(forest_.At(path.back()).parent);
  }
  std::vector<float> sum(shape_.Stride());
  std::vector<float> pushed(shape_.Stride());
  for (size_t i = path.size(); i-- > 0;) {
    const DisplayElement& e = forest_.At(path[i]);
    if (e.parent != path[i]) {
      const size_t child = path[i] - forest_.At(e.parent).first_child;
      PushTo(basis, shape_, child, sum, pushed);
      std::swap(sum, pushed);
    }
    if (e.source) {
      const std::span<const float> gathered = gathered_[*e.source];
      for (size_t k = 0; k < sum.size(); ++k) {
        sum[k] += gathered[k];
      }
    }
  }
  const auto value_at = [&](UnitPoint p) {
    const auto functions = basis.Evaluate(Inside(shape, p));
    Value value{};
    for (size_t c = 0; c < value.size(); ++c) {
      double at_p = 0;
      for (size_t q = 0; q < basis.NodeCount(); ++q) {
        at_p += functions[q] *
                static_cast<double>(sum[c * shape_.NodeStride() + q]);
      }
      value[c] = static_cast<float>(at_p);
    }
    return value;
  };
  for (const uint32_t vertex : mesh_.Ring(leaf)) {
    own_.push_back(value_at(forest_.LocalOf(element, welded_[vertex])));
  }
  centres_.push_back(value_at(UnitCentroid(shape)));
}

// Sums the areas of the leaf's triangles at each vertex. An area that rounding
// makes 0 or negative counts as a tiny positive one, so that a weighted mean
// stays within the range of its values.
void DisplayMeshBuilder::WeighLeaf(size_t leaf) {
  constexpr double kLeastWeight = 1e-30;
  const std::span<const uint32_t> ring = mesh_.Ring(leaf);
  const size_t begin = weights_.size();
  const size_t n = ring.size();
  const auto area_m2 = [&](PlanePoint a, PlanePoint b, PlanePoint c) {
    return static_cast<float>(std::max(Cross(b - a, c - a) / 2, kLeastWeight));
  };
  if (mesh_.leaves_[leaf].centre == DisplayMesh::kNoCentre) {
    weights_.resize(
        begin + n,
        area_m2(welded_[ring[0]], welded_[ring[1]], welded_[ring[2]]));
    return;
  }
  weights_.resize(begin + n);
  const uint32_t element = mesh_.leaves_[leaf].element;
  const PlanePoint centre =
      forest_.PointOn(element, UnitCentroid(forest_.ShapeOf(element)));
  for (size_t i = 0; i < n; ++i) {
    const size_t j = (i + 1) % n;
    const float area = area_m2(centre, welded_[ring[i]], welded_[ring[j]]);
    weights_[begin + i] += area;
    weights_[begin + j] += area;
  }
}

void DisplayMeshBuilder::SortEdges() {
  edges_.reserve(mesh_.rings_.size());
  for (size_t leaf = 0; leaf < mesh_.leaves_.size(); ++leaf) {
    const std::span<const uint32_t> ring = mesh_.Ring(leaf);
    const uint32_t begin = mesh_.leaves_[leaf].ring;
    for (uint32_t i = 0; i < ring.size(); ++i) {
      const auto j = static_cast<uint32_t>((i + 1) % ring.size());
      const uint64_t low = std::min(ring[i], ring[j]);
      const uint64_t high = std::max(ring[i], ring[j]);
      edges_.push_back({low << 32 | high, begin + i, begin + j});
    }
  }
  std::sort(
      edges_.begin(), edges_.end(), [](const RingEdge& a, const RingEdge& b) {
        return std::tie(a.key, a.begin) < std::tie(b.key, b.begin);
      });
}

void DisplayMeshBuilder::JoinLeaves(const CoplanarPatches& cell, size_t group) {
  if (mesh_.leaves_.size() < 2) {
    return;
  }
  const double tolerance_m = 2 * forest_.ToleranceM();
  const SegmentIndex barriers(StandingSegments(cell, group), tolerance_m);
  SortEdges();
  for (size_t i = 0; i < edges_.size();) {
    size_t end = i + 1;
    while (end < edges_.size() && edges_[end].key == edges_[i].key) {
      ++end;
    }
    const RingEdge& a = edges_[i];
    const RingEdge& b = edges_[i + 1 < end ? i + 1 : i];
    const uint32_t from = mesh_.rings_[a.begin];
    // Exactly two leaves share the edge, one on each side; if there are more,
    // leaves overlap.
    if (end - i == 2 && from == mesh_.rings_[b.end] &&
        !barriers.Covers(welded_[from], welded_[mesh_.rings_[a.end]])) {
      joined_.Join(a.begin, b.end);
      joined_.Join(a.end, b.begin);
    }
    i = end;
  }
  FreeVector(&edges_);
}

// Makes one vertex for each class of joined ring places and one for each
// centre.
void DisplayMeshBuilder::MakeVertices() {
  using Sum = std::array<double, kRgbChannels + 1>;
  const auto places = static_cast<uint32_t>(mesh_.rings_.size());
  size_t classes = 0;
  for (uint32_t i = 0; i < places; ++i) {
    classes += joined_.Find(i) == i ? 1U : 0U;
  }
  const size_t vertices = classes + centres_.size();
  Recharge(places * (sizeof(Value) + sizeof(float) + 2 * sizeof(uint32_t)) +
           classes * sizeof(Sum) +
           vertices * (sizeof(PlanePoint) + sizeof(Value)));
  mesh_.points_.reserve(vertices);
  mesh_.values_.reserve(vertices);
  std::vector<Sum> sums;
  sums.reserve(classes);
  std::vector<uint32_t> vertex_of(places);
  for (uint32_t i = 0; i < places; ++i) {
    const uint32_t first = joined_.Find(i);
    if (first == i) {
      vertex_of[i] = static_cast<uint32_t>(sums.size());
      sums.emplace_back();
      mesh_.points_.push_back(welded_[mesh_.rings_[i]]);
    }
    vertex_of[i] = vertex_of[first];
    auto& sum = sums[vertex_of[i]];
    const auto weight = static_cast<double>(weights_[i]);
    for (size_t c = 0; c < kRgbChannels; ++c) {
      sum.at(c) += weight * static_cast<double>(own_[i].at(c));
    }
    sum.back() += weight;
  }
  mesh_.rings_ = std::move(vertex_of);
  mesh_.values_.resize(sums.size());
  for (size_t v = 0; v < sums.size(); ++v) {
    for (size_t c = 0; c < kRgbChannels; ++c) {
      mesh_.values_[v].at(c) =
          static_cast<float>(sums[v].at(c) / sums[v].back());
    }
  }
  AddCentres();
}

void DisplayMeshBuilder::AddCentres() {
  for (size_t leaf = 0; leaf < mesh_.leaves_.size(); ++leaf) {
    DisplayMesh::Leaf& l = mesh_.leaves_[leaf];
    if (l.centre != DisplayMesh::kNoCentre) {
      l.centre = static_cast<uint32_t>(mesh_.points_.size());
      mesh_.points_.push_back(
          forest_.PointOn(l.element, UnitCentroid(forest_.ShapeOf(l.element))));
      mesh_.values_.push_back(centres_[leaf]);
    }
  }
}

}  // namespace enfilade
