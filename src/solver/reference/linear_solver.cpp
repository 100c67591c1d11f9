#include "solver/reference/linear_solver.h"

#include "base/parallel.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

double RelativeResidual(const RadiositySystem& system,
                        const Eigen::VectorXd& z) {
  const double rhs = system.rhs.norm();
  return rhs > 0 ? (system.rhs - system.Apply(z)).norm() / rhs : 0;
}

// Every sweep updates each unknown in turn from the newest values of the
// others. omega = 1 is Gauss-Seidel, above 1 is successive overrelaxation.
LinearResult Relax(const RadiositySystem& system,
                   double omega,
                   const LinearOptions& options) {
  LinearResult result;
  result.z = Eigen::VectorXd::Zero(system.rhs.size());
  result.residual = 1;
  Eigen::VectorXd scaled = result.z;  // S z
  while (result.residual > options.tolerance &&
         result.iterations < options.most_iterations) {
    options.check_stop();
    for (Eigen::Index i = 0; i < system.rhs.size(); ++i) {
      const double gathered = RowTimes(*system.exchange, i, scaled);
      const double newest = system.rhs[i] + system.scale[i] * gathered;
      result.z[i] += omega * (newest - result.z[i]);
      scaled[i] = system.scale[i] * result.z[i];
    }
    result.residual = RelativeResidual(system, result.z);
    ++result.iterations;
  }
  return result;
}

// Hestenes and Stiefel 1952.
LinearResult ConjugateGradients(const RadiositySystem& system,
                                const LinearOptions& options) {
  LinearResult result;
  result.z = Eigen::VectorXd::Zero(system.rhs.size());
  Eigen::VectorXd residual = system.rhs;
  Eigen::VectorXd direction = residual;
  double square = residual.squaredNorm();
  const double target = options.tolerance * system.rhs.norm();
  while (std::sqrt(square) > target &&
         result.iterations < options.most_iterations) {
    options.check_stop();
    const Eigen::VectorXd image = system.Apply(direction);
    const double step = square / direction.dot(image);
    result.z += step * direction;
    residual -= step * image;
    const double next = residual.squaredNorm();
    direction = residual + (next / square) * direction;
    square = next;
    ++result.iterations;
  }
  result.residual = RelativeResidual(system, result.z);
  return result;
}

}  // namespace

double RowTimes(const ExchangeMatrix& exchange,
                Eigen::Index row,
                const Eigen::VectorXd& x) {
  double sum = 0;
  for (ExchangeMatrix::InnerIterator it(exchange, row); it; ++it) {
    sum += static_cast<double>(it.value()) * x[it.col()];
  }
  return sum;
}

Eigen::VectorXd RadiositySystem::Apply(const Eigen::VectorXd& z) const {
  const Eigen::VectorXd scaled = scale.cwiseProduct(z);
  Eigen::VectorXd result(z.size());
  ParallelFor(static_cast<size_t>(z.size()), [&](size_t row) {
    const auto i = static_cast<Eigen::Index>(row);
    result[i] = z[i] - scale[i] * RowTimes(*exchange, i, scaled);
  });
  return result;
}

LinearResult SolveLinear(const RadiositySystem& system,
                         const LinearOptions& options) {
  LinearResult result;
  if (options.solver == "cg") {
    result = ConjugateGradients(system, options);
  } else {
    result = Relax(system,
                   options.solver == "sor" ? options.overrelaxation : 1.0,
                   options);
  }
  // The true residual of conjugate gradients may end a little above the
  // residual that they update from step to step.
  result.converged = result.residual <= 2 * options.tolerance;
  return result;
}

}  // namespace enfilade
