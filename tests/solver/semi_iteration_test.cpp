// The semi-iteration on small systems B = E + T B whose eigenvalues are known.

#include "solver/semi_iteration.h"

#include "base/random.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

using Vector = std::vector<double>;

constexpr size_t kSize = 24;

// Neighbours on a ring exchange light: symmetric, nonnegative, eigenvalues
// radius * cos(2 pi k / kSize), among them radius and, for the even ring,
// -radius.
struct Ring {
  double radius = 0;

  [[nodiscard]] Vector Times(const Vector& b) const {
    Vector t(kSize);
    for (size_t i = 0; i < kSize; ++i) {
      t[i] = 0.5 * radius * (b[(i + 1) % kSize] + b[(i + kSize - 1) % kSize]);
    }
    return t;
  }
};

double Norm(const Vector& v) {
  double sum = 0;
  for (const double x : v) {
    sum += x * x;
  }
  return std::sqrt(sum);
}

// Solves B = E + T B as the solver does within a cell.
class Iterated {
 public:
  Iterated(Ring ring, Vector emitted)
      : ring_(ring), emitted_(std::move(emitted)), b_(emitted_), step_(kSize) {}

  // Begins anew with what was sent so far.
  void Begin() { std::fill(step_.begin(), step_.end(), 0.0); }

  [[nodiscard]] Vector Unsent() const {
    Vector unsent = ring_.Times(b_);
    for (size_t i = 0; i < kSize; ++i) {
      unsent[i] += emitted_[i] - b_[i];
    }
    return unsent;
  }

  void Step(SemiIteration* iteration) {
    const Vector unsent = Unsent();
    Step(iteration->NextWeight(), unsent);
    iteration->Saw(Norm(unsent));
  }

  void Step(double weight, const Vector& unsent) {
    for (size_t i = 0; i < kSize; ++i) {
      step_[i] = weight * unsent[i] + (weight - 1) * step_[i];
      b_[i] += step_[i];
    }
  }

  [[nodiscard]] const Vector& Radiosity() const { return b_; }

 private:
  Ring ring_;
  Vector emitted_;
  Vector b_;
  Vector step_;
};

Vector RandomEmission(uint64_t seed) {
  Random random(seed);
  Vector emitted(kSize);
  for (double& e : emitted) {
    e = random.Next();
  }
  return emitted;
}

// Chebyshev's polynomial outside and inside of [-1, 1].
double Chebyshev(int degree, double x) {
  const double a = std::abs(x);
  return a <= 1 ? std::cos(degree * std::acos(a))
                : std::cosh(degree * std::acosh(a));
}

// The largest absolute value on [-radius, radius] of the residual polynomial
// after `steps` steps that were told the radius `told`.
double ResidualBound(int steps, double told, double radius) {
  const double most = radius <= told ? 1 : Chebyshev(steps, radius / told);
  return most / Chebyshev(steps, 1 / told);
}

TEST(SemiIteration, ConvergesToTheSolution) {
  const Ring ring{0.95};
  const Vector emitted = RandomEmission(1);
  Iterated run(ring, emitted);
  SemiIteration iteration(ring.radius);
  for (int i = 0; i < 100; ++i) {
    run.Step(&iteration);
  }
  // The residual r leaves an error of at most |r| / (1 - radius).
  const double bound = ResidualBound(100, 0.95, 0.95) * Norm(run.Unsent());
  EXPECT_LT(bound, 1e-10);
  const Vector again = ring.Times(run.Radiosity());
  for (size_t i = 0; i < kSize; ++i) {
    EXPECT_NEAR(run.Radiosity()[i], emitted[i] + again[i], 1e-10);
  }
  // T multiplies the mean by the radius, so the mean of B is that of E / (1 -
  // radius).
  double mean = 0;
  double sent = 0;
  for (size_t i = 0; i < kSize; ++i) {
    mean += run.Radiosity()[i];
    sent += emitted[i];
  }
  EXPECT_NEAR(mean, sent / (1 - 0.95), 1e-9);
}

TEST(SemiIteration, UnsentStaysBelowItsResidualPolynomialWhateverItIsTold) {
  const double radius = 0.95;
  for (const double told : {0.05, 0.3, 0.6, 0.9, 0.95, 0.99}) {
    Iterated run({radius}, RandomEmission(2));
    const double first = Norm(run.Unsent());
    SemiIteration iteration(told);
    for (int steps = 1; steps <= 60; ++steps) {
      run.Step(&iteration);
      // The bound is below 1 and falls; a radius that is told too small only
      // slows the iteration.
      const double bound = ResidualBound(steps, told, radius);
      ASSERT_LT(bound, 1);
      EXPECT_LE(Norm(run.Unsent()), first * bound * (1 + 1e-9) + 1e-12)
          << told << " after " << steps;
    }
  }
}

// Plain steps until this share of the unsent light is left.
int PlainSteps(Ring ring, double share) {
  Iterated run(ring, RandomEmission(3));
  const double goal = share * Norm(run.Unsent());
  int steps = 0;
  for (; Norm(run.Unsent()) > goal; ++steps) {
    run.Step(1, run.Unsent());
  }
  return steps;
}

// The same for the semi-iteration in cycles, each of which begins with the
// radius that the one before learnt.
int LearningSteps(Ring ring, double share, double told, int cycle) {
  Iterated run(ring, RandomEmission(3));
  const double goal = share * Norm(run.Unsent());
  int steps = 0;
  while (true) {
    SemiIteration iteration(told);
    run.Begin();
    for (int i = 0; i < cycle; ++i, ++steps) {
      if (Norm(run.Unsent()) <= goal) {
        return steps;
      }
      run.Step(&iteration);
    }
    told = iteration.LearntRadius();
  }
}

TEST(SemiIteration, NeedsAThirdOfThePlainStepsAtRadius95) {
  const Ring ring{0.95};
  const int plain = PlainSteps(ring, 1e-6);
  // The plain iteration loses 5 % a step; the asymptotic rate of the
  // semi-iteration is 0.95 / (1 + sqrt(1 - 0.95^2)) = 0.724, 6 times faster in
  // one long cycle.
  EXPECT_NEAR(plain, std::log(1e-6) / std::log(0.95), 20);
  EXPECT_LT(LearningSteps(ring, 1e-6, 0.95, 1000), plain / 5);
  EXPECT_LT(LearningSteps(ring, 1e-6, 0.95, 8), plain / 3);
}

TEST(SemiIteration, IsNotSlowerThanPlainWhenToldTooLittle) {
  for (const double radius : {0.3, 0.6, 0.8, 0.95}) {
    const int plain = PlainSteps({radius}, 1e-6);
    EXPECT_LE(LearningSteps({radius}, 1e-6, 0.3, 8), plain) << radius;
  }
}

TEST(SemiIteration, LearntRadiusApproachesTheTrueOne) {
  for (const double radius : {0.8, 0.95}) {
    Iterated run({radius}, RandomEmission(4));
    double told = 0.5;
    for (int cycle = 0; cycle < 8; ++cycle) {
      SemiIteration iteration(told);
      run.Begin();
      for (int i = 0; i < 8; ++i) {
        run.Step(&iteration);
      }
      const double learnt = iteration.LearntRadius();
      EXPECT_GE(learnt, told);
      EXPECT_LE(learnt, radius + 0.02) << radius;
      told = learnt;
    }
    EXPECT_NEAR(told, radius, 0.02);
  }
}

TEST(SemiIteration, NeverLearnsLessThanItWasToldNorARadiusOfOne) {
  for (const double told : {0.1, 0.5, 0.9, 0.985}) {
    Iterated run({0.9}, RandomEmission(5));
    SemiIteration iteration(told);
    for (int i = 0; i < 12; ++i) {
      run.Step(&iteration);
      EXPECT_GE(iteration.LearntRadius(), told);
      EXPECT_LT(iteration.LearntRadius(), 1);
    }
  }
}

}  // namespace
}  // namespace enfilade
