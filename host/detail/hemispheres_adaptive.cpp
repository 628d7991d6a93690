// Ambient occlusion with a given maximum error: casts more rays until two smoothed estimates agree.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <numeric>

#include "base/memory.h"
#include "base/parallel.h"
#include "detail/hemisphere_rays.h"
#include "detail/hemispheres.h"

namespace kiln {
namespace {

// The number of picked samples is rounded up to a multiple of this.
constexpr std::uint32_t kPickGranularity = 64;
constexpr std::uint32_t kMaxAddedRays = 4096;
// Each of the two estimates starts with OcclusionOptions::rays divided by this number of rays.
constexpr std::uint32_t kInitialRayDivisor = 8;
// Target for the estimated error, as a share of the requested error. It is below 1, since the estimate is
// noisy.
constexpr double kTargetErrorShare = 0.8;
// A texel gets no further rays if the previous round of rays left more than this share of its
// error, since then noise is not the cause of the error.
constexpr float kMaxRemainingError = 0.85F;
// Maximum factor by which a round increases the number of a texel's rays
constexpr std::uint32_t kMaxGrowth = 8;
// Host memory in bytes per texel, besides the denoiser's: two estimates and the number of rays as integers; copies of
// both estimates as floats; and the previous errors.
constexpr std::uint64_t kBytesPerTexel = 3 * sizeof(std::uint32_t) + 3 * sizeof(float);
// Device memory in bytes for the rays of one launch
constexpr std::uint64_t kBytesPerLaunch = 25'000'000;

/// If max_error is at least this, no rays are added to reach an error. Instead, texels that
/// smoothing may blur are recomputed from OcclusionOptions::rays rays.
constexpr double kMinErrorToSmoothOnly = 1;

/// Variance of an estimate from `rays` rays, divided by the variance of the mean of two estimates
/// from `rays_each` rays each. The rays of a set are stratified, so the variance is proportional to
/// rays^-1.5 (tools/bench/README.md).
double plain_variance(std::uint32_t rays_each, std::uint32_t rays) {
  return 2 * std::pow(static_cast<double>(rays_each) / rays, 1.5);
}

/// Number of rays of each first estimate. It is made even, since an even number of rays is balanced
/// and has less noise: 16 rays have less noise than 21.
std::uint32_t choose_initial_rays(std::uint32_t rays) {
  const std::uint32_t share = rays / kInitialRayDivisor;
  return share > 1 ? share / 2 * 2 : 1;
}

}  // namespace

const Hemispheres::RaySet& Hemispheres::outward_rays(std::uint32_t count) {
  RaySet& set = ray_sets_[count];
  set.falls_off = true;
  if (set.count == 0) upload_rays(set, count, 1);
  return set;
}

void Hemispheres::pick(const TexelBand& band, const DeviceCorrespondence& match,
                       std::span<const std::uint32_t> samples, std::optional<std::uint32_t> round) {
  const auto count = static_cast<std::uint32_t>(samples.size());
  const std::uint32_t capacity =
      (count + kPickGranularity - 1) / kPickGranularity * kPickGranularity;
  make_room(context_, picked_samples_.triangle, capacity);
  make_room(context_, picked_samples_.barycentric, std::size_t{2} * capacity);
  make_room(context_, picked_samples_.points, std::size_t{3} * capacity);
  make_room(context_, picked_match_.triangle, capacity);
  make_room(context_, picked_match_.barycentric, std::size_t{2} * capacity);
  make_room(context_, picked_rotations_, capacity);
  picked_samples_.sample_count = count;
  picked_samples_.capacity = picked_match_.capacity = capacity;
  make_room(context_, picked_indices_, capacity);
  picked_indices_.write(context_, samples);
  const kiln_pick_params params{count,    band.capacity,   match.capacity,
                                capacity, round ? 1U : 0U, round.value_or(0)};
  context_.launch(context_.kernel("hemisphere", "kiln_hemisphere_gather"), count, kLocal, params,
                  picked_indices_, band.triangle, band.barycentric, band.points, match.triangle,
                  match.barycentric, round ? keys_ : rotations_, picked_samples_.triangle,
                  picked_samples_.barycentric, picked_samples_.points, picked_match_.triangle,
                  picked_match_.barycentric, picked_rotations_);
}

void Hemispheres::rotate_picked(std::uint32_t count, std::uint32_t round,
                                cl::Array<std::uint32_t>& sample_rotations) {
  make_room(context_, sample_rotations, round_up_to_lanes(count));
  const kiln_pick_params params{count, 0, 0, 0, 1, round};
  context_.launch(context_.kernel("hemisphere", "kiln_hemisphere_renew_rotations"), count, kLocal,
                  params, picked_indices_, keys_, sample_rotations);
}

/// Prepares the denoiser for the texels of a band that have at least one sample with rays. The
/// first such sample of a texel gives its point.
Hemispheres::TexelSamples Hemispheres::prepare_filter(const TexelBand& band,
                                                      const DeviceCorrespondence& match,
                                                      bool second) {
  const std::vector<std::uint32_t>& index = reads_->read(band.texel_index, band.texel_count);
  const std::vector<std::uint32_t>& first =
      reads_->read(band.texel_first, band.texel_count + std::size_t{1});
  const std::vector<std::uint32_t>& triangle = reads_->read(match.triangle, band.sample_count);
  const std::vector<std::uint32_t>& low = reads_->read(band.triangle, band.sample_count);
  const auto has_rays = [&](std::uint32_t sample) {
    return triangle[sample] != KILN_NO_TRIANGLE || (keeps_misses_ && !second);
  };
  // A first pass counts samples and texels, so that each piece knows its offset in the output.
  struct Piece {
    std::size_t samples = 0, texels = 0;
  };
  const std::size_t texel_count = band.texel_count;
  std::vector<Piece> texel_pieces((texel_count + kTexelsPerPiece - 1) / kTexelsPerPiece + 1);
  parallel_for(texel_count, kTexelsPerPiece, [&](std::size_t begin, std::size_t end) {
    Piece& piece = texel_pieces[begin / kTexelsPerPiece + 1];
    for (std::size_t t = begin; t < end; ++t) {
      std::size_t count = 0;
      for (std::uint32_t s = first[t]; s < first[t + 1]; ++s) count += has_rays(s) ? 1 : 0;
      piece.samples += count;
      piece.texels += count > 0 ? 1 : 0;
    }
  });
  for (std::size_t p = 1; p < texel_pieces.size(); ++p) {
    texel_pieces[p].samples += texel_pieces[p - 1].samples;
    texel_pieces[p].texels += texel_pieces[p - 1].texels;
  }
  TexelSamples texel_samples;
  texel_samples.samples.resize(texel_pieces.back().samples);
  texel_samples.first.resize(texel_pieces.back().texels + 1);
  std::vector<std::uint32_t> representative(texel_pieces.back().texels),
      place(representative.size()), low_triangles(representative.size());
  parallel_for(texel_count, kTexelsPerPiece, [&](std::size_t begin, std::size_t end) {
    auto [to, at] = texel_pieces[begin / kTexelsPerPiece];
    for (std::size_t t = begin; t < end; ++t) {
      const std::size_t first_output = to;
      for (std::uint32_t s = first[t]; s < first[t + 1]; ++s) {
        if (has_rays(s)) texel_samples.samples[to++] = s;
      }
      if (to == first_output) continue;
      representative[at] = texel_samples.samples[first_output];
      place[at] = index[t];
      low_triangles[at] = low[representative[at]];
      texel_samples.first[++at] = static_cast<std::uint32_t>(to);
    }
  });
  if (representative.empty()) return texel_samples;
  if (!denoiser_) denoiser_.emplace(context_, surface_, width_, height_);
  upload();
  make_room(context_, picked_indices_, representative.size());
  picked_indices_.write(context_, representative);
  kiln_hemisphere_params params = ray_params(band, match, second, rays_out_);
  params.by_list = 1;
  params.count = static_cast<std::uint32_t>(representative.size());
  params.stride = params.plane = round_up_to_lanes(params.count);
  make_room(context_, texel_points_, std::size_t{KILN_HEMISPHERE_PLANES} * params.plane);
  make_points(params, band, match, texel_points_);
  denoiser_->prepare(
      {band.first_row, band.row_count, place, low_triangles, texel_points_, params.plane});
  context_.finish();
  return texel_samples;
}

void Hemispheres::cast_all(std::uint32_t rays, std::span<std::vector<std::uint32_t>* const> open,
                           Estimates& of) {
  const auto count = static_cast<std::uint32_t>(of.rays.size());
  const std::array<RotationsAndCounts, 2> both_estimates{
      RotationsAndCounts{&picked_rotations_, &picked_open_},
      RotationsAndCounts{&second_rotations_, &second_open_}};
  const std::span<const RotationsAndCounts> rotations =
      std::span(both_estimates).first(open.size());
  const std::array<cl::Array<std::uint32_t>*, 2> sample_rotations{&picked_rotations_,
                                                                  &second_rotations_};
  const std::array<cl::Array<std::uint32_t>*, 2> counts{&picked_open_, &second_open_};
  for (std::size_t i = 0; i < open.size(); ++i) {
    rotate_picked(count, of.next_seed++, *sample_rotations[i]);
    make_room(context_, *counts[i], round_up_to_lanes(count));
    context_.fill(*counts[i], std::uint32_t{0});
  }
  cast_texels(count, outward_rays(rays), rotations);
  for (std::size_t i = 0; i < open.size(); ++i) counts[i]->read(context_, *open[i]);
}

void Hemispheres::estimate(Estimates& of, const std::vector<std::uint32_t>& texels,
                           std::uint32_t rays, std::span<std::vector<std::uint32_t>* const> open) {
  if (rays == 0) return;
  std::vector<std::uint32_t> samples, rounds;
  samples.reserve(of.shared.samples.size());
  for (const std::uint32_t t : texels) {
    samples.insert(samples.end(), of.shared.samples.begin() + of.shared.first[t],
                   of.shared.samples.begin() + of.shared.first[t + 1]);
  }
  for (std::size_t i = 0; i < open.size(); ++i) rounds.push_back(of.next_seed++);
  const std::vector<RayCounts> ray_counts =
      cast_rounds(of.band, of.match, of.second, samples, rays, rounds);
  for (std::size_t i = 0; i < open.size(); ++i) {
    for (const std::uint32_t t : texels) {
      for (std::size_t s = of.shared.first[t]; s < of.shared.first[t + 1]; ++s) {
        (*open[i])[t] += ray_counts[i].open[of.shared.samples[s]];
      }
    }
  }
}

AoDenoiser::Result Hemispheres::denoise_estimates(const Estimates& of, double plain_variance) {
  const std::size_t texels = of.rays.size();
  const auto pairs = std::make_unique_for_overwrite<float[]>(2 * texels);
  parallel_for(texels, kTexelsPerPiece, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const double variance_share =
          static_cast<double>(of.rays[t]) * (of.shared.first[t + 1] - of.shared.first[t]);
      pairs[2 * t] = static_cast<float>(of.a[t] / variance_share);
      pairs[2 * t + 1] = static_cast<float>(of.b[t] / variance_share);
    }
  });
  return denoiser_->run({pairs.get(), 2 * texels}, plain_variance);
}

/// Casts more rays where they reduce the total error at the lowest cost. If a texel has the error e
/// with n rays, e^2 falls as 1 / n, so the optimal number of rays is proportional to e sqrt(n).
/// Texels that go from the same old to the same new number of rays are cast in one batch.
/// \returns true if any rays were cast
bool Hemispheres::cast_more_rays(Estimates& of, const AoDenoiser::Result& last,
                                 const std::vector<float>& previous_errors) {
  double squared_errors = 0, error_roots = 0;
  for (const float error : last.errors) squared_errors += static_cast<double>(error) * error;
  const auto texel_count = static_cast<double>(of.rays.size());
  const double target_error = kTargetErrorShare * max_error_ * kTargetErrorShare * max_error_;
  if (squared_errors / texel_count <= target_error) return false;
  for (std::size_t t = 0; t < of.rays.size(); ++t) {
    error_roots += last.errors[t] * std::sqrt(of.rays[t]);
  }
  of.has_converged.resize(of.rays.size());
  of.cast_round.resize(of.rays.size());
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::uint32_t>> groups;
  for (std::uint32_t t = 0; t < of.rays.size(); ++t) {
    // More rays did not reduce this texel's error, so noise is not its cause.
    if (!previous_errors.empty() && last.errors[t] > kMaxRemainingError * previous_errors[t] &&
        of.round == of.cast_round[t]) {
      of.has_converged[t] = 1;
    }
    if (of.has_converged[t] != 0) continue;
    const double optimal_growth =
        error_roots / texel_count / target_error * last.errors[t] / std::sqrt(of.rays[t]);
    if (optimal_growth <= 1) continue;
    std::uint32_t growth_factor = 2;
    while (growth_factor < kMaxGrowth && growth_factor * std::numbers::sqrt2 < optimal_growth)
      growth_factor *= 2;
    while (growth_factor > 1 && 2 * growth_factor * of.rays[t] > kMaxAddedRays) growth_factor /= 2;
    if (growth_factor > 1) groups[{of.rays[t], growth_factor}].push_back(t);
  }
  ++of.round;
  for (const auto& [key, texels] : groups) {
    const auto [rays, growth_factor] = key;
    for (const std::uint32_t t : texels) {
      of.a[t] += of.b[t];
      of.b[t] = 0;
      of.rays[t] = rays * growth_factor;
      of.cast_round[t] = of.round;
    }
    estimate(of, texels, rays * (growth_factor - 2), std::array{&of.a});
    estimate(of, texels, rays * growth_factor, std::array{&of.b});
  }
  return !groups.empty();
}

/// Recomputes unsure texels, which smoothing may have blurred, from OcclusionOptions::rays rays
/// without smoothing. Where the result shows that smoothing did blur, texels nearby are recomputed,
/// too, until no more blur is found.
void Hemispheres::cast_unsure(const Estimates& of, AoDenoiser::Result& result) {
  std::vector<std::uint32_t> texels;
  for (std::size_t t = 0; t < result.unsure.size(); ++t) {
    if (result.unsure[t] != 0) texels.push_back(static_cast<std::uint32_t>(t));
  }
  if (texels.empty()) return;
  make_rotations(of.band);
  std::vector<RayCounts> plain_ray_counts(1);
  plain_ray_counts[0].open.resize(of.band.sample_count);
  std::vector<std::uint32_t> samples;
  // For each result of blur_reach(), the texels that have it
  std::array<std::vector<std::uint32_t>, 3> blurred_by_reach;
  while (!texels.empty()) {
    samples.clear();
    for (std::vector<std::uint32_t>& list : blurred_by_reach) list.clear();
    for (const std::uint32_t t : texels) {
      samples.insert(samples.end(), of.shared.samples.begin() + of.shared.first[t],
                     of.shared.samples.begin() + of.shared.first[t + 1]);
    }
    for (const OccluderGroup& group : group_samples(of.band, of.match, of.second, samples)) {
      cast_group(group, of.band, of.match, of.second, rays_out_, {}, plain_ray_counts);
    }
    for (const std::uint32_t t : texels) {
      double open = 0;
      for (std::size_t s = of.shared.first[t]; s < of.shared.first[t + 1]; ++s) {
        open += plain_ray_counts[0].open[of.shared.samples[s]];
      }
      const auto share = static_cast<float>(open / rays_out_.count /
                                            (of.shared.first[t + 1] - of.shared.first[t]));
      blurred_by_reach[AoDenoiser::blur_reach(share, result.shares[t], result.plain_variance[t])]
          .push_back(t);
      result.shares[t] = share;
    }
    texels.clear();
    for (std::uint32_t reach = 1; reach < blurred_by_reach.size(); ++reach) {
      const auto added = denoiser_->mark_nearby(blurred_by_reach[reach], reach, result.unsure);
      texels.insert(texels.end(), added.begin(), added.end());
    }
    std::sort(texels.begin(), texels.end());
  }
}

std::vector<float> Hemispheres::visibility_within_error(const TexelBand& band,
                                                        const DeviceCorrespondence& match,
                                                        bool second) {
  make_keys(band);
  std::vector<float> shares(band.sample_count);
  Estimates of{band, match, second, prepare_filter(band, match, second), {}, {}, {}, {}, {}};
  const std::size_t texels = of.shared.first.size() - 1;
  if (texels == 0) return shares;
  const bool casts_all =
      of.shared.has_one_sample_a_texel() && parts_ == nullptr && occluders().are_cast_in_one_step();
  if (casts_all) {
    for (auto* const array :
         {&picked_rotations_, &second_rotations_, &picked_open_, &second_open_}) {
      make_room(context_, *array, round_up_to_lanes(static_cast<std::uint32_t>(texels)));
    }
  }
  // Checks all memory in advance, so that it cannot run out after rays were cast.
  const bool smooths_alone = max_error_ >= kMinErrorToSmoothOnly;
  require_memory("Smoothing ambient occlusion",
                 (AoDenoiser::kBytesPerTexel + kBytesPerTexel +
                  (smooths_alone ? AoDenoiser::kBytesPerTexelToFindUnsure : 0)) *
                         texels +
                     (scratch_.empty() ? kBytesPerLaunch : 0));
  of.a.resize(texels);
  of.b.resize(texels);
  of.rays.assign(texels, choose_initial_rays(rays_out_.count));
  if (casts_all) {
    cast_all(of.rays[0], std::array{&of.a, &of.b}, of);
  } else {
    std::vector<std::uint32_t> all_texels(texels);
    std::iota(all_texels.begin(), all_texels.end(), 0U);
    estimate(of, all_texels, of.rays[0], std::array{&of.a, &of.b});
  }
  AoDenoiser::Result result =
      denoise_estimates(of, smooths_alone ? plain_variance(of.rays[0], rays_out_.count) : 0);
  if (smooths_alone) {
    cast_unsure(of, result);
  } else {
    std::vector<float> previous_errors;
    while (cast_more_rays(of, result, previous_errors)) {
      previous_errors = std::move(result.errors);
      result = denoise_estimates(of, 0);
    }
  }
  parallel_for(texels, kTexelsPerPiece, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      for (std::size_t s = of.shared.first[t]; s < of.shared.first[t + 1]; ++s) {
        shares[of.shared.samples[s]] = result.shares[t];
      }
    }
  });
  return shares;
}

}  // namespace kiln
