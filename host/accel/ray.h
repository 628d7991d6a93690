// Ray queries on the high poly.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "accel/device_bvh.h"
#include "cl/context.h"
#include "kiln/types.h"
#include "shared/ray.h"
#include "texel/device_correspondence.h"

namespace kiln {

/// Query of a batch of rays. Lengths are in frame units.
///
/// A ray starts at position + offset * direction and runs along the direction (or against it where
/// `inward`); only hits with t in [t_min, t_max] along the ray count.
struct RayQuery {
  float t_min = 0;
  float t_max = 1;
  float offset = 0;
  bool use_reach = false;  ///< The offset of each ray is its sample's `reach` (cage meshes)
  bool inward = false;
  /// Find the nearest hit with t >= 0, else the nearest one with t < 0 (Tarini et al., section 3.2); requires t_min <
  /// 0. If false, find the hit with the smallest t.
  bool outward_first = false;
  bool two_sided = false;  ///< Count faces turned away from the direction, too
  /// Find the largest t instead. KILN_RAY_SEVERAL is set in the status of rays with hits at two or
  /// more different t >= 0. Not with `inward` or `outward_first`.
  bool outermost = false;
  bool has_ray_limits =
      false;  ///< With `outermost`, ignore hits with t above the sample's own `reach`
  /// Only whether a ray has a hit matters: on CPUs, rays that are not traced as streams end at any hit. The
  /// result then only tells which rays hit nothing. Meant for incoherent rays. For many such rays,
  /// RayCaster::occluded() is faster, which has a kernel of its own.
  bool any_hit = false;
  /// If known, the number of triangles per ray in the region that rays of neighbouring texels hit. On CPUs it
  /// determines whether these rays are traced as a stream. Never changes results.
  double triangles_per_ray = 0;
};

class RayCaster;

/// Ray queries on a surface, whose data may be in memory or in parts of a file.
class RaySearch {
 public:
  RaySearch() = default;
  RaySearch(const RaySearch&) = default;
  RaySearch& operator=(const RaySearch&) = default;
  virtual ~RaySearch() = default;

  /// Casts rays for samples [0, count) of `points` (planes of `capacity`: position x y z, unit
  /// direction x y z, reach; see TexelBand). Writes triangle, barycentric, distance (signed, along
  /// the direction, from the sample's position) and status for each.
  virtual void intersect(const cl::Array<float>& points, std::uint32_t count,
                         std::uint32_t capacity, const RayQuery& query,
                         DeviceCorrespondence& result) const = 0;

  /// Calls `use` with one BVH after the other, which together hold all of the surface. Each is freed after its call, if
  /// memory needs it.
  virtual void for_each_part(const std::function<void(const RayCaster&)>& use) const = 0;
};

/// The traversal kernels of rays, and their BVH.
///
/// The intersection test is watertight (after Woop, Benthin, Wald 2013): no ray passes between two
/// triangles that share an edge or a vertex. Ties go to the smaller triangle index. So the result
/// is a function of the triangles and the ray alone: it does not depend on tree, variant and
/// threads.
class RayCaster : public RaySearch {
 public:
  /// Builds the tree on the host and uploads it.
  /// \param positions  in the working frame: about unit size
  /// \throws Error(device) if the device has too little memory
  RayCaster(cl::Context& context, std::span<const Vec3> positions,
            std::span<const Triangle> triangles, Traversal traversal = Traversal::automatic);
  /// \param tree may be shared with other queries
  RayCaster(cl::Context& context, std::shared_ptr<const Tree> tree,
            Traversal traversal = Traversal::automatic);
  ~RayCaster() override;
  /// The tree.
  const Tree& tree() const;
  RayCaster(RayCaster&&) noexcept;
  RayCaster& operator=(RayCaster&&) noexcept;

  void intersect(const cl::Array<float>& points, std::uint32_t count, std::uint32_t capacity,
                 const RayQuery& query, DeviceCorrespondence& result) const override;
  /// There is one part: this BVH.
  void for_each_part(const std::function<void(const RayCaster&)>& use) const override {
    use(*this);
  }

  /// Any-hit query: writes 1 to `hit` for rays with a hit in [t_min, t_max], else 0.
  void occluded(const cl::Array<float>& points, std::uint32_t count, std::uint32_t capacity,
                const RayQuery& query, const cl::Array<std::uint8_t>& hit) const;

  /// Parameters of a query for kernels that generate their own rays; the range of ray indices is empty.
  kiln_ray_params params(const RayQuery& query, std::uint32_t capacity) const;

  using Stats = Tree::Stats;
  const Stats& stats() const;
  Traversal traversal() const;  ///< The resolved variant, never `automatic`

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kiln
