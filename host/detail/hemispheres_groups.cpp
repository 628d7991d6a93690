// Casts rays of chosen samples of a band against their occluders: all meshes, or the samples' own parts.
#include <algorithm>
#include <array>
#include <iterator>
#include <numeric>

#include "detail/hemisphere_rays.h"
#include "detail/hemispheres.h"

namespace kiln {
namespace {

constexpr std::size_t kGroupLanes = 8;
// Number of samples per batch, which need 42 MB of device memory.
constexpr std::size_t kSamplesPerBatch = std::size_t{1} << 20;

}  // namespace

const RayCaster& Hemispheres::occluders_of(std::uint32_t part) {
  if (const auto cached = part_occluders_.find(part); cached != part_occluders_.end()) {
    return cached->second;
  }
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  const auto add = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
    const auto first = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), {a, b, c});
    triangles.push_back({first, first + 1, first + 2});
  };
  const auto add_all = [&](const std::vector<Vec3>& points, const Triangle& t) {
    add(points[t[0]], points[t[1]], points[t[2]]);
  };
  for (std::size_t t = 0; by_high_ && t < source_.triangles.size(); ++t) {
    if (parts_->high[t] == part) add_all(source_.positions, source_.triangles[t]);
  }
  for (const Mesh& other : other_occluders_) {
    for (const Triangle& t : other.triangles) add_all(other.positions, t);
  }
  for (std::size_t t = 0; by_low_ && t < surface_.triangles.size(); ++t) {
    const auto& [a, b, c] = surface_.triangles[t];
    if (surface_.usable[t] != 0 && parts_->low[t] == part) add(a.position, b.position, c.position);
  }
  return part_occluders_.try_emplace(part, context_, positions, triangles, source_.traversal)
      .first->second;
}

std::vector<Hemispheres::OccluderGroup> Hemispheres::group_samples(
    const TexelBand& band, const DeviceCorrespondence& match, bool second,
    std::span<const std::uint32_t> samples) {
  const std::vector<std::uint32_t>& hit_triangles = reads_->read(match.triangle, band.sample_count);
  const auto has_rays = [&](std::uint32_t sample) {
    return hit_triangles[sample] != KILN_NO_TRIANGLE || (keeps_misses_ && !second);
  };
  if (parts_ == nullptr) {
    OccluderGroup all_samples{occluders(), {}};
    all_samples.samples.reserve(samples.size());
    std::copy_if(samples.begin(), samples.end(), std::back_inserter(all_samples.samples), has_rays);
    return {std::move(all_samples)};
  }
  const std::vector<std::uint32_t>& low = reads_->read(band.triangle, band.sample_count);
  std::map<std::uint32_t, std::vector<std::uint32_t>> samples_by_part;
  for (const std::uint32_t sample : samples) {
    if (has_rays(sample)) samples_by_part[parts_->low[low[sample]]].push_back(sample);
  }
  std::vector<OccluderGroup> result;
  result.reserve(samples_by_part.size());
  for (auto& [part, list] : samples_by_part)
    result.push_back({{.whole = &occluders_of(part)}, std::move(list)});
  return result;
}

void Hemispheres::cast_group(const OccluderGroup& group, const TexelBand& band,
                             const DeviceCorrespondence& match, bool second, const RaySet& set,
                             std::span<const std::uint32_t> rounds,
                             std::span<RayCounts> ray_counts) {
  const RayQuery query =
      make_ray_query(unbounded_reach_, back_faces_);  // Used by rays to the light
  const cl::Kernel count_lit = context_.kernel("hemisphere", "kiln_hemisphere_count_lit");
  const cl::Array<float> no_bent_sum;
  const std::size_t plane = plane_of(band);
  const bool wants_bent_sum = !ray_counts[0].bent_sum.empty();
  const std::array<RotationsAndCounts, 2> round_arrays{
      RotationsAndCounts{&picked_rotations_, &picked_open_},
      RotationsAndCounts{&second_rotations_, &second_open_}};
  const std::span<const RotationsAndCounts> rotations =
      std::span(round_arrays).first(ray_counts.size());
  const std::span<const std::uint32_t> samples = group.samples;
  // Each batch passes over all occluders, which is slow if they are not in memory together.
  const std::size_t batch = group.occluders.whole != nullptr ? kSamplesPerBatch : samples.size();
  for (std::size_t first = 0; first < samples.size(); first += batch) {
    const auto part = samples.subspan(first, std::min(batch, samples.size() - first));
    pick(band, match, part, rounds.empty() ? std::nullopt : std::optional(rounds[0]));
    const std::size_t picked_plane = plane_of(picked_samples_);
    make_room(context_, picked_open_, picked_plane);
    context_.fill(picked_open_, std::uint32_t{0});
    if (rounds.size() > 1) {
      rotate_picked(picked_samples_.sample_count, rounds[1], second_rotations_);
      make_room(context_, second_open_, picked_plane);
      context_.fill(second_open_, std::uint32_t{0});
    }
    if (wants_bent_sum) {
      make_room(context_, picked_bent_sum_, 3 * picked_plane);
      context_.fill(picked_bent_sum_, 0.0F);
    }
    if (set.toward_light) {
      for_each_hit_piece(picked_samples_, picked_match_, second, set, rotations.first(1), false,
                         group.occluders, query,
                         [&](const RotationsAndCounts& of, const kiln_hemisphere_params& params) {
                           context_.launch(count_lit, params.stride / kLanes, kGroupLanes, params,
                                           ray_hits_, rays_, *of.open);
                         });
    } else {
      count_open(picked_samples_, picked_match_, second, set, rotations, group.occluders,
                 wants_bent_sum ? picked_bent_sum_ : no_bent_sum);
    }
    std::vector<std::uint32_t> part_counts(part.size());
    for (std::size_t t = 0; t < rotations.size(); ++t) {
      rotations[t].open->read(context_, std::span(part_counts));
      for (std::size_t i = 0; i < part.size(); ++i) ray_counts[t].open[part[i]] = part_counts[i];
    }
    if (!wants_bent_sum) continue;
    std::vector<float> sums(3 * picked_plane);
    picked_bent_sum_.read(context_, std::span(sums));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < part.size(); ++i) {
        ray_counts[0].bent_sum[axis * plane + part[i]] = sums[axis * picked_plane + i];
      }
    }
  }
}

Hemispheres::RayCounts Hemispheres::cast_parts(const TexelBand& band,
                                               const DeviceCorrespondence& match, bool second,
                                               const RaySet& set, bool bent_sum) {
  RayCounts ray_counts;
  ray_counts.open.resize(plane_of(band));
  if (bent_sum) ray_counts.bent_sum.resize(std::size_t{3} * plane_of(band));
  make_rotations(band);
  std::vector<std::uint32_t> all_indices(band.sample_count);
  std::iota(all_indices.begin(), all_indices.end(), 0U);
  for (const OccluderGroup& group : group_samples(band, match, second, all_indices)) {
    cast_group(group, band, match, second, set, {}, {&ray_counts, 1});
  }
  return ray_counts;
}

std::vector<Hemispheres::RayCounts> Hemispheres::cast_rounds(
    const TexelBand& band, const DeviceCorrespondence& match, bool second,
    std::span<const std::uint32_t> samples, std::uint32_t rays,
    std::span<const std::uint32_t> rounds) {
  std::vector<RayCounts> ray_counts(rounds.size());
  for (RayCounts& of_round : ray_counts) of_round.open.resize(band.sample_count);
  for (const OccluderGroup& group : group_samples(band, match, second, samples)) {
    cast_group(group, band, match, second, outward_rays(rays), rounds, ray_counts);
  }
  return ray_counts;
}

}  // namespace kiln
