#include "solver/reference/hierarchical_method.h"

#include "base/parallel.h"
#include "base/random.h"
#include "base/stop.h"
#include "solver/elements/push_pull.h"
#include "solver/elements/received_light.h"
#include "solver/reference/hierarchical_oracle.h"
#include "solver/reference/hierarchical_transfer.h"
#include "solver/reference/hierarchical_visibility.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace enfilade {
namespace {

// Epsilon is multiplied by this where a link is partly visible (vis_epsilon).
constexpr float kPartialShare = 0.15F;
// Elements are not split below this share of the scene's longest edge.
constexpr float kLeastEdgeShare = 1.0F / 512;
// The passes end when one changes no more than this share of what the first
// pass changed.
constexpr double kChangeRatio = 1e-4;
constexpr uint64_t kMostPasses = 300;

struct HierarchicalLink {
  ElementPath receiver_path = kRootPath;
  ElementPath source_path = kRootPath;
  uint32_t source_patch = 0;  // of all cells
  ElementId receiver;
  ElementId source;
  bool made = false;  // the members below are known
  bool dropped = false;
  bool abut = false;       // may abut; else children do not, either
  bool inherited = false;  // the share holds for all links below
  SeenShare share;
  std::vector<float> kernel;  // [receiver node][source node]
};

enum class Verdict : uint8_t { kKeep, kSplitReceiver, kSplitSource };

class Hierarchy {
 public:
  Hierarchy(const ReferenceScene& scene,
            const Basis& basis,
            const HierarchicalOptions& options,
            const RunControl& control,
            MemoryBudget& budget);

  HierarchicalSolution Run();

 private:
  void LinkPatches();
  void Gather();
  void AddLight(const HierarchicalLink& link, std::span<float> gathered) const;
  double PushAndPull();
  bool Refine();
  [[nodiscard]] Verdict Judge(uint32_t receiver,
                              const HierarchicalLink& link) const;
  bool SplitLinks(uint32_t receiver, const std::vector<Verdict>& verdicts);
  void AppendChildren(uint32_t receiver,
                      const HierarchicalLink& parent,
                      Verdict verdict);
  void MakeLinks();
  void MakeLink(uint32_t receiver, HierarchicalLink* link) const;
  void ChargeFor(size_t links);
  [[nodiscard]] bool MayExchange(uint32_t receiver, uint32_t source) const;
  [[nodiscard]] bool IsSmallest(const Panel& panel) const;
  [[nodiscard]] HierarchicalOracle::Light LightOf() const;
  [[nodiscard]] size_t LinkCount() const;
  [[nodiscard]] double ReflectedPower() const;
  ElementId ElementAt(uint32_t patch, ElementPath path);

  [[nodiscard]] const CellTree& TreeOf(uint32_t patch) const {
    return solution_.trees[cell_of_[patch]];
  }

  const ReferenceScene& scene_;
  const Basis& basis_;
  const HierarchicalOptions& options_;
  const RunControl& control_;
  HierarchicalTransfer transfer_;
  HierarchicalVisibility visibility_;
  HierarchicalOracle oracle_;
  GrowingCharge charge_;
  float least_edge_;                                  // m
  std::vector<size_t> cell_of_;                       // by patch
  std::vector<std::vector<HierarchicalLink>> links_;  // by receiving patch
  HierarchicalSolution solution_;
};

// ------------------------------------------------------------- the main loop

HierarchicalSolution Hierarchy::Run() {
  LinkPatches();
  double first_change = 0;
  double change = 0;
  bool refined = true;
  while (refined || change > kChangeRatio * first_change) {
    if (solution_.passes == kMostPasses) {
      solution_.complete = false;
      break;
    }
    const auto passes = static_cast<double>(solution_.passes);
    control_.Check(1 - 1 / (1 + 0.1 * passes), "refining links");
    Gather();
    change = PushAndPull();
    first_change = solution_.passes == 0 ? change : first_change;
    refined = Refine();
    ++solution_.passes;
  }
  solution_.links = LinkCount();
  solution_.residual = change / std::max(ReflectedPower(), 1e-30);
  return std::move(solution_);
}

void Hierarchy::Gather() {
  solution_.gathered.clear();
  for (const CellTree& tree : solution_.trees) {
    CoefficientArray& gathered =
        solution_.gathered.emplace_back(tree.Shape().Stride());
    gathered.GrowTo(tree.Size());
  }
  ParallelFor(links_.size(), [&](size_t patch) {
    CoefficientArray& gathered = solution_.gathered[cell_of_[patch]];
    for (const HierarchicalLink& link : links_[patch]) {
      AddLight(link, gathered[link.receiver]);
    }
  });
}

// Returns the change of the radiosity, W.
double Hierarchy::PushAndPull() {
  double change = 0;
  for (size_t c = 0; c < solution_.trees.size(); ++c) {
    CellTree& tree = solution_.trees[c];
    CoefficientArray radiosity = PushPull(
        {tree, scene_.PatchesOf(c), scene_.Surfaces(), &solution_.gathered[c]});
    CoefficientArray gained = radiosity;
    gained.Subtract(tree.Sent());
    change += SumOverLeaves(tree, scene_.PatchesOf(c), gained).absolute;
    tree.Sent() = std::move(radiosity);
    tree.UpdateDetail();
  }
  return change;
}

// Splits every link at most once. Returns false if no link was split.
bool Hierarchy::Refine() {
  std::vector<std::vector<Verdict>> verdicts(links_.size());
  ParallelFor(links_.size(), [&](size_t patch) {
    for (const HierarchicalLink& link : links_[patch]) {
      verdicts[patch].push_back(Judge(static_cast<uint32_t>(patch), link));
    }
  });
  size_t after = 0;
  for (const std::vector<Verdict>& of_patch : verdicts) {
    for (const Verdict verdict : of_patch) {
      after += verdict == Verdict::kKeep ? 1 : kChildren;
    }
  }
  ChargeFor(after);
  bool any = false;
  for (size_t patch = 0; patch < links_.size(); ++patch) {
    any |= SplitLinks(static_cast<uint32_t>(patch), verdicts[patch]);
  }
  ChargeFor(after);  // with the elements that splitting has made
  MakeLinks();
  return any;
}

// ------------------------------------------------------------ its few verbs

Hierarchy::Hierarchy(const ReferenceScene& scene,
                     const Basis& basis,
                     const HierarchicalOptions& options,
                     const RunControl& control,
                     MemoryBudget& budget)
    : scene_(scene),
      basis_(basis),
      options_(options),
      control_(control),
      transfer_(basis, options.singular),
      visibility_(scene, options.visibility),
      oracle_(options.oracle, basis, LightOf()),
      charge_(budget,
              "the elements and links of --method hierarchical (a larger "
              "--epsilon makes fewer)"),
      least_edge_(static_cast<float>(scene.LongestEdge()) * kLeastEdgeShare) {
  for (size_t c = 0; c < scene.CellCount(); ++c) {
    const auto patches = scene.PatchesOf(c);
    cell_of_.insert(cell_of_.end(), patches.size(), c);
    CellTree tree({&basis, kRgbChannels}, patches);
    tree.Sent() = PushPull({tree, patches, scene.Surfaces()});
    solution_.trees.push_back(std::move(tree));
  }
  links_.resize(cell_of_.size());
}

// H_g += sum over q of K_gq V_gq B_q, for each channel.
void Hierarchy::AddLight(const HierarchicalLink& link,
                         std::span<float> gathered) const {
  const auto radiosity = TreeOf(link.source_patch).Sent()[link.source];
  const size_t stride = basis_.parallelogram.NodeCount();
  const size_t columns =
      basis_.On(scene_.ShapeOf(link.source_patch)).NodeCount();
  for (size_t k = 0; k < link.kernel.size(); ++k) {
    const size_t g = k / columns;
    const size_t q = k % columns;
    for (size_t c = 0; c < kRgbChannels; ++c) {
      gathered[c * stride + g] += link.kernel[k] * radiosity[c * stride + q];
    }
  }
}

// Links all patches that send light to all patches that reflect light.
void Hierarchy::LinkPatches() {
  const auto count = static_cast<uint32_t>(links_.size());
  std::vector<size_t> pairs(count);
  ParallelFor(count, [&](size_t i) {
    ThrowIfStopRequested();
    for (uint32_t j = 0; j < count; ++j) {
      pairs[i] += MayExchange(static_cast<uint32_t>(i), j) ? 1U : 0U;
    }
  });
  size_t sum = 0;
  for (const size_t n : pairs) {
    sum += n;
  }
  ChargeFor(sum);
  ParallelFor(count, [&](size_t i) {
    links_[i].reserve(pairs[i]);
    for (uint32_t j = 0; j < count; ++j) {
      if (MayExchange(static_cast<uint32_t>(i), j)) {
        HierarchicalLink& link = links_[i].emplace_back();
        link.source_patch = j;
        link.receiver = ElementId(i - scene_.CellBegin(cell_of_[i]));
        link.source = ElementId(j - scene_.CellBegin(cell_of_[j]));
        link.abut = true;
      }
    }
  });
  MakeLinks();
}

bool Hierarchy::MayExchange(uint32_t receiver, uint32_t source) const {
  const Panel i = scene_.PanelAt(receiver, 0, kRootPath);
  const Panel j = scene_.PanelAt(source, 0, kRootPath);
  return receiver != source && i.end.patch->reflects &&
         (j.end.patch->emits || j.end.patch->reflects) &&
         ReferenceScene::Face(i, j);
}

Verdict Hierarchy::Judge(uint32_t receiver,
                         const HierarchicalLink& link) const {
  const Panel r = scene_.PanelAt(receiver, 0, link.receiver_path);
  const Panel s = scene_.PanelAt(link.source_patch, 0, link.source_path);
  const bool receiver_is_least = IsSmallest(r);
  const bool source_is_least = IsSmallest(s);
  if (receiver_is_least && source_is_least) {
    return Verdict::kKeep;
  }
  const Coupling ends = transfer_.Couple(r.end, s.end, false);
  const CellTree& tree = TreeOf(link.source_patch);
  const LinkError error = oracle_.Error({ends.receiver,
                                         ends.source,
                                         tree.Sent()[link.source],
                                         tree.Detail(link.source)});
  const auto limit = static_cast<float>(options_.epsilon) *
                     (link.share.IsPartial() ? kPartialShare : 1.0F);
  if (error.error <= limit) {
    return Verdict::kKeep;
  }
  const bool split_source =
      receiver_is_least || (error.source_is_worse && !source_is_least);
  return split_source ? Verdict::kSplitSource : Verdict::kSplitReceiver;
}

bool Hierarchy::SplitLinks(uint32_t receiver,
                           const std::vector<Verdict>& verdicts) {
  std::vector<HierarchicalLink> old = std::move(links_[receiver]);
  links_[receiver].clear();
  bool any = false;
  for (size_t i = 0; i < old.size(); ++i) {
    if (verdicts[i] == Verdict::kKeep) {
      links_[receiver].push_back(std::move(old[i]));
    } else {
      AppendChildren(receiver, old[i], verdicts[i]);
      any = true;
    }
  }
  return any;
}

void Hierarchy::AppendChildren(uint32_t receiver,
                               const HierarchicalLink& parent,
                               Verdict verdict) {
  for (size_t c = 0; c < kChildren; ++c) {
    HierarchicalLink child;
    child.receiver_path = parent.receiver_path;
    child.source_path = parent.source_path;
    ElementPath& path = verdict == Verdict::kSplitSource ? child.source_path
                                                         : child.receiver_path;
    path = ChildPath(path, c);
    child.source_patch = parent.source_patch;
    child.receiver = ElementAt(receiver, child.receiver_path);
    child.source = ElementAt(parent.source_patch, child.source_path);
    child.abut = parent.abut;
    child.inherited = parent.inherited;
    child.share = parent.share;
    if (ReferenceScene::Face(
            scene_.PanelAt(receiver, 0, child.receiver_path),
            scene_.PanelAt(child.source_patch, 0, child.source_path))) {
      links_[receiver].push_back(std::move(child));
    }
  }
}

// Makes all links that are not made yet.
void Hierarchy::MakeLinks() {
  ParallelFor(links_.size(), [&](size_t patch) {
    auto& links = links_[patch];
    for (HierarchicalLink& link : links) {
      ThrowIfStopRequested();
      if (!link.made) {
        MakeLink(static_cast<uint32_t>(patch), &link);
      }
    }
    links.erase(std::remove_if(
                    links.begin(),
                    links.end(),
                    [](const HierarchicalLink& link) { return link.dropped; }),
                links.end());
  });
}

void Hierarchy::MakeLink(uint32_t receiver, HierarchicalLink* link) const {
  const Panel r = scene_.PanelAt(receiver, 0, link->receiver_path);
  const Panel s = scene_.PanelAt(link->source_patch, 0, link->source_path);
  link->made = true;
  link->abut =
      link->abut && transfer_.AsksForEdges() && AbutAlongEdge(r.end, s.end);
  if (!link->inherited) {
    link->share = visibility_.Share(r, s);
    link->inherited = visibility_.IsInherited() && link->share.rays > 0 &&
                      !link->share.IsPartial();
  }
  if (link->inherited && link->share.seen == 0) {
    link->dropped = true;
    return;
  }
  const Coupling ends = transfer_.Couple(r.end, s.end, link->abut);
  NodeKernel kernel = transfer_.Unoccluded(ends);
  visibility_.Mask(
      ends, link->share, MixKey(scene_.KeyOf(r), scene_.KeyOf(s)), &kernel);
  kernel = transfer_.InBasis(ends, kernel);
  const size_t rows = basis_.On(r.end.patch->shape).NodeCount();
  const size_t columns = basis_.On(s.end.patch->shape).NodeCount();
  link->kernel.reserve(rows * columns);
  for (size_t g = 0; g < rows; ++g) {
    for (size_t q = 0; q < columns; ++q) {
      link->kernel.push_back(kernel[g * kMaxNodes + q]);
    }
  }
}

// ---------------------------------------------------------------- what it asks

void Hierarchy::ChargeFor(size_t links) {
  constexpr uint64_t kAllocationBytes = 32;  // and a verdict in a vector
  const size_t nodes = basis_.parallelogram.NodeCount();
  uint64_t bytes = links * (2 * sizeof(HierarchicalLink) + kAllocationBytes +
                            nodes * nodes * sizeof(float));
  for (const CellTree& tree : solution_.trees) {
    bytes += CellTree::BytesFor(tree.Size(), tree.Shape()) +
             ReceivedLight::BytesFor(tree.Size(), tree.Shape());
  }
  charge_.GrowTo(bytes);
}

bool Hierarchy::IsSmallest(const Panel& panel) const {
  const PatchGeometry& p = *panel.end.patch;
  const float edge =
      std::max(Length(p.u), Length(p.v)) * std::abs(panel.end.frame.scale);
  return edge / 2 < least_edge_ || IsDeepest(panel.path);
}

HierarchicalOracle::Light Hierarchy::LightOf() const {
  HierarchicalOracle::Light light;
  for (size_t c = 0; c < scene_.CellCount(); ++c) {
    const auto patches = scene_.PatchesOf(c);
    light.emitted_power += EmittedFlux(patches, scene_.Surfaces());
    for (const PatchGeometry& p : patches) {
      light.area += static_cast<double>(p.area);
    }
  }
  light.emitted_power = std::max(light.emitted_power, 1e-30);
  return light;
}

size_t Hierarchy::LinkCount() const {
  size_t count = 0;
  for (const auto& links : links_) {
    for (const HierarchicalLink& link : links) {
      count += std::any_of(link.kernel.begin(),
                           link.kernel.end(),
                           [](float k) { return k != 0; })
                   ? 1U
                   : 0U;
    }
  }
  return count;
}

double Hierarchy::ReflectedPower() const {
  double power = 0;
  for (size_t c = 0; c < solution_.trees.size(); ++c) {
    const CellTree& tree = solution_.trees[c];
    power += SumOverLeaves(tree, scene_.PatchesOf(c), tree.Sent()).value -
             EmittedFlux(scene_.PatchesOf(c), scene_.Surfaces());
  }
  return power;
}

ElementId Hierarchy::ElementAt(uint32_t patch, ElementPath path) {
  const size_t cell = cell_of_[patch];
  return solution_.trees[cell].FindOrCreate(
      PatchId(patch - scene_.CellBegin(cell)), path, scene_.PatchesOf(cell));
}

}  // namespace

HierarchicalSolution SolveByHierarchy(const ReferenceScene& scene,
                                      const Basis& basis,
                                      const HierarchicalOptions& options,
                                      const RunControl& control,
                                      MemoryBudget& budget) {
  return Hierarchy(scene, basis, options, control, budget).Run();
}

}  // namespace enfilade
