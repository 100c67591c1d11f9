// The element trees of one cell and what the elements send. What has changed of
// that, and what they receive, is beside it: cell_delta.h, received_light.h.
//
//   paper  here      per element, channel and node
//   B      sent      radiosity that the cell's own links have been told of, in
//                    W/m2
//
// Elements are numbered in the order of their creation: the roots are the
// patches, children follow their parent, four in a row. So a loop upwards is a
// push and a loop downwards a pull.

#pragma once

#include "base/block_storage.h"
#include "base/bytes.h"
#include "base/ids.h"
#include "base/paged_vector.h"
#include "solver/elements/basis.h"
#include "solver/elements/coefficient_array.h"
#include "solver/elements/geometry.h"

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace enfilade {

struct Element {
  uint32_t patch = 0;
  uint32_t first_child = 0;  // 0: a leaf
  ElementFrame frame;
};

// A node of a tree by its way from the root: two bits per level, lowest level
// last, below a leading 1. The root is 1.
using ElementPath = uint64_t;
inline constexpr ElementPath kRootPath = 1;
inline constexpr size_t kMaxLevel = 20;

inline ElementPath ChildPath(ElementPath path, size_t child) {
  return path << 2 | static_cast<ElementPath>(child);
}

// An element that is not split further.
inline bool IsDeepest(ElementPath path) {
  return path >> (2 * kMaxLevel) != 0;
}

// Where the element at the end of a path lies on its patch.
ElementFrame FrameOfPath(PatchShape shape, ElementPath path);

// What all trees of a solve share.
struct TreeShape {
  const Basis* basis = nullptr;
  size_t channels = kRgbChannels;

  // Floats per element in a coefficient array.
  [[nodiscard]] size_t NodeStride() const {
    return basis->parallelogram.NodeCount();
  }

  [[nodiscard]] size_t Stride() const { return channels * NodeStride(); }
};

class CellTree {
 public:
  // One root per patch, all coefficients zero. `patches` is borrowed.
  CellTree(TreeShape shape, std::span<const PatchGeometry> patches);

  // The tree of a cell as Save left it, nothing if there is none;
  // DamagedStoreError if it contradicts itself.
  static std::optional<CellTree> Load(const BlockStorage& store,
                                      CellId cell,
                                      TreeShape shape,
                                      std::span<const PatchGeometry> patches);

  // The same without coefficients, for gathering from it and for reading the
  // solution. It must not grow.
  static std::optional<CellTree> LoadElements(
      const BlockStorage& store,
      CellId cell,
      TreeShape shape,
      std::span<const PatchGeometry> patches);

  // Elements of the stored tree; 0 if there is none.
  static size_t StoredSize(const BlockStorage& store, CellId cell);

  // What a tree of so many elements takes, and one without coefficients.
  static uint64_t BytesFor(size_t elements, TreeShape shape);
  static uint64_t ElementBytesFor(size_t elements);

  // Writes the structure and the coefficients, both page by page. Returns what
  // they take in the store.
  uint64_t Save(BlockStorage& store, CellId cell) const;

  // Hash of what is the solution: structure and what is gathered, which is of
  // as many elements.
  [[nodiscard]] uint64_t Digest(const CoefficientArray& gathered) const;

  [[nodiscard]] size_t Size() const { return elements_.Size(); }

  [[nodiscard]] size_t PatchCount() const { return patch_count_; }

  [[nodiscard]] const Element& At(ElementId e) const {
    return elements_[e.Index()];
  }

  // The element at the end of `path`, made if need be: its coefficients are
  // the restriction of its parent's.
  ElementId FindOrCreate(PatchId patch,
                         ElementPath path,
                         std::span<const PatchGeometry> patches);

  // The deepest existing element on `path`, and how many levels were walked.
  [[nodiscard]] std::pair<ElementId, size_t> FindDeepest(
      PatchId patch, ElementPath path) const;

  // Coefficients: Stride() floats per element, [channel][node].
  CoefficientArray& Sent() { return sent_; }

  [[nodiscard]] const CoefficientArray& Sent() const { return sent_; }

  // RMS over the element of what its children's `sent` has beyond its own,
  // largest over the channels. Zero at leaves; valid after UpdateDetail.
  [[nodiscard]] float Detail(ElementId e) const { return detail_[e.Index()]; }

  void UpdateDetail();

  [[nodiscard]] uint64_t SizeBytes() const;

  [[nodiscard]] const TreeShape& Shape() const { return shape_; }

  [[nodiscard]] PatchShape ShapeOf(uint32_t patch) const {
    return patch_shapes_[patch];
  }

  // Children follow parents, every coefficient is finite.
  [[nodiscard]] bool IsValid() const;

 private:
  explicit CellTree(TreeShape shape) : shape_(shape), sent_(shape.Stride()) {}

  void AppendRoots(std::span<const PatchGeometry> patches);
  void GrowCoefficients();
  void AppendChildren(uint32_t parent, PatchShape patch_shape);
  void Split(ElementId e, PatchShape patch_shape);

  TreeShape shape_;
  size_t patch_count_ = 0;
  PagedVector<Element> elements_;
  // Those that were split, in that order, which is the order of their children:
  // the structure.
  PagedVector<uint32_t> parents_;
  std::vector<PatchShape> patch_shapes_;
  CoefficientArray sent_;
  PagedVector<float> detail_;
};

// Pushes the parent's coefficients to a child: to[c][q] = sum Push from[c][g].
void PushTo(const ShapeBasis& basis,
            const TreeShape& shape,
            size_t child,
            std::span<const float> from,
            std::span<float> to);

// Adds the child's share of the parent's coefficients.
void PullFrom(const ShapeBasis& basis,
              const TreeShape& shape,
              size_t child,
              std::span<const float> from,
              std::span<float> to);

}  // namespace enfilade
