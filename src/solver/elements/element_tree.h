// The element trees of one cell and the radiosity that the elements send. What
// changed of that radiosity is in cell_delta.h, what elements receive in
// received_light.h.
//
//   paper  here      per element, channel and node
//   B      sent      radiosity that the cell's own links have gathered, W/m2
//
// Elements are numbered in the order of their creation: the roots are the
// patches, and the four children of an element follow it in a row. So a push is
// a loop over ascending numbers and a pull a loop over descending ones.

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
#include <vector>

namespace enfilade {

struct Element {
  uint32_t patch = 0;
  uint32_t first_child = 0;  // 0: a leaf
  ElementFrame frame;
};

// The path from the root to an element: a leading 1, then two bits per level,
// the deepest level in the lowest bits. The root has path 1.
using ElementPath = uint64_t;
inline constexpr ElementPath kRootPath = 1;
inline constexpr size_t kMaxLevel = 20;

inline ElementPath ChildPath(ElementPath path, size_t child) {
  return path << 2 | static_cast<ElementPath>(child);
}

// Whether an element is at the deepest level and cannot be split.
inline bool IsDeepest(ElementPath path) {
  return path >> (2 * kMaxLevel) != 0;
}

// Where the element at the end of a path lies on its patch.
ElementFrame FrameOfPath(PatchShape shape, ElementPath path);

// The properties that all trees of a solve share.
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
  // A tree of one root per patch; all coefficients are zero. `patches` is
  // borrowed.
  CellTree(TreeShape shape, std::span<const PatchGeometry> patches);

  // Loads the tree of a cell that Save stored; nullopt if none is stored.
  // Throws DamagedStoreError if the stored tree contradicts itself.
  static std::optional<CellTree> Load(const BlockStorage& store,
                                      CellId cell,
                                      TreeShape shape,
                                      std::span<const PatchGeometry> patches);

  // Loads the tree without coefficients, for gathering from the cell and for
  // reading the solution. Such a tree must not grow.
  static std::optional<CellTree> LoadElements(
      const BlockStorage& store,
      CellId cell,
      TreeShape shape,
      std::span<const PatchGeometry> patches);

  // The number of elements of the stored tree; 0 if none is stored.
  static size_t StoredSize(const BlockStorage& store, CellId cell);

  // The bytes of a tree of so many elements, with and without coefficients.
  static uint64_t BytesFor(size_t elements, TreeShape shape);
  static uint64_t ElementBytesFor(size_t elements);

  // Stores the structure and the coefficients, both page by page. Returns the
  // bytes that they take in the store.
  uint64_t Save(BlockStorage& store, CellId cell) const;

  // A hash of the solution: the tree's structure and the gathered irradiance,
  // which has as many elements as the tree.
  [[nodiscard]] uint64_t Digest(const CoefficientArray& gathered) const;

  [[nodiscard]] size_t Size() const { return elements_.Size(); }

  [[nodiscard]] size_t PatchCount() const { return patch_count_; }

  [[nodiscard]] const Element& At(ElementId e) const {
    return elements_[e.Index()];
  }

  // The element at the end of `path`. Missing elements on the path are created;
  // their coefficients are the restriction of their parent's.
  ElementId FindOrCreate(PatchId patch,
                         ElementPath path,
                         std::span<const PatchGeometry> patches);

  // Coefficients: Stride() floats per element, [channel][node].
  CoefficientArray& Sent() { return sent_; }

  [[nodiscard]] const CoefficientArray& Sent() const { return sent_; }

  // RMS over the element of the difference between the `sent` of its
  // descendants and its own, in the channel where it is largest. Zero at
  // leaves; valid after UpdateDetail.
  [[nodiscard]] float Detail(ElementId e) const { return detail_[e.Index()]; }

  void UpdateDetail();

  [[nodiscard]] uint64_t SizeBytes() const;

  [[nodiscard]] const TreeShape& Shape() const { return shape_; }

  [[nodiscard]] PatchShape ShapeOf(uint32_t patch) const {
    return patch_shapes_[patch];
  }

  // Whether children follow parents and every coefficient is finite.
  [[nodiscard]] bool IsValid() const;

 private:
  explicit CellTree(TreeShape shape) : shape_(shape), sent_(shape.Stride()) {}

  void AppendRoots(std::span<const PatchGeometry> patches);
  void GrowCoefficients();
  void AppendChildren(uint32_t parent, PatchShape patch_shape);
  void SplitStored(std::span<const uint32_t> parents, uint64_t left);
  void Split(ElementId e, PatchShape patch_shape);

  TreeShape shape_;
  size_t patch_count_ = 0;
  PagedVector<Element> elements_;
  // The elements that were split, in the order of their splitting, which is the
  // order of their children. They determine the structure.
  PagedVector<uint32_t> parents_;
  std::vector<PatchShape> patch_shapes_;
  CoefficientArray sent_;
  PagedVector<float> detail_;
};

// Pushes the parent's coefficients `from` to a child: to[c][q] = sum over g of
// Push(child, q, g) from[c][g].
void PushTo(const ShapeBasis& basis,
            const TreeShape& shape,
            size_t child,
            std::span<const float> from,
            std::span<float> to);

// Adds the pulled coefficients `from` of one child to its parent's, `to`.
void PullFrom(const ShapeBasis& basis,
              const TreeShape& shape,
              size_t child,
              std::span<const float> from,
              std::span<float> to);

}  // namespace enfilade
