#include "source/chunked_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <string>
#include <utility>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress_guard.h"
#include "base/stopwatch.h"
#include "kiln/limits.h"
#include "mesh/kernels_shared.h"
#include "shared/match.h"
#include "shared/ray.h"
#include "texel/host_correspondence.h"

namespace kiln {
namespace {

constexpr std::size_t kPointPlanes = 7;  // of TexelBand::points
constexpr std::size_t kSamplesPerTask = std::size_t{1} << 15;
// Margins by which boxes are enlarged, since searches have rounding errors: an absolute one in frame units, and a share
// of the coordinates. Rounding errors are smaller.
constexpr double kMargin = 1e-4, kMarginShare = 1e-5;

float coordinate(const Vec3& v, std::size_t axis) { return component(v, static_cast<int>(axis)); }

/// Samples on the host.
class Samples {
 public:
  Samples(cl::Context& context, const cl::Array<float>& points, std::uint32_t count,
          std::uint32_t capacity)
      : count_(count) {
    for (std::size_t p = 0; p < kPointPlanes; ++p) {
      planes_[p].resize(count);
      // Rays that maps generate have no plane of reaches, and their queries do not read it.
      if (points.size() < (p + 1) * capacity) continue;
      points.read(context, planes_[p], p * capacity);
    }
  }
  std::uint32_t size() const { return count_; }
  float operator()(std::size_t plane, std::uint32_t i) const { return planes_[plane][i]; }

  /// A subset of the samples on the device: one array per component, as kernels read them.
  cl::Array<float> pick(cl::Context& context, std::span<const std::uint32_t> some) const {
    std::vector<float> values(kPointPlanes * some.size());
    parallel_for(some.size(), kSamplesPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = 0; p < kPointPlanes; ++p) {
        for (std::size_t k = begin; k < end; ++k) {
          values[p * some.size() + k] = planes_[p][some[k]];
        }
      }
    });
    return cl::Array<float>(context, std::span<const float>(values));
  }

 private:
  std::uint32_t count_;
  std::array<std::vector<float>, kPointPlanes> planes_;
};

/// The samples that satisfy a predicate, in ascending order.
template <typename Wanted>
std::vector<std::uint32_t> samples_with(std::uint32_t count, const Wanted& wanted) {
  std::vector<std::vector<std::uint32_t>> pieces((count + kSamplesPerTask - 1) / kSamplesPerTask);
  parallel_for(count, kSamplesPerTask, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t>& piece = pieces[begin / kSamplesPerTask];
    for (std::size_t i = begin; i < end; ++i) {
      if (wanted(static_cast<std::uint32_t>(i))) piece.push_back(static_cast<std::uint32_t>(i));
    }
  });
  std::vector<std::uint32_t> samples;
  for (const auto& piece : pieces) samples.insert(samples.end(), piece.begin(), piece.end());
  return samples;
}

/// Ratio of a chunk's triangles to the searched samples above which only the triangles near the samples are loaded.
constexpr std::size_t kTrianglesPerSample = 32;

/// One search over all chunks.
///
/// \tparam Rule  Provides these functions:
///   reach_of(samples, i, best): a box that contains all points that the rest of a sample's search can reach
///   reaches(samples, i, best, box): false if no triangle in the box can change the best result of a sample compare(a,
///   ia, b, ib): below 0 if a's result is better; 0 if the rounded distances are equal search(context, tree, points,
///   count, result): searches one tree merge_status(winner, iw, loser, il): status of the winner
template <typename Rule>
class ChunkSearch {
 public:
  ChunkSearch(const LoadedChunks& chunks, const Samples& samples, const Rule& rule)
      : chunks_(chunks), samples_(samples), rule_(rule), best_(samples.size()) {}

  const HostCorrespondence& run() {
    const ChunkedMesh& mesh = chunks_.mesh();
    for (std::size_t chunk = 0; chunk < mesh.size(); ++chunk) {
      const Box<Vec3>& box = mesh.box(chunk);
      const std::vector<std::uint32_t> some = samples_with(
          samples_.size(), [&](std::uint32_t i) { return rule_.reaches(samples_, i, best_, box); });
      if (some.empty()) continue;
      ProgressGuard::poll_within_stage("matching chunk " + std::to_string(chunk + 1) + " of " +
                                       std::to_string(mesh.size()));
      const std::shared_ptr<const LoadedChunks::Chunk> loaded =
          some.size() * kTrianglesPerSample <= mesh.records(chunk)
              ? chunks_.load_near(chunk, boxes_of(some))
              : chunks_.load(chunk);
      if (loaded->tree == nullptr) continue;
      const HostCorrespondence found = search(loaded->tree, loaded->triangles.ids, some);
      decide(merge(some, found));
    }
    return best_;
  }

 private:
  std::vector<Box<Vec3>> boxes_of(std::span<const std::uint32_t> some) const {
    std::vector<Box<Vec3>> boxes;
    boxes.reserve(some.size());
    for (const std::uint32_t i : some) boxes.push_back(rule_.reach_of(samples_, i, best_));
    return boxes;
  }

  /// Searches a subset of the samples; triangles in the result are ids of the whole mesh.
  HostCorrespondence search(const std::shared_ptr<const Tree>& tree,
                            std::span<const std::uint32_t> ids,
                            std::span<const std::uint32_t> some) const {
    const auto count = static_cast<std::uint32_t>(some.size());
    cl::Context& context = chunks_.context();
    const cl::Array<float> points = samples_.pick(context, some);
    DeviceCorrespondence result(context, count);
    rule_.search(context, tree, points, count, result);
    HostCorrespondence found(context, result, count);
    for (std::uint32_t& t : found.triangle) {
      if (t != KILN_NO_TRIANGLE) t = ids[t];
    }
    return found;
  }

  void take(std::uint32_t i, const HostCorrespondence& from, std::size_t k, std::uint8_t status) {
    best_.take(i, from, k);
    best_.status[i] = status;
  }

  struct Tie {
    std::uint32_t sample, triangle;
  };

  /// Replaces results by better ones of another chunk. \returns the samples for which two chunks have equally good
  /// triangles
  std::vector<Tie> merge(std::span<const std::uint32_t> some, const HostCorrespondence& found) {
    std::vector<Tie> ties;
    for (std::size_t k = 0; k < some.size(); ++k) {
      const std::uint32_t i = some[k];
      if (found.triangle[k] == KILN_NO_TRIANGLE) continue;
      if (best_.triangle[i] == KILN_NO_TRIANGLE) {
        take(i, found, k, found.status[k]);
        continue;
      }
      const int order = rule_.compare(best_, i, found, k);
      const std::uint8_t status = order <= 0 ? rule_.merge_status(best_, i, found, k)
                                             : rule_.merge_status(found, k, best_, i);
      if (order <= 0) best_.status[i] = status;
      if (order > 0) take(i, found, k, status);
      if (order == 0) ties.push_back({i, found.triangle[k]});
    }
    return ties;
  }

  /// Distances that are equal after rounding may differ before it. So a search of only the triangles concerned decides
  /// between them.
  void decide(const std::vector<Tie>& ties) {
    if (ties.empty()) return;
    std::vector<std::uint32_t> ids, some;
    for (const Tie& tie : ties) {
      some.push_back(tie.sample);
      ids.insert(ids.end(), {tie.triangle, best_.triangle[tie.sample]});
    }
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    const auto tree = std::make_shared<const Tree>(chunks_.context(), chunks_.mesh().positions(),
                                                   chunks_.mesh().triangles(ids));
    const HostCorrespondence found = search(tree, ids, some);
    for (std::size_t k = 0; k < some.size(); ++k) {
      if (found.triangle[k] == KILN_NO_TRIANGLE) continue;
      take(some[k], found, k, rule_.merge_status(found, k, best_, some[k]));
    }
  }

  const LoadedChunks& chunks_;
  const Samples& samples_;
  const Rule& rule_;
  HostCorrespondence best_;
};

/// Merges hits of a ray in several chunks by the rules of ray_accept() in kernels/accel/ray.clh.
struct RayRules {
  RayQuery query;
  Traversal traversal = Traversal::automatic;

  double sign() const { return query.inward ? -1 : 1; }

  /// The interval of a ray in which a better hit may still lie, enlarged by a margin for rounding.
  struct Part {
    double lo = 0, hi = 0, margin = 0;
    std::array<double, 3> start{}, direction{};
  };
  Part part_of(const Samples& samples, std::uint32_t i, const HostCorrespondence& best) const {
    Part part;
    const double offset = query.use_reach ? samples(6, i) : query.offset;
    part.lo = query.t_min;
    part.hi = query.t_max;
    if (query.has_ray_limits) part.hi = std::min(part.hi, double{samples(6, i)});
    // If rays start at an offset, t has a rounding error, which the margin covers.
    const double t = sign() * (best.distance[i] - offset);
    if (best.triangle[i] != KILN_NO_TRIANGLE) {
      if (query.outermost) {
        const bool several = (best.status[i] & KILN_RAY_SEVERAL) != 0;
        part.lo = t >= 0 && !several ? std::max(part.lo, 0.0) : t;
      } else if (query.outward_first && t < 0) {
        part.lo = t;
      } else {
        part.hi = t;
        if (query.outward_first) part.lo = 0;
      }
    }
    double largest = std::max(std::abs(part.lo), std::abs(part.hi)) + std::abs(offset);
    for (std::size_t k = 0; k < 3; ++k) {
      const double along = samples(3 + k, i);
      part.start[k] = samples(k, i) + offset * along;
      part.direction[k] = sign() * along;
      largest = std::max(largest, std::abs(double{samples(k, i)}));
    }
    part.margin = kMargin + kMarginShare * largest;
    part.lo -= part.margin;
    part.hi += part.margin;
    return part;
  }

  Box<Vec3> reach_of(const Samples& samples, std::uint32_t i,
                     const HostCorrespondence& best) const {
    const Part part = part_of(samples, i, best);
    std::array<float, 3> low{}, high{};
    for (std::size_t k = 0; k < 3; ++k) {
      const double a = part.start[k] + part.lo * part.direction[k],
                   b = part.start[k] + part.hi * part.direction[k];
      low[k] = static_cast<float>(std::min(a, b) - part.margin);
      high[k] = static_cast<float>(std::max(a, b) + part.margin);
    }
    return {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
  }

  bool reaches(const Samples& samples, std::uint32_t i, const HostCorrespondence& best,
               const Box<Vec3>& box) const {
    const Part part = part_of(samples, i, best);
    double from = part.lo, to = part.hi;
    for (std::size_t k = 0; k < 3; ++k) {
      const double low = coordinate(box.low, k) - part.margin - part.start[k],
                   high = coordinate(box.high, k) + part.margin - part.start[k],
                   d = part.direction[k];
      if (std::abs(d) < 1e-12) {
        if (!(low <= 0 && high >= 0)) return false;
        continue;
      }
      from = std::max(from, std::min(low / d, high / d));
      to = std::min(to, std::max(low / d, high / d));
    }
    return from <= to;
  }

  int compare(const HostCorrespondence& a, std::size_t i, const HostCorrespondence& b,
              std::size_t k) const {
    double p = sign() * a.distance[i], q = sign() * b.distance[k];
    if (query.outermost) {
      std::swap(p, q);
    } else if (query.outward_first) {
      if ((p >= 0) != (q >= 0)) return p >= 0 ? -1 : 1;
      p = std::abs(p);
      q = std::abs(q);
    }
    return p < q ? -1 : p > q ? 1 : 0;
  }

  /// The provenance of the better hit; the flag for several hits is set if the ray hits both chunks or had several hits
  /// before.
  std::uint8_t merge_status(const HostCorrespondence& winner, std::size_t i,
                            const HostCorrespondence& loser, std::size_t k) const {
    if (!query.outermost) return winner.status[i];
    const bool both = winner.distance[i] >= 0 && loser.distance[k] >= 0 &&
                      winner.distance[i] != loser.distance[k];
    const auto mark_cells = static_cast<std::uint8_t>(loser.status[k] & KILN_RAY_SEVERAL);
    return static_cast<std::uint8_t>(winner.status[i] | mark_cells |
                                     (both ? KILN_RAY_SEVERAL : 0U));
  }

  void search(cl::Context& context, const std::shared_ptr<const Tree>& tree,
              const cl::Array<float>& points, std::uint32_t count,
              DeviceCorrespondence& result) const {
    RayCaster(context, tree, traversal).intersect(points, count, count, query, result);
  }
};

/// Merges the nearest points of several chunks.
struct ClosestRules {
  ClosestQuery query;
  Traversal traversal = Traversal::automatic;

  /// Largest distance at which a nearer point may still lie, enlarged by a margin for rounding.
  double bound_of(const Samples& samples, std::uint32_t i, const HostCorrespondence& best) const {
    const double bound = best.triangle[i] != KILN_NO_TRIANGLE ? std::abs(double{best.distance[i]})
                                                              : double{query.max_distance};
    double largest = bound;
    for (std::size_t k = 0; k < 3; ++k) {
      largest = std::max(largest, std::abs(double{samples(k, i)}));
    }
    return bound + kMargin + kMarginShare * largest;
  }

  Box<Vec3> reach_of(const Samples& samples, std::uint32_t i,
                     const HostCorrespondence& best) const {
    const double bound = bound_of(samples, i, best);
    const auto at = [&](std::size_t k, double off) {
      return static_cast<float>(samples(k, i) + off);
    };
    return {{at(0, -bound), at(1, -bound), at(2, -bound)},
            {at(0, bound), at(1, bound), at(2, bound)}};
  }

  bool reaches(const Samples& samples, std::uint32_t i, const HostCorrespondence& best,
               const Box<Vec3>& box) const {
    double squared = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double p = samples(k, i);
      const double beyond =
          std::max({0.0, coordinate(box.low, k) - p, p - coordinate(box.high, k)});
      squared += beyond * beyond;
    }
    return std::sqrt(squared) <= bound_of(samples, i, best);
  }

  static int compare(const HostCorrespondence& a, std::size_t i, const HostCorrespondence& b,
                     std::size_t k) {
    const float p = std::abs(a.distance[i]), q = std::abs(b.distance[k]);
    return p < q ? -1 : p > q ? 1 : 0;
  }
  static std::uint8_t merge_status(const HostCorrespondence& winner, std::size_t i,
                                   const HostCorrespondence& /*loser*/, std::size_t /*k*/) {
    return winner.status[i];
  }
  void search(cl::Context& context, const std::shared_ptr<const Tree>& tree,
              const cl::Array<float>& points, std::uint32_t count,
              DeviceCorrespondence& result) const {
    ClosestFinder(context, tree, traversal).find(points, count, count, query, result);
  }
};

template <typename Rule>
void search_chunks(const LoadedChunks& chunks, const Rule& rule, const cl::Array<float>& points,
                   std::uint32_t count, std::uint32_t capacity, DeviceCorrespondence& result) {
  result.count = count;
  if (count == 0) return;
  const Samples samples(chunks.context(), points, count, capacity);
  ChunkSearch<Rule> search(chunks, samples, rule);
  search.run().write(chunks.context(), result);
}

}  // namespace

std::shared_ptr<const LoadedChunks::Chunk> LoadedChunks::load(std::size_t chunk) const {
  const auto lock = lock_polling(mutex_);
  if (kept_[chunk] != nullptr) return kept_[chunk];
  Stopwatch watch;
  auto loaded = std::make_shared<Chunk>();
  loaded->triangles = mesh_->read(chunk);
  loaded->tree =
      std::make_shared<const Tree>(context_, mesh_->positions(), loaded->triangles.triangles);
  loaded->triangles.triangles = {};  // The tree has its own copy of the triangles.
  seconds_ += watch.lap();
  if (memory_left() > memory_limit() / 2) kept_[chunk] = loaded;
  return loaded;
}

namespace {

/// A set of cells of a grid over a box; mark_cells() adds all cells that a smaller box touches.
class MarkedCells {
 public:
  explicit MarkedCells(const Box<Vec3>& box)
      : marks_(kCellsPerSide * kCellsPerSide * kCellsPerSide) {
    for (std::size_t k = 0; k < 3; ++k) {
      low_[k] = coordinate(box.low, k);
      const float size = coordinate(box.high, k) - coordinate(box.low, k);
      scale_[k] = size > 0 ? static_cast<float>(kCellsPerSide) / size : 0;
    }
  }

  /// \returns the number of cells
  std::size_t mark_cells(const Box<Vec3>& box) {
    std::size_t count = 0;
    for_each_cell(box, [&](std::uint8_t& cell) {
      cell = 1;
      ++count;
      return false;
    });
    return count;
  }
  bool touches(const Box<Vec3>& box) {
    bool found = false;
    for_each_cell(box, [&](const std::uint8_t& cell) { return found = cell != 0; });
    return found;
  }

 private:
  static constexpr std::size_t kCellsPerSide = 64;

  /// Calls visit(cell) for the cells that a box touches, until it returns true. The cells of triangles and of boxes are
  /// computed with the same rounding, so a triangle inside a box touches one of the box's cells.
  template <typename Visit>
  void for_each_cell(const Box<Vec3>& box, const Visit& visit) {
    std::array<std::size_t, 3> from{}, to{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto cell = [&](float x) {
        const float at = (x - low_[k]) * scale_[k];
        return static_cast<std::size_t>(
            std::clamp(at, 0.0F, static_cast<float>(kCellsPerSide - 1)));
      };
      from[k] = cell(coordinate(box.low, k));
      to[k] = cell(coordinate(box.high, k));
    }
    for (std::size_t z = from[2]; z <= to[2]; ++z) {
      for (std::size_t y = from[1]; y <= to[1]; ++y) {
        for (std::size_t x = from[0]; x <= to[0]; ++x) {
          if (visit(marks_[(z * kCellsPerSide + y) * kCellsPerSide + x])) return;
        }
      }
    }
  }

  std::array<float, 3> low_{}, scale_{};
  std::vector<std::uint8_t> marks_;
};

Box<Vec3> box_of_triangle(std::span<const Vec3> positions, const Triangle& triangle) {
  const Vec3 &a = positions[triangle[0]], &b = positions[triangle[1]], &c = positions[triangle[2]];
  return {{std::min({a.x, b.x, c.x}), std::min({a.y, b.y, c.y}), std::min({a.z, b.z, c.z})},
          {std::max({a.x, b.x, c.x}), std::max({a.y, b.y, c.y}), std::max({a.z, b.z, c.z})}};
}

}  // namespace

std::shared_ptr<const LoadedChunks::Chunk> LoadedChunks::load_near(
    std::size_t chunk, std::span<const Box<Vec3>> boxes) const {
  // Above this number of marked cells, marking takes longer than building the BVH
  constexpr std::size_t kMaxMarks = std::size_t{1} << 25;
  {
    const auto lock = lock_polling(mutex_);
    if (kept_[chunk] != nullptr) return kept_[chunk];
  }
  Stopwatch watch;
  MarkedCells marks(mesh_->box(chunk));
  std::size_t marked = 0;
  for (const Box<Vec3>& box : boxes) {
    marked += marks.mark_cells(box);
    if (marked > kMaxMarks) return load(chunk);
  }
  const ChunkTriangles all = mesh_->read(chunk);
  std::vector<std::uint8_t> near(all.ids.size());
  parallel_for(near.size(), kSamplesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      near[t] = marks.touches(box_of_triangle(mesh_->positions(), all.triangles[t])) ? 1 : 0;
    }
  });
  auto loaded = std::make_shared<Chunk>();
  for (std::size_t t = 0; t < near.size(); ++t) {
    if (near[t] == 0) continue;
    loaded->triangles.triangles.push_back(all.triangles[t]);
    loaded->triangles.ids.push_back(all.ids[t]);
  }
  if (!loaded->triangles.ids.empty()) {
    loaded->tree =
        std::make_shared<const Tree>(context_, mesh_->positions(), loaded->triangles.triangles);
  }
  const std::lock_guard lock(mutex_);
  seconds_ += watch.lap();
  return loaded;
}

void LoadedChunks::forget() const {
  const std::lock_guard lock(mutex_);
  for (auto& chunk : kept_) chunk = nullptr;
}

double LoadedChunks::seconds() const {
  const std::lock_guard lock(mutex_);
  return seconds_;
}

void ChunkedRays::intersect(const cl::Array<float>& points, std::uint32_t count,
                            std::uint32_t capacity, const RayQuery& query,
                            DeviceCorrespondence& result) const {
  const bool starts_apart = query.offset != 0 || query.use_reach;
  if (starts_apart && (query.outermost || query.outward_first)) {
    throw Error(ErrorCode::internal,
                "If the high poly is searched by chunks, rays that start at a distance from their "
                "sample can only use the rule of the first hit.");
  }
  search_chunks(*chunks_, RayRules{query, traversal_}, points, count, capacity, result);
}

void ChunkedRays::for_each_part(const std::function<void(const RayCaster&)>& use) const {
  const std::size_t count = chunks_->mesh().size();
  for (std::size_t chunk = 0; chunk < count; ++chunk) {
    ProgressGuard::poll_within_stage("occlusion by chunk " + std::to_string(chunk + 1) + " of " +
                                     std::to_string(count));
    const std::shared_ptr<const LoadedChunks::Chunk> loaded = chunks_->load(chunk);
    if (loaded->tree != nullptr) use(RayCaster(chunks_->context(), loaded->tree, traversal_));
  }
}

void ChunkedClosest::find(const cl::Array<float>& points, std::uint32_t count,
                          std::uint32_t capacity, const ClosestQuery& query,
                          DeviceCorrespondence& result) const {
  search_chunks(*chunks_, ClosestRules{query, traversal_}, points, count, capacity, result);
}

}  // namespace kiln
