// Casts the rays of a band, piece by piece.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/memory.h"
#include "base/parallel.h"
#include "detail/hemisphere_rays.h"
#include "detail/hemispheres.h"

namespace kiln {
namespace {

constexpr std::size_t kCastLanes = 8;
// Maximum number of rays per launch. It limits the time of a launch and the device memory: 25 MB,
// or 47 MB with nearest hits.
constexpr std::uint32_t kMaxRaysPerLaunch = 1U << 20;
// Rays are grouped by sample if there are at least kMinRaysPerSampleToGroup rays per sample and at
// most kMaxSamplesToGroup samples. A packet then holds rays of one sample, which are more coherent than
// rays of neighbouring samples.
constexpr std::uint32_t kMinRaysPerSampleToGroup = 512, kMaxSamplesToGroup = 1U << 14;

// Ray directions per block of kiln_hemisphere_cast. With more directions per block, values that all
// rays of a sample share are computed less often. A block then holds fewer samples, which lie
// closer together.
constexpr std::uint32_t kDirectionsPerBlock = 32;

// Offset of ray origins from their face, in frame units. The high poly's diagonal is 0.5 to 1 and the rounding
// error of its points is about 1e-7, so the offset is about 100 times that error and at most 1.5e-5 of the
// diagonal.
constexpr float kOriginOffset = 0x1p-17F;

/// Chooses the numbers of directions and of samples in a block of rays.
kiln_cast_params choose_block_size(std::uint32_t rays) {
  kiln_cast_params block{};
  block.rows = std::min(kDirectionsPerBlock, rays);
  block.samples = KILN_OCCLUSION_BLOCK / block.rows / kLanes * kLanes;
  return block;
}

/// Which rays of a band have a hit in the occluders that were searched so far: one bit a ray, in the order in which
/// the pieces of rays are generated. The numbers of rays in pieces are multiples of kLanes.
class HitBits {
 public:
  explicit HitBits(std::size_t rays) : bits_(rays / kLanes) {}

  /// Starts again at the first ray.
  void rewind() { next_ = 0; }
  /// Adds the hits of the next piece of rays. \param hits  1 or 0 for each ray
  void add(std::span<const std::uint8_t> hits) {
    for_each_group(hits.size(), [&](std::uint8_t& bits, std::size_t ray) {
      for (std::size_t k = 0; k < kLanes; ++k) {
        bits = static_cast<std::uint8_t>(bits | hits[ray + k] << k);
      }
    });
  }
  /// Reads the hits of the next piece of rays, as 1 or 0 for each.
  void read(std::span<std::uint8_t> hits) {
    for_each_group(hits.size(), [&](std::uint8_t& bits, std::size_t ray) {
      for (std::size_t k = 0; k < kLanes; ++k) hits[ray + k] = bits >> k & 1U;
    });
  }

 private:
  static_assert(kLanes == 8);
  template <typename Use>
  void for_each_group(std::size_t rays, const Use& use) {
    constexpr std::size_t kGroupsPerTask = std::size_t{1} << 15;
    parallel_for(rays / kLanes, kGroupsPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t g = begin; g < end; ++g) use(bits_[next_ + g], g * kLanes);
    });
    next_ += rays / kLanes;
  }

  std::vector<std::uint8_t> bits_;
  std::size_t next_ = 0;
};

}  // namespace

void Hemispheres::Occluders::for_each_part(const std::function<void(const RayCaster&)>& use) const {
  if (whole != nullptr) use(*whole);
  if (high != nullptr) high->for_each_part(use);
  if (others != nullptr) use(*others);
}

kiln_hemisphere_params Hemispheres::ray_params(const TexelBand& band,
                                               const DeviceCorrespondence& match, bool second,
                                               const RaySet& set) const {
  kiln_hemisphere_params params{};
  params.all_rays = set.count;
  params.low_capacity = band.capacity;
  params.hit_capacity = match.capacity;
  params.out_capacity = plane_of(band);
  params.keep = keeps_misses_ && !second ? 1 : 0;
  params.two_sided = two_sided_ ? 1 : 0;
  params.side = set.side;
  params.lit = set.toward_light ? 1 : 0;
  params.light_x = light_direction_.x;
  params.light_y = light_direction_.y;
  params.light_z = light_direction_.z;
  // Stream kernels need the directions as they are stored; beam kernels do not
  params.aligned = set.side > 0 ? 1 : 0;
  params.unequal = set.falls_off && falloff_ != OcclusionFalloff::none ? 1 : 0;
  params.push = kOriginOffset;
  params.reach = thickness_reach_;
  return params;
}

void Hemispheres::make_points(const kiln_hemisphere_params& params, const TexelBand& band,
                              const DeviceCorrespondence& match, const cl::Array<float>& points) {
  context_.launch(context_.kernel("hemisphere_points", "kiln_hemisphere_write_points"),
                  params.stride, kLocal, params, band.triangle, band.barycentric, band.points,
                  shading_, match.triangle, match.barycentric, positions_, triangles_,
                  source_.attributes.normal_indices, source_.attributes.normals, picked_indices_,
                  points);
}

void Hemispheres::for_each_piece(const TexelBand& band, const DeviceCorrespondence& match,
                                 bool second, const RaySet& set, std::uint32_t batch_size,
                                 const PieceLauncher& launch) {
  upload();
  const std::uint32_t piece = round_up_to_lanes(std::min(batch_size, band.sample_count));
  make_room(context_, points_, std::size_t{KILN_HEMISPHERE_PLANES} * piece);
  kiln_hemisphere_params params = ray_params(band, match, second, set);
  std::span<const std::uint32_t> triangle;
  if (params.keep == 0 && &band != &picked_samples_)
    triangle = reads_->read(match.triangle, band.sample_count);
  for (; params.first < band.sample_count; params.first += params.count) {
    params.count = std::min(piece, band.sample_count - params.first);
    params.stride = params.plane = round_up_to_lanes(params.count);
    if (!triangle.empty()) {
      const auto begin = triangle.begin() + params.first, end = begin + params.count;
      if (std::all_of(begin, end, [](std::uint32_t t) { return t == KILN_NO_TRIANGLE; })) continue;
    }
    make_points(params, band, match, points_);
    launch(params);
    context_.finish();
  }
}

bool Hemispheres::casts_by_sample(const TexelBand& band, const RaySet& set) {
  return set.count >= kMinRaysPerSampleToGroup && band.sample_count <= kMaxSamplesToGroup;
}

void Hemispheres::for_each_ray_piece(const TexelBand& band, const DeviceCorrespondence& match,
                                     bool second, const RaySet& set,
                                     const cl::Array<std::uint32_t>& sample_rotations,
                                     bool groups_by_sample, const RayPieceLauncher& launch) {
  const bool by_sample = groups_by_sample && casts_by_sample(band, set);
  const std::uint32_t batch_size = by_sample ? kMaxRaysPerLaunch / set.count : kSamplesPerPiece;
  const std::uint32_t piece = round_up_to_lanes(std::min(batch_size, band.sample_count));
  const std::uint32_t capacity =
      std::min(kMaxRaysPerLaunch, static_cast<std::uint32_t>(std::uint64_t{piece} * set.count));
  if (ray_capacity_ < capacity) {
    ray_capacity_ = capacity;
    make_room(context_, rays_, std::size_t{6} * capacity);
  }
  const cl::Kernel rays = context_.kernel("hemisphere", "kiln_hemisphere_write_rays");
  for_each_piece(band, match, second, set, batch_size, [&](kiln_hemisphere_params params) {
    params.ray_capacity = ray_capacity_;
    params.by_sample = by_sample ? 1 : 0;
    const std::uint32_t max_rays = ray_capacity_ / params.stride;
    for (params.first_ray = 0; params.first_ray < set.count; params.first_ray += params.rays) {
      params.rays = std::min(max_rays, set.count - params.first_ray);
      const std::size_t items =
          by_sample ? std::size_t{params.stride} * (round_up_to_lanes(params.rays) / kLanes)
                    : std::size_t{params.stride} / kLanes * params.rays;
      context_.launch(rays, items, kLocal, params, points_, sample_rotations, rotation_table_,
                      set.directions, set.rings, rays_);
      launch(params, params.stride * params.rays);
    }
  });
}

void Hemispheres::add_misses(const kiln_hemisphere_params& params,
                             const cl::Array<std::uint32_t>& open) {
  if (params.by_sample != 0) {
    context_.launch(context_.kernel("hemisphere", "kiln_hemisphere_count_open_by_sample"),
                    params.count, kLocal, params, ray_hits_, open);
    return;
  }
  context_.launch(context_.kernel("hemisphere", "kiln_hemisphere_count_open"),
                  params.stride / kLanes, kCastLanes, params, ray_hits_, open);
}

void Hemispheres::count_open(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                             const RaySet& set, std::span<const RotationsAndCounts> rotations,
                             const Occluders& occluders, const cl::Array<float>& bent_sum) {
  const RayQuery query = make_ray_query(occlusion_reach_, back_faces_);
  if (occluders.are_cast_in_one_step()) {
    if (bent_sum.empty() && casts_by_sample(band, set)) {
      cast_by_sample(band, match, second, set, rotations, *occluders.whole, query);
    } else {
      cast_blocks(band, match, second, set, rotations, *occluders.whole, query, bent_sum);
    }
    return;
  }
  for_each_hit_piece(band, match, second, set, rotations, bent_sum.empty(), occluders, query,
                     [&](const RotationsAndCounts& of, const kiln_hemisphere_params& params) {
                       add_misses(params, *of.open);
                       if (bent_sum.empty()) return;
                       context_.launch(
                           context_.kernel("hemisphere", "kiln_hemisphere_sum_directions"),
                           params.stride / kLanes, kCastLanes, params, ray_hits_, rays_, bent_sum);
                     });
}

void Hemispheres::for_each_hit_piece(const TexelBand& band, const DeviceCorrespondence& match,
                                     bool second, const RaySet& set,
                                     std::span<const RotationsAndCounts> rotations,
                                     bool groups_by_sample, const Occluders& occluders,
                                     const RayQuery& query, const HitUser& use) {
  const auto for_each_piece_of = [&](const RotationsAndCounts& of, const RayPieceLauncher& launch) {
    for_each_ray_piece(band, match, second, set, *of.sample_rotations, groups_by_sample, launch);
  };
  if (occluders.whole != nullptr) {
    for (const RotationsAndCounts& of : rotations) {
      for_each_piece_of(of, [&](const kiln_hemisphere_params& params, std::uint32_t count) {
        make_room(context_, ray_hits_, ray_capacity_);
        occluders.whole->occluded(rays_, count, ray_capacity_, query, ray_hits_);
        use(of, params);
      });
    }
    return;
  }
  const std::size_t max_rays = std::size_t{round_up_to_lanes(band.sample_count)} * set.count;
  require_memory("Occlusion by a high poly that is larger than memory",
                 max_rays / kLanes * rotations.size());
  std::vector<HitBits> hits(rotations.size(), HitBits(max_rays));
  std::vector<std::uint8_t> piece;
  occluders.for_each_part([&](const RayCaster& part) {
    for (std::size_t r = 0; r < rotations.size(); ++r) {
      hits[r].rewind();
      for_each_piece_of(rotations[r], [&](const kiln_hemisphere_params&, std::uint32_t count) {
        make_room(context_, ray_hits_, ray_capacity_);
        part.occluded(rays_, count, ray_capacity_, query, ray_hits_);
        piece.resize(count);
        ray_hits_.read(context_, std::span(piece));
        hits[r].add(piece);
      });
    }
  });
  for (std::size_t r = 0; r < rotations.size(); ++r) {
    hits[r].rewind();
    for_each_piece_of(rotations[r], [&](const kiln_hemisphere_params& params, std::uint32_t count) {
      piece.resize(count);
      hits[r].read(piece);
      make_room(context_, ray_hits_, ray_capacity_);
      ray_hits_.write(context_, std::span<const std::uint8_t>(piece));
      use(rotations[r], params);
    });
  }
}

void Hemispheres::cast_blocks(const TexelBand& band, const DeviceCorrespondence& match, bool second,
                              const RaySet& set, std::span<const RotationsAndCounts> rotations,
                              const RayCaster& caster, const RayQuery& query,
                              const cl::Array<float>& bent_sum) {
  for_each_piece(band, match, second, set, kSamplesPerPiece,
                 [&](const kiln_hemisphere_params& params) {
                   cast_piece(params, set, rotations, caster, query, points_, bent_sum);
                 });
}

void Hemispheres::cast_by_sample(const TexelBand& band, const DeviceCorrespondence& match,
                                 bool second, const RaySet& set,
                                 std::span<const RotationsAndCounts> rotations,
                                 const RayCaster& caster, const RayQuery& query) {
  const std::uint32_t batch_size = kMaxRaysPerLaunch / set.count;
  const kiln_ray_params query_params = caster.params(query, KILN_OCCLUSION_BLOCK);
  const cl::Kernel cast =
      context_.kernel("hemisphere_cast", "kiln_hemisphere_cast_by_sample", caster.tree().defines());
  for_each_piece(band, match, second, set, batch_size, [&](kiln_hemisphere_params params) {
    params.rays = set.count;
    make_room(context_, scratch_, std::size_t{params.count} * 6 * KILN_OCCLUSION_BLOCK);
    make_room(context_, ray_hits_, std::size_t{params.count} * KILN_OCCLUSION_BLOCK);
    for (const auto& [sample_rotations, open] : rotations) {
      context_.launch(cast, params.count, 1, params, query_params, caster.tree().nodes,
                      caster.tree().blocks, points_, *sample_rotations, rotation_table_,
                      set.directions, scratch_, ray_hits_, *open);
    }
  });
}

void Hemispheres::cast_texels(std::uint32_t count, const RaySet& set,
                              std::span<const RotationsAndCounts> rotations) {
  const RayCaster& caster = *occluders().whole;
  const RayQuery query = make_ray_query(occlusion_reach_, back_faces_);
  const cl::Array<float> no_bent_sum;
  kiln_hemisphere_params params = ray_params(picked_samples_, picked_match_, false, set);
  params.plane = round_up_to_lanes(count);
  for (; params.first < count; params.first += params.count) {
    params.first_point = params.first;
    params.count = std::min(kSamplesPerPiece, count - params.first);
    params.stride = round_up_to_lanes(params.count);
    cast_piece(params, set, rotations, caster, query, texel_points_, no_bent_sum);
    context_.finish();
  }
}

void Hemispheres::measure_piece(kiln_hemisphere_params params, const RayCaster& caster,
                                const RayQuery& query, const cl::Array<float>& depth) {
  const kiln_cast_params block = choose_block_size(rays_in_.count);
  const std::size_t items = (params.stride + block.samples - 1) / block.samples;
  make_room(context_, scratch_, items * 6 * KILN_OCCLUSION_BLOCK);
  make_room(context_, distances_, items * KILN_OCCLUSION_BLOCK);
  const cl::Kernel cast =
      context_.kernel("hemisphere_depth", "kiln_hemisphere_cast_depth", caster.tree().defines());
  const std::uint32_t max_rays = std::max(1U, kMaxRaysPerLaunch / params.stride);
  for (params.first_ray = 0; params.first_ray < rays_in_.count; params.first_ray += params.rays) {
    params.rays = std::min(max_rays, rays_in_.count - params.first_ray);
    context_.launch(cast, items, 1, params, caster.params(query, KILN_OCCLUSION_BLOCK), block,
                    caster.tree().nodes, caster.tree().blocks, points_, rotations_, rotation_table_,
                    rays_in_.directions, rays_in_.rings, scratch_, distances_, depth);
  }
}

/// Generates the rays of a piece, casts them and counts those that hit nothing, in one kernel. Used
/// with Traversal::cpu.
void Hemispheres::cast_piece(kiln_hemisphere_params params, const RaySet& set,
                             std::span<const RotationsAndCounts> rotations, const RayCaster& caster,
                             const RayQuery& query, const cl::Array<float>& points,
                             const cl::Array<float>& bent_sum) {
  kiln_cast_params block = choose_block_size(set.count);
  block.wants_bent_sum = bent_sum.empty() ? 0 : 1;
  const std::size_t items = (params.stride + block.samples - 1) / block.samples;
  make_room(context_, scratch_, items * 6 * KILN_OCCLUSION_BLOCK);
  make_room(context_, ray_hits_, items * KILN_OCCLUSION_BLOCK);
  const kiln_ray_params query_params = caster.params(query, KILN_OCCLUSION_BLOCK);
  const cl::Kernel cast =
      context_.kernel("hemisphere_cast", "kiln_hemisphere_cast", caster.tree().defines());
  const std::uint32_t max_rays = std::max(1U, kMaxRaysPerLaunch / params.stride);
  for (params.first_ray = 0; params.first_ray < set.count; params.first_ray += params.rays) {
    params.rays = std::min(max_rays, set.count - params.first_ray);
    for (const auto& [sample_rotations, open] : rotations) {
      context_.launch(cast, items, 1, params, query_params, block, caster.tree().nodes,
                      caster.tree().blocks, points, *sample_rotations, rotation_table_,
                      set.directions, set.rings, scratch_, ray_hits_, *open,
                      bent_sum.empty() ? scratch_ : bent_sum);
    }
  }
}

}  // namespace kiln
