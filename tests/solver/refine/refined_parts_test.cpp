// Links are handed out in the order of their parts, whichever parts are refined
// together and however the trees have grown.

#include "solver/refine/refined_parts.h"

#include "base/parallel.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <vector>

#include "tests/solver/test_refinement.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::BrightCell;
using test::ExpectSame;
using test::FurnishedRoom;
using test::RefinedPart;
using test::RefineInParts;
using test::Scenery;

struct HandedOut {
  std::vector<WorkPart> parts;
  std::vector<RawLink> links;
  std::vector<double> squared_errors;  // of each part
  std::vector<uint64_t> rays;          // likewise
};

void Append(const RawLinks& from, WorkPart part, HandedOut* to) {
  to->parts.push_back(part);
  to->squared_errors.push_back(from.squared_error);
  to->rays.push_back(from.rays);
  std::copy(
      from.links.begin(), from.links.end(), std::back_inserter(to->links));
}

HandedOut OneByOne(const Refiner& refiner) {
  HandedOut all;
  for (const RefinedPart& part :
       RefineInParts(refiner, RefinedParts::kMostPartLinks)) {
    Append(part.out, part.work, &all);
  }
  return all;
}

HandedOut Together(const Refiner& refiner, WorkPart first) {
  HandedOut all;
  RefinedParts parts(refiner, first);
  while (!parts.AtEnd()) {
    parts.Refine();
    EXPECT_NE(parts.Front(), nullptr);
    while (const RawLinks* links = parts.Front()) {
      Append(*links, parts.Next(), &all);
      parts.Pop();
    }
  }
  return all;
}

void ExpectEnd(const HandedOut& whole, size_t links, const HandedOut& end) {
  ASSERT_LE(end.parts.size(), whole.parts.size());
  EXPECT_TRUE(
      std::equal(end.parts.rbegin(), end.parts.rend(), whole.parts.rbegin()));
  ASSERT_EQ(end.links.size(), links);
  for (size_t i = 0; i < links; ++i) {
    ExpectSame(end.links[i], whole.links[whole.links.size() - links + i]);
  }
}

// A furnished room that is linked to itself so finely that an item must be cut
// and not all links can wait in memory.
class VeryFinelyLinkedRoom : public ::testing::Test {
 protected:
  VeryFinelyLinkedRoom() {
    // Each channel has its own gradient, so that the largest channel, pushed,
    // is not the largest of the pushed channels.
    CellTree& tree = cell_.Tree();
    for (size_t i = 0; i < tree.Size(); ++i) {
      auto sent = tree.Sent()[ElementId(i)];
      for (size_t k = 0; k < sent.size(); ++k) {
        sent[k] = 1 + 0.1F * static_cast<float>((7 * i + 5 * k) % 9);
      }
    }
    tree.UpdateDetail();
  }

  const Basis basis_{2};
  const std::vector<Patch> room_ = FurnishedRoom();
  BrightCell cell_{0, basis_, room_};
  const Scenery scenery_{room_};
  const Refiner refiner_ =
      test::MakeRefiner({.tau = 0.0004, .tau_weak = 0.0002},
                        cell_.Receiver(),
                        cell_.Source(),
                        scenery_.All());
};

TEST_F(VeryFinelyLinkedRoom, HandsOutTheLinksOfAllPartsInTheirOrder) {
  const HandedOut expected = OneByOne(refiner_);
  ASSERT_GT(expected.links.size(), 2 * RefinedParts::kMostLinks);
  ASSERT_TRUE(std::any_of(expected.parts.begin(),
                          expected.parts.end(),
                          [](const WorkPart& p) { return p.depth > 0; }));
  for (const size_t threads : {size_t{1}, size_t{2}, size_t{7}}) {
    const ThreadLimit limit(threads);
    const HandedOut seen = Together(refiner_, {});
    EXPECT_EQ(seen.parts.size(), expected.parts.size());
    EXPECT_EQ(seen.squared_errors, expected.squared_errors);
    EXPECT_EQ(seen.rays, expected.rays);
    ExpectEnd(expected, expected.links.size(), seen);
  }
}

TEST_F(VeryFinelyLinkedRoom, GoesOnAtAnyPart) {
  const HandedOut expected = OneByOne(refiner_);
  for (const size_t skipped : {size_t{1}, expected.parts.size() / 2}) {
    const HandedOut rest = Together(refiner_, expected.parts[skipped]);
    EXPECT_EQ(rest.parts.size(), expected.parts.size() - skipped);
    ExpectEnd(expected, rest.links.size(), rest);
  }
}

TEST_F(VeryFinelyLinkedRoom, LinksAreTheSameWhenTreesHaveGrown) {
  const HandedOut expected = OneByOne(refiner_);
  const size_t before = cell_.Tree().Size();
  LinkBlock block;
  RefinedParts parts(refiner_, {});
  parts.Refine();
  while (const RawLinks* links = parts.Front()) {
    cell_.Link(*links, &block);
    parts.Pop();
  }
  ASSERT_GT(cell_.Tree().Size(), before);
  ExpectEnd(expected, expected.links.size(), Together(refiner_, {}));
}

}  // namespace
}  // namespace enfilade
