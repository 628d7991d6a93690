#include "match/cage_reach.h"

#include <algorithm>
#include <span>
#include <string>

#include "base/formatted.h"
#include "match/surface_places.h"
#include "mesh/vector.h"
#include "texel/host_correspondence.h"

namespace kiln {
namespace {

constexpr std::size_t kHullTestPoints =
    1
    // number of points at which a hull is tested before the bake
    << 14;
constexpr float kMaxHullDistance = 4;  // Frame units; larger than the size of any mesh
constexpr float kMaxContactDistance = 8 * KILN_BVH_EPSILON;

struct DistanceRange {
  double min_distance = 0, median = 0, max_distance = 0;
};

DistanceRange distance_range(std::vector<float> values, double unit) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  return {double{values.front()} * unit, double{values[values.size() / 2]} * unit,
          double{values.back()} * unit};
}

}  // namespace

CageReach::CageReach(cl::Context& context, const Frame& frame, LowSurface& surface)
    : frame_(frame) {
  if (!surface.has_cage_mesh || surface.cage_kind == CageKind::offsets) return;
  has_cage_mesh_ = true;
  if (surface.cage_kind == CageKind::shells) {
    outer_shell_heights_ = cl::Array<float>(context, std::span<const float>(surface.shell(false)));
    return;
  }
  hull_ = surface.cage_hull;
  rays_ = std::make_unique<RayCaster>(context, hull_->positions, hull_->triangles);
  const SampledPoints test_points = spread_points(context, surface, kHullTestPoints);
  hull_distances_ = write_hull_distances(context, test_points.band.points,
                                         test_points.band.sample_count, test_points.band.capacity);
  for (const float distance : hull_distances_) {
    surface.cage_length = std::max(surface.cage_length, 2 * double{distance});
  }
}

void CageReach::write_sample_reach(cl::Context& context, TexelBand& band) const {
  if (!has_cage_mesh_ || band.sample_count == 0) return;
  if (hull_ == nullptr) {
    context.launch(context.kernel("turn", "kiln_texel_write_reach"), band.sample_count, kLocal,
                   band.sample_count, band.capacity, outer_shell_heights_, band.triangle,
                   band.barycentric, band.points);
    return;
  }
  const std::vector<float> hull_distances =
      write_hull_distances(context, band.points, band.sample_count, band.capacity);
  band.points.write(context, std::span<const float>(hull_distances),
                    std::size_t{6} * band.capacity);
}

std::vector<float> CageReach::write_hull_distances(cl::Context& context,
                                                   const cl::Array<float>& points,
                                                   std::uint32_t count,
                                                   std::uint32_t capacity) const {
  RayQuery query;
  query.t_min = -kMaxContactDistance;
  query.t_max = kMaxHullDistance;
  query.two_sided = true;
  DeviceCorrespondence hits(context, count);
  rays_->intersect(points, count, capacity, query, hits);
  const HostCorrespondence correspondence(context, hits, count);
  std::vector<float> planes(std::size_t{7} * capacity), hull_distances(count);
  points.read(context, planes);
  const std::size_t plane = capacity;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3d d{planes[3 * plane + i], planes[4 * plane + i], planes[5 * plane + i]};
    bool leaves_hull = false;
    if (correspondence.triangle[i] != KILN_NO_TRIANGLE) {
      const Triangle& t = hull_->triangles[correspondence.triangle[i]];
      const Vec3d a = to_double(hull_->positions[t[0]]);
      leaves_hull =
          dot(cross(to_double(hull_->positions[t[1]]) - a, to_double(hull_->positions[t[2]]) - a),
              d) > 0;
    }
    hull_distances[i] = std::max(0.0F, correspondence.distance[i]);
    if (leaves_hull) continue;
    const auto world = [&](std::size_t axis) {
      return double{planes[axis * plane + i]} / frame_.scale + frame_.center[axis];
    };
    throw Error(
        ErrorCode::input,
        "The cage '" + hull_->name + "' does not enclose the low poly: from " +
            place_text(world(0), world(1), world(2)) + " along " + place_text(d.x, d.y, d.z) +
            " a ray hits none of its triangles. " +
            (hull_->mismatch.empty()
                 ? "It has " + std::to_string(hull_->triangles.size()) +
                       " triangles, not the low poly's " + std::to_string(hull_->low_triangles)
                 : "It is no copy of the low poly: " + hull_->mismatch) +
            (hull_->mismatch.empty() ? " in their order" : "") +
            ", so it must be a closed hull with its faces outward. Enlarge "
            "it there; or copy the low poly and move its vertices.");
  }
  return hull_distances;
}

std::optional<CageReport> CageReach::report(const LowSurface& surface) const {
  if (!surface.has_cage_mesh) return std::nullopt;
  const double unit = 1 / frame_.scale;
  std::vector<float> outward = hull_distances_, inward;
  for (std::size_t t = 0; t < surface.triangles.size() && hull_ == nullptr; ++t) {
    if (surface.usable[t] == 0) continue;
    for (const LowSurface::Corner& corner : surface.triangles[t]) {
      const bool shells = surface.cage_kind == CageKind::shells;
      outward.push_back(shells ? corner.outward
                               : static_cast<float>(length(to_double(corner.direction))));
      if (shells) inward.push_back(corner.inward);
    }
  }
  const DistanceRange out = distance_range(std::move(outward), unit),
                      in = distance_range(std::move(inward), unit);
  return CageReport{surface.cage_kind, out.min_distance, out.median,     out.max_distance,
                    in.min_distance,   in.median,        in.max_distance};
}

}  // namespace kiln
