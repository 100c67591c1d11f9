#include "visibility/cone.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace enfilade {
namespace {

constexpr size_t kDim = 6;
constexpr size_t kMaxCorral = kDim + 1;
constexpr double kOrigin = 1e-7;  // points nearer than this are the origin
constexpr double kPivot = 1e-13;  // smaller pivots: affine dependence
constexpr double kWeightZero = 1e-12;
constexpr double kStrictly = 1e-10;  // least margin of an interior vector
constexpr int kMaxRounds = 300;

PluckerRow Scaled(const PluckerRow& a, double s) {
  PluckerRow r = a;
  for (double& x : r) {
    x *= s;
  }
  return r;
}

// Wolfe's corral: affinely independent rows with positive weights that sum to
// one. Their weighted sum is the point of their hull that is nearest to the
// origin.
struct Corral {
  size_t size = 0;
  std::array<size_t, kMaxCorral> rows{};
  std::array<double, kMaxCorral> weights{};

  void Add(size_t row, double weight) {
    rows[size] = row;
    weights[size] = weight;
    ++size;
  }

  void RemoveZeros() {
    size_t kept = 0;
    for (size_t i = 0; i < size; ++i) {
      if (weights[i] > kWeightZero) {
        rows[kept] = rows[i];
        weights[kept++] = weights[i];
      }
    }
    size = kept;
  }

  [[nodiscard]] PluckerRow Point(std::span<const PluckerRow> all) const {
    PluckerRow sum{};
    for (size_t i = 0; i < size; ++i) {
      for (size_t k = 0; k < kDim; ++k) {
        sum[k] += weights[i] * all[rows[i]][k];
      }
    }
    return sum;
  }
};

using Weights = std::array<double, kMaxCorral>;

// The weights of the point nearest to the origin in the affine hull of the
// corral, from (1 + a_i . a_j) w = 1, scaled to sum to one; nullopt if the
// corral is degenerate.
std::optional<Weights> NearestInAffineHull(const Corral& corral,
                                           std::span<const PluckerRow> all) {
  const size_t n = corral.size;
  std::array<std::array<double, kMaxCorral>, kMaxCorral> lower{};
  Weights w{};
  for (size_t i = 0; i < n; ++i) {  // Cholesky, and forward substitution
    double rhs = 1;
    for (size_t j = 0; j <= i; ++j) {
      double s = 1 + Dot(all[corral.rows[i]], all[corral.rows[j]]);
      for (size_t k = 0; k < j; ++k) {
        s -= lower[i][k] * lower[j][k];
      }
      if (j < i) {
        lower[i][j] = s / lower[j][j];
        rhs -= lower[i][j] * w[j];
      } else if (s < kPivot) {
        return std::nullopt;
      } else {
        lower[i][i] = std::sqrt(s);
      }
    }
    w[i] = rhs / lower[i][i];
  }
  double sum = 0;
  for (size_t i = n; i-- > 0;) {
    for (size_t k = i + 1; k < n; ++k) {
      w[i] -= lower[k][i] * w[k];
    }
    w[i] /= lower[i][i];
    sum += w[i];
  }
  for (size_t i = 0; i < n; ++i) {
    w[i] /= sum;
  }
  return w;
}

// Moves the weights towards `target` as far as all stay positive; true when
// the target was reached.
bool MoveTowards(const Weights& target, Corral& corral) {
  double step = 1;
  for (size_t i = 0; i < corral.size; ++i) {
    if (target[i] <= kWeightZero) {
      const double w = corral.weights[i];
      step = std::min(step, w / std::max(w - target[i], 1e-300));
    }
  }
  for (size_t i = 0; i < corral.size; ++i) {
    corral.weights[i] += step * (target[i] - corral.weights[i]);
  }
  corral.RemoveZeros();
  return step >= 1;
}

// Makes the corral's point the nearest one of its affine hull to the origin.
// Returns false if the corral is degenerate.
bool Settle(std::span<const PluckerRow> all, Corral& corral) {
  for (size_t i = 0; i <= kMaxCorral; ++i) {
    const auto target = NearestInAffineHull(corral, all);
    if (!target) {
      return false;
    }
    if (MoveTowards(*target, corral)) {
      return true;
    }
  }
  return false;
}

}  // namespace

double Dot(const PluckerRow& a, const PluckerRow& b) {
  double sum = 0;
  for (size_t k = 0; k < kDim; ++k) {
    sum += a[k] * b[k];
  }
  return sum;
}

PluckerRow EdgeRow(Point3 p, Point3 q) {
  const Vec3 m = Cross(p - Point3{}, q - Point3{});
  const Vec3 d = q - p;
  const PluckerRow row = {m.x, m.y, m.z, d.x, d.y, d.z};
  return Scaled(row, 1 / std::sqrt(Dot(row, row)));
}

std::optional<PluckerRow> InteriorOfCone(std::span<const PluckerRow> rows) {
  Corral corral;
  corral.Add(0, 1);
  PluckerRow nearest = rows[0];
  for (int round = 0; round < kMaxRounds; ++round) {
    size_t lowest = 0;
    double least = Dot(rows[0], nearest);
    for (size_t i = 1; i < rows.size(); ++i) {
      const double side = Dot(rows[i], nearest);
      if (side < least) {
        least = side;
        lowest = i;
      }
    }
    const double square = Dot(nearest, nearest);
    if (square < kOrigin * kOrigin) {
      return std::nullopt;
    }
    if (least > kStrictly || corral.size == kMaxCorral) {
      return nearest;
    }
    corral.Add(lowest, 0);
    if (!Settle(rows, corral)) {
      return nearest;
    }
    nearest = corral.Point(rows);
  }
  return nearest;
}

}  // namespace enfilade
