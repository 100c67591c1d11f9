// Solvers of the radiosity system, after Willmott and Heckbert 1997, section
// 2.1: Gauss-Seidel, successive overrelaxation, conjugate gradients.
//
//   paper        here
//   B = E + rho F B, with B - E = S z, S = diag sqrt(rho / A), becomes
//   (I - S G S) z = S G E,  G = A F     symmetric, positive definite where the
//                                       rows of F sum to at most 1, rho < 1
//
// The paper ran conjugate gradients on the unsymmetric I - rho F and could not
// say why that worked; the symmetrised system is one that conjugate gradients
// are made for. Gauss-Seidel and SOR take the same steps on z as on B.

#pragma once

#include <functional>
#include <string>

#include <Eigen/Dense>
#include <Eigen/SparseCore>

namespace enfilade {

using ExchangeMatrix = Eigen::SparseMatrix<float, Eigen::RowMajor>;

struct RadiositySystem {
  const ExchangeMatrix* exchange = nullptr;  // G, n x n, m2
  Eigen::VectorXd scale;                     // diagonal of S, n
  Eigen::VectorXd rhs;                       // S G E, n

  // (I - S G S) z.
  [[nodiscard]] Eigen::VectorXd Apply(const Eigen::VectorXd& z) const;
};

struct LinearResult {
  Eigen::VectorXd z;
  int iterations = 0;
  double residual = 0;  // ||rhs - (I - S G S) z|| / ||rhs||
  bool converged = false;
};

struct LinearOptions {
  std::string solver = "cg";  // gs, sor or cg
  double tolerance = 1e-6;    // of the residual
  int most_iterations = 2000;
  double overrelaxation = 1.2;       // omega of sor, in (0, 2)
  std::function<void()> check_stop;  // called between iterations; may throw
};

LinearResult SolveLinear(const RadiositySystem& system,
                         const LinearOptions& options);

// The sum over j of G_ij x_j.
double RowTimes(const ExchangeMatrix& exchange,
                Eigen::Index row,
                const Eigen::VectorXd& x);

}  // namespace enfilade
