#include "tools/verify/lights.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace enfilade {
namespace {

// Emitter, two nodes, lamp, index, slack.
constexpr uint64_t kBytesPerEmitter = 300;
// A node is a lamp if its emitters have at least this many times the area of
// the disk of the sphere around their bounding box. A bulb has 1.3, half a bulb
// 0.9, a square 0.64.
constexpr double kLampArea = 0.75;

// Orders emitters by which are kept first: the brightest, ties by id.
struct Brighter {
  const SceneInfo* scene;

  [[nodiscard]] auto Rank(const Emitter& e) const {
    return std::tuple(
        -MaxChannel(scene->materials[e.material.Index()].exitance),
        e.cell,
        e.patch);
  }

  bool operator()(const Emitter& left, const Emitter& right) const {
    return Rank(left) < Rank(right);
  }
};

Emitter MakeEmitter(CellId cell, PatchId id, const Patch& patch) {
  Emitter e;
  e.cell = cell;
  e.patch = id;
  e.shape = patch.shape;
  e.material = patch.material;
  e.origin = patch.origin;
  e.u = patch.u;
  e.v = patch.v;
  e.normal = PatchNormal(patch);
  e.area = PatchArea(patch);
  return e;
}

// cos(max(0, a - b)) from cosines and sines, for angles in [0, pi].
double CosOfDifference(double cos_a, double sin_a, double cos_b, double sin_b) {
  return cos_a > cos_b ? 1.0 : cos_a * cos_b + sin_a * sin_b;
}

double SinFromCos(double c) {
  return std::sqrt(std::max(0.0, 1 - c * c));
}

}  // namespace

EmitterTree::EmitterTree(const BuildingView& view,
                         MemoryBudget& budget,
                         uint64_t max_bytes)
    : scene_(view.scene), charge_(budget, "the light sources") {
  Gather(view, static_cast<size_t>(max_bytes / kBytesPerEmitter));
  if (emitters_.empty()) {
    return;
  }
  Sort(0, emitters_.size());
  nodes_.resize(2 * emitters_.size() - 1);
  Build(0, 0, emitters_.size());
  lamps_.reserve(emitters_.size());
  FindLamps(0, 0, emitters_.size());
  by_id_.resize(emitters_.size());
  std::iota(by_id_.begin(), by_id_.end(), 0U);
  std::sort(by_id_.begin(), by_id_.end(), [&](uint32_t left, uint32_t right) {
    return std::tie(emitters_[left].cell, emitters_[left].patch) <
           std::tie(emitters_[right].cell, emitters_[right].patch);
  });
}

// Keeps the brightest emitters in a heap, with the dimmest of them on top.
void EmitterTree::Gather(const BuildingView& view, size_t max_count) {
  const Brighter brighter{scene_};
  for (size_t c = 0; c < view.partition->cells.size(); ++c) {
    const CellPatches cell = view.load_cell(CellId(c));
    for (size_t p = 0; p < cell.patches.size(); ++p) {
      const Patch& patch = cell.patches[p];
      if (!patch.emits ||
          !Emits(scene_->materials.at(patch.material.Index()))) {
        continue;
      }
      charge_.GrowTo(std::min(emitters_.size() + 1, max_count) *
                     kBytesPerEmitter);
      emitters_.push_back(MakeEmitter(CellId(c), PatchId(p), patch));
      std::push_heap(emitters_.begin(), emitters_.end(), brighter);
      if (emitters_.size() > max_count) {
        std::pop_heap(emitters_.begin(), emitters_.end(), brighter);
        emitters_.pop_back();
      }
    }
  }
}

// Orders a range by halving it recursively along the longest axis of its
// centroids.
void EmitterTree::Sort(size_t first, size_t last) {
  if (last - first < 2) {
    return;
  }
  Box3 box;
  for (size_t i = first; i < last; ++i) {
    box.Include(Centroid(emitters_[i]));
  }
  const Vec3 extent = box.Extent();
  const size_t axis = extent.x >= extent.y && extent.x >= extent.z ? 0
                      : extent.y >= extent.z                       ? 1
                                                                   : 2;
  const size_t middle = first + (last - first) / 2;
  const auto at = [&](size_t i) {
    return emitters_.begin() + static_cast<std::ptrdiff_t>(i);
  };
  std::nth_element(
      at(first),
      at(middle),
      at(last),
      [&](const Emitter& left, const Emitter& right) {
        return std::tuple(Centroid(left)[axis], left.cell, left.patch) <
               std::tuple(Centroid(right)[axis], right.cell, right.patch);
      });
  Sort(first, middle);
  Sort(middle, last);
}

EmitterTree::Node EmitterTree::Build(size_t node, size_t first, size_t last) {
  if (last - first == 1) {
    const Emitter& e = emitters_[first];
    const Rgb& exitance = scene_->materials[e.material.Index()].exitance;
    nodes_[node] = LeafNode(e, exitance[0] + exitance[1] + exitance[2]);
    return nodes_[node];
  }
  const size_t middle = first + (last - first) / 2;
  const Node left = Build(node + 1, first, middle);
  const Node right = Build(node + 2 * (middle - first), middle, last);
  nodes_[node] = Merge(left, right);
  Box3 box;
  for (size_t i = first; i < last; ++i) {
    const CornerList<Point3> corners = CornersOf(emitters_[i]);
    box.Include(BoundsOf(corners.View()));
  }
  nodes_[node].center = box.Center();
  nodes_[node].radius =
      static_cast<float>(Length(box.Extent()) / 2 * (1 + 1e-6));
  return nodes_[node];
}

void EmitterTree::FindLamps(size_t node, size_t first, size_t last) {
  double area = 0;
  for (size_t i = first; i < last; ++i) {
    area += emitters_[i].area;
  }
  const double radius = nodes_[node].radius;
  if (last - first == 1 || area >= kLampArea * kPi * radius * radius) {
    lamps_.push_back({static_cast<uint32_t>(node),
                      static_cast<uint32_t>(first),
                      static_cast<uint32_t>(last - first)});
    return;
  }
  const size_t middle = first + (last - first) / 2;
  FindLamps(node + 1, first, middle);
  FindLamps(node + 2 * (middle - first), middle, last);
}

uint32_t EmitterTree::LampOf(uint32_t leaf) const {
  const auto after = std::upper_bound(
      lamps_.begin(), lamps_.end(), leaf, [](uint32_t i, const Lamp& lamp) {
        return i < lamp.first;
      });
  return static_cast<uint32_t>(after - lamps_.begin()) - 1;
}

EmitterTree::Node EmitterTree::LeafNode(const Emitter& e, double exitance) {
  Node node;
  node.center = e.origin + (e.u + e.v) * 0.5;
  node.radius = static_cast<float>(
      0.5 * std::max(Length(e.u + e.v), Length(e.u - e.v)) * (1 + 1e-6));
  node.axis = e.normal;
  node.power = static_cast<float>(exitance * e.area);
  return node;
}

// Merges the power and the cones of normals, but not the spheres.
EmitterTree::Node EmitterTree::Merge(const Node& left, const Node& right) {
  Node node;
  node.power = left.power + right.power;
  const Vec3 sum = left.axis + right.axis;
  if (Length(sum) < 1e-3) {
    node.axis = left.axis;
    node.cos_cone = -1;
    return node;
  }
  node.axis = Normalize(sum);
  const auto reach = [&](const Node& child) {
    return std::acos(std::clamp(Dot(node.axis, child.axis), -1.0, 1.0)) +
           std::acos(static_cast<double>(child.cos_cone));
  };
  node.cos_cone = static_cast<float>(
      std::cos(std::min(kPi, std::max(reach(left), reach(right)) + 1e-4)));
  return node;
}

// A bound, up to a factor, of what the node's emitters send to x: power times
// the best cosines at both ends over the squared distance.
double EmitterTree::Importance(const Node& node, Point3 x, Vec3 normal) {
  const Vec3 to_node = node.center - x;
  const double distance2 = Dot(to_node, to_node);
  const double radius = node.radius;
  if (distance2 <= radius * radius) {
    return node.power / std::max(distance2, radius * radius / 4);
  }
  const double distance = std::sqrt(distance2);
  const Vec3 direction = to_node / distance;
  const double sin_bound = radius / distance;
  const double cos_bound = SinFromCos(sin_bound);
  const double cos_x = Dot(normal, direction);
  const double best_x =
      CosOfDifference(cos_x, SinFromCos(cos_x), cos_bound, sin_bound);
  if (best_x <= 0) {
    return 0;
  }
  const double cos_e = -Dot(node.axis, direction);
  const double cone = node.cos_cone;
  const double outside =
      CosOfDifference(cos_e, SinFromCos(cos_e), cone, SinFromCos(cone));
  const double best_e =
      CosOfDifference(outside, SinFromCos(outside), cos_bound, sin_bound);
  return best_e <= 0 ? 0 : node.power * best_x * best_e / distance2;
}

double EmitterTree::LeftShare(size_t node,
                              size_t left_count,
                              Point3 x,
                              Vec3 normal) const {
  const double left = Importance(nodes_[node + 1], x, normal);
  const double right = Importance(nodes_[node + 2 * left_count], x, normal);
  const double sum = left + right;
  return sum > 0 ? left / sum : -1;
}

std::optional<EmitterTree::Choice> EmitterTree::Choose(Point3 x,
                                                       Vec3 normal,
                                                       double s) const {
  const Lamp all{0, 0, static_cast<uint32_t>(emitters_.size())};
  return ChooseIn(all, x, normal, s);
}

std::optional<EmitterTree::Choice> EmitterTree::ChooseIn(const Lamp& lamp,
                                                         Point3 x,
                                                         Vec3 normal,
                                                         double s) const {
  if (lamp.count == 0) {
    return std::nullopt;
  }
  size_t node = lamp.node;
  size_t first = lamp.first;
  size_t last = first + lamp.count;
  double probability = 1;
  while (last - first > 1) {
    const size_t left_count = (last - first) / 2;
    const double share = LeftShare(node, left_count, x, normal);
    if (share < 0) {
      return std::nullopt;
    }
    if (s < share) {
      s = std::min(s / share, 0x1.fffffffffffffp-1);
      probability *= share;
      node = node + 1;
      last = first + left_count;
    } else {
      s = std::min((s - share) / (1 - share), 0x1.fffffffffffffp-1);
      probability *= 1 - share;
      node = node + 2 * left_count;
      first = first + left_count;
    }
  }
  return Choice{&emitters_[first], probability};
}

double EmitterTree::Probability(size_t leaf, Point3 x, Vec3 normal) const {
  const Lamp all{0, 0, static_cast<uint32_t>(emitters_.size())};
  return ProbabilityIn(all, leaf, x, normal);
}

double EmitterTree::ProbabilityIn(const Lamp& lamp,
                                  size_t leaf,
                                  Point3 x,
                                  Vec3 normal) const {
  size_t node = lamp.node;
  size_t first = lamp.first;
  size_t last = first + lamp.count;
  double probability = 1;
  while (last - first > 1 && probability > 0) {
    const size_t left_count = (last - first) / 2;
    const double share = LeftShare(node, left_count, x, normal);
    if (share < 0) {
      return 0;
    }
    if (leaf < first + left_count) {
      probability *= share;
      node = node + 1;
      last = first + left_count;
    } else {
      probability *= 1 - share;
      node = node + 2 * left_count;
      first = first + left_count;
    }
  }
  return probability;
}

std::optional<uint32_t> EmitterTree::Find(CellId cell, PatchId patch) const {
  const std::tuple key(cell, patch);
  const auto id_of = [&](uint32_t i) {
    return std::tuple(emitters_[i].cell, emitters_[i].patch);
  };
  const auto found = std::lower_bound(
      by_id_.begin(), by_id_.end(), key, [&](uint32_t i, const auto& k) {
        return id_of(i) < k;
      });
  if (found == by_id_.end() || id_of(*found) != key) {
    return std::nullopt;
  }
  return *found;
}

void EmitterTree::AppendLampsOfCell(CellId cell,
                                    std::vector<uint32_t>& indices) const {
  const auto first = std::lower_bound(
      by_id_.begin(), by_id_.end(), cell, [&](uint32_t i, CellId c) {
        return emitters_[i].cell < c;
      });
  for (auto at = first; at != by_id_.end() && emitters_[*at].cell == cell;
       ++at) {
    indices.push_back(LampOf(*at));
  }
}

double EmitterTree::Density(Point3 x,
                            Vec3 normal,
                            CellId cell,
                            PatchId patch) const {
  const std::optional<uint32_t> leaf = Find(cell, patch);
  return leaf ? Probability(*leaf, x, normal) / emitters_[*leaf].area : 0;
}

}  // namespace enfilade
