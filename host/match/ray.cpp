// Rays along the low poly's normals (Tarini, Cignoni, Scopigno, section 3.2), or from a cage.
#include "match/ray.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "match/extended_range.h"
#include "match/fallback.h"
#include "match/outermost.h"
#include "match/smooth_normal_retry.h"
#include "mesh/charts.h"

namespace kiln {
namespace {

class RayMatcher : public Matcher {
 public:
  RayMatcher(const RaySearch& rays, const RayQuery& query) : rays_(rays), query_(query) {}

  void run(const TexelBand& band, DeviceCorrespondence& match) override {
    if (band.sample_count == 0) return;
    rays_.intersect(band.points, band.sample_count, band.capacity, query_, match);
  }

 private:
  const RaySearch& rays_;
  RayQuery query_;
};

/// Rays from an outer shell to an inner one.
class ShellMatcher : public Matcher {
 public:
  ShellMatcher(std::unique_ptr<Matcher> rays, const MatchRequest& request)
      : context_(context_of(request.source.device)), rays_(std::move(rays)) {
    inner_shell_heights_ =
        cl::Array<float>(context_, std::span<const float>(request.surface.shell(true)));
  }

  void run(const TexelBand& band, DeviceCorrespondence& match) override {
    if (band.sample_count == 0) return;
    rays_->run(band, match);
    context_.launch(context_.kernel("match", "kiln_match_reject_deep"), band.sample_count, kLocal,
                    band.sample_count, band.capacity, match.capacity, inner_shell_heights_,
                    band.triangle, band.barycentric, band.points, match.triangle, match.barycentric,
                    match.distance, match.status);
  }

  bool needs_whole_texels() const override { return true; }  // reads the triangle of each sample

 private:
  cl::Context& context_;
  std::unique_ptr<Matcher> rays_;
  cl::Array<float> inner_shell_heights_;
};

/// Makes the matcher of the requested RayRule.
std::unique_ptr<Matcher> make_ray_matcher(const MatchRequest& request) {
  const bool cage = request.cage_mesh || request.cage.has_value();
  if (!cage && request.ray.rule == RayRule::outermost) return outermost_matcher(request);
  return std::make_unique<RayMatcher>(request.source.ray_search(), ray_query(request, true));
}

/// Makes a matcher that searches within near_distance first, and then within the full distance for
/// samples that miss.
std::unique_ptr<Matcher> make_near_ray_matcher(const MatchRequest& request) {
  MatchRequest near_request = request;
  near_request.distance = request.near_distance;
  std::vector<std::unique_ptr<Matcher>> farther_matchers;
  farther_matchers.push_back(make_ray_matcher(request));
  return with_fallbacks(context_of(request.source.device), make_ray_matcher(near_request),
                        std::move(farther_matchers));
}

/// Number of the high poly's triangles per sample, assuming that the map covers them all. 0 without
/// UVs.
double triangles_per_sample(const MatchRequest& request) {
  double area = 0;
  for (const std::uint32_t t : request.surface.with_uvs) {
    const auto& [a, b, c] = request.surface.triangles[t];
    area += uv_area(a.uv, b.uv, c.uv);
  }
  const double samples =
      std::min(area, 1.0) * request.width * request.height * request.samples * request.samples;
  return samples >= 1 ? static_cast<double>(request.source.stats().triangles) / samples : 0;
}

}  // namespace

RayQuery ray_query(const MatchRequest& request, bool with_cage) {
  const auto distance = static_cast<float>(request.distance);
  RayQuery query;
  query.two_sided = request.two_sided;
  query.t_max = distance;
  query.triangles_per_ray = triangles_per_sample(request);
  if (with_cage && (request.cage_mesh || request.cage)) {
    query.inward = true;
    query.use_reach = request.cage_mesh;
    if (request.cage) query.offset = static_cast<float>(*request.cage);
  } else {
    query.t_min = -distance;
    query.outward_first = true;
  }
  return query;
}

MatchRow ray_match() {
  MatchRow row;
  row.info.method = MatchMethod::ray;
  row.info.searches = "along the low poly's normal, outward first; from a cage inward";
  row.info.options =
      "match.max_distance match.near_distance match.cage match.cage_mesh match.ray match.parts "
      "report.recall";
  row.is_refittable = row.uses_sheet_distance = row.is_good_fallback =
      row.supports_large_high_poly = true;
  row.info.other_names = "rays raycast raycasting raytrace raytracing";
  row.plan_order = row.low_poly_order = 1;
  row.make = [](const MatchRequest& request, MatchNotes&) -> std::unique_ptr<Matcher> {
    const bool cage = request.cage_mesh || request.cage.has_value();
    const bool has_near_search =
        !cage && request.near_distance > 0 && request.near_distance < request.distance;
    std::unique_ptr<Matcher> rays =
        has_near_search ? make_near_ray_matcher(request) : make_ray_matcher(request);
    if (request.cage_mesh && request.surface.cage_kind == CageKind::shells) {
      rays = std::make_unique<ShellMatcher>(std::move(rays), request);
    }
    if (request.blends_directions) rays = smooth_normal_retry(std::move(rays), request);
    return request.max_sheet_distance > 0 ? make_extended_range_matcher(std::move(rays), request)
                                          : std::move(rays);
  };
  return row;
}

}  // namespace kiln
