// The links of a cell pair, refined in parallel and handed out part by part in
// a fixed order. What a part makes depends on nothing but the part: so parts
// may be refined ahead of their turn, together with any others, and are kept
// until it comes; and a run that goes on from Next() makes the same links.

#pragma once

#include "solver/refine/refiner.h"
#include "solver/state/work_part.h"

#include <cstddef>
#include <deque>
#include <vector>

namespace enfilade {

class RefinedParts {
 public:
  // A part that makes more links is cut, at the same places in every run.
  static constexpr size_t kMostPartLinks = 8000;
  // At most so many wait for their turn, beside those of the part whose turn it
  // is.
  static constexpr size_t kMostLinks = 32000;

  // From a part on. The refiner is borrowed.
  RefinedParts(const Refiner& refiner, WorkPart first);

  // Whether all links were handed out.
  [[nodiscard]] bool AtEnd() const;

  // Refines some parts, the next one among them. Requires that there is one.
  void Refine();

  // The links of the next part; null if it must be refined first.
  [[nodiscard]] const RawLinks* Front() const;

  // Done with them.
  void Pop() { parts_.pop_front(); }

  // The first part that was not handed out; of item ItemCount() at the end.
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
  WorkPart after_;          // what comes after them
};

}  // namespace enfilade
