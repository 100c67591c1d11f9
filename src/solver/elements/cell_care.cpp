#include "solver/elements/cell_care.h"

#include "base/bytes.h"
#include "base/error.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace enfilade {
namespace {

// The largest raise of care in one round, and the largest care.
constexpr double kMostRaise = 64;
constexpr float kMostCare = 1024;
// The squared error is proportional to this power of tau. The number of links
// takes up the rest, so that the squared error per link is proportional to the
// square of tau.
constexpr double kSquarePerTau = 2 / kTauPerError;
// The bisection for the level ends at this ratio of its bounds.
constexpr double kSameLevel = 1.01;

// The squared error that is left once tau is divided by `raise`.
double Left(const LinkErrors& errors, double raise) {
  return errors.square * std::pow(raise, -kSquarePerTau);
}

double PerLink(const LinkErrors& errors) {
  return errors.square / std::max(errors.links, 1.0);
}

BlockKey KeyOf(CellId cell) {
  return {BlockKind::kCellCare, cell.value, 0, 0};
}

}  // namespace

CellCare LoadCellCare(const BlockStorage& store, CellId cell, size_t patches) {
  auto care = ReadBlockIfAny(store, KeyOf(cell), [&](ByteReader& in) {
    CellCare read = in.GetArray<PatchCare>();
    if (read.size() != patches) {
      throw DamagedStoreError(fmt::format(
          "it is of {} patches, and the cell has {}", read.size(), patches));
    }
    return read;
  });
  return care ? std::move(*care) : CellCare(patches);
}

void SaveCellCare(std::span<const PatchCare> care,
                  CellId cell,
                  BlockStorage& store) {
  ByteWriter writer;
  writer.PutArray(care);
  store.Put(KeyOf(cell), writer.View());
}

double RaiseOfCare(const LinkErrors& errors, double level) {
  return std::clamp(std::sqrt(PerLink(errors) / level), 1.0, kMostRaise);
}

double LevelOfErrors(std::span<const LinkErrors> known,
                     const LinkErrors& rest,
                     double left) {
  double all = rest.square;
  double high = PerLink(rest);
  for (const LinkErrors& errors : known) {
    all += errors.square;
    high = std::max(high, PerLink(errors));
  }
  if (left >= 1 || !(high > 0)) {
    return std::numeric_limits<double>::infinity();
  }
  // At this low level every raise that matters is already at kMostRaise.
  double low = high * 1e-12;
  while (high > kSameLevel * low) {
    const double level = std::sqrt(low * high);
    double sum = Left(rest, RaiseOfCare(rest, level));
    for (const LinkErrors& errors : known) {
      sum += Left(errors, RaiseOfCare(errors, level));
    }
    (sum > left * all ? high : low) = level;
  }
  return low;
}

double RaiseCare(std::span<const float> square,
                 double level,
                 double by_tau,
                 CellCare* care) {
  double gone = 0;
  for (size_t i = 0; i < square.size(); ++i) {
    PatchCare& patch = (*care)[i];
    const LinkErrors errors = {static_cast<double>(square[i]),
                               static_cast<double>(patch.links)};
    const auto raise =
        static_cast<float>(std::max(RaiseOfCare(errors, level) / by_tau, 1.0));
    const float before = patch.care;
    patch.care = std::min(before * raise, kMostCare);
    gone +=
        errors.square - Left(errors, static_cast<double>(patch.care / before));
  }
  return gone;
}

}  // namespace enfilade
