#include "detail/hemispheres.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <numbers>
#include <span>

#include "detail/hemisphere_rays.h"
#include "mesh/frame.h"
#include "mesh/length.h"
#include "mesh/low_shading.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

constexpr std::size_t kLocalLanes = 8;
// Beyond any point that a ray may start from (KILN_RAY_FARTHEST), and all of the high poly.
constexpr double kFarthest = 2097152;
// Shortest ray with a falloff, as a share of the longest: what is nearer darkens as if it touched.
constexpr double kShortest = 0x1p-12;

float ray_length(const Length& length, const Frame& frame) {
  // Ranges of rays need a length above 0.
  return static_cast<float>(std::clamp(to_frame(length, frame), 1e-30, kFarthest));
}

/// Beyond all of the high poly, seen from its own points and the low poly's. No longer than that: boxes are
/// widened by what the ray's length may be rounded by, so rays without end would meet them all.
float beyond_everything(const LowSurface& surface, std::span<const Mesh> others) {
  double farthest = 1;  // vertices of the high poly stay within, also in sessions
  for (const std::size_t i : surface.usable_triangles()) {
    for (const LowSurface::Corner& corner : surface.triangles[i]) {
      farthest = std::max(farthest, length(Vec3d(corner.position)));
    }
  }
  for (const Mesh& other : others) {
    for (const Vec3& p : other.positions) {
      if (is_finite(p)) farthest = std::max(farthest, length(Vec3d(p)));
    }
  }
  return static_cast<float>(std::min(farthest + 3, kFarthest));
}

/// Rays of one sample about +Z, and the rings that they are sorted into.
struct RaySets {
  std::vector<float> directions;  // of each set: x, y, z, a plane each
  std::vector<std::uint32_t>
      rings;  // first ray and number of rays of each ray's ring, a plane each
};

double fraction(double value) { return value - std::floor(value); }

/// Two arms of Vogel's spiral, opposite each other: even on the disk at any number, and balanced, so that the
/// mean of all rays is the normal. A ray of an odd number is left over, and lies next to the middle.
///
/// \param disk       its radius: 1 is the whole hemisphere
/// \param length_of  how long rays are, of numbers that are even on 0 to 1
/// A ray's place along the radius is one of its share of the disk, another one in each set. Rings are
/// about as wide as the way between two of their rays.
RaySets spirals(std::uint32_t count, double disk, const std::function<double(double)>& length_of) {
  const double turn = std::numbers::phi - 1, step = 0.7548776662466927,
               step_of_length = std::numbers::sqrt3 - 1;  // as irrational as can be
  const std::uint32_t odd = count % 2;
  std::vector<double> angle(count);
  std::vector<std::uint32_t> order(count), arm(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    arm[i] = (i + odd) / 2;
    angle[i] = (fraction(arm[i] * turn) + (i + odd) % 2) / 2;
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
      const bool single = odd != 0 && ray == 0;
      const double within = fraction(arm[ray] * step + (set + 0.5) / KILN_HEMISPHERE_SETS);
      // The share of the disk that is nearer to the middle.
      const double squared =
          (single ? within : odd + 2 * (arm[ray] - odd + within)) / count * disk * disk;
      const double radians = 2 * std::numbers::pi * angle[ray], radius = std::sqrt(squared);
      // Opposite rays are half of all lengths apart.
      const double length = length_of(fraction(arm[ray] * step_of_length + (ray + odd) % 2 * 0.5 +
                                               (3 * set + 0.5) / KILN_HEMISPHERE_SETS));
      to[i] = static_cast<float>(length * radius * std::cos(radians));
      to[i + std::size_t{count}] = static_cast<float>(length * radius * std::sin(radians));
      to[i + std::size_t{2} * count] = static_cast<float>(length * std::sqrt(1 - squared));
    }
  }
  return sets;
}

/// Length of a ray, as a share of the falloff's distance, by a number that is even on 0 to 1. Of these lengths
/// a hit at d is within as many as it is to darken by. So any hit serves, where d itself asks for the nearest one.
double inverse(OcclusionFalloff falloff, double even) {
  switch (falloff) {
    case OcclusionFalloff::linear:
      return even;
    case OcclusionFalloff::smooth:
      return 0.5 - std::sin(std::asin(1 - 2 * even) / 3);
    case OcclusionFalloff::none:
      break;
  }
  return 1;
}

/// Cosines, then sines, of all angles that a sample's rays may be turned by.
std::vector<float> turn_table() {
  constexpr std::size_t kTurns = KILN_HEMISPHERE_TURNS;
  std::vector<float> table(2 * kTurns);
  for (std::size_t i = 0; i < kTurns; ++i) {
    const double radians = 2 * std::numbers::pi * static_cast<double>(i) / kTurns;
    table[i] = static_cast<float>(std::cos(radians));
    table[i + kTurns] = static_cast<float>(std::sin(radians));
  }
  return table;
}

}  // namespace

Hemispheres::Hemispheres(const MapRequest& request)
    : context_(context_of(request.source.device)),
      source_(request.source),
      surface_(request.surface),
      reads_(request.reads()),
      width_(request.options.width),
      height_(request.options.height),
      slot_bits_(static_cast<std::uint32_t>(
          std::bit_width(request.options.samples * request.options.samples - 1))),
      keep_(request.options.encoding.miss == MissPolicy::keep),
      two_sided_(request.options.match.two_sided),
      back_faces_(request.options.occlusion.back_faces),
      by_high_(request.options.occlusion.by_high),
      by_low_(request.options.occlusion.by_low),
      parts_(request.options.occlusion.own_part ? request.options.match.parts : nullptr),
      shading_(context_,
               std::span<const kiln_low_shading>(low_shading(request.surface, /*with_uvs=*/true))) {
  max_error_ = request.options.occlusion.max_error;
  view_directions_ = views_for(request);
  const std::optional<Length>& distance = request.options.occlusion.distance;
  const Frame& frame = source_.frame;
  for (const Mesh* mesh : request.options.occlusion.by_others) {
    Mesh other;
    other.positions = frame.to_frame(*mesh);
    other.triangles = mesh->triangles;
    others_.push_back(std::move(other));
  }
  beyond_ = beyond_everything(request.surface, others_);
  occluding_ = beyond_;
  if (distance) occluding_ = std::min(occluding_, ray_length(*distance, frame));
  falloff_ = request.options.occlusion.falloff;
  if (falloff_ != OcclusionFalloff::none) {
    const float reach = ray_length(distance ? *distance : Length::share(1), frame);
    occluding_ = std::min(beyond_, reach);
    lengths_ = double{reach} / occluding_;
  }
  thick_ = ray_length(distance ? *distance : Length::share(0.1), frame);
  const std::uint32_t rays = request.options.occlusion.rays;
  rays_out_.falls_off = true;
  upload_rays(rays_out_, rays, 1);
  upload_rays(rays_in_, rays, 1);
  rays_in_.side = -1;
  const ShadowLight& light = request.options.light;
  const Vec3d towards(light.direction);
  const double half = light.angle_degrees / 2 * std::numbers::pi / 180;
  if (length(towards) > 0) light_ = to_float(towards * (1 / length(towards)));
  rays_to_light_.lit = true;
  upload_rays(rays_to_light_, half > 0 ? rays : 1, std::sin(half));
  turn_table_ = cl::Array<float>(context_, std::span<const float>(turn_table()));
}

void Hemispheres::upload_rays(RaySet& set, std::uint32_t count, double radius) {
  const RaySets sets = spirals(count, radius, [&](double even) {
    if (!set.falls_off || falloff_ == OcclusionFalloff::none) return 1.0;
    return std::clamp(inverse(falloff_, even) * lengths_, kShortest, 1.0);
  });
  set.count = count;
  set.directions = cl::Array<float>(context_, std::span<const float>(sets.directions));
  set.rings = cl::Array<std::uint32_t>(context_, std::span<const std::uint32_t>(sets.rings));
}

void Hemispheres::next_band() {
  has_turns_ = has_keys_ = false;
  for (Sums& sums : sums_) sums.has_open = sums.has_depth = false;
}

void Hemispheres::next_source() {
  next_band();
  all_occluders_.reset();
  part_occluders_.clear();
  views_.reset();
  uploaded_ = false;  // vertices may have moved
}

std::uint32_t Hemispheres::plane_of(const TexelBand& band) { return padded(band.capacity); }

void Hemispheres::upload() {
  if (uploaded_) return;
  make_room(context_, positions_, source_.positions.size() * 3);
  positions_.write(context_,
                   std::span<const float>(&source_.positions[0].x, source_.positions.size() * 3));
  if (triangles_.empty()) {
    triangles_ = cl::Array<std::uint32_t>(
        context_,
        std::span<const std::uint32_t>(source_.triangles[0].data(), source_.triangles.size() * 3));
  }
  uploaded_ = true;
}

void Hemispheres::make_turns(const TexelBand& band) {
  if (!std::exchange(has_turns_, true)) turn(band, "kiln_hemisphere_turns", turns_);
}

void Hemispheres::make_keys(const TexelBand& band) {
  if (!std::exchange(has_keys_, true)) turn(band, "kiln_hemisphere_keys", keys_);
}

void Hemispheres::turn(const TexelBand& band, const std::string& kernel,
                       cl::Array<std::uint32_t>& to) {
  make_room(context_, to, plane_of(band));
  const kiln_turn_params params{band.texel_count, band.first_row * width_, width_, slot_bits_};
  context_.launch(context_.kernel("hemisphere", kernel), band.texel_count, kLocal, params,
                  band.texel_index, band.texel_first, band.sample_slot, to);
}

void Hemispheres::cast(const TexelBand& band, const DeviceCorrespondence& match, bool second) {
  Sums& sums = sums_[second ? 1 : 0];
  if (sums.has_open) return;
  make_room(context_, sums.open, plane_of(band));
  context_.fill(sums.open, std::uint32_t{0});
  if (wants_bent_sum_) {
    make_room(context_, sums.bent_sum, std::size_t{3} * plane_of(band));
    context_.fill(sums.bent_sum, 0.0F);
  }
  if (parts_ != nullptr) {
    const Counted counted = cast_parts(band, match, second, rays_out_, wants_bent_sum_);
    sums.open.write(context_, std::span(counted.open));
    if (wants_bent_sum_) sums.bent_sum.write(context_, std::span(counted.bent_sum));
    sums.has_open = true;
    return;
  }
  make_turns(band);
  const cl::Array<float> none;
  const Turned all{&turns_, &sums.open};
  count_open(band, match, second, rays_out_, {&all, 1}, occluders(),
             wants_bent_sum_ ? sums.bent_sum : none);
  sums.has_open = true;
}

void Hemispheres::measure(const TexelBand& band, const DeviceCorrespondence& match, bool second) {
  Sums& sums = sums_[second ? 1 : 0];
  if (sums.has_depth) return;
  make_room(context_, sums.depth, plane_of(band));
  context_.fill(sums.depth, 0.0F);
  const RayCaster& caster = source_.rays();
  const RayQuery query = query_up_to(std::min(thick_, beyond_), true);
  make_turns(band);
  sums.has_depth = true;
  if (caster.traversal() == Traversal::cpu) {
    over_pieces(band, match, second, rays_in_, kPiece, [&](const kiln_hemisphere_params& params) {
      measure_piece(params, caster, query, sums.depth);
    });
    return;
  }
  const cl::Kernel depth = context_.kernel("hemisphere", "kiln_hemisphere_depth");
  over_rays(band, match, second, rays_in_, turns_, false,
            [&](const kiln_hemisphere_params& params, std::uint32_t count) {
              if (first_hits_.capacity < ray_capacity_) {
                first_hits_ = DeviceCorrespondence();
                first_hits_ = DeviceCorrespondence(context_, ray_capacity_);
              }
              caster.intersect(rays_, count, ray_capacity_, query, first_hits_);
              context_.launch(depth, params.stride / kLanes, kLocalLanes, params,
                              first_hits_.triangle, first_hits_.distance, sums.depth);
            });
}

std::vector<float> Hemispheres::visibility(const TexelBand& band, const DeviceCorrespondence& match,
                                           bool second) {
  if (view_directions_ > 0) return visibility_by_views(band, match, second);
  if (max_error_ > 0) return visibility_within(band, match, second);
  cast(band, match, second);
  return shares(band, sums_[second ? 1 : 0].open, rays_out_.count);
}

std::vector<float> Hemispheres::shares(const TexelBand& band,
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
  make_room(context_, lit_, plane_of(band));
  context_.fill(lit_, std::uint32_t{0});
  if (parts_ != nullptr) {
    const Counted counted = cast_parts(band, match, second, rays_to_light_, false);
    lit_.write(context_, std::span(counted.open));
    return shares(band, lit_, rays_to_light_.count);
  }
  const RayCaster& caster = occluders();
  const RayQuery query = query_up_to(beyond_, back_faces_);
  const cl::Kernel lit = context_.kernel("hemisphere", "kiln_hemisphere_lit");
  make_turns(band);
  over_rays(band, match, second, rays_to_light_, turns_, false,
            [&](const kiln_hemisphere_params& params, std::uint32_t count) {
              make_room(context_, hits_, ray_capacity_);
              caster.occluded(rays_, count, ray_capacity_, query, hits_);
              context_.launch(lit, params.stride / kLanes, kLocalLanes, params, hits_, rays_, lit_);
            });
  return shares(band, lit_, rays_to_light_.count);
}

const cl::Array<float>& Hemispheres::bent_sum(const TexelBand& band,
                                              const DeviceCorrespondence& match, bool second) {
  view_directions_ > 0 ? see(band, match, second) : cast(band, match, second);
  return sums_[second ? 1 : 0].bent_sum;
}

std::vector<float> Hemispheres::thickness(const TexelBand& band, const DeviceCorrespondence& match,
                                          bool second) {
  measure(band, match, second);
  std::vector<float> shares(band.sample_count);
  sums_[second ? 1 : 0].depth.read(context_, shares);
  for (float& share : shares) {
    share = static_cast<float>(static_cast<double>(share) / rays_in_.count);
  }
  return shares;
}

}  // namespace kiln
