// Schroeder's convergence test (S, section 2.5.1): an emitter of 1 x 1 m,
// turned by 45 degrees, 0.1 m above a receiver of 2 x 2 m and reflectance 1;
// relative L1 error of the receiver's radiosity, whose exact value is known at
// every point, against the number of couplings. docs/convergence.md has the
// tables.

#include "solver/transfer/node_transfer.h"
#include "solver/transfer/oracle.h"

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "tests/solver/test_cells.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

Patch Parallelogram(Point3 origin, Vec3 u, Vec3 v) {
  Patch p;
  p.origin = origin;
  p.u = u;
  p.v = v;
  p.shape = PatchShape::kParallelogram;
  return p;
}

struct Squares {
  PatchGeometry receiver;
  PatchGeometry emitter;  // 1 W/m2

  Squares() {
    const double h = std::sqrt(0.5);  // half a diagonal, m
    const auto both =
        test::GeometryOf({Parallelogram({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}),
                          Parallelogram({-h, 0, 0.1}, {h, h, 0}, {h, -h, 0})});
    receiver = both[0];
    emitter = both[1];
  }
};

struct Couplings {
  double count = 0;
  double error = 0;  // relative L1
};

// A receiver's tree with the irradiance that couplings brought to its elements.
class Experiment {
 public:
  explicit Experiment(size_t order) : basis_(order) {
    elements_.push_back({{}, 0, std::vector<double>(Nodes().NodeCount())});
  }

  // Couples all elements of 2^-level of the receiver with the whole emitter, or
  // with elements of it of that size (plain quadrature: S's full matrix).
  void CoupleAll(size_t level, bool whole_emitter) {
    Visit(0, level, [&](uint32_t e) {
      if (whole_emitter) {
        Couple(e, {}, false);
        return;
      }
      const float size = std::ldexp(1.0F, -static_cast<int>(level));
      for (size_t i = 0; i < size_t{1} << (2 * level); ++i) {
        const size_t column = i & ((size_t{1} << level) - 1);
        Couple(e,
               {static_cast<float>(column) * size,
                static_cast<float>(i >> level) * size,
                size},
               true);
      }
    });
  }

  // The solver's way: its oracle splits the receiver until the error of each
  // coupling, weighted by the root of the area, is at most `tau`, W/m. The
  // emitter is even and form factors are exact, so it is never split.
  void CoupleByOracle(float tau, uint32_t e = 0) {
    const TransferEnd end = MakeTransferEnd(squares_.receiver, FrameOf(e));
    RadiantEnd source;
    source.end = MakeTransferEnd(squares_.emitter, {});
    source.radiosity.fill(1);
    const Judgement judgement = Judge(end, source, basis_);
    EXPECT_EQ(judgement.source_error, 0);
    if (std::sqrt(end.area) * judgement.receiver_error <= tau) {
      Couple(e, {}, false);
      return;
    }
    const uint32_t first = Split(e);
    for (uint32_t c = 0; c < kChildren; ++c) {
      CoupleByOracle(tau, first + c);
    }
  }

  Couplings Measure() {
    PushDown();
    // Points that no element's rim goes through.
    constexpr size_t kPoints = 201;
    double difference = 0;
    double total = 0;
    for (size_t i = 0; i < kPoints * kPoints; ++i) {
      const UnitPoint p = {(static_cast<double>(i % kPoints) + 0.5) / kPoints,
                           (static_cast<double>(i / kPoints) + 0.5) / kPoints};
      const double exact = ExactAt(p);
      difference += std::abs(ValueAt(p) - exact);
      total += exact;
    }
    return {count_, difference / total};
  }

 private:
  struct Item {
    ElementFrame frame;
    uint32_t first_child = 0;
    std::vector<double> irradiance;  // [node], W/m2
  };

  [[nodiscard]] const ShapeBasis& Nodes() const { return basis_.parallelogram; }

  [[nodiscard]] ElementFrame FrameOf(uint32_t e) const {
    return elements_[e].frame;
  }

  uint32_t Split(uint32_t e) {
    const auto first = static_cast<uint32_t>(elements_.size());
    elements_[e].first_child = first;
    for (size_t c = 0; c < kChildren; ++c) {
      elements_.push_back({ChildOf(FrameOf(e), PatchShape::kParallelogram, c),
                           0,
                           std::vector<double>(Nodes().NodeCount())});
    }
    return first;
  }

  // Makes all elements `level` levels below `e` and calls `visit` for each.
  void Visit(uint32_t e,
             size_t level,
             const std::function<void(uint32_t)>& visit) {
    if (level == 0) {
      visit(e);
      return;
    }
    const uint32_t first = Split(e);
    for (uint32_t c = 0; c < kChildren; ++c) {
      Visit(first + c, level - 1, visit);
    }
  }

  void Couple(uint32_t e, ElementFrame emitter, bool plain) {
    const NodeEnd r = MakeNodeEnd(Nodes(), squares_.receiver, FrameOf(e));
    const NodeEnd s = MakeNodeEnd(Nodes(), squares_.emitter, emitter);
    const NodeKernel kernel =
        plain ? FarNodeKernel(r, s) : TransferKernel(r, s);
    for (size_t g = 0; g < r.count; ++g) {
      for (size_t q = 0; q < s.count; ++q) {
        elements_[e].irradiance[g] +=
            static_cast<double>(kernel[g * kMaxNodes + q]);
      }
    }
    ++count_;
  }

  void PushDown() {
    for (size_t i = 0; i < elements_.size(); ++i) {
      for (size_t c = 0; elements_[i].first_child != 0 && c < kChildren; ++c) {
        auto& child = elements_[elements_[i].first_child + c].irradiance;
        for (size_t q = 0; q < child.size(); ++q) {
          for (size_t g = 0; g < child.size(); ++g) {
            child[q] += Nodes().Push(c, q, g) * elements_[i].irradiance[g];
          }
        }
      }
    }
  }

  [[nodiscard]] double ExactAt(UnitPoint p) const {
    const Corners corners = CornersOf(squares_.emitter, {});
    return static_cast<double>(PointToPolygon(PointOn(squares_.receiver,
                                                      {},
                                                      static_cast<float>(p.a),
                                                      static_cast<float>(p.b)),
                                              squares_.receiver.normal,
                                              corners.View()));
  }

  [[nodiscard]] double ValueAt(UnitPoint p) const {
    uint32_t e = 0;
    while (elements_[e].first_child != 0) {
      const uint32_t right = p.a >= 0.5 ? 1 : 0;
      const uint32_t upper = p.b >= 0.5 ? 1 : 0;
      p = {2 * p.a - right, 2 * p.b - upper};
      e = elements_[e].first_child + right + 2 * upper;
    }
    const auto functions = Nodes().Evaluate(p);
    double value = 0;
    for (size_t g = 0; g < Nodes().NodeCount(); ++g) {
      value += functions[g] * elements_[e].irradiance[g];
    }
    return value;
  }

  Basis basis_;
  Squares squares_;
  std::vector<Item> elements_;
  double count_ = 0;
};

// Minus the slope of log error against log couplings, by least squares.
double FallOf(const std::vector<Couplings>& runs) {
  double n = 0;
  double x = 0;
  double y = 0;
  double xx = 0;
  double xy = 0;
  for (const Couplings& run : runs) {
    const double a = std::log(run.count);
    const double b = std::log(run.error);
    ++n;
    x += a;
    y += b;
    xx += a * a;
    xy += a * b;
  }
  return -(n * xy - x * y) / (n * xx - x * x);
}

// At 4,000 couplings, S reads "about 22 %" off the line of full matrices, whose
// slope is 1 in h, the fourth root of 1 / couplings.
TEST(SchroederTest, FullMatrixOfConstantElementsIsThePapers) {
  std::vector<Couplings> runs;
  for (const size_t level : {3U, 4U, 5U}) {
    Experiment experiment(1);
    experiment.CoupleAll(level, false);
    runs.push_back(experiment.Measure());
  }
  EXPECT_EQ(runs[0].count, 4096);
  EXPECT_NEAR(runs[0].error, 0.22, 0.005);
  EXPECT_NEAR(4 * FallOf(runs), 1, 0.1);
}

TEST(SchroederTest, EvenMeshesConvergeAtTheOrderOfTheBasis) {
  for (size_t order = 1; order <= 3; ++order) {
    std::vector<Couplings> runs;
    for (const size_t level : {4U, 5U, 6U}) {
      Experiment experiment(order);
      experiment.CoupleAll(level, true);
      runs.push_back(experiment.Measure());
    }
    // Each coupling is an element of the receiver, so h is the root of 1 /
    // couplings.
    const auto k = static_cast<double>(order);
    EXPECT_NEAR(2 * FallOf(runs) / k, 1, 0.1) << "M" << order;
  }
}

// The runs of an order between 100 and 20,000 couplings. Kernels are single
// precision: below 1e-5 their rounding is seen.
std::vector<Couplings> RunsByOracle(size_t order) {
  constexpr double kRounding = 1e-5;
  std::vector<Couplings> runs;
  for (float tau = 0.1F;; tau *= std::sqrt(0.5F)) {
    Experiment experiment(order);
    experiment.CoupleByOracle(tau);
    const Couplings run = experiment.Measure();
    if (run.count > 20000 || run.error < kRounding) {
      return runs;
    }
    if (run.count >= 100) {
      runs.push_back(run);
    }
  }
}

TEST(SchroederTest, SlopesOfTheOraclesCouplingsAreInTheRatioOfTheOrders) {
  const double first = FallOf(RunsByOracle(1));
  // Only one end is split, so the fall is half the order, as with even meshes.
  EXPECT_NEAR(2 * first, 1, 0.1);
  for (size_t order = 2; order <= 4; ++order) {
    const double ratio =
        FallOf(RunsByOracle(order)) / first / static_cast<double>(order);
    RecordProperty("M" + std::to_string(order), std::to_string(ratio));
    EXPECT_NEAR(ratio, 1, 0.1) << "M" << order;
  }
}

}  // namespace
}  // namespace enfilade
