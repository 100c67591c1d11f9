// The links of a cell pair, refined in parallel and handed out part by part in
// a fixed order. The links of a part depend on nothing but the part. Parts may
// therefore be refined ahead of their turn, together with any others, and are
// kept until their turn comes. A run that resumes from Next() makes the same
// links.

#pragma once

#include "solver/refine/refiner.h"
#include "solver/state/work_part.h"

#include <cstddef>
#include <deque>
#include <vector>

namespace enfilade {

class RefinedParts {
 public:
  // A part that makes more links is cut, in every run at the same places.
  static constexpr size_t kMostPartLinks = 8000;
  // At most this many links wait for their turn, beside those of the part whose
  // turn it is.
  static constexpr size_t kMostLinks = 32000;

  // Begins with the part `first`. The refiner is borrowed.
  RefinedParts(const Refiner& refiner, WorkPart first);

  // Whether all links were handed out.
  [[nodiscard]] bool AtEnd() const;

  // Refines some parts, including the next one. Requires !AtEnd().
  void Refine();

  // The links of the next part; null if it must be refined first.
  [[nodiscard]] const RawLinks* Front() const;

  // Drops the links of the next part.
  void Pop() { parts_.pop_front(); }

  // The first part that was not handed out; at the end, its item is
  // ItemCount().
  [[nodiscard]] WorkPart Next() const;

 private:
  struct Part {
    WorkPart work;
    RawLinks links;
    bool is_whole = false;
  };

  [[nodiscard]] std::vector<Part*> Missing();
  void RefineTogether(const std::vector<Part*>& missing);
  void CutLargeOnes();

  const Refiner* refiner_;
  std::deque<Part> parts_;  // consecutive
  WorkPart after_;          // the part after those
};

}  // namespace enfilade
