#include "solver/transfer/point_pair.h"

#include "base/photometry.h"

#include <algorithm>
#include <array>
#include <utility>

namespace enfilade {
namespace {

// A random point of the part of a unit shape that node g stands for.
struct UnitPlace {
  float s = 0;
  float t = 0;
};

UnitPlace PlaceOnTriangle(size_t g, float s, float t) {
  const auto [a, b] = FoldedOnto(PatchShape::kTriangle, s, t);
  // Nodes 0, 1, 2 lie near the corners of weight (1 - a - b), a, b.
  std::array<float, 3> corner = {1 - a - b, a, b};
  const size_t larger = corner[1] > corner[0] ? 1 : 0;
  const size_t largest = corner[2] > corner[larger] ? 2 : larger;
  std::swap(corner[largest], corner[g]);
  return {corner[1], corner[2]};
}

UnitPlace PlaceOnSquare(size_t g, float s, float t) {
  return {0.5F * (s + static_cast<float>(g & 1)),
          0.5F * (t + static_cast<float>(g >> 1))};
}

// The share of the coordinate range off the rim: coordinates are rim + inner *
// s.
float InnerShare(const TransferEnd& end) {
  return 1 - (end.node_count == 4 ? 2.0F : 3.0F) * end.rim;
}

struct Places {
  CandidateLanes s{}, t{};

  void Set(size_t i, UnitPlace at) {
    s[i] = at.s;
    t[i] = at.t;
  }

  void Set(size_t i, std::array<float, 2> at) {
    s[i] = at[0];
    t[i] = at[1];
  }
};

// Moves places of the unit square to the part that node g stands for.
void MoveNearNode(const TransferEnd& end, size_t g, Places* places) {
  if (end.node_count == 4) {
    for (size_t i = 0; i < kCandidates; ++i) {
      places->Set(i, PlaceOnSquare(g, places->s[i], places->t[i]));
    }
    return;
  }
  for (size_t i = 0; i < kCandidates; ++i) {
    places->Set(i, PlaceOnTriangle(g, places->s[i], places->t[i]));
  }
}

// PointOn of each place, kept off the rim.
CandidatePoints PointsOn(const TransferEnd& end, const Places& places) {
  const Vec3f origin = end.patch->origin;
  const Vec3f u = end.patch->u;
  const Vec3f v = end.patch->v;
  const ElementFrame frame = end.frame;
  const float rim = end.rim;
  const float inner = InnerShare(end);
  CandidatePoints points;
  for (size_t i = 0; i < kCandidates; ++i) {
    const float a = frame.a + frame.scale * (rim + inner * places.s[i]);
    const float b = frame.b + frame.scale * (rim + inner * places.t[i]);
    points.x[i] = origin.x + u.x * a + v.x * b;
    points.y[i] = origin.y + u.y * a + v.y * b;
    points.z[i] = origin.z + u.z * a + v.z * b;
  }
  return points;
}

// PointKernel of each pair.
CandidateLanes PointKernels(const CandidatePoints& x,
                            const CandidatePoints& y,
                            const TransferEnd& receiver,
                            const TransferEnd& source) {
  const Vec3f n = receiver.patch->normal;
  const Vec3f m = source.patch->normal;
  CandidateLanes kernels{};
  for (size_t i = 0; i < kCandidates; ++i) {
    kernels[i] = PlainKernel(
        kInversePi, y.x[i] - x.x[i], y.y[i] - x.y[i], y.z[i] - x.z[i], n, m);
  }
  return kernels;
}

}  // namespace

Vec3f PointNearNode(const TransferEnd& end, size_t g, Random* random) {
  const auto [s, t] = random->NextTwo();
  const UnitPlace at =
      end.node_count == 4 ? PlaceOnSquare(g, s, t) : PlaceOnTriangle(g, s, t);
  const float inner = InnerShare(end);
  return PointOn(
      *end.patch, end.frame, end.rim + inner * at.s, end.rim + inner * at.t);
}

Vec3f RandomPoint(const TransferEnd& end, Random* random) {
  return PointNearNode(
      end, random->NextBelow(static_cast<uint32_t>(end.node_count)), random);
}

float PointKernel(PointPair points,
                  const TransferEnd& receiver,
                  const TransferEnd& source) {
  const Vec3f d = points.y - points.x;
  return PlainKernel(
      kInversePi, d.x, d.y, d.z, receiver.patch->normal, source.patch->normal);
}

PairCandidates DrawCandidates(const TransferEnd& receiver,
                              size_t g,
                              const TransferEnd& source,
                              size_t q,
                              Random* random) {
  Places on_receiver;
  Places on_source;
  Random next = *random;  // a local copy stays in registers
  for (size_t i = 0; i < kCandidates; ++i) {
    on_receiver.Set(i, next.NextTwo());
    on_source.Set(i, next.NextTwo());
  }
  *random = next;
  MoveNearNode(receiver, g, &on_receiver);
  MoveNearNode(source, q, &on_source);
  PairCandidates pairs;
  pairs.x = PointsOn(receiver, on_receiver);
  pairs.y = PointsOn(source, on_source);
  pairs.kernels = PointKernels(pairs.x, pairs.y, receiver, source);
  return pairs;
}

}  // namespace enfilade
