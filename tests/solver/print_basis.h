// How tests print which basis they were at.

#pragma once

#include "solver/elements/basis.h"

#include <ostream>

namespace enfilade {

inline void PrintTo(const BasisKind& kind, std::ostream* out) {
  *out << (kind.flat ? "F" : "M") << kind.order;
}

}  // namespace enfilade
