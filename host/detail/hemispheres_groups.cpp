// Rays of some samples of a band, each against what occludes it: all, or its own part.
#include <algorithm>
#include <numeric>

#include "detail/hemisphere_rays.h"
#include "detail/hemispheres.h"

namespace kiln {
namespace {

constexpr std::size_t kLocalLanes = 8;
// Samples that are copied together: 42 MB.
constexpr std::size_t kPicked = std::size_t{1} << 20;
// An odd number near the golden ratio of all turns and sets: each round's rays lie between those before.
constexpr std::uint32_t kMoreTurn = 5063;

}  // namespace

const RayCaster& Hemispheres::occluders_of(std::uint32_t part) {
  if (const auto known = part_occluders_.find(part); known != part_occluders_.end()) {
    return known->second;
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
  for (const Mesh& other : others_) {
    for (const Triangle& t : other.triangles) add_all(other.positions, t);
  }
  for (std::size_t t = 0; by_low_ && t < surface_.triangles.size(); ++t) {
    const auto& [a, b, c] = surface_.triangles[t];
    if (surface_.usable[t] != 0 && parts_->low[t] == part) add(a.position, b.position, c.position);
  }
  return part_occluders_.try_emplace(part, context_, positions, triangles, source_.traversal)
      .first->second;
}

std::vector<Hemispheres::Group> Hemispheres::groups(const TexelBand& band,
                                                    const Correspondence& match, bool second,
                                                    std::span<const std::uint32_t> samples) {
  if (parts_ == nullptr) return {{&occluders(), {samples.begin(), samples.end()}}};
  const std::vector<std::uint32_t>& low = reads_->read(band.triangle, band.sample_count);
  const std::vector<std::uint32_t>& found = reads_->read(match.triangle, band.sample_count);
  std::map<std::uint32_t, std::vector<std::uint32_t>> by_part;
  for (const std::uint32_t sample : samples) {
    const bool has_rays = found[sample] != KILN_NO_TRIANGLE || (keep_ && !second);
    if (has_rays) by_part[parts_->low[low[sample]]].push_back(sample);
  }
  std::vector<Group> result;
  for (auto& [part, list] : by_part) result.push_back({&occluders_of(part), std::move(list)});
  return result;
}

void Hemispheres::cast_group(const Group& group, const TexelBand& band, const Correspondence& match,
                             bool second, const RaySet& set, std::uint32_t turn, Counted& counted) {
  const RayQuery query = query_up_to(beyond_, back_faces_);  // of the light's rays
  const cl::Kernel lit = context_.kernel("hemisphere", "kiln_hemisphere_lit");
  const cl::Array<float> no_lean;
  const std::size_t plane = plane_of(band);
  const std::span<const std::uint32_t> samples = group.samples;
  for (std::size_t first = 0; first < samples.size(); first += kPicked) {
    const auto part = samples.subspan(first, std::min(kPicked, samples.size() - first));
    pick(band, match, part, turn);
    const std::size_t own = plane_of(some_);
    make_room(context_, some_open_, own);
    context_.fill(some_open_, std::uint32_t{0});
    if (!counted.lean.empty()) {
      make_room(context_, some_lean_, 3 * own);
      context_.fill(some_lean_, 0.0F);
    }
    if (set.lit) {
      over_rays(some_, some_match_, second, set, some_turns_, false,
                [&](const kiln_hemisphere_params& of, std::uint32_t all) {
                  make_room(context_, hits_, ray_capacity_);
                  group.caster->occluded(rays_, all, ray_capacity_, query, hits_);
                  context_.launch(lit, of.stride / kLanes, kLocalLanes, of, hits_, rays_,
                                  some_open_);
                });
    } else {
      count_open(some_, some_match_, second, set, some_turns_, *group.caster, some_open_,
                 counted.lean.empty() ? no_lean : some_lean_);
    }
    std::vector<std::uint32_t> read(part.size());
    some_open_.read(context_, std::span(read));
    for (std::size_t i = 0; i < part.size(); ++i) counted.open[part[i]] = read[i];
    if (counted.lean.empty()) continue;
    std::vector<float> leans(3 * own);
    some_lean_.read(context_, std::span(leans));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < part.size(); ++i) {
        counted.lean[axis * plane + part[i]] = leans[axis * own + i];
      }
    }
  }
}

Hemispheres::Counted Hemispheres::cast_parts(const TexelBand& band, const Correspondence& match,
                                             bool second, const RaySet& set, bool lean) {
  Counted counted;
  counted.open.resize(plane_of(band));
  if (lean) counted.lean.resize(std::size_t{3} * plane_of(band));
  make_turns(band);
  std::vector<std::uint32_t> all(band.sample_count);
  std::iota(all.begin(), all.end(), 0U);
  for (const Group& group : groups(band, match, second, all)) {
    cast_group(group, band, match, second, set, 0, counted);
  }
  return counted;
}

std::vector<std::uint32_t> Hemispheres::cast_more(const TexelBand& band,
                                                  const Correspondence& match, bool second,
                                                  std::span<const std::uint32_t> samples,
                                                  std::uint32_t rays, std::uint32_t round) {
  Counted counted;
  counted.open.resize(band.sample_count);
  for (const Group& group : groups(band, match, second, samples)) {
    cast_group(group, band, match, second, outward_rays(rays), round * kMoreTurn, counted);
  }
  std::vector<std::uint32_t> result;
  result.reserve(samples.size());
  for (const std::uint32_t sample : samples) result.push_back(counted.open[sample]);
  return result;
}

}  // namespace kiln
