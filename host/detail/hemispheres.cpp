#include "detail/hemispheres.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <numbers>
#include <span>

#include "detail/device_shading.h"
#include "detail/hemisphere_rays.h"
#include "mesh/frame.h"
#include "mesh/length.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

constexpr std::size_t kLocalLanes = 8;
// Maximum ray length. It is larger than the distance of any ray's origin from the high poly, which
// is at most KILN_RAY_FARTHEST.
constexpr double kMaxRayLength = 2097152;
// Distance below which hits occlude fully in spite of a falloff, as a share of the longest ray.
constexpr double kMinLengthShare = 0x1p-12;

float ray_length(const Length& length, const Frame& frame) {
  // Ray queries need a length above 0.
  return static_cast<float>(std::clamp(to_frame(length, frame), 1e-30, kMaxRayLength));
}

/// Ray length that suffices to reach all of the high poly from points on it and on the low poly. It
/// should not be larger, since bounding boxes are widened by the rounding error of the ray's
/// length: an infinite ray would intersect every box.
float unbounded_ray_length(const LowSurface& surface, std::span<const Mesh> other_occluders) {
  // Vertices of the high poly stay within a distance of 1 from the origin, even in sessions that
  // move them
  double max_origin_distance = 1;
  for (const std::size_t i : surface.usable_triangles()) {
    for (const LowSurface::Corner& corner : surface.triangles[i]) {
      max_origin_distance = std::max(max_origin_distance, length(to_double(corner.position)));
    }
  }
  for (const Mesh& other : other_occluders) {
    for (const Vec3& p : other.positions) {
      if (is_finite(p)) max_origin_distance = std::max(max_origin_distance, length(to_double(p)));
    }
  }
  return static_cast<float>(std::min(max_origin_distance + 3, kMaxRayLength));
}

/// Directions of a sample's rays about the +Z axis, in several sets, and the ring that each ray
/// belongs to.
struct RaySets {
  // For each set: the x components of all rays, then all y, then all z
  std::vector<float> directions;
  // For each ray, the index of the first ray in its ring; after these, for each ray, the number of
  // rays in its ring
  std::vector<std::uint32_t> rings;
};

double fractional_part(double value) { return value - std::floor(value); }

/// Ray directions by Vogel's spiral with two opposite arms on the disk below the hemisphere. The
/// spiral covers the disk evenly for any number of rays, and is balanced: the mean of all rays is
/// the normal. If the number of rays is odd, one ray has no opposite; it lies next to the centre.
/// Each ray stands for an equal share of the disk's area; its distance from the centre varies
/// within that share from set to set. Rings are about as wide as the distance between two
/// neighbouring rays.
///
/// \param disk       radius of the disk; 1 covers the whole hemisphere
/// \param length_of  quantile function of ray lengths: returns the length for a number that is
///   uniformly distributed on [0, 1)
RaySets spiral_rays(std::uint32_t count, double disk,
                    const std::function<double(double)>& length_of) {
  // Step widths of additive recurrences. They are irrational and badly approximable by fractions,
  // so their multiples are evenly distributed.
  const double rotation_step = std::numbers::phi - 1, radius_step = 0.7548776662466927,
               length_step = std::numbers::sqrt3 - 1;
  const std::uint32_t has_centre_ray = count % 2;
  std::vector<double> angle(count);
  std::vector<std::uint32_t> order(count), arm(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    arm[i] = (i + has_centre_ray) / 2;
    angle[i] = (fractional_part(arm[i] * rotation_step) + (i + has_centre_ray) % 2) / 2;
    order[i] = i;
  }
  RaySets sets;
  sets.rings.resize(std::size_t{2} * count);
  const auto ring_count = static_cast<std::uint32_t>(std::max(1L, std::lround(std::sqrt(count))));
  for (std::uint32_t ring = 0; ring < ring_count; ++ring) {
    const std::uint32_t first = count * ring / ring_count;
    const std::uint32_t end = count * (ring + 1) / ring_count;
    std::sort(order.begin() + first, order.begin() + end,
              [&](std::uint32_t a, std::uint32_t b) { return angle[a] < angle[b]; });
    for (std::uint32_t i = first; i < end; ++i) {
      sets.rings[i] = first;
      sets.rings[i + std::size_t{count}] = end - first;
    }
  }
  sets.directions.resize(std::size_t{3} * KILN_HEMISPHERE_SETS * count);
  float* to = sets.directions.data();
  for (int set = 0; set < KILN_HEMISPHERE_SETS; ++set, to += std::size_t{3} * count) {
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t ray = order[i];
      const bool is_centre = has_centre_ray != 0 && ray == 0;
      const double radial_fraction =
          fractional_part(arm[ray] * radius_step + (set + 0.5) / KILN_HEMISPHERE_SETS);
      // Squared distance from the centre: the share of the disk's area that is nearer to the centre
      // than the ray.
      const double squared =
          (is_centre ? radial_fraction
                     : has_centre_ray + 2 * (arm[ray] - has_centre_ray + radial_fraction)) /
          count * disk * disk;
      const double radians = 2 * std::numbers::pi * angle[ray], radius = std::sqrt(squared);
      // Opposite rays get the lengths of two quantiles that differ by 1/2.
      const double length =
          length_of(fractional_part(arm[ray] * length_step + (ray + has_centre_ray) % 2 * 0.5 +
                                    (3 * set + 0.5) / KILN_HEMISPHERE_SETS));
      to[i] = static_cast<float>(length * radius * std::cos(radians));
      to[i + std::size_t{count}] = static_cast<float>(length * radius * std::sin(radians));
      to[i + std::size_t{2} * count] = static_cast<float>(length * std::sqrt(1 - squared));
    }
  }
  return sets;
}

/// Quantile function of ray lengths, as a share of the falloff's distance. A ray whose length is
/// drawn from this distribution hits a surface at distance d with a probability equal to the
/// falloff at d. So all hits have the same weight, and the distance of the nearest hit is not
/// needed.
double inverse_falloff(OcclusionFalloff falloff, double quantile) {
  switch (falloff) {
    case OcclusionFalloff::linear:
      return quantile;
    case OcclusionFalloff::smooth:
      return 0.5 - std::sin(std::asin(1 - 2 * quantile) / 3);
    case OcclusionFalloff::none:
      break;
  }
  return 1;
}

/// Cosines, then sines, of all angles by which the rays of a sample may be rotated about its
/// normal.
std::vector<float> rotation_table() {
  constexpr std::size_t kRotations = KILN_HEMISPHERE_TURNS;
  std::vector<float> cosines_and_sines(2 * kRotations);
  for (std::size_t i = 0; i < kRotations; ++i) {
    const double radians = 2 * std::numbers::pi * static_cast<double>(i) / kRotations;
    cosines_and_sines[i] = static_cast<float>(std::cos(radians));
    cosines_and_sines[i + kRotations] = static_cast<float>(std::sin(radians));
  }
  return cosines_and_sines;
}

}  // namespace

Hemispheres::Hemispheres(const MapRequest& request)
    : context_(context_of(request.source.device)),
      source_(request.source),
      surface_(request.surface),
      reads_(request.reads()),
      width_(request.options.width),
      height_(request.options.height),
      sample_slot_bits_(static_cast<std::uint32_t>(
          std::bit_width(request.options.samples * request.options.samples - 1))),
      keeps_misses_(request.options.encoding.miss == MissPolicy::keep),
      two_sided_(request.options.match.two_sided),
      back_faces_(request.options.occlusion.back_faces),
      by_high_(request.options.occlusion.by_high),
      by_low_(request.options.occlusion.by_low),
      parts_(request.options.occlusion.own_part ? request.options.match.parts : nullptr),
      shading_(device_shading(context_, request.surface)) {
  max_error_ = request.options.occlusion.max_error;
  view_directions_ = views_for(request);
  const std::optional<Length>& distance = request.options.occlusion.distance;
  const Frame& frame = source_.frame;
  for (const Mesh* mesh : request.options.occlusion.by_others) {
    Mesh other;
    other.positions = frame.to_frame(*mesh);
    other.triangles = mesh->triangles;
    other_occluders_.push_back(std::move(other));
  }
  unbounded_reach_ = unbounded_ray_length(request.surface, other_occluders_);
  occlusion_reach_ = unbounded_reach_;
  if (distance) occlusion_reach_ = std::min(occlusion_reach_, ray_length(*distance, frame));
  falloff_ = request.options.occlusion.falloff;
  if (falloff_ != OcclusionFalloff::none) {
    const float reach = ray_length(distance ? *distance : Length::share(1), frame);
    occlusion_reach_ = std::min(unbounded_reach_, reach);
    length_share_ = double{reach} / occlusion_reach_;
  }
  thickness_reach_ = ray_length(distance ? *distance : Length::share(0.1), frame);
  const std::uint32_t rays = request.options.occlusion.rays;
  rays_out_.falls_off = true;
  upload_rays(rays_out_, rays, 1);
  upload_rays(rays_in_, rays, 1);
  rays_in_.side = -1;
  const ShadowLight& light = request.options.light;
  const Vec3d light_vector = to_double(light.direction);
  const double half_angle = light.angle_degrees / 2 * std::numbers::pi / 180;
  if (length(light_vector) > 0)
    light_direction_ = to_float(light_vector * (1 / length(light_vector)));
  rays_to_light_.toward_light = true;
  upload_rays(rays_to_light_, half_angle > 0 ? rays : 1, std::sin(half_angle));
  rotation_table_ = cl::Array<float>(context_, std::span<const float>(rotation_table()));
}

void Hemispheres::upload_rays(RaySet& set, std::uint32_t count, double radius) {
  const RaySets sets = spiral_rays(count, radius, [&](double quantile) {
    if (!set.falls_off || falloff_ == OcclusionFalloff::none) return 1.0;
    return std::clamp(inverse_falloff(falloff_, quantile) * length_share_, kMinLengthShare, 1.0);
  });
  set.count = count;
  set.directions = cl::Array<float>(context_, std::span<const float>(sets.directions));
  set.rings = cl::Array<std::uint32_t>(context_, std::span<const std::uint32_t>(sets.rings));
}

void Hemispheres::next_band() {
  has_rotations_ = has_keys_ = false;
  for (Sums& sums : sums_) sums.has_open_counts = sums.has_depth = false;
}

void Hemispheres::next_source() {
  next_band();
  all_occluders_.reset();
  part_occluders_.clear();
  views_.reset();
  is_uploaded_ = false;  // Vertices of the high poly may have moved, so they are uploaded again
}

std::uint32_t Hemispheres::plane_of(const TexelBand& band) {
  return round_up_to_lanes(band.capacity);
}

void Hemispheres::upload() {
  if (is_uploaded_) return;
  make_room(context_, positions_, source_.positions.size() * 3);
  positions_.write(context_,
                   std::span<const float>(&source_.positions[0].x, source_.positions.size() * 3));
  // The triangles of a high poly that is larger than memory are those that the band matched.
  if (triangles_.empty() || source_.is_streamed()) {
    triangles_ = cl::Array<std::uint32_t>(
        context_,
        std::span<const std::uint32_t>(source_.triangles[0].data(), source_.triangles.size() * 3));
  }
  is_uploaded_ = true;
}

void Hemispheres::make_rotations(const TexelBand& band) {
  if (!std::exchange(has_rotations_, true))
    compute_rotations(band, "kiln_hemisphere_write_rotations", rotations_);
}

void Hemispheres::make_keys(const TexelBand& band) {
  if (!std::exchange(has_keys_, true)) compute_rotations(band, "kiln_hemisphere_write_keys", keys_);
}

void Hemispheres::compute_rotations(const TexelBand& band, const std::string& kernel,
                                    cl::Array<std::uint32_t>& to) {
  make_room(context_, to, plane_of(band));
  const kiln_rotation_params params{band.texel_count, band.first_row * width_, width_,
                                    sample_slot_bits_};
  context_.launch(context_.kernel("hemisphere_points", kernel), band.texel_count, kLocal, params,
                  band.texel_index, band.texel_first, band.sample_slot, to);
}

void Hemispheres::cast(const TexelBand& band, const DeviceCorrespondence& match, bool second) {
  Sums& sums = sums_[second ? 1 : 0];
  if (sums.has_open_counts) return;
  make_room(context_, sums.open, plane_of(band));
  context_.fill(sums.open, std::uint32_t{0});
  if (needs_bent_sum_) {
    make_room(context_, sums.bent_sum, std::size_t{3} * plane_of(band));
    context_.fill(sums.bent_sum, 0.0F);
  }
  if (parts_ != nullptr) {
    const RayCounts ray_counts = cast_parts(band, match, second, rays_out_, needs_bent_sum_);
    sums.open.write(context_, std::span(ray_counts.open));
    if (needs_bent_sum_) sums.bent_sum.write(context_, std::span(ray_counts.bent_sum));
    sums.has_open_counts = true;
    return;
  }
  make_rotations(band);
  const cl::Array<float> none;
  const RotationsAndCounts rotations_and_counts{&rotations_, &sums.open};
  count_open(band, match, second, rays_out_, {&rotations_and_counts, 1}, occluders(),
             needs_bent_sum_ ? sums.bent_sum : none);
  sums.has_open_counts = true;
}

void Hemispheres::measure_thickness(const TexelBand& band, const DeviceCorrespondence& match,
                                    bool second) {
  Sums& sums = sums_[second ? 1 : 0];
  if (sums.has_depth) return;
  make_room(context_, sums.depth, plane_of(band));
  context_.fill(sums.depth, 0.0F);
  const RayQuery query = make_ray_query(std::min(thickness_reach_, unbounded_reach_), true);
  make_rotations(band);
  sums.has_depth = true;
  if (!source_.is_streamed() && source_.rays().traversal() == Traversal::cpu) {
    for_each_piece(band, match, second, rays_in_, kSamplesPerPiece,
                   [&](const kiln_hemisphere_params& params) {
                     measure_piece(params, source_.rays(), query, sums.depth);
                   });
    return;
  }
  const RaySearch& search = source_.occluder_search();
  const cl::Kernel depth = context_.kernel("hemisphere", "kiln_hemisphere_sum_depths");
  for_each_ray_piece(band, match, second, rays_in_, rotations_, false,
                     [&](const kiln_hemisphere_params& params, std::uint32_t count) {
                       if (first_hits_.capacity < ray_capacity_) {
                         first_hits_ = DeviceCorrespondence();
                         first_hits_ = DeviceCorrespondence(context_, ray_capacity_);
                       }
                       search.intersect(rays_, count, ray_capacity_, query, first_hits_);
                       context_.launch(depth, params.stride / kLanes, kLocalLanes, params,
                                       first_hits_.triangle, first_hits_.distance, sums.depth);
                     });
}

std::vector<float> Hemispheres::visibility(const TexelBand& band, const DeviceCorrespondence& match,
                                           bool second) {
  if (view_directions_ > 0) return visibility_by_views(band, match, second);
  if (max_error_ > 0) return visibility_within_error(band, match, second);
  cast(band, match, second);
  return compute_shares(band, sums_[second ? 1 : 0].open, rays_out_.count);
}

std::vector<float> Hemispheres::compute_shares(const TexelBand& band,
                                               const cl::Array<std::uint32_t>& counts,
                                               std::uint32_t rays) const {
  std::vector<std::uint32_t> read(band.sample_count);
  counts.read(context_, read);
  std::vector<float> shares(read.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    shares[i] = static_cast<float>(static_cast<double>(read[i]) / rays);
  }
  return shares;
}

std::vector<float> Hemispheres::shadow(const TexelBand& band, const DeviceCorrespondence& match,
                                       bool second) {
  make_room(context_, lit_counts_, plane_of(band));
  context_.fill(lit_counts_, std::uint32_t{0});
  if (parts_ != nullptr) {
    const RayCounts ray_counts = cast_parts(band, match, second, rays_to_light_, false);
    lit_counts_.write(context_, std::span(ray_counts.open));
    return compute_shares(band, lit_counts_, rays_to_light_.count);
  }
  const RayQuery query = make_ray_query(unbounded_reach_, back_faces_);
  const cl::Kernel lit = context_.kernel("hemisphere", "kiln_hemisphere_count_lit");
  make_rotations(band);
  const RotationsAndCounts rotations_and_counts{&rotations_, &lit_counts_};
  for_each_hit_piece(band, match, second, rays_to_light_, {&rotations_and_counts, 1}, false,
                     occluders(), query,
                     [&](const RotationsAndCounts& of, const kiln_hemisphere_params& params) {
                       context_.launch(lit, params.stride / kLanes, kLocalLanes, params, ray_hits_,
                                       rays_, *of.open);
                     });
  return compute_shares(band, lit_counts_, rays_to_light_.count);
}

const cl::Array<float>& Hemispheres::bent_sum(const TexelBand& band,
                                              const DeviceCorrespondence& match, bool second) {
  view_directions_ > 0 ? gather_views(band, match, second) : cast(band, match, second);
  return sums_[second ? 1 : 0].bent_sum;
}

std::vector<float> Hemispheres::thickness(const TexelBand& band, const DeviceCorrespondence& match,
                                          bool second) {
  measure_thickness(band, match, second);
  std::vector<float> shares(band.sample_count);
  sums_[second ? 1 : 0].depth.read(context_, shares);
  for (float& share : shares) {
    share = static_cast<float>(static_cast<double>(share) / rays_in_.count);
  }
  return shares;
}

}  // namespace kiln
