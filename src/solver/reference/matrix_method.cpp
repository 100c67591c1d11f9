#include "solver/reference/matrix_method.h"

#include "base/parallel.h"
#include "base/stop.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace enfilade {
namespace {

using Index = Eigen::Index;

// Rows that are made in parallel between two checks for a stop request.
constexpr size_t kRowGroup = 64;
// Bytes for a facing pair: two entries of the matrix, and one or two entries of
// the rows that it is made from (of its upper half if it is symmetric).
constexpr uint64_t kBytesPerPair = 2 * 8 + 8;
constexpr uint64_t kBytesPerUnsymmetricPair = 2 * 8 + 2 * 8;
// The scaling of row sums ends when all sums are within kHeld of their target,
// or after kMostHoldPasses; a pass scales by at most kMostScale.
constexpr int kMostHoldPasses = 200;
constexpr double kHeld = 1e-6;
constexpr double kMostScale = 2;

struct Entry {
  uint32_t column = 0;
  float value = 0;
};

uint64_t CountFacingPairs(const std::vector<Panel>& panels) {
  std::vector<uint64_t> counts(panels.size());
  ParallelFor(panels.size(), [&](size_t i) {
    ThrowIfStopRequested();
    for (size_t j = i + 1; j < panels.size(); ++j) {
      counts[i] += ReferenceScene::Face(panels[i], panels[j]) ? 1U : 0U;
    }
  });
  uint64_t sum = 0;
  for (const uint64_t count : counts) {
    sum += count;
  }
  return sum;
}

// The entries of row i from column `first` on; none on the diagonal.
std::vector<Entry> MakeRow(const FormFactors& form_factors,
                           const std::vector<Panel>& panels,
                           size_t i,
                           size_t first) {
  std::vector<Entry> row;
  for (size_t j = first; j < panels.size(); ++j) {
    const float value =
        j == i ? 0 : form_factors.Exchange(panels[i], panels[j]);
    if (value > 0) {
      row.push_back({static_cast<uint32_t>(j), value});
    }
  }
  row.shrink_to_fit();
  return row;
}

// All rows, or the upper half of a symmetric matrix.
std::vector<std::vector<Entry>> MakeRows(const FormFactors& form_factors,
                                         const std::vector<Panel>& panels,
                                         const RunControl& control) {
  const bool upper = form_factors.Options().AreSymmetric();
  std::vector<std::vector<Entry>> rows(panels.size());
  for (size_t begin = 0; begin < panels.size(); begin += kRowGroup) {
    const double left =
        1 - static_cast<double>(begin) / static_cast<double>(panels.size());
    control.Check(upper ? 1 - left * left : 1 - left, "form factors");
    const size_t count = std::min(kRowGroup, panels.size() - begin);
    ParallelFor(count, [&](size_t k) {
      const size_t i = begin + k;
      rows[i] = MakeRow(form_factors, panels, i, upper ? i + 1 : 0);
    });
  }
  return rows;
}

std::vector<std::vector<Entry>> TraceRows(const ReferenceScene& scene,
                                          FormFactors& form_factors,
                                          const std::vector<Panel>& panels,
                                          const RunControl& control) {
  PanelIndex index(scene);
  for (size_t i = 0; i < panels.size(); ++i) {
    index.Add(panels[i], i);
  }
  std::vector<std::vector<Entry>> rows(panels.size());
  for (size_t i = 0; i < panels.size(); ++i) {
    control.Check(static_cast<double>(i) / static_cast<double>(panels.size()),
                  "form factors");
    const std::vector<float> row = form_factors.TraceRow(panels[i], index);
    for (size_t j = 0; j < row.size(); ++j) {
      if (row[j] > 0) {
        rows[i].push_back({static_cast<uint32_t>(j), row[j]});
      }
    }
    rows[i].shrink_to_fit();
  }
  return rows;
}

// Inserts the rows from the top down, so that every row, mirrored entries
// included, is filled from left to right.
ExchangeMatrix MatrixOf(const std::vector<std::vector<Entry>>& rows,
                        bool mirror) {
  Eigen::VectorXi counts =
      Eigen::VectorXi::Zero(static_cast<Index>(rows.size()));
  for (size_t i = 0; i < rows.size(); ++i) {
    counts[static_cast<Index>(i)] += static_cast<int>(rows[i].size());
    for (const Entry& entry : rows[i]) {
      counts[entry.column] += mirror ? 1 : 0;
    }
  }
  ExchangeMatrix exchange(counts.size(), counts.size());
  exchange.reserve(counts);
  for (size_t i = 0; i < rows.size(); ++i) {
    for (const Entry& entry : rows[i]) {
      exchange.insert(static_cast<Index>(i), entry.column) = entry.value;
      if (mirror) {
        exchange.insert(entry.column, static_cast<Index>(i)) = entry.value;
      }
    }
  }
  exchange.makeCompressed();
  return exchange;
}

Eigen::VectorXd RowSums(const ExchangeMatrix& exchange) {
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(exchange.cols());
  Eigen::VectorXd sums(exchange.rows());
  for (Index i = 0; i < exchange.rows(); ++i) {
    sums[i] = RowTimes(exchange, i, ones);
  }
  return sums;
}

}  // namespace

ExchangeMatrix MakeExchangeMatrix(const ReferenceScene& scene,
                                  FormFactors& form_factors,
                                  const std::vector<Panel>& panels,
                                  const RunControl& control,
                                  MemoryBudget& budget) {
  const FormFactorOptions& options = form_factors.Options();
  const bool symmetric = options.AreSymmetric();
  const MemoryCharge making(
      budget,
      CountFacingPairs(panels) *
          (symmetric ? kBytesPerPair : kBytesPerUnsymmetricPair),
      fmt::format("the matrix of {} panels, making it", panels.size()));
  const auto rows = options.AreTraced()
                        ? TraceRows(scene, form_factors, panels, control)
                        : MakeRows(form_factors, panels, control);
  return MatrixOf(rows, symmetric);
}

void HoldRowSums(const ReferenceScene& scene,
                 const std::vector<Panel>& panels,
                 bool symmetric,
                 ExchangeMatrix* exchange) {
  std::vector<uint8_t> enclosed(panels.size());
  ParallelFor(panels.size(), [&](size_t i) {
    enclosed[i] = static_cast<uint8_t>(scene.IsEnclosed(panels[i]));
  });
  double worst = 1;
  for (int pass = 0; pass < kMostHoldPasses && worst > kHeld; ++pass) {
    ThrowIfStopRequested();
    worst = 0;
    const Eigen::VectorXd sums = RowSums(*exchange);
    Eigen::VectorXd scale = Eigen::VectorXd::Ones(sums.size());
    for (Index i = 0; i < sums.size(); ++i) {
      const auto k = static_cast<size_t>(i);
      const double share = sums[i] / static_cast<double>(panels[k].end.area);
      if (share > 1 || (enclosed[k] != 0 && share > 0)) {
        worst = std::max(worst, std::abs(share - 1));
        scale[i] = std::clamp(symmetric ? std::sqrt(1 / share) : 1 / share,
                              1 / kMostScale,
                              kMostScale);
      }
    }
    for (Index i = 0; i < exchange->rows(); ++i) {
      for (ExchangeMatrix::InnerIterator it(*exchange, i); it; ++it) {
        it.valueRef() *= static_cast<float>(
            symmetric ? scale[i] * scale[it.col()] : scale[i]);
      }
    }
  }
}

PanelSolution SolveByMatrix(const ReferenceScene& scene,
                            FormFactors& form_factors,
                            std::vector<Panel> panels,
                            const LinearOptions& options,
                            const RunControl& control,
                            MemoryBudget& budget) {
  ExchangeMatrix exchange =
      MakeExchangeMatrix(scene, form_factors, panels, control, budget);
  const MemoryCharge charge(
      budget, static_cast<uint64_t>(exchange.nonZeros()) * 8, "the matrix");
  HoldRowSums(scene, panels, form_factors.Options().AreSymmetric(), &exchange);
  const auto n = static_cast<Index>(panels.size());
  PanelSolution solution;
  solution.irradiance.resize(panels.size());
  solution.form_factors = static_cast<uint64_t>(exchange.nonZeros());
  for (size_t c = 0; c < kRgbChannels; ++c) {
    RadiositySystem system{&exchange, Eigen::VectorXd(n), Eigen::VectorXd(n)};
    Eigen::VectorXd radiosity(n);  // E, then B
    for (Index i = 0; i < n; ++i) {
      const Panel& panel = panels[static_cast<size_t>(i)];
      radiosity[i] = scene.ExitanceOf(panel)[c];
      system.scale[i] = std::sqrt(scene.ReflectanceOf(panel)[c] /
                                  static_cast<double>(panel.end.area));
    }
    for (Index i = 0; i < n; ++i) {
      system.rhs[i] = system.scale[i] * RowTimes(exchange, i, radiosity);
    }
    const LinearResult result = SolveLinear(system, options);
    radiosity += system.scale.cwiseProduct(result.z);
    for (Index i = 0; i < n; ++i) {
      const auto k = static_cast<size_t>(i);
      solution.irradiance[k][c] = RowTimes(exchange, i, radiosity) /
                                  static_cast<double>(panels[k].end.area);
    }
    solution.steps += static_cast<uint64_t>(result.iterations);
    solution.residual = std::max(solution.residual, result.residual);
    solution.complete = solution.complete && result.converged;
  }
  solution.panels = std::move(panels);
  return solution;
}

}  // namespace enfilade
