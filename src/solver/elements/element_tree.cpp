#include "solver/elements/element_tree.h"

#include "base/check.h"
#include "base/error.h"
#include "base/hash.h"
#include "solver/elements/coefficient_pages.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include <fmt/format.h>

namespace enfilade {
namespace {

// The block of the numbers of patches and parents; the parents themselves
// follow under the next keys.
BlockKey StructureKey(CellId cell) {
  return {BlockKind::kCellTree, cell.value, 0, 0};
}

BlockKey PagesKey(CellId cell) {
  return {BlockKind::kCellTree, cell.value, 1, 0};
}

// The counts in the structure block of a stored tree.
struct StoredCounts {
  uint64_t patches = 0;
  uint64_t parents = 0;
};

std::optional<StoredCounts> StoredCountsOf(const BlockStorage& store,
                                           CellId cell) {
  return ReadBlockIfAny(store, StructureKey(cell), [](ByteReader& in) {
    StoredCounts counts;
    counts.patches = in.GetVarint();
    counts.parents = in.GetVarint();
    return counts;
  });
}

// The number of levels from the root to the end of a path.
size_t LevelOf(ElementPath path) {
  return static_cast<size_t>(std::bit_width(path) - 1) / 2;
}

// The mean square of a - b over an element, in the channel where it is largest.
double MeanSquare(const ShapeBasis& basis,
                  const TreeShape& shape,
                  std::span<const float> a,
                  std::span<const float> b) {
  double largest = 0;
  for (size_t ch = 0; ch < shape.channels; ++ch) {
    double sum = 0;
    for (size_t q = 0; q < basis.NodeCount(); ++q) {
      const size_t at = ch * shape.NodeStride() + q;
      const double d = static_cast<double>(a[at] - b[at]);
      sum += basis.Weight(q) * d * d;
    }
    largest = std::max(largest, sum);
  }
  return largest;
}

}  // namespace

ElementFrame FrameOfPath(PatchShape shape, ElementPath path) {
  ElementFrame frame;
  for (size_t level = LevelOf(path); level-- > 0;) {
    frame = ChildOf(frame, shape, path >> (2 * level) & 3);
  }
  return frame;
}

void PushTo(const ShapeBasis& basis,
            const TreeShape& shape,
            size_t child,
            std::span<const float> from,
            std::span<float> to) {
  const size_t n = basis.NodeCount();
  for (size_t c = 0; c < shape.channels; ++c) {
    const size_t at = c * shape.NodeStride();
    for (size_t q = 0; q < n; ++q) {
      double sum = 0;
      for (size_t g = 0; g < n; ++g) {
        sum += basis.Push(child, q, g) * static_cast<double>(from[at + g]);
      }
      to[at + q] = static_cast<float>(sum);
    }
  }
}

void PullFrom(const ShapeBasis& basis,
              const TreeShape& shape,
              size_t child,
              std::span<const float> from,
              std::span<float> to) {
  const size_t n = basis.NodeCount();
  for (size_t c = 0; c < shape.channels; ++c) {
    const size_t at = c * shape.NodeStride();
    for (size_t g = 0; g < n; ++g) {
      double sum = 0;
      for (size_t q = 0; q < n; ++q) {
        sum += basis.Pull(child, g, q) * static_cast<double>(from[at + q]);
      }
      to[at + g] += static_cast<float>(sum);
    }
  }
}

CellTree::CellTree(TreeShape shape, std::span<const PatchGeometry> patches)
    : CellTree(shape) {
  AppendRoots(patches);
  GrowCoefficients();
}

void CellTree::AppendRoots(std::span<const PatchGeometry> patches) {
  patch_count_ = patches.size();
  for (size_t i = 0; i < patches.size(); ++i) {
    elements_.PushBack({static_cast<uint32_t>(i), 0, {}});
    patch_shapes_.push_back(patches[i].shape);
  }
}

void CellTree::GrowCoefficients() {
  sent_.GrowTo(elements_.Size());
  detail_.GrowTo(elements_.Size());
}

void CellTree::AppendChildren(uint32_t parent, PatchShape patch_shape) {
  const Element from = elements_[parent];
  elements_[parent].first_child = static_cast<uint32_t>(elements_.Size());
  parents_.PushBack(parent);
  for (size_t c = 0; c < kChildren; ++c) {
    elements_.PushBack({from.patch, 0, ChildOf(from.frame, patch_shape, c)});
  }
}

void CellTree::Split(ElementId e, PatchShape patch_shape) {
  const size_t first = elements_.Size();
  AppendChildren(e.value, patch_shape);
  GrowCoefficients();
  const ShapeBasis& basis = shape_.basis->On(patch_shape);
  for (size_t c = 0; c < kChildren; ++c) {
    const ElementId child(first + c);
    PushTo(basis, shape_, c, sent_[e], sent_[child]);
  }
}

ElementId CellTree::FindOrCreate(PatchId patch,
                                 ElementPath path,
                                 std::span<const PatchGeometry> patches) {
  ElementId e(patch.value);
  for (size_t level = LevelOf(path); level-- > 0;) {
    if (At(e).first_child == 0) {
      Split(e, patches[patch.Index()].shape);
    }
    e = ElementId(At(e).first_child + (path >> (2 * level) & 3));
  }
  return e;
}

void CellTree::UpdateDetail() {
  std::vector<float> pushed(shape_.Stride());
  for (size_t i = elements_.Size(); i-- > 0;) {
    const Element& parent = elements_[i];
    detail_[i] = 0;
    if (parent.first_child == 0) {
      continue;
    }
    const ShapeBasis& basis = shape_.basis->On(patch_shapes_[parent.patch]);
    double square = 0;
    for (size_t c = 0; c < kChildren; ++c) {
      const ElementId child(parent.first_child + c);
      PushTo(basis, shape_, c, sent_[ElementId(i)], pushed);
      const double below = detail_[child.Index()];
      square +=
          (MeanSquare(basis, shape_, sent_[child], pushed) + below * below) /
          kChildren;
    }
    detail_[i] = static_cast<float>(std::sqrt(square));
  }
}

uint64_t CellTree::Save(BlockStorage& store, CellId cell) const {
  BlockKey key = StructureKey(cell);
  ByteWriter counts;
  counts.PutVarint(patch_count_);
  counts.PutVarint(parents_.Size());
  uint64_t stored = store.Put(key, counts.View());
  for (size_t page = 0; page < parents_.PageCount(); ++page) {
    ByteWriter parents;
    parents.PutArray(parents_.Page(page));
    ++key.c;
    stored += store.Put(key, parents.View());
  }
  return stored + SavePages(store, PagesKey(cell), sent_);
}

std::optional<CellTree> CellTree::LoadElements(
    const BlockStorage& store,
    CellId cell,
    TreeShape shape,
    std::span<const PatchGeometry> patches) {
  const auto counts = StoredCountsOf(store, cell);
  if (!counts) {
    return std::nullopt;
  }
  if (counts->patches != patches.size()) {
    ThrowDamaged(store,
                 fmt::format("has an element tree of {} patches for cell {}, "
                             "which has {}",
                             counts->patches,
                             cell.value,
                             patches.size()));
  }
  CellTree tree(shape);
  tree.AppendRoots(patches);
  BlockKey key = StructureKey(cell);
  while (tree.parents_.Size() < counts->parents) {
    ++key.c;
    ReadBlock(store, key, [&](ByteReader& in) {
      const auto parents = in.GetArray<uint32_t>();
      tree.SplitStored(parents, counts->parents - tree.parents_.Size());
      return parents.size();
    });
  }
  return tree;
}

// `left`: how many elements of the stored tree are still to be split.
void CellTree::SplitStored(std::span<const uint32_t> parents, uint64_t left) {
  if (parents.empty() || parents.size() > left) {
    throw DamagedStoreError("it is of another state than the first page");
  }
  for (const uint32_t parent : parents) {
    if (parent >= elements_.Size() || elements_[parent].first_child != 0) {
      throw DamagedStoreError("it splits an element that cannot be split");
    }
    AppendChildren(parent, patch_shapes_[elements_[parent].patch]);
  }
}

std::optional<CellTree> CellTree::Load(const BlockStorage& store,
                                       CellId cell,
                                       TreeShape shape,
                                       std::span<const PatchGeometry> patches) {
  auto tree = LoadElements(store, cell, shape, patches);
  if (tree) {
    tree->GrowCoefficients();
    const size_t size = tree->Size();
    if (LoadPages(store, PagesKey(cell), size, &tree->sent_) != size) {
      ThrowDamaged(store,
                   fmt::format("lacks coefficients of the element tree of cell "
                               "{}",
                               cell.value));
    }
    tree->UpdateDetail();
  }
  return tree;
}

size_t CellTree::StoredSize(const BlockStorage& store, CellId cell) {
  const auto counts = StoredCountsOf(store, cell);
  return counts ? counts->patches + kChildren * counts->parents : 0;
}

uint64_t CellTree::BytesFor(size_t elements, TreeShape shape) {
  const size_t floats = shape.Stride() + 1;  // coefficients and detail
  return ElementBytesFor(elements) + elements * floats * sizeof(float);
}

uint64_t CellTree::ElementBytesFor(size_t elements) {
  return elements * sizeof(Element) + elements / kChildren * sizeof(uint32_t);
}

uint64_t CellTree::Digest(const CoefficientArray& gathered) const {
  ENFILADE_CHECK(
      gathered.Size() == Size(), "{} of {} elements", gathered.Size(), Size());
  StreamingHash children;
  for (size_t i = 0; i < elements_.Size(); ++i) {
    children.Add(std::as_bytes(std::span(&elements_[i].first_child, 1)));
  }
  uint64_t digest = children.Value();
  for (size_t page = 0; page < gathered.PageCount(); ++page) {
    digest = HashBytes(std::as_bytes(gathered.Page(page)), digest);
  }
  return digest;
}

uint64_t CellTree::SizeBytes() const {
  return elements_.SizeBytes() + parents_.SizeBytes() + sent_.SizeBytes() +
         detail_.SizeBytes() + patch_shapes_.capacity();
}

bool CellTree::IsValid() const {
  for (size_t i = 0; i < elements_.Size(); ++i) {
    const Element& e = elements_[i];
    const bool children_follow =
        e.first_child == 0 ||
        (e.first_child > i && e.first_child + kChildren <= elements_.Size());
    if (!children_follow || e.patch >= patch_count_) {
      return false;
    }
  }
  return sent_.IsFinite();
}

}  // namespace enfilade
