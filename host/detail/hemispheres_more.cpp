// Ambient occlusion to a given error: blocks of samples cast until they agree with themselves.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "detail/hemisphere_rays.h"
#include "detail/hemispheres.h"

namespace kiln {
namespace {

constexpr std::size_t kLocal = 64, kLocalLanes = 8;
constexpr std::uint32_t kLanes = KILN_HEMISPHERE_LANES;
// Samples that stop together: a block of the map, since samples are ordered so.
constexpr std::uint32_t kBlock = 64;
constexpr std::uint32_t kMostRays = 4096;
// Samples that are copied together: 42 MB.
constexpr std::size_t kPicked = std::size_t{1} << 20;
// An odd number near the golden ratio of all turns and sets: each round's rays lie between those before.
constexpr std::uint32_t kMoreTurn = 5063;

}  // namespace

const Hemispheres::RaySet& Hemispheres::outward_rays(std::uint32_t count) {
  RaySet& set = more_rays_[count];
  if (set.count == 0) upload_rays(set, count, 1);
  return set;
}

std::vector<std::uint32_t> Hemispheres::cast_more(const TexelBand& band,
                                                  const Correspondence& match, bool second,
                                                  std::span<const std::uint32_t> samples,
                                                  std::uint32_t rays, std::uint32_t round) {
  const auto count = static_cast<std::uint32_t>(samples.size());
  const std::uint32_t capacity = (count + kBlock - 1) / kBlock * kBlock;
  make_room(context_, some_.triangle, capacity);
  make_room(context_, some_.barycentric, std::size_t{2} * capacity);
  make_room(context_, some_.points, std::size_t{3} * capacity);
  make_room(context_, some_match_.triangle, capacity);
  make_room(context_, some_match_.barycentric, std::size_t{2} * capacity);
  make_room(context_, some_turns_, capacity);
  make_room(context_, some_open_, capacity);
  some_.sample_count = count;
  some_.capacity = some_match_.capacity = capacity;
  const cl::Array<std::uint32_t> picked(context_, samples);
  const kiln_pick_params params{count, band.capacity, match.capacity, capacity, round * kMoreTurn};
  context_.launch(context_.kernel("hemisphere", "kiln_hemisphere_pick"), count, kLocal, params,
                  picked, band.triangle, band.barycentric, band.points, match.triangle,
                  match.barycentric, turns_, some_.triangle, some_.barycentric, some_.points,
                  some_match_.triangle, some_match_.barycentric, some_turns_);
  context_.fill(some_open_, std::uint32_t{0});
  const RayCaster& caster = source_.rays();
  const RayQuery query = query_up_to(occluding_, back_faces_);
  const cl::Kernel open = context_.kernel("hemisphere", "kiln_hemisphere_open");
  over_rays(some_, some_match_, second, outward_rays(rays), some_turns_,
            [&](const kiln_hemisphere_params& of, std::uint32_t all) {
              make_room(context_, hits_, ray_capacity_);
              caster.occluded(rays_, all, ray_capacity_, query, hits_);
              context_.launch(open, of.stride / kLanes, kLocalLanes, of, hits_, some_open_);
            });
  std::vector<std::uint32_t> result(count);
  some_open_.read(context_, result);
  return result;
}

std::vector<float> Hemispheres::open_within(const TexelBand& band, const Correspondence& match,
                                            bool second) {
  make_turns(band);
  const std::vector<std::uint32_t>& triangle = reads_->read(match.triangle, band.sample_count);
  std::vector<std::uint32_t> active;
  for (std::uint32_t s = 0; s < band.sample_count; ++s) {
    if (triangle[s] != KILN_NO_TRIANGLE || (keep_ && !second)) active.push_back(s);
  }
  std::vector<std::uint32_t> open(band.sample_count), rays(band.sample_count);
  std::uint32_t total = 0;  // of the samples that are active
  for (std::uint32_t round = 0; !active.empty() && total < kMostRays; ++round) {
    const std::uint32_t wanted = round == 0 ? std::max(1U, rays_out_.count / 2) : total;
    const std::uint32_t now = std::min(wanted, kMostRays - total);
    std::vector<std::uint32_t> hit;
    for (std::size_t first = 0; first < active.size(); first += kPicked) {
      const auto some = std::span(active).subspan(first, std::min(kPicked, active.size() - first));
      const std::vector<std::uint32_t> of = cast_more(band, match, second, some, now, round);
      hit.insert(hit.end(), of.begin(), of.end());
    }
    std::vector<std::uint32_t> next;
    for (std::size_t begin = 0, end = 0; begin < active.size(); begin = end) {
      double squares = 0;
      for (; end < active.size() && active[end] / kBlock == active[begin] / kBlock; ++end) {
        const std::uint32_t s = active[end];
        if (round != 0) {
          const double apart =
              static_cast<double>(open[s]) / total - static_cast<double>(hit[end]) / now;
          squares += apart * apart;
        }
        open[s] += hit[end];
        rays[s] += now;
      }
      // Of two means that err alike and apart, the mean errs by half their difference.
      const double error = std::sqrt(squares / static_cast<double>(end - begin)) / 2;
      if (round != 0 && error <= max_error_) continue;
      next.insert(next.end(), active.begin() + static_cast<std::ptrdiff_t>(begin),
                  active.begin() + static_cast<std::ptrdiff_t>(end));
    }
    total += now;
    active = std::move(next);
  }
  std::vector<float> shares(band.sample_count);
  for (std::size_t s = 0; s < shares.size(); ++s) {
    if (rays[s] != 0) shares[s] = static_cast<float>(static_cast<double>(open[s]) / rays[s]);
  }
  return shares;
}

}  // namespace kiln
