#include "tools/export_elements.h"

#include "base/check.h"

namespace enfilade {
namespace {

void CheckCorners(const LeafElement& leaf) {
  ENFILADE_CHECK(leaf.corners.size() == 3 || leaf.corners.size() == 4,
                 "{} corners",
                 leaf.corners.size());
}

}  // namespace

void ForEachElement(
    const ElementSource& source,
    const ExportProgress& progress,
    const std::function<void(CellId, const LeafElement&)>& visit) {
  for (size_t c = 0; c < source.cells; ++c) {
    source.for_each_leaf(CellId(c), [&](const LeafElement& leaf) {
      CheckCorners(leaf);
      visit(CellId(c), leaf);
    });
    if (progress) {
      progress(static_cast<double>(c + 1) / static_cast<double>(source.cells));
    }
  }
}

ElementCensus TakeCensus(const ElementSource& source,
                         const ExportProgress& progress) {
  ElementCensus census;
  ForEachElement(source, progress, [&](CellId, const LeafElement& leaf) {
    ++census.leaves;
    ++(leaf.corners.size() == 4 ? census.quads : census.triangles);
    const double weight = Length(AreaVector(leaf.corners)) /
                          static_cast<double>(leaf.corners.size());
    for (size_t i = 0; i < leaf.corners.size(); ++i) {
      census.bounds.Include(leaf.corners[i]);
      census.meter.Add(leaf.radiosity[i], weight);
    }
  });
  return census;
}

}  // namespace enfilade
