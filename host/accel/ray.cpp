#include "accel/ray.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/formatted.h"
#include "cl/tuning.h"
#include "kiln/error.h"
#include "shared/ray.h"

namespace kiln {
namespace {

constexpr std::size_t kLocalSize = 64;
// Bounds the duration of a launch: a few milliseconds on a GPU, tens on a CPU.
constexpr std::uint32_t kRaysPerLaunch = 1u << 20;
// Rays of a work-item: KILN_ITEM_RAYS of kernels/accel/ray.cl.
constexpr std::uint32_t kRaysPerBeam = 64;
// Neighbouring rays are traced as streams instead of beams if the region that they hit has at least this many triangles
// per ray. By processor time, streams took 0.28 as long with 1.2 triangles per ray, 0.63 with 0.15, 0.93 with 0.04, and
// 1.18 with 0.01.
constexpr double kMinTrianglesPerRayForStreams = 0.025;
// Number of beams that have as many rays as a block of the stream kernels: a work-group of these traces as many rays as
// one of the beam kernel.
constexpr std::size_t kBeamsPerStreamBlock = KILN_RAY_STREAM_BLOCK / kRaysPerBeam;
// Work-group size of the any-hit stream kernel; each work-item casts one block of rays.
constexpr std::size_t kOcclusionLocalSize = 4;
static_assert(kRaysPerLaunch % kRaysPerBeam == 0 && kRaysPerLaunch % KILN_OCCLUSION_BLOCK == 0 &&
              kRaysPerLaunch % KILN_RAY_STREAM_BLOCK == 0);

void check_query(const RayQuery& query, std::uint32_t count, std::uint32_t capacity) {
  if (!std::isfinite(query.t_min) || !std::isfinite(query.t_max) || query.t_min > query.t_max) {
    throw Error(ErrorCode::usage, "A ray's range [" + decimal(query.t_min) + ", " +
                                      decimal(query.t_max) + "] must be finite and not reversed.");
  }
  if (query.has_ray_limits && (!query.outermost || query.use_reach)) {
    throw Error(ErrorCode::internal,
                "Limits per ray require the ray rule `outermost` and a ray offset of 0.");
  }
  if (count > capacity) {
    throw Error(ErrorCode::internal, "The number of rays exceeds the size of their arrays.");
  }
}

}  // namespace

struct RayCaster::Impl {
  cl::Context* context = nullptr;
  Traversal traversal = Traversal::cpu;
  std::string defines;
  std::shared_ptr<const Tree> tree;

  void choose_variant(Traversal requested) {
    traversal = choose_traversal(*context, requested);
    defines = tree->defines(traversal == Traversal::gpu          ? "-DKILN_RAY_SCALAR=1"
                            : traversal == Traversal::cpu_single ? "-DKILN_RAY_SINGLE=1"
                                                                 : "");
  }

  kiln_ray_params params(const RayQuery& query, std::uint32_t capacity,
                         std::uint32_t result_capacity) const {
    kiln_ray_params params{};
    params.t_min = query.t_min;
    params.t_max = query.t_max;
    params.offset = query.offset;
    params.capacity = capacity;
    params.result_capacity = result_capacity;
    params.flags =
        (query.use_reach ? KILN_RAY_USE_REACH : 0) | (query.inward ? KILN_RAY_INWARD : 0) |
        (query.outward_first ? KILN_RAY_OUTWARD_FIRST : 0) |
        (query.two_sided ? KILN_RAY_TWO_SIDED : 0) | (query.outermost ? KILN_RAY_OUTERMOST : 0) |
        (query.has_ray_limits ? KILN_RAY_LIMITED : 0) | (query.any_hit ? KILN_RAY_ANY : 0);
    return params;
  }

  template <typename... Results>
  void launch(const std::string& family, const std::string& name,
              const std::string& program_defines, std::uint32_t tuned_size,
              std::size_t default_size, std::uint32_t rays_per_item, kiln_ray_params params,
              std::uint32_t count, const cl::Array<float>& points, const Results&... results) {
    const cl::Kernel kernel = context->kernel(family, name, program_defines);
    const std::size_t local_size = context->group_size(kernel, tuned_size, default_size);
    for (std::uint32_t first = 0; first < count; first += params.end - first) {
      params.first = first;
      params.end = first + std::min(count - first, kRaysPerLaunch);
      const std::size_t items = (params.end - first + rays_per_item - 1) / rays_per_item;
      context->launch(kernel, items, local_size, params, tree->nodes, tree->blocks, points,
                      results...);
    }
  }
};

RayCaster::RayCaster(cl::Context& context, std::span<const Vec3> positions,
                     std::span<const Triangle> triangles, Traversal traversal)
    : RayCaster(context, std::make_shared<Tree>(context, positions, triangles), traversal) {}

RayCaster::RayCaster(cl::Context& context, std::shared_ptr<const Tree> tree, Traversal traversal)
    : impl_(std::make_unique<Impl>()) {
  impl_->context = &context;
  impl_->tree = std::move(tree);
  impl_->choose_variant(traversal);
}

RayCaster::~RayCaster() = default;
const Tree& RayCaster::tree() const { return *impl_->tree; }
RayCaster::RayCaster(RayCaster&&) noexcept = default;
RayCaster& RayCaster::operator=(RayCaster&&) noexcept = default;

void RayCaster::intersect(const cl::Array<float>& points, std::uint32_t count,
                          std::uint32_t capacity, const RayQuery& query,
                          DeviceCorrespondence& result) const {
  check_query(query, count, std::min(capacity, result.capacity));
  result.count = count;
  const bool gpu = impl_->traversal == Traversal::gpu;
  const bool traces_streams = impl_->traversal == Traversal::cpu &&
                              query.triangles_per_ray >= kMinTrianglesPerRayForStreams;
  const std::uint32_t tuned = impl_->context->tuning().ray_group;
  constexpr std::uint32_t kBeams = kBeamsPerStreamBlock;
  impl_->launch(traces_streams ? "ray_stream" : "ray",
                gpu              ? "kiln_ray_closest_scalar"
                : traces_streams ? "kiln_ray_closest_stream"
                                 : "kiln_ray_closest_beam",
                traces_streams ? impl_->tree->defines() : impl_->defines,
                traces_streams && tuned != 0 ? std::max(tuned / kBeams, 1U) : tuned,
                traces_streams ? kLocalSize / kBeams : kLocalSize,
                gpu              ? 1
                : traces_streams ? KILN_RAY_STREAM_BLOCK
                                 : kRaysPerBeam,
                impl_->params(query, capacity, result.capacity), count, points, result.triangle,
                result.barycentric, result.distance, result.status);
}

void RayCaster::occluded(const cl::Array<float>& points, std::uint32_t count,
                         std::uint32_t capacity, const RayQuery& query,
                         const cl::Array<std::uint8_t>& hit) const {
  check_query(query, count, capacity);
  if (query.has_ray_limits)
    throw Error(ErrorCode::internal, "Any-hit queries do not support limits per ray.");
  const bool traces_streams = impl_->traversal == Traversal::cpu;
  impl_->launch("occlusion",
                traces_streams                       ? "kiln_occlusion_any_stream"
                : impl_->traversal == Traversal::gpu ? "kiln_occlusion_any_scalar"
                                                     : "kiln_occlusion_any_wide",
                impl_->defines, impl_->context->tuning().occlusion_group,
                traces_streams ? kOcclusionLocalSize : kLocalSize,
                traces_streams ? KILN_OCCLUSION_BLOCK : 1, impl_->params(query, capacity, capacity),
                count, points, hit);
}

kiln_ray_params RayCaster::params(const RayQuery& query, std::uint32_t capacity) const {
  check_query(query, 0, capacity);
  return impl_->params(query, capacity, capacity);
}

const RayCaster::Stats& RayCaster::stats() const { return impl_->tree->stats; }
Traversal RayCaster::traversal() const { return impl_->traversal; }

}  // namespace kiln
