#include "partition/wall_fragments.h"

#include <span>
#include <utility>

namespace enfilade {
namespace {

uint64_t EncodedBytes(const WallFragment& fragment) {
  constexpr uint64_t kMostCountBytes = 10;
  return sizeof(uint32_t) + sizeof(Plane) + kMostCountBytes +
         fragment.polygon.size() * sizeof(Point3);
}

void Encode(const WallFragment& fragment, ByteWriter& out) {
  out.Put(fragment.plane_group);
  out.Put(fragment.plane);
  out.PutArray(std::span<const Point3>(fragment.polygon));
}

// Decodes into an existing fragment, so that the memory of its polygon is
// reused.
void Decode(ByteReader& in, WallFragment& fragment) {
  fragment.plane_group = in.Get<uint32_t>();
  fragment.plane = in.Get<Plane>();
  fragment.polygon.clear();
  for (uint64_t left = in.GetVarint(); left > 0; --left) {
    fragment.polygon.push_back(in.Get<Point3>());
  }
}

// Returns a visitor that calls `visit` for each fragment. All fragments share
// the memory of one.
ScratchList::Visitor Decoded(const FragmentList::Visitor& visit) {
  return [&visit, fragment = WallFragment()](ByteReader& in) mutable {
    Decode(in, fragment);
    visit(fragment);
  };
}

}  // namespace

void FragmentList::Add(const WallFragment& fragment) {
  Encode(fragment, list_.Append(EncodedBytes(fragment)));
  ++size_;
}

void FragmentList::Visit(const Visitor& visit) const {
  list_.Visit(Decoded(visit));
}

void FragmentList::Consume(const Visitor& visit) {
  list_.Consume(Decoded(visit));
  size_ = 0;
}

}  // namespace enfilade
