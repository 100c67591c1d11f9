#include "solver/reference/shooting_method.h"

#include "base/parallel.h"
#include "solver/reference/corner_deviations.h"
#include "solver/reference/panel_index.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr uint64_t kMostShots = 2'000'000;
constexpr size_t kMostDepth = 7;  // of receivers below their first size
constexpr uint64_t kBytesPerReceiver = 256;

double MeanAbsolute(const Rgb& value) {
  return (std::abs(value[0]) + std::abs(value[1]) + std::abs(value[2])) / 3;
}

struct Source {
  Panel panel;
  Rgb reflectance{};
  Rgb unshot{};  // W/m2
  Rgb shot{};    // W/m2, in all
  // The factor that makes the form factors of the source sum to at most 1, and
  // to exactly 1 if the source is enclosed; 0 if not known yet.
  double hold = 0;
  std::vector<float> form_factors;  // F_ep times hold, by receiver
};

struct Receiver {
  Panel panel;
  uint32_t source = 0;
  uint32_t depth = 0;
  bool split = false;  // its children took its place
  Rgb irradiance{};    // W/m2
};

class Shooting {
 public:
  Shooting(const ReferenceScene& scene,
           FormFactors& form_factors,
           const ShootingOptions& options,
           const RunControl& control,
           MemoryBudget& budget);

  PanelSolution Run();

 private:
  void ShootUntilQuiet();
  [[nodiscard]] size_t BrightestSource() const;
  void Shoot(Source* source);
  void FindFormFactors(Source* source);
  [[nodiscard]] std::vector<float> FormFactorsTo(const Panel& source,
                                                 size_t first);
  const PanelIndex& IndexFrom(size_t first);
  bool SplitSteepReceivers();
  [[nodiscard]] std::vector<size_t> SteepReceivers() const;
  void AppendChildren(size_t parent);
  void GatherFrom(size_t first_child);
  [[nodiscard]] std::vector<double> Deviations() const;
  [[nodiscard]] Rgb RadiosityOf(const Receiver& receiver) const;
  [[nodiscard]] double ReflectedPower() const;
  [[nodiscard]] Rgb LightStillToCome() const;
  [[nodiscard]] double SeenError() const;
  void AddAmbient();

  const ReferenceScene& scene_;
  FormFactors& form_factors_;
  const ShootingOptions& options_;
  const RunControl& control_;
  MemoryBudget& budget_;
  std::vector<MemoryCharge> charges_;
  std::vector<Source> sources_;
  std::vector<Receiver> receivers_;
  // For traced kinds: the receivers by their places, from one on.
  std::optional<PanelIndex> index_;
  size_t index_first_ = 0;
  Rgb all_bounces_{};  // R of eq. 7
  double area_ = 0;    // of all reflecting panels, m2
  PanelSolution solution_;
};

// ------------------------------------------------------------ the main loops

PanelSolution Shooting::Run() {
  do {
    ShootUntilQuiet();
  } while (options_.gradient && SplitSteepReceivers());
  solution_.seen_error = SeenError();
  solution_.residual =
      MeanAbsolute(LightStillToCome()) / std::max(ReflectedPower(), 1e-30);
  if (options_.ambient) {
    AddAmbient();
  }
  for (Receiver& receiver : receivers_) {
    if (!receiver.split) {
      solution_.panels.push_back(receiver.panel);
      solution_.irradiance.push_back(receiver.irradiance);
    }
  }
  return std::move(solution_);
}

void Shooting::ShootUntilQuiet() {
  double to_come = MeanAbsolute(LightStillToCome());
  const double at_first = to_come;
  while (to_come > options_.still_to_come * ReflectedPower()) {
    if (solution_.steps == kMostShots) {
      solution_.complete = false;
      return;
    }
    control_.Check(1 - to_come / at_first, "shooting");
    Shoot(&sources_[BrightestSource()]);
    to_come = MeanAbsolute(LightStillToCome());
  }
}

void Shooting::Shoot(Source* source) {
  if (source->hold == 0) {
    FindFormFactors(source);
  }
  const Rgb light = source->unshot;
  source->unshot = {};
  for (size_t e = 0; e < receivers_.size(); ++e) {
    Receiver& receiver = receivers_[e];
    const auto f = static_cast<double>(source->form_factors[e]);
    if (f == 0 || receiver.split) {
      continue;
    }
    Source& parent = sources_[receiver.source];
    const double share =
        static_cast<double>(receiver.panel.end.area / parent.panel.end.area);
    for (size_t c = 0; c < light.size(); ++c) {
      receiver.irradiance[c] += f * light[c];
      parent.unshot[c] += share * parent.reflectance[c] * f * light[c];
    }
  }
  for (size_t c = 0; c < light.size(); ++c) {
    source->shot[c] += light[c];
  }
  ++solution_.steps;
}

// Splits receivers until none is steep. Returns false if none was.
bool Shooting::SplitSteepReceivers() {
  bool any = false;
  while (true) {
    const size_t old_count = receivers_.size();
    for (const size_t e : SteepReceivers()) {
      if (receivers_.size() + kChildren > options_.most_receivers) {
        solution_.complete = false;
        break;
      }
      AppendChildren(e);
    }
    if (receivers_.size() == old_count) {
      return any;
    }
    any = true;
    control_.Check(1, "splitting receivers");
    GatherFrom(old_count);
  }
}

// ------------------------------------------------------------------- details

Shooting::Shooting(const ReferenceScene& scene,
                   FormFactors& form_factors,
                   const ShootingOptions& options,
                   const RunControl& control,
                   MemoryBudget& budget)
    : scene_(scene),
      form_factors_(form_factors),
      options_(options),
      control_(control),
      budget_(budget) {
  const std::vector<Panel> panels = scene.Dice(options.source_edge);
  Rgb absorbed{};  // area-weighted absorptance
  double all_area = 0;
  for (const Panel& panel : panels) {
    Source source;
    source.panel = panel;
    source.reflectance = scene.ReflectanceOf(panel);
    source.unshot = scene.ExitanceOf(panel);
    const auto area = static_cast<double>(panel.end.area);
    for (size_t c = 0; c < absorbed.size(); ++c) {
      absorbed[c] += (1 - source.reflectance[c]) * area;
    }
    all_area += area;
    area_ += panel.end.patch->reflects ? area : 0;
    sources_.push_back(std::move(source));
  }
  for (size_t c = 0; c < absorbed.size(); ++c) {
    all_bounces_[c] = all_area / absorbed[c];
  }
  const auto receivers = scene.Dice(options.gradient ? options.source_edge / 2
                                                     : options.source_edge);
  size_t first = 0;  // first source of the patch
  for (const Panel& panel : receivers) {
    while (sources_[first].panel.patch != panel.patch) {
      ++first;
    }
    size_t s = first;
    while (!scene.Covers(sources_[s].panel, panel)) {
      ++s;
    }
    receivers_.push_back({panel, static_cast<uint32_t>(s), 0, false, {}});
  }
  charges_.emplace_back(
      budget_,
      receivers_.size() * (4 * sources_.size() + kBytesPerReceiver),
      fmt::format("the form factors of {} sources and {} receivers",
                  sources_.size(),
                  receivers_.size()));
}

// The source with the most unshot power.
size_t Shooting::BrightestSource() const {
  size_t best = 0;
  double most = -1;
  for (size_t i = 0; i < sources_.size(); ++i) {
    const double power = MeanAbsolute(sources_[i].unshot) *
                         static_cast<double>(sources_[i].panel.end.area);
    if (power > most) {
      most = power;
      best = i;
    }
  }
  return best;
}

void Shooting::FindFormFactors(Source* source) {
  source->form_factors = FormFactorsTo(source->panel, 0);
  double sent = 0;
  for (size_t e = 0; e < receivers_.size(); ++e) {
    const float f = source->form_factors[e];
    sent += static_cast<double>(f * receivers_[e].panel.end.area);
    solution_.form_factors += f > 0 ? 1U : 0U;
  }
  const double share = sent / static_cast<double>(source->panel.end.area);
  const bool enclosed = share > 0 && scene_.IsEnclosed(source->panel);
  source->hold = enclosed || share > 1 ? std::clamp(1 / share, 0.5, 2.0) : 1;
  for (float& f : source->form_factors) {
    f *= static_cast<float>(source->hold);
  }
}

// F_ep from the receivers e, from `first` on, to a source p; 0 for split
// receivers. Traced kinds trace from the source: A_e F_ep = A_p F_pe.
std::vector<float> Shooting::FormFactorsTo(const Panel& source, size_t first) {
  std::vector<float> exchanges(receivers_.size() - first);
  if (form_factors_.Options().AreTraced()) {
    exchanges = form_factors_.TraceRow(source, IndexFrom(first));
    exchanges.resize(receivers_.size() - first);
  } else {
    ParallelFor(exchanges.size(), [&](size_t k) {
      const Receiver& r = receivers_[first + k];
      exchanges[k] = r.split ? 0 : form_factors_.Exchange(r.panel, source);
    });
  }
  for (size_t k = 0; k < exchanges.size(); ++k) {
    exchanges[k] /= receivers_[first + k].panel.end.area;
  }
  return exchanges;
}

// The receivers from `first` on that are not split, by their distance from it.
const PanelIndex& Shooting::IndexFrom(size_t first) {
  if (!index_ || index_first_ != first) {
    index_.emplace(scene_);
    index_first_ = first;
    for (size_t e = first; e < receivers_.size(); ++e) {
      if (!receivers_[e].split) {
        index_->Add(receivers_[e].panel, e - first);
      }
    }
  }
  return *index_;
}

// The receivers that are to be split, the steepest first.
std::vector<size_t> Shooting::SteepReceivers() const {
  const std::vector<double> deviations = Deviations();
  const double most = *options_.gradient * ReflectedPower() / area_;
  std::vector<size_t> steep;
  for (size_t e = 0; e < receivers_.size(); ++e) {
    if (deviations[e] > most && receivers_[e].depth < kMostDepth) {
      steep.push_back(e);
    }
  }
  std::stable_sort(steep.begin(), steep.end(), [&](size_t a, size_t b) {
    return deviations[a] > deviations[b];
  });
  return steep;
}

void Shooting::AppendChildren(size_t parent) {
  index_.reset();
  receivers_[parent].split = true;
  for (size_t c = 0; c < kChildren; ++c) {
    Receiver child = receivers_[parent];
    child.split = false;
    ++child.depth;
    child.panel = scene_.PanelAt(
        child.panel.patch, child.panel.strip, ChildPath(child.panel.path, c));
    receivers_.push_back(child);
  }
}

// New receivers, which still have their parent's irradiance, gather what all
// sources have shot. The difference goes into the unshot light of the sources
// that they belong to.
void Shooting::GatherFrom(size_t first_child) {
  const size_t count = receivers_.size() - first_child;
  charges_.emplace_back(budget_,
                        count * (4 * sources_.size() + kBytesPerReceiver),
                        "the form factors of split receivers");
  std::vector<Rgb> gathered(count);
  for (Source& source : sources_) {
    if (source.hold == 0) {
      continue;
    }
    source.form_factors.resize(receivers_.size());
    const auto form_factors = FormFactorsTo(source.panel, first_child);
    for (size_t k = 0; k < count; ++k) {
      const double f = source.hold * static_cast<double>(form_factors[k]);
      source.form_factors[first_child + k] = static_cast<float>(f);
      for (size_t c = 0; c < kRgbChannels; ++c) {
        gathered[k][c] += f * source.shot[c];
      }
    }
  }
  for (size_t k = 0; k < count; ++k) {
    Receiver& receiver = receivers_[first_child + k];
    Source& parent = sources_[receiver.source];
    const double share =
        static_cast<double>(receiver.panel.end.area / parent.panel.end.area);
    for (size_t c = 0; c < kRgbChannels; ++c) {
      parent.unshot[c] += share * parent.reflectance[c] *
                          (gathered[k][c] - receiver.irradiance[c]);
    }
    receiver.irradiance = gathered[k];
    for (const Source& source : sources_) {
      solution_.form_factors +=
          source.hold != 0 && source.form_factors[first_child + k] > 0 ? 1U
                                                                       : 0U;
    }
  }
}

// The deviation of each receiver that is not split; 0 for the others.
std::vector<double> Shooting::Deviations() const {
  std::vector<const Panel*> panels;
  std::vector<Rgb> radiosities;
  for (const Receiver& receiver : receivers_) {
    if (!receiver.split) {
      panels.push_back(&receiver.panel);
      radiosities.push_back(RadiosityOf(receiver));
    }
  }
  const auto of_panels = CornerDeviations(scene_, panels, radiosities);
  std::vector<double> deviations(receivers_.size());
  for (size_t e = 0, k = 0; e < receivers_.size(); ++e) {
    deviations[e] = receivers_[e].split ? 0 : of_panels[k++];
  }
  return deviations;
}

// The corners of a linear function deviate by sqrt(3) times the RMS error of a
// constant. Without substructuring, the result is 0.
double Shooting::SeenError() const {
  if (!options_.gradient) {
    return 0;
  }
  const std::vector<double> deviations = Deviations();
  double square = 0;
  for (size_t e = 0; e < receivers_.size(); ++e) {
    square += static_cast<double>(receivers_[e].panel.end.area) *
              deviations[e] * deviations[e] / 3;
  }
  return std::sqrt(square / area_) / std::max(ReflectedPower() / area_, 1e-30);
}

Rgb Shooting::RadiosityOf(const Receiver& receiver) const {
  const Source& source = sources_[receiver.source];
  Rgb radiosity = scene_.ExitanceOf(receiver.panel);
  for (size_t c = 0; c < radiosity.size(); ++c) {
    radiosity[c] += source.reflectance[c] * receiver.irradiance[c];
  }
  return radiosity;
}

// The reflected power of all sources, mean of the channels, W.
double Shooting::ReflectedPower() const {
  double power = 0;
  for (const Source& s : sources_) {
    const Rgb exitance = scene_.ExitanceOf(s.panel);
    for (size_t c = 0; c < exitance.size(); ++c) {
      power += static_cast<double>(s.panel.end.area) *
               (s.shot[c] + s.unshot[c] - exitance[c]) / 3;
    }
  }
  return power;
}

// Unshot power times R, W: the unshot light with all its bounces.
Rgb Shooting::LightStillToCome() const {
  Rgb power{};
  for (const Source& s : sources_) {
    for (size_t c = 0; c < power.size(); ++c) {
      power[c] += static_cast<double>(s.panel.end.area) *
                  std::abs(s.unshot[c]) * all_bounces_[c];
    }
  }
  return power;
}

// Adds the ambient term of Cohen et al. 1988: the light still to come, spread
// over all panels.
void Shooting::AddAmbient() {
  double area = 0;
  for (const Source& s : sources_) {
    area += static_cast<double>(s.panel.end.area);
  }
  const Rgb power = LightStillToCome();
  for (Receiver& receiver : receivers_) {
    for (size_t c = 0; c < power.size(); ++c) {
      receiver.irradiance[c] += power[c] / area;
    }
  }
}

}  // namespace

PanelSolution SolveByShooting(const ReferenceScene& scene,
                              FormFactors& form_factors,
                              const ShootingOptions& options,
                              const RunControl& control,
                              MemoryBudget& budget) {
  return Shooting(scene, form_factors, options, control, budget).Run();
}

}  // namespace enfilade
