// Points, vectors and boxes in metres, in world space unless a name says
// otherwise. Points and vectors are different types: the difference of two
// points is a vector, and points cannot be added.

#pragma once

#include "base/packed.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

namespace enfilade {

struct Vec3 {
  double x = 0, y = 0, z = 0;

  double operator[](size_t i) const { return i == 0 ? x : i == 1 ? y : z; }

  friend bool operator==(const Vec3&, const Vec3&) = default;
};

template <>
inline constexpr bool kIsPacked<Vec3> = sizeof(Vec3) == 3 * sizeof(double);

struct Point3 {
  double x = 0, y = 0, z = 0;

  double operator[](size_t i) const { return i == 0 ? x : i == 1 ? y : z; }

  friend bool operator==(const Point3&, const Point3&) = default;
};

template <>
inline constexpr bool kIsPacked<Point3> = sizeof(Point3) == 3 * sizeof(double);

inline Vec3 operator+(Vec3 a, Vec3 b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}

inline Vec3 operator-(Vec3 a, Vec3 b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

inline Vec3 operator-(Vec3 a) {
  return {-a.x, -a.y, -a.z};
}

inline Vec3 operator*(Vec3 a, double s) {
  return {a.x * s, a.y * s, a.z * s};
}

inline Vec3 operator*(double s, Vec3 a) {
  return a * s;
}

inline Vec3 operator/(Vec3 a, double s) {
  return a * (1.0 / s);
}

inline Vec3 operator-(Point3 a, Point3 b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

inline Point3 operator+(Point3 a, Vec3 b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}

inline Point3 operator-(Point3 a, Vec3 b) {
  return a + (-b);
}

inline double Dot(Vec3 a, Vec3 b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

inline Vec3 Cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

inline double Length(Vec3 a) {
  return std::sqrt(Dot(a, a));
}

// Requires a nonzero vector.
inline Vec3 Normalize(Vec3 a) {
  return a / Length(a);
}

inline Point3 Lerp(Point3 a, Point3 b, double t) {
  return a + (b - a) * t;
}

inline bool IsFinite(Point3 p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

// An axis-parallel box; empty (low > high) by default.
struct Box3 {
  Point3 low{std::numeric_limits<double>::infinity(),
             std::numeric_limits<double>::infinity(),
             std::numeric_limits<double>::infinity()};
  Point3 high{-std::numeric_limits<double>::infinity(),
              -std::numeric_limits<double>::infinity(),
              -std::numeric_limits<double>::infinity()};

  [[nodiscard]] bool IsEmpty() const { return low.x > high.x; }

  void Include(Point3 p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {
        std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }

  void Include(const Box3& b) {
    if (!b.IsEmpty()) {
      Include(b.low);
      Include(b.high);
    }
  }

  [[nodiscard]] Vec3 Extent() const { return high - low; }

  [[nodiscard]] Point3 Center() const { return Lerp(low, high, 0.5); }

  [[nodiscard]] bool Contains(Point3 p) const {
    return p.x >= low.x && p.x <= high.x && p.y >= low.y && p.y <= high.y &&
           p.z >= low.z && p.z <= high.z;
  }

  [[nodiscard]] bool Overlaps(const Box3& b) const {
    return low.x <= b.high.x && b.low.x <= high.x && low.y <= b.high.y &&
           b.low.y <= high.y && low.z <= b.high.z && b.low.z <= high.z;
  }
};

template <>
inline constexpr bool kIsPacked<Box3> = kIsPacked<Point3> &&
                                        sizeof(Box3) == 2 * sizeof(Point3);

// Whether `box` meets the convex hull of `a` and `b`, that is, any of the boxes
// whose corners interpolate linearly between those of `a` and `b`.
inline bool MeetsHull(const Box3& box, const Box3& a, const Box3& b) {
  double first = 0;  // shares of the way from a to b that meet the box
  double last = 1;
  // Keeps the shares t with from + t * (to - from) >= 0.
  const auto keep = [&](double from, double to) {
    if (from < 0 && to < 0) {
      last = -1;
    } else if (from < 0) {
      first = std::max(first, from / (from - to));
    } else if (to < 0) {
      last = std::min(last, from / (from - to));
    }
  };
  for (size_t i = 0; i < 3; ++i) {
    keep(box.high[i] - a.low[i], box.high[i] - b.low[i]);
    keep(a.high[i] - box.low[i], b.high[i] - box.low[i]);
  }
  return first <= last;
}

inline Box3 BoundsOf(std::span<const Point3> points) {
  Box3 box;
  for (const Point3 p : points) {
    box.Include(p);
  }
  return box;
}

}  // namespace enfilade
