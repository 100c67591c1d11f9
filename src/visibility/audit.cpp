#include "visibility/audit.h"

#include "base/parallel.h"
#include "base/stop.h"
#include "partition/bsp_tree.h"
#include "partition/overlap.h"
#include "partition/patch.h"
#include "partition/polygon.h"
#include "visibility/audit_rays.h"
#include "visibility/ray_tracer.h"
#include "visibility/visible_set.h"

#include <algorithm>
#include <map>
#include <optional>
#include <span>
#include <unordered_set>

namespace enfilade {
namespace {

constexpr size_t kLeastAuditBatch = 4096;
constexpr size_t kMostAuditBatch = 1U << 18;
constexpr size_t kAuditRaysPerTask = 1024;
constexpr size_t kMostMissedKept = 10;

// Whether a point lies straight behind a patch that was put in front of others,
// in the gap between the patch and where it lay.
bool IsInGapBehind(const Patch& patch, Point3 p) {
  if (patch.layer == 0) {
    return false;
  }
  const Vec3 d = p - patch.origin;
  const double height = Dot(d, PatchNormal(patch));
  const double uu = Dot(patch.u, patch.u);
  const double uv = Dot(patch.u, patch.v);
  const double vv = Dot(patch.v, patch.v);
  const double det = uu * vv - uv * uv;
  const double s = (vv * Dot(d, patch.u) - uv * Dot(d, patch.v)) / det;
  const double t = (uu * Dot(d, patch.v) - uv * Dot(d, patch.u)) / det;
  const double most_t = patch.shape == PatchShape::kTriangle ? 1 - s : 1;
  return height < 0 && height > -patch.layer * kApartM && s >= 0 && s <= 1 &&
         t >= 0 && t <= most_t;
}

class Auditor {
 public:
  Auditor(const BlockStorage& store, MemoryBudget& budget)
      : store_(&store), budget_(&budget), tracer_(store, budget) {
    summary_.conservative_pairs = LoadVisibilitySummary(store).visible_pairs;
    constexpr uint64_t kBytesPerPair = 40;
    constexpr uint64_t kBytesPerCell = 200;  // of its share and bounds
    pair_charge_ =
        MemoryCharge(budget,
                     summary_.conservative_pairs * kBytesPerPair +
                         store.Count(BlockKind::kCellPatches) * kBytesPerCell,
                     "the pairs that the audit finds");
    // All rays of a batch may be suspects.
    constexpr size_t kBytesPerRay =
        sizeof(TraceRay) + sizeof(TraceHit) + sizeof(Suspect);
    batch_ = std::clamp(budget.FreeBytes() / 8 / kBytesPerRay,
                        kLeastAuditBatch,
                        kMostAuditBatch);
    ray_charge_ = MemoryCharge(budget, batch_ * kBytesPerRay, "audit rays");
    rays_.reserve(batch_);
    hits_.reserve(batch_);
    suspects_.reserve(batch_);
  }

  AuditSummary Run(uint64_t rays, const std::function<void(double)>& progress) {
    const std::vector<CellShare> shares = ShareRays(*store_, rays);
    for (const CellShare& share : shares) {
      bounds_[share.cell] = share.bounds;
    }
    const auto report = [&] {
      if (progress) {
        progress(static_cast<double>(summary_.audit_rays) /
                 static_cast<double>(rays));
      }
    };
    for (const CellShare& share : shares) {
      ShootFrom(share, report);
    }
    TraceBatch();
    report();
    for (const uint64_t pair : pairs_) {
      summary_.sampled_pairs += pair >> 32 == (pair & ~0U) ? 1U : 2U;
    }
    return summary_;
  }

 private:
  // A ray that joins a pair that the sets lack, or other parts of a pair than
  // the sets list.
  struct Suspect {
    CellId origin;
    TraceHit hit;
    TraceRay ray;
  };

  // A cell that the receiver sees, and the visible parts of both cells.
  struct Source {
    CellId cell;
    Box3 of_receiver;
    Box3 of_source;
  };

  // Consecutive rays of the batch that start in one cell.
  struct BatchRun {
    CellId cell;
    size_t end = 0;
  };

  // Calls `report` after each batch.
  void ShootFrom(const CellShare& share, const std::function<void()>& report) {
    const CellPatches content = LoadCellPatches(*store_, share.cell);
    const AuditRays cell_rays(share.cell, content);
    for (uint64_t done = 0; done < share.rays;) {
      const size_t first = rays_.size();
      const size_t count =
          std::min<uint64_t>(share.rays - done, batch_ - first);
      rays_.resize(first + count);
      const size_t tasks = (count + kAuditRaysPerTask - 1) / kAuditRaysPerTask;
      ParallelFor(tasks, [&](size_t task) {
        const size_t end = std::min(count, (task + 1) * kAuditRaysPerTask);
        for (size_t i = task * kAuditRaysPerTask; i < end; ++i) {
          rays_[first + i] = cell_rays.Draw(done + i);
        }
      });
      done += count;
      runs_.push_back({share.cell, rays_.size()});
      if (rays_.size() == batch_) {
        TraceBatch();
        report();
      }
    }
  }

  void TraceBatch() {
    hits_.resize(rays_.size());
    tracer_.Trace(rays_, hits_);
    size_t i = 0;
    for (const BatchRun& run : runs_) {
      ThrowIfStopRequested();
      LoadSources(run.cell);
      for (; i < run.end; ++i) {
        Judge(run.cell, rays_[i], hits_[i]);
      }
    }
    summary_.audit_rays += rays_.size();
    Reexamine();
    rays_.clear();
    hits_.clear();
    runs_.clear();
  }

  // The patch that a ray has hit. The patches of one cell are kept.
  const Patch& PatchAt(const TraceHit& hit) {
    if (hit_cell_ != hit.cell) {
      hit_cell_ = hit.cell;
      hit_patches_ = LoadCellPatches(*store_, hit.cell).patches;
    }
    return hit_patches_[hit.patch.Index()];
  }

  // Whether a ray may hit the patch from behind. It may if the patch is a
  // luminaire, whose back is black, or if the ray began between the patch and
  // the surface that the patch was put in front of (overlap.h), a gap that
  // nothing else can see.
  [[nodiscard]] bool HasOpenBack(const TraceRay& ray, const TraceHit& hit) {
    const Patch& patch = PatchAt(hit);
    const double depth = hit.distance * Dot(ray.direction, PatchNormal(patch));
    return patch.emits || depth <= (kMostLayers + 1) * kApartM;
  }

  void LoadSources(CellId receiver) {
    if (receiver_ == receiver) {
      return;
    }
    receiver_ = receiver;
    sources_.clear();
    MemoryCharge charge;
    const auto reserve = [&](uint64_t bytes) {
      charge = MemoryCharge(*budget_, bytes, "what a cell sees");
    };
    for (const VisibleCell& v : LoadVisibleSet(*store_, receiver, reserve)) {
      sources_.push_back({v.source,
                          BoxOf(bounds_[receiver], v.of_receiver),
                          BoxOf(bounds_[v.source], v.of_source)});
    }
  }

  // Whether the sets say that the receiver sees the point that a ray from it
  // has hit.
  [[nodiscard]] bool IsKnown(const TraceRay& ray, const TraceHit& hit) const {
    const auto found = std::lower_bound(
        sources_.begin(),
        sources_.end(),
        hit.cell,
        [](const Source& s, CellId cell) { return s.cell < cell; });
    return found != sources_.end() && found->cell == hit.cell &&
           found->of_receiver.Contains(ray.origin) &&
           found->of_source.Contains(ray.origin + ray.direction * hit.distance);
  }

  void Judge(CellId origin, const TraceRay& ray, const TraceHit& hit) {
    if (!hit.hit) {
      return;
    }
    if (!hit.on_front) {
      summary_.audit_leaks += HasOpenBack(ray, hit) ? 0U : 1U;
      return;
    }
    if (!IsKnown(ray, hit)) {
      suspects_.push_back({origin, hit, ray});
      return;
    }
    const auto [low, high] = std::minmax(origin.value, hit.cell.value);
    pairs_.insert(uint64_t{low} << 32 | high);
  }

  // Traces rays a little beside each suspect. A suspect counts as missed only
  // if all these rays find the missing pair too, because an opening has some
  // width and a crack between patches has none. Uses the batch's buffers.
  void Reexamine() {
    const size_t per_trace = batch_ / kRaysBeside;
    for (size_t first = 0; first < suspects_.size(); first += per_trace) {
      const auto slice = std::span(suspects_).subspan(
          first, std::min(per_trace, suspects_.size() - first));
      rays_.clear();
      for (const Suspect& s : slice) {
        for (const TraceRay& beside : RaysBeside(s.ray)) {
          rays_.push_back(beside);
        }
      }
      hits_.resize(rays_.size());
      tracer_.Trace(rays_, hits_);
      for (size_t i = 0; i < slice.size(); ++i) {
        Convict(slice[i],
                std::span(hits_).subspan(kRaysBeside * i, kRaysBeside));
      }
    }
    suspects_.clear();
  }

  // Whether the ray starts and ends in the cells of its pair. Rays start and
  // end a little off their patches. Where a cell is thinner than that, between
  // two walls, a ray starts or ends in another cell and proves nothing. The
  // same holds where the cell reaches just as far, up to rounding.
  bool IsBetweenItsCells(const Suspect& s) {
    if (store_->Count(BlockKind::kPortals) == 0) {
      return true;  // cells without a partition
    }
    if (!locator_) {
      locator_.emplace(*store_);
      constexpr size_t kBytesPerLeaf = 2 * sizeof(BspNode);
      locator_charge_ = MemoryCharge(*budget_,
                                     locator_->LeafCount() * kBytesPerLeaf,
                                     "the tree of splitting planes");
    }
    const Point3 end = s.ray.origin + s.ray.direction * s.hit.distance +
                       PatchNormal(PatchAt(s.hit)) * kRayOffsetMetres;
    const Vec3 inwards = s.ray.direction * kOnPlaneM;
    return locator_->Locate(s.ray.origin) == s.origin &&
           locator_->Locate(s.ray.origin + inwards) == s.origin &&
           locator_->Locate(end) == s.hit.cell &&
           locator_->Locate(end - inwards) == s.hit.cell;
  }

  // Whether a point lies between a patch of the cell and the surface that this
  // patch was put in front of. What stands on the patch begins there
  // (overlap_rims.h), so that such gaps may join those of the next cell; no
  // light gets into them.
  [[nodiscard]] bool IsBehindMovedPatch(CellId cell, Point3 p) const {
    const CellPatches content = LoadCellPatches(*store_, cell);
    return std::any_of(
        content.patches.begin(),
        content.patches.end(),
        [&](const Patch& patch) { return IsInGapBehind(patch, p); });
  }

  void Convict(const Suspect& s, std::span<const TraceHit> beside) {
    const Point3 end = s.ray.origin + s.ray.direction * s.hit.distance;
    const bool is_real =
        IsBetweenItsCells(s) && !IsBehindMovedPatch(s.origin, s.ray.origin) &&
        !IsBehindMovedPatch(s.hit.cell, end) &&
        std::all_of(beside.begin(), beside.end(), [&](const TraceHit& hit) {
          return hit.hit && hit.on_front && hit.cell == s.hit.cell;
        });
    if (!is_real) {
      ++summary_.audit_leaks;
      return;
    }
    ++summary_.audit_missed;
    if (summary_.first_missed.size() < kMostMissedKept) {
      summary_.first_missed.push_back(
          {s.origin,
           s.hit.cell,
           s.ray.origin,
           s.ray.origin + s.ray.direction * s.hit.distance});
    }
  }

  const BlockStorage* store_;
  MemoryBudget* budget_;
  std::map<CellId, Box3> bounds_;  // of cells with patches
  RayTracer tracer_;
  // Loaded when it is first needed.
  std::optional<PartitionLocator> locator_;
  MemoryCharge locator_charge_;
  MemoryCharge pair_charge_;
  MemoryCharge ray_charge_;
  size_t batch_ = 0;
  std::vector<TraceRay> rays_;
  std::vector<TraceHit> hits_;
  std::vector<BatchRun> runs_;
  std::optional<CellId> receiver_;
  // The cell that was last hit from behind.
  std::optional<CellId> hit_cell_;
  std::vector<Patch> hit_patches_;  // patches of hit_cell_
  std::vector<Source> sources_;     // cells that the receiver sees, ascending
  std::vector<Suspect> suspects_;
  std::unordered_set<uint64_t> pairs_;  // found by a ray: low << 32 | high
  AuditSummary summary_;
};

}  // namespace

AuditSummary Audit(const BlockStorage& store,
                   uint64_t rays,
                   MemoryBudget& budget,
                   const std::function<void(double)>& progress) {
  return Auditor(store, budget).Run(rays, progress);
}

}  // namespace enfilade
