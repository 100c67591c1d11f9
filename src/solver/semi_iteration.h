// Chebyshev's semi-iteration for B = E + T B (Golub and Varga 1961). The plain
// iteration adds the unsent radiosity; the semi-iteration adds
//
//   step(k) = omega(k) unsent + (omega(k) - 1) step(k - 1)
//
// with the weights omega(k) that best damp all eigenvalues of T in [-radius,
// radius]. Rooms with white walls, where light bounces for long, converge in a
// third of the steps. The radius is learnt from how fast the unsent radiosity
// falls.

#pragma once

namespace enfilade {

class SemiIteration {
 public:
  // `radius`: an estimate of the largest eigenvalue of T, in (0, 1).
  explicit SemiIteration(double radius) : radius_(radius) {}

  // The weight of the next step.
  double NextWeight();

  // Takes the norm of the unsent radiosity that the step started from.
  void Saw(double unsent);

  // The radius as observed since the beginning. It exceeds the constructor's
  // radius if the unsent radiosity fell more slowly than that radius allows.
  [[nodiscard]] double LearntRadius() const;

 private:
  double radius_;
  double weight_ = 1;
  int steps_ = 0;
  // The norms before the second and before the last step. The first step is
  // left out: it shows how light spreads from the lamps, not how it fades.
  double early_ = 0;
  double last_ = 0;
};

}  // namespace enfilade
