#include "partition/convex_region.h"

#include "base/memory.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace enfilade {

ConvexRegion::ConvexRegion(const Box3& box) {
  for (size_t axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      const Vec3 normal{axis == 0 ? sign : 0.0,
                        axis == 1 ? sign : 0.0,
                        axis == 2 ? sign : 0.0};
      const Point3 corner = sign > 0 ? box.high : box.low;
      facets_.push_back(
          {{normal, Dot(normal, Vec3{corner.x, corner.y, corner.z})}, {}});
    }
  }
  for (Facet& facet : facets_) {
    Polygon polygon = RectangleAround(box, facet.plane);
    for (const Facet& other : facets_) {
      if (&other != &facet) {
        polygon = ClipToFront(polygon, other.plane.Flipped(), 0);
      }
    }
    facet.polygon = std::move(polygon);
  }
}

Polygon ConvexRegion::CrossSection(const Plane& plane) const {
  Polygon section = RectangleAround(Bounds(), plane);
  for (const Facet& facet : facets_) {
    section = ClipToFront(section, facet.plane.Flipped(), kRoundingM);
    if (section.size() < 3) {
      return {};
    }
  }
  return PolygonArea(section) > kLeastAreaM2 ? section : Polygon{};
}

ConvexRegion ConvexRegion::ClippedTo(const Plane& outward,
                                     const Polygon& cap) const {
  ConvexRegion part;
  for (const Facet& facet : facets_) {
    Polygon polygon = ClipToFront(facet.polygon, outward.Flipped(), kRoundingM);
    if (polygon.size() >= 3 && PolygonArea(polygon) > kLeastAreaM2) {
      part.facets_.push_back({facet.plane, std::move(polygon)});
    }
  }
  part.facets_.push_back({outward, cap});
  return part;
}

ConvexRegion::Halves ConvexRegion::Cut(const Plane& plane) const {
  const Polygon cap = CrossSection(plane);
  const Polygon reversed(cap.rbegin(), cap.rend());
  return {ClippedTo(plane.Flipped(), reversed), ClippedTo(plane, cap)};
}

ConvexRegion::Thickness ConvexRegion::ThicknessAt(const Plane& plane) const {
  Thickness thickness;
  for (const Facet& facet : facets_) {
    for (const Point3& p : facet.polygon) {
      const double d = plane.Distance(p);
      thickness.front_m = std::max(thickness.front_m, d);
      thickness.back_m = std::max(thickness.back_m, -d);
    }
  }
  return thickness;
}

double ConvexRegion::LeastWidth() const {
  double least = std::numeric_limits<double>::infinity();
  for (const Facet& facet : facets_) {
    least = std::min(least, ThicknessAt(facet.plane).back_m);
  }
  return least;
}

double ConvexRegion::Volume() const {
  const Point3 center = Center();
  double volume = 0;
  for (const Facet& facet : facets_) {
    volume += PolygonArea(facet.polygon) * -facet.plane.Distance(center) / 3;
  }
  return std::max(volume, 0.0);
}

Box3 ConvexRegion::Bounds() const {
  Box3 box;
  for (const Facet& facet : facets_) {
    box.Include(BoundsOf(facet.polygon));
  }
  return box;
}

Point3 ConvexRegion::Center() const {
  Vec3 sum;
  double count = 0;
  const Point3 first = facets_.front().polygon.front();
  for (const Facet& facet : facets_) {
    for (const Point3& p : facet.polygon) {
      sum = sum + (p - first);
      count += 1;
    }
  }
  return first + sum / count;
}

std::vector<Point3> ConvexRegion::Corners() const {
  std::vector<Point3> corners;
  for (const Facet& facet : facets_) {
    for (const Point3& p : facet.polygon) {
      const bool known =
          std::any_of(corners.begin(), corners.end(), [&p](const Point3& c) {
            return Length(p - c) < kRoundingM;
          });
      if (!known) {
        corners.push_back(p);
      }
    }
  }
  return corners;
}

uint64_t ConvexRegion::FacetBytes() const {
  uint64_t bytes = kAllocationHeaderBytes + facets_.capacity() * sizeof(Facet);
  for (const Facet& facet : facets_) {
    bytes += kAllocationHeaderBytes + facet.polygon.capacity() * sizeof(Point3);
  }
  return bytes;
}

}  // namespace enfilade
