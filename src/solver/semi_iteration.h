// Chebyshev's semi-iteration for B = E + T B (Golub and Varga 1961): where the
// plain iteration adds the unsent radiosity, it adds
//
//   step(k) = omega(k) unsent + (omega(k) - 1) step(k - 1)
//
// with weights that damp all eigenvalues of T in [-radius, radius] best. Rooms
// of white walls, where light bounces for long, converge in a third of the
// steps. The radius is learnt from how fast the unsent radiosity falls.

#pragma once

namespace enfilade {

class SemiIteration {
 public:
  // `radius`: the largest eigenvalue of T as far as it is known, in (0, 1).
  explicit SemiIteration(double radius) : radius_(radius) {}

  // The weight of the next step.
  double NextWeight();

  // The norm of what that step started from.
  void Saw(double unsent);

  // The radius by what was seen since the beginning: larger than it was told if
  // the unsent radiosity fell more slowly than that allows.
  [[nodiscard]] double LearntRadius() const;

 private:
  double radius_;
  double weight_ = 1;
  int steps_ = 0;
  // The norms before the second and before the last step: the first steps show
  // how light spreads from the lamps and not how it fades.
  double early_ = 0;
  double last_ = 0;
};

}  // namespace enfilade
