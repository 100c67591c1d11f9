// The solvers of the radiosity system against each other and against a closed
// room whose answer is known.

#include "solver/reference/linear_solver.h"

#include "base/random.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// Symmetric exchange of n panels of unit area with rows that sum to `row_sum`:
// random circulants, so that all rows sum to the same.
ExchangeMatrix RandomExchange(Index n, double row_sum, uint64_t seed) {
  Random random(seed);
  std::vector<double> ring(static_cast<size_t>(n));
  double sum = 0;
  for (Index k = 1; k <= n / 2; ++k) {
    const double value = random.Next();
    ring[static_cast<size_t>(k)] = value;
    ring[static_cast<size_t>(n - k)] = value;
  }
  for (const double value : ring) {
    sum += value;
  }
  Eigen::MatrixXf dense(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      dense(i, j) = static_cast<float>(
          row_sum / sum * ring[static_cast<size_t>((i + n - j) % n)]);
    }
  }
  return dense.sparseView();
}

RadiositySystem SystemOf(const ExchangeMatrix& exchange,
                         double reflectance,
                         const VectorXd& emission) {
  RadiositySystem system{&exchange, {}, {}};
  system.scale = VectorXd::Constant(exchange.rows(), std::sqrt(reflectance));
  system.rhs = system.scale.cwiseProduct(exchange.cast<double>() * emission);
  return system;
}

LinearOptions OptionsOf(const char* solver) {
  LinearOptions options;
  options.solver = solver;
  options.tolerance = 1e-8;
  options.check_stop = [] {};
  return options;
}

// The eigenvalues of I - S G S are at least 1 - rho, so that a residual r
// leaves an error of at most |r| / (1 - rho).
TEST(LinearSolver, AllAgreeToTheirResiduals) {
  const Index n = 60;
  const ExchangeMatrix exchange = RandomExchange(n, 1, 7);
  VectorXd emission = VectorXd::Zero(n);
  emission.head(5).setConstant(3);
  const double rho = 0.9;
  const RadiositySystem system = SystemOf(exchange, rho, emission);
  const VectorXd exact = (Eigen::MatrixXd::Identity(n, n) -
                          rho * Eigen::MatrixXd(exchange.cast<double>()))
                             .lu()
                             .solve(system.rhs);
  for (const char* solver : {"gs", "sor", "cg"}) {
    const LinearResult result = SolveLinear(system, OptionsOf(solver));
    EXPECT_TRUE(result.converged) << solver;
    EXPECT_LE((result.z - exact).norm(),
              2e-8 * system.rhs.norm() / (1 - rho) + 1e-12)
        << solver;
    EXPECT_NEAR(
        result.residual,
        (system.rhs - system.Apply(result.z)).norm() / system.rhs.norm(),
        1e-12)
        << solver;
  }
}

TEST(LinearSolver, ConjugateGradientsTakeFewerStepsThanGaussSeidel) {
  const ExchangeMatrix exchange = RandomExchange(60, 1, 7);
  VectorXd emission = VectorXd::Zero(60);
  emission[0] = 1;
  const RadiositySystem system = SystemOf(exchange, 0.95, emission);
  EXPECT_LT(SolveLinear(system, OptionsOf("cg")).iterations,
            SolveLinear(system, OptionsOf("gs")).iterations);
}

// B = E / (1 - rho): z = sqrt(rho) E / (1 - rho).
TEST(LinearSolver, FurnaceIsFlat) {
  const ExchangeMatrix exchange = RandomExchange(40, 1, 3);
  const RadiositySystem system = SystemOf(exchange, 0.5, VectorXd::Ones(40));
  for (const char* solver : {"gs", "sor", "cg"}) {
    const LinearResult result = SolveLinear(system, OptionsOf(solver));
    for (Index i = 0; i < 40; ++i) {
      EXPECT_NEAR(result.z[i], 2 * std::sqrt(0.5), 1e-6) << solver;
    }
  }
}

TEST(LinearSolver, NoLightIsNoWork) {
  const ExchangeMatrix exchange = RandomExchange(10, 1, 3);
  const RadiositySystem system = SystemOf(exchange, 0.5, VectorXd::Zero(10));
  for (const char* solver : {"gs", "sor", "cg"}) {
    const LinearResult result = SolveLinear(system, OptionsOf(solver));
    EXPECT_EQ(result.z.norm(), 0) << solver;
    EXPECT_TRUE(result.converged) << solver;
  }
}

TEST(LinearSolver, TooFewIterationsAreNotConverged) {
  const ExchangeMatrix exchange = RandomExchange(40, 1, 3);
  VectorXd emission = VectorXd::Zero(40);
  emission[0] = 1;
  const RadiositySystem system = SystemOf(exchange, 0.9, emission);
  for (const char* solver : {"gs", "sor", "cg"}) {
    LinearOptions options = OptionsOf(solver);
    options.most_iterations = 2;
    EXPECT_FALSE(SolveLinear(system, options).converged) << solver;
  }
}

}  // namespace
}  // namespace enfilade
