#include "tools/verify/guide.h"

#include "base/random.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace enfilade {
namespace {

constexpr size_t kMostSpots = 256;
constexpr size_t kTestsOfSpot = 8;  // rays from a cell to a spot
constexpr uint64_t kGroup = 4;      // cells of one batch of rays
// Bytes of the rays, hits and their owners, for each cell of a group.
constexpr uint64_t kSpotSearchBytes =
    (kMostSpots * kTestsOfSpot + CellSurveyor::kMostPoints) * 192;

// The share of a spot that no ray reached, if the survey met the spot's cell.
constexpr double kHiddenSpotShare = 0.25 / kTestsOfSpot;
// Within this many radii, a spot counts as seen whatever the rays of the cell
// say.
constexpr double kSpotRadii = 4;
// Within this many radii, the cosine finds a spot, and no guide is needed.
constexpr double kLeastRadii = 1.5;
// No guide is needed either if the brightest spots fill this much of the
// hemisphere, weighted by cosines.
constexpr double kFilled = 0.3;
// A spot is among the brightest unless it is more than this many times darker
// than the mean of the spots.
constexpr double kAsBright = 4;

// A sphere about some of the parts.
struct Group {
  size_t begin = 0;
  size_t end = 0;
  BrightPart whole;
};

BrightPart Around(std::span<const BrightPart> parts) {
  Box3 box;
  BrightPart whole;
  double most = 0;
  for (const BrightPart& part : parts) {
    box.Include(part.position);
    whole.flux += part.flux;
    if (part.flux > most) {
      most = part.flux;
      whole.cell = part.cell;
    }
  }
  whole.position = box.low + (box.high - box.low) * 0.5;
  for (const BrightPart& part : parts) {
    whole.radius = std::max(
        whole.radius, Length(part.position - whole.position) + part.radius);
  }
  return whole;
}

// How much is lost by aiming at the whole sphere.
double Waste(const Group& group) {
  return group.end - group.begin < 2
             ? 0
             : group.whole.flux * group.whole.radius * group.whole.radius;
}

// Sorts the parts along the longest side of their box, and returns the index of
// the median.
size_t Halve(std::span<BrightPart> parts) {
  Box3 box;
  for (const BrightPart& part : parts) {
    box.Include(part.position);
  }
  const Vec3 size = box.high - box.low;
  const auto along = [&](const BrightPart& p) {
    return size.x >= size.y && size.x >= size.z ? p.position.x
           : size.y >= size.z                   ? p.position.y
                                                : p.position.z;
  };
  std::stable_sort(
      parts.begin(), parts.end(), [&](const auto& a, const auto& b) {
        return along(a) < along(b);
      });
  return parts.size() / 2;
}

// Groups all parts into a few small spheres.
std::vector<BrightPart> Spots(std::vector<BrightPart> parts) {
  std::vector<Group> groups;
  if (!parts.empty()) {
    groups.push_back({0, parts.size(), Around(parts)});
  }
  while (!groups.empty() && groups.size() < kMostSpots) {
    const auto worst = std::max_element(
        groups.begin(), groups.end(), [](const Group& a, const Group& b) {
          return Waste(a) < Waste(b);
        });
    if (Waste(*worst) <= 0) {
      break;
    }
    const std::span<BrightPart> all(parts);
    const size_t begin = worst->begin;
    const size_t end = worst->end;
    const size_t middle = begin + Halve(all.subspan(begin, end - begin));
    *worst = {begin, middle, Around(all.subspan(begin, middle - begin))};
    groups.push_back({middle, end, Around(all.subspan(middle, end - middle))});
  }
  std::vector<BrightPart> spots;
  spots.reserve(groups.size());
  for (const Group& group : groups) {
    spots.push_back(group.whole);
  }
  return spots;
}

// A direction uniform in a cone whose half angle has the cosine 1 - height.
Vec3 InCone(Vec3 axis, double height, double u, double v) {
  Vec3 s;
  Vec3 t;
  MakeFrame(axis, &s, &t);
  const double below = u * height;  // 1 - cosine
  const double sine = std::sqrt(std::max(0.0, below * (2 - below)));
  const double angle = 2 * kPi * v;
  return axis * (1 - below) + s * (sine * std::cos(angle)) +
         t * (sine * std::sin(angle));
}

// 1 less the cosine of the half angle of a sphere of radius `r` at distance
// `d`, without loss of digits for small spheres.
double ConeHeight(double r, double d) {
  const double sine2 = r * r / (d * d);
  return sine2 / (1 + std::sqrt(1 - sine2));
}

// A direction towards the sphere or, from inside it, by the cosine.
Vec3 Towards(
    const BrightPart& spot, Point3 x, Vec3 normal, double u, double v) {
  const Vec3 to_spot = spot.position - x;
  const double d = Length(to_spot);
  return d > spot.radius ? InCone(to_spot / d, ConeHeight(spot.radius, d), u, v)
                         : CosineDirection(normal, u, v);
}

bool IsWithin(Vec3 axis, double height, Vec3 direction) {
  // The bound exceeds the cone a little, because directions on its rim are
  // rounded.
  return 1 - Dot(axis, direction) <= height * (1 + 1e-9) + 1e-15;
}

Vec3 Mirrored(Vec3 direction, Vec3 normal) {
  return direction - normal * (2 * Dot(direction, normal));
}

}  // namespace

Vec3 PathGuide::Aims::Direction(double u, double v) const {
  if (u >= share_) {
    return CosineDirection(
        normal_,
        std::min((u - share_) / (1 - share_), 0x1.fffffffffffffp-1),
        v);
  }
  double left = u / share_;
  size_t chosen = 0;
  while (chosen + 1 < count_ && left >= cones_[chosen].probability) {
    left -= cones_[chosen].probability;
    ++chosen;
  }
  const Cone& cone = cones_[chosen];
  const Vec3 direction =
      InCone(cone.axis, cone.height, std::min(left / cone.probability, 1.0), v);
  return Dot(direction, normal_) < 0 ? Mirrored(direction, normal_) : direction;
}

double PathGuide::Aims::Excess(Vec3 direction) const {
  if (count_ == 0) {
    return 1;
  }
  const Vec3 mirrored = Mirrored(direction, normal_);
  double density = 0;
  for (size_t j = 0; j < count_; ++j) {
    const Cone& cone = cones_[j];
    const int within = (IsWithin(cone.axis, cone.height, direction) ? 1 : 0) +
                       (IsWithin(cone.axis, cone.height, mirrored) ? 1 : 0);
    density += within * cone.probability / (2 * kPi * cone.height);
  }
  const double cosine = std::max(Dot(direction, normal_), 1e-12);
  return 1 - share_ + share_ * density * kPi / cosine;
}

PathGuide::Aims PathGuide::At(std::optional<CellId> cell,
                              Point3 x,
                              Vec3 normal) const {
  Aims aims;
  aims.normal_ = normal;
  double around = mean_radiosity_;
  double sum = 0;
  double sum_of_brightness = 0;
  // Not cleared, because clearing all entries would take longer than most
  // lists.
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init)
  std::array<double, kMostAims> brightness;
  for (const Aim& aim : lists_.Of(cell)) {
    const BrightPart& spot = spots_[aim.spot];
    const Vec3 to_spot = spot.position - x;
    const double d = Length(to_spot);
    const double r2 = spot.radius * spot.radius;
    const double bright = spot.flux / (kPi * r2);
    if (d < kLeastRadii * spot.radius) {
      around = std::max(around, bright);
      continue;
    }
    const double above = (Dot(to_spot, normal) + spot.radius) / d;
    if (above <= 0) {
      continue;
    }
    const double near_share = kSpotRadii * kSpotRadii * r2 / (d * d);
    const double share = std::min(1.0, std::max(double{aim.share}, near_share));
    const double sent = share * bright * above * r2 / (d * d);
    aims.cones_[aims.count_] = {to_spot / d, ConeHeight(spot.radius, d), sent};
    brightness[aims.count_] = bright;
    ++aims.count_;
    sum += sent;
    sum_of_brightness += sent * bright;
  }
  if (aims.count_ == 0) {
    return aims;
  }
  double filled = 0;  // F, by the brightest spots
  for (size_t j = 0; j < aims.count_; ++j) {
    Aims::Cone& cone = aims.cones_[j];
    if (kAsBright * brightness[j] * sum >= sum_of_brightness) {
      filled += cone.probability / brightness[j];
    }
    cone.probability /= sum;
  }
  if (filled < kFilled) {
    aims.share_ = sum / (2 * (sum + around)) * (1 - filled / kFilled);
  } else {
    aims.count_ = 0;
  }
  return aims;
}

uint64_t PathGuide::Learn(const BuildingView& view,
                          std::vector<BrightPart> parts,
                          double mean_radiosity,
                          MemoryBudget& budget,
                          uint64_t max_bytes,
                          uint64_t key) {
  mean_radiosity_ = mean_radiosity;
  spots_ = Spots(std::move(parts));
  const size_t cells = view.partition->cells.size();
  const uint64_t search_bytes =
      kGroup * kSpotSearchBytes + CellSurveyor::Bytes(view);
  constexpr uint64_t kSpotBytes = kMostSpots * sizeof(BrightPart);
  const uint64_t fixed_bytes = search_bytes + kSpotBytes;
  if (spots_.empty() ||
      fixed_bytes + CellLists<Aim>::LeastBytes(cells) > max_bytes) {
    return 0;
  }
  const MemoryCharge search_charge(
      budget, search_bytes, "looking for the bright spots that cells see");
  charge_ = MemoryCharge(budget, kSpotBytes, "bright spots");
  lists_.Reserve(budget,
                 cells,
                 std::min(max_bytes - fixed_bytes,
                          CellLists<Aim>::MostBytes(cells, kMostAims)),
                 "the bright spots that cells see");
  const uint64_t rays = LearnCells(view, key);
  lists_.Finish();
  return rays;
}

uint64_t PathGuide::LearnCells(const BuildingView& view, uint64_t key) {
  const CellSurveyor surveyor(view);
  uint64_t rays = 0;
  for (size_t first = 0; first < view.partition->cells.size();
       first += kGroup) {
    for (const CellSurvey& survey : surveyor.Survey(first, kGroup, key)) {
      std::vector<Aim> aims = SpotsOfCells(survey);
      rays += survey.points.size() + kTestsOfSpot * aims.size();
      Test(view, survey, aims);
      KeepTheStrongest(aims);
      if (!lists_.HasRoomFor(aims.size())) {
        return rays;  // the cells from here on go unguided
      }
      std::ranges::for_each(aims, [&](const Aim& aim) { lists_.Add(aim); });
      lists_.EndCell();
    }
  }
  return rays;
}

// The spots of all cells in the survey.
std::vector<PathGuide::Aim> PathGuide::SpotsOfCells(
    const CellSurvey& survey) const {
  std::vector<Aim> aims;
  for (uint32_t j = 0; j < spots_.size() && !survey.points.empty(); ++j) {
    if (std::binary_search(
            survey.cells.begin(), survey.cells.end(), spots_[j].cell)) {
      aims.push_back({j, 0});
    }
  }
  return aims;
}

// Finds the share of each aim by rays from points of the cell.
void PathGuide::Test(const BuildingView& view,
                     const CellSurvey& survey,
                     std::vector<Aim>& aims) const {
  const double offset = RayOffset(view.scene->bounds);
  Random random(MixKey(survey.key, 2));
  std::vector<TraceRay> rays;
  rays.reserve(kTestsOfSpot * aims.size());
  for (const Aim& aim : aims) {
    const BrightPart& spot = spots_[aim.spot];
    for (size_t i = 0; i < kTestsOfSpot; ++i) {
      const Receiver& r = survey.points[random.NextBelow(
          static_cast<uint32_t>(survey.points.size()))];
      const Point3 x = r.position + r.normal * offset;
      const double u = random.Next();
      rays.push_back({x, Towards(spot, x, r.normal, u, random.Next())});
    }
  }
  std::vector<TraceHit> hits(rays.size());
  view.trace(rays, hits);
  for (size_t k = 0; k < aims.size(); ++k) {
    const BrightPart& spot = spots_[aims[k].spot];
    double share = 0;
    for (size_t i = k * kTestsOfSpot; i < (k + 1) * kTestsOfSpot; ++i) {
      const Point3 y = rays[i].origin + rays[i].direction * hits[i].distance;
      const bool came = hits[i].hit && Length(y - spot.position) <= spot.radius;
      share += came ? 1.0 / kTestsOfSpot : 0.0;
    }
    aims[k].share = static_cast<float>(std::max(share, kHiddenSpotShare));
  }
}

void PathGuide::KeepTheStrongest(std::vector<Aim>& aims) const {
  const auto flux = [&](const Aim& aim) {
    return double{aim.share} * spots_[aim.spot].flux;
  };
  std::stable_sort(aims.begin(), aims.end(), [&](const Aim& a, const Aim& b) {
    return flux(a) > flux(b);
  });
  aims.resize(std::min(aims.size(), kMostAims));
}

}  // namespace enfilade
