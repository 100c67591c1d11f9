// A part of the work of a Refiner while it is done: shared by the files that
// implement it.

#pragma once

#include "solver/refiner.h"
#include "solver/transfer_sample.h"

#include <array>
#include <cstdint>
#include <optional>

namespace enfilade {

// What sixteen rays that all get through leave unknown, as a share of the
// transfer.
constexpr float kUnprovenClear = 0.03F;

// One item of work: kItemReceivers receivers and this many sources.
constexpr size_t kItemSources = 32;

// A part of an item of work.
struct Refiner::Task {
  // Whether links to a receiver on the part's way belong to it.
  [[nodiscard]] bool Takes(const Receiver& r) const {
    return part.Owns(r.level);
  }

  // Whether the part has a share in a child of a receiver on its way.
  [[nodiscard]] bool Enters(const Receiver& r, size_t child) const {
    return r.level >= part.Levels() || part.ChildAt(r.level) == child;
  }

  // Whether one of the receivers [first, first + count) is of the part.
  [[nodiscard]] bool Meets(uint32_t first, uint32_t count) const {
    const uint32_t low = first_receiver + part.FirstReceiver();
    return first < low + part.ReceiverCount() && low < first + count;
  }

  RawLinks* out = nullptr;
  WorkPart part;
  size_t most = 0;  // links
  // The ends of the item's clusters, made when first asked for.
  uint32_t first_receiver = 0;
  uint32_t first_source = 0;
  std::array<std::optional<Receiver>, kItemReceivers> receivers;
  std::array<std::optional<Source>, kItemSources> sources;
  // What blocked transfers would add to the squared error if half of all rays
  // of the item were blocked, and its rays.
  double blocked_squared = 0;
  RayCount rays;
  // Weak links wait for their rays until the packet is full.
  SegmentPacket packet{};
  std::array<PendingLink, 16> pending{};
};

}  // namespace enfilade
