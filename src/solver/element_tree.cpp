#include "solver/element_tree.h"

#include "base/check.h"
#include "base/hash.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace enfilade {
namespace {

// Floats with their bytes grouped by significance, which zstd likes.
void PutShuffled(const std::vector<float>& values, ByteWriter* out) {
  std::vector<uint8_t> bytes(values.size() * sizeof(float));
  for (size_t i = 0; i < values.size(); ++i) {
    const auto bits = std::bit_cast<uint32_t>(values[i]);
    for (size_t k = 0; k < sizeof(float); ++k) {
      bytes[k * values.size() + i] = static_cast<uint8_t>(bits >> (8 * k));
    }
  }
  out->PutArray(std::span<const uint8_t>(bytes));
}

std::vector<float> GetShuffled(size_t count, ByteReader* in) {
  const auto bytes = in->GetArray<uint8_t>();
  if (bytes.size() != count * sizeof(float)) {
    throw DamagedStoreError("an element tree has the wrong number of values");
  }
  std::vector<float> values(count);
  for (size_t i = 0; i < count; ++i) {
    uint32_t bits = 0;
    for (size_t k = 0; k < sizeof(float); ++k) {
      bits |= static_cast<uint32_t>(bytes[k * count + i]) << (8 * k);
    }
    values[i] = std::bit_cast<float>(bits);
  }
  return values;
}

// Number of levels below the root on a path.
size_t LevelOf(ElementPath path) {
  return static_cast<size_t>(std::bit_width(path) - 1) / 2;
}

}  // namespace

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
    : shape_(shape), patch_count_(patches.size()) {
  elements_.resize(patches.size());
  for (size_t i = 0; i < patches.size(); ++i) {
    elements_[i].patch = static_cast<uint32_t>(i);
    patch_shapes_.push_back(patches[i].shape);
  }
  const size_t floats = elements_.size() * shape_.Stride();
  gathered_.resize(floats);
  sent_.resize(floats);
  delta_.resize(floats);
  detail_.resize(elements_.size());
}

void CellTree::AppendChildren(uint32_t parent, PatchShape patch_shape) {
  const Element from = elements_[parent];
  elements_[parent].first_child = static_cast<uint32_t>(elements_.size());
  for (size_t c = 0; c < kChildren; ++c) {
    elements_.push_back({from.patch, 0, ChildOf(from.frame, patch_shape, c)});
  }
}

void CellTree::Split(ElementId e, PatchShape patch_shape) {
  const size_t first = elements_.size();
  AppendChildren(e.value, patch_shape);
  const size_t floats = elements_.size() * shape_.Stride();
  gathered_.resize(floats);
  sent_.resize(floats);
  delta_.resize(floats);
  detail_.resize(elements_.size());
  const ShapeBasis& basis = shape_.basis->On(patch_shape);
  for (size_t c = 0; c < kChildren; ++c) {
    const ElementId child(first + c);
    PushTo(basis, shape_, c, Sent(e), Sent(child));
    PushTo(basis, shape_, c, Delta(e), Delta(child));
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

std::pair<ElementId, size_t> CellTree::FindDeepest(PatchId patch,
                                                   ElementPath path) const {
  ElementId e(patch.value);
  const size_t levels = LevelOf(path);
  for (size_t level = levels; level-- > 0;) {
    if (At(e).first_child == 0) {
      return {e, levels - 1 - level};
    }
    e = ElementId(At(e).first_child + (path >> (2 * level) & 3));
  }
  return {e, levels};
}

void CellTree::UpdateDetail() {
  std::vector<float> pushed(shape_.Stride());
  for (size_t i = elements_.size(); i-- > 0;) {
    const Element& parent = elements_[i];
    detail_[i] = 0;
    if (parent.first_child == 0) {
      continue;
    }
    const ShapeBasis& basis = shape_.basis->On(patch_shapes_[parent.patch]);
    double square = 0;
    for (size_t c = 0; c < kChildren; ++c) {
      const ElementId child(parent.first_child + c);
      PushTo(basis, shape_, c, Sent(ElementId(i)), pushed);
      double largest = 0;
      for (size_t ch = 0; ch < shape_.channels; ++ch) {
        double sum = 0;
        for (size_t q = 0; q < basis.NodeCount(); ++q) {
          const size_t at = ch * shape_.NodeStride() + q;
          const double d = static_cast<double>(Sent(child)[at] - pushed[at]);
          sum += basis.Weight(q) * d * d;
        }
        largest = std::max(largest, sum);
      }
      const double below = detail_[child.Index()];
      square += (largest + below * below) / kChildren;
    }
    detail_[i] = static_cast<float>(std::sqrt(square));
  }
}

Bytes CellTree::Encode() const {
  ByteWriter out;
  out.PutVarint(patch_count_);
  out.PutVarint(elements_.size());
  uint32_t last = static_cast<uint32_t>(patch_count_);
  // First children grow in the order in which parents were split; a parent is
  // stored as its own number at the place of its children.
  std::vector<uint32_t> parents((elements_.size() - patch_count_) / kChildren);
  for (size_t i = 0; i < elements_.size(); ++i) {
    if (elements_[i].first_child != 0) {
      parents[(elements_[i].first_child - last) / kChildren] =
          static_cast<uint32_t>(i);
    }
  }
  out.PutArray(std::span<const uint32_t>(parents));
  PutShuffled(gathered_, &out);
  PutShuffled(sent_, &out);
  PutShuffled(delta_, &out);
  return out.Take();
}

CellTree CellTree::Decode(TreeShape shape,
                          std::span<const PatchGeometry> patches,
                          std::span<const std::byte> bytes) {
  ByteReader in(bytes);
  CellTree tree(shape);
  tree.patch_count_ = in.GetVarint();
  const uint64_t size = in.GetVarint();
  const auto parents = in.GetArray<uint32_t>();
  if (tree.patch_count_ != patches.size() ||
      size != tree.patch_count_ + kChildren * parents.size()) {
    throw DamagedStoreError("an element tree does not match its cell");
  }
  tree.elements_.reserve(size);
  for (size_t i = 0; i < patches.size(); ++i) {
    tree.elements_.push_back({static_cast<uint32_t>(i), 0, {}});
    tree.patch_shapes_.push_back(patches[i].shape);
  }
  for (const uint32_t parent : parents) {
    if (parent >= tree.elements_.size() ||
        tree.elements_[parent].first_child != 0) {
      throw DamagedStoreError("an element tree is not a tree");
    }
    tree.AppendChildren(parent,
                        tree.patch_shapes_[tree.elements_[parent].patch]);
  }
  const size_t floats = size * shape.Stride();
  tree.gathered_ = GetShuffled(floats, &in);
  tree.sent_ = GetShuffled(floats, &in);
  tree.delta_ = GetShuffled(floats, &in);
  tree.detail_.resize(size);
  tree.UpdateDetail();
  return tree;
}

uint64_t CellTree::Digest() const {
  ByteWriter out;
  for (const Element& e : elements_) {
    out.Put(e.first_child);
  }
  return HashBytes(std::as_bytes(std::span(gathered_)), HashBytes(out.View()));
}

uint64_t CellTree::SizeBytes() const {
  return elements_.capacity() * sizeof(Element) +
         (gathered_.capacity() + sent_.capacity() + delta_.capacity() +
          detail_.capacity()) *
             sizeof(float) +
         patch_shapes_.capacity();
}

bool CellTree::IsValid() const {
  for (size_t i = 0; i < elements_.size(); ++i) {
    const Element& e = elements_[i];
    const bool children_follow =
        e.first_child == 0 ||
        (e.first_child > i && e.first_child + kChildren <= elements_.size());
    if (!children_follow || e.patch >= patch_count_) {
      return false;
    }
  }
  const auto finite = [](float x) { return std::isfinite(x); };
  return std::all_of(gathered_.begin(), gathered_.end(), finite) &&
         std::all_of(sent_.begin(), sent_.end(), finite) &&
         std::all_of(delta_.begin(), delta_.end(), finite);
}

}  // namespace enfilade
