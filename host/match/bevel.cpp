#include "match/bevel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "accel/ray.h"
#include "base/parallel.h"
#include "mesh/vector.h"
#include "texel/host_correspondence.h"

namespace kiln {
namespace {

// Rays from points along each edge, at several distances from it, measure the angle between the high
// poly and the face. A bevel ends at the first distance at which the median angle over these points is
// below kMaxParallelDegrees, or, for faces that are nowhere parallel, below kMaxAngleOverMedian times
// the median angle of the outer distances.
constexpr std::size_t kEdgeDistances = 24;
constexpr std::size_t kMaxPointsPerEdge = 8;
// Maximum number of measured edges; of more edges, only every n-th is measured
constexpr std::size_t kMaxMeasuredEdges = 4096;
constexpr std::size_t kTargetRayCount = 1 << 18;  // approximate number of rays of a batch
constexpr double kMaxParallelDegrees = 5;
constexpr double kMaxAngleOverMedian = 1.25;
// Maximum distance from an edge, minimum blend width, and blend width without an estimate, as
// shares of the high poly's diagonal.
constexpr double kMaxEdgeDistance = 0.04, kMinBlendWidth = 0.0005, kDefaultBlendWidth = 0.01;
// The blend width is the larger of these multiples of the bevel's width and of the high poly's height.
constexpr double kBlendWidthPerBevel = 0.4;
constexpr double kBlendWidthPerGap = 2;
constexpr double kDegreesPerRadian = 180 / 3.14159265358979323846;
constexpr double kNoBevel = std::numeric_limits<double>::infinity();

double edge_distance(std::size_t ring, double max_edge_distance) {
  const double share = static_cast<double>(ring + 1) / kEdgeDistances;
  return max_edge_distance * share * share;
}

/// Median of a list; infinity if it is empty.
double median(std::vector<double> values) {
  if (values.empty()) return kNoBevel;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// A point near an edge of a face of the low poly, and the ray direction there. If the point lies outside of the face,
/// its direction is 0.
struct EdgeSidePoint {
  Vec3 position, direction;
};

/// Makes the point on one of an edge's faces at `share` of the edge's length and at a distance of
/// `distance_from_edge` from the edge.
EdgeSidePoint point_beside_edge(const std::array<LowSurface::Corner, 3>& face,
                                const HardEdges::Edge& edge, double share,
                                double distance_from_edge) {
  const Vec3d along = to_double(edge.along), a = to_double(face[0].position);
  const Vec3d ab = to_double(face[1].position) - a, ac = to_double(face[2].position) - a;
  const Vec3d normal = cross(ab, ac);
  Vec3d inward_direction = cross(normal, along);
  const Vec3d middle = a + (ab + ac) * (1.0 / 3);
  if (dot(inward_direction, middle - to_double(edge.from)) < 0)
    inward_direction = -inward_direction;
  const Vec3d p = to_double(edge.from) + along * share +
                  inward_direction * (distance_from_edge / length(inward_direction));
  const double area = dot(normal, normal);
  const double u = dot(cross(p - a, ac), normal) / area, v = dot(cross(ab, p - a), normal) / area;
  if (!(u >= 0 && v >= 0 && u + v <= 1)) return {};
  const Vec3d direction = to_double(face[0].normal) * (1 - u - v) + to_double(face[1].normal) * u +
                          to_double(face[2].normal) * v;
  const double size = length(direction);
  if (!(size > 1e-6)) return {};
  return {to_float(p), to_float(direction * (1 / size))};
}

/// Measurements of rays on one side of an edge, for each distance from the edge: the angles between
/// high poly and face, and the gaps (heights of the high poly above the face).
struct SideProfile {
  std::array<std::vector<double>, kEdgeDistances> angles, gaps;

  struct BevelEnd {
    /// Distance from the edge at which the bevel ends; infinity if no bevel was found
    double bevel = kNoBevel;
    double gap = 0;  ///< Outward height of the high poly at that distance
  };

  BevelEnd find_bevel_end(double max_edge_distance) const {
    std::array<double, kEdgeDistances> median_angles{};
    std::size_t last = 0;
    for (std::size_t r = 0; r < kEdgeDistances; ++r) {
      median_angles[r] = median(angles[r]);
      if (median_angles[r] < kNoBevel) last = r;
    }
    std::vector<double> outer_angles;  // Median angles at the outer half of the distances
    for (std::size_t r = 0; r <= last; ++r) {
      if (median_angles[r] < kNoBevel && 2 * edge_distance(r, 1) >= edge_distance(last, 1)) {
        outer_angles.push_back(median_angles[r]);
      }
    }
    const double parallel =
        std::max(kMaxParallelDegrees, kMaxAngleOverMedian * median(outer_angles));
    for (std::size_t r = 0; r < kEdgeDistances && !outer_angles.empty(); ++r) {
      if (!(median_angles[r] <= parallel)) continue;
      // A bevel that ends before the smallest measured distance has width 0.
      return {r == 0 ? 0 : edge_distance(r, max_edge_distance), std::max(0.0, median(gaps[r]))};
    }
    return {};
  }
};

/// Casts rays from points near edges, and collects the angles and gaps that they measure.
class BevelProbes {
 public:
  BevelProbes(const Source::Impl& high, const LowSurface& surface, double max_edge_distance,
              const Parts* parts)
      : high_(high), surface_(surface), max_edge_distance_(max_edge_distance), parts_(parts) {}

  /// Measures the profiles of both sides of edges [begin, end) of a list.
  std::vector<std::array<SideProfile, 2>> measure_profiles(const HardEdges& hard, std::size_t begin,
                                                           std::size_t end, std::size_t stride,
                                                           std::size_t points_per_edge,
                                                           double reach) const {
    const std::size_t rays_per_side = points_per_edge * kEdgeDistances;
    const auto count = static_cast<std::uint32_t>((end - begin) * 2 * rays_per_side);
    std::vector<float> planes(7 * std::size_t{count}, 0.0F);
    parallel_for(count, 4096, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        const HardEdges::Edge& edge = hard.edges[(begin + i / (2 * rays_per_side)) * stride];
        const std::size_t side = i / rays_per_side % 2,
                          along = i / kEdgeDistances % points_per_edge;
        const EdgeSidePoint edge_point = point_beside_edge(
            surface_.triangles[edge.faces[side]], edge,
            (static_cast<double>(along) + 0.5) / static_cast<double>(points_per_edge),
            edge_distance(i % kEdgeDistances, max_edge_distance_));
        const Vec3 &p = edge_point.position, &d = edge_point.direction;
        const float values[6] = {p.x, p.y, p.z, d.x, d.y, d.z};
        for (std::size_t k = 0; k < 6; ++k) planes[k * count + i] = values[k];
      }
    });
    cl::Context& context = context_of(high_.device);
    const cl::Array<float> points(context, std::span<const float>(planes));
    DeviceCorrespondence device_hits(context, count);
    RayQuery query;
    query.t_min = -static_cast<float>(reach);
    query.t_max = static_cast<float>(reach);
    query.outermost = true;
    high_.ray_search().intersect(points, count, count, query, device_hits);
    const HostCorrespondence hits(context, device_hits, count);
    const std::vector<std::array<Vec3, 3>> corners = high_.corners_of(hits.triangle);
    std::vector<std::array<SideProfile, 2>> profiles(end - begin);
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3d direction{planes[3 * std::size_t{count} + i], planes[4 * std::size_t{count} + i],
                            planes[5 * std::size_t{count} + i]};
      const std::size_t e = i / (2 * rays_per_side), side = i / rays_per_side % 2;
      const std::uint32_t face = hard.edges[(begin + e) * stride].faces[side];
      if (!is_face_of_own_part(hits.triangle[i], face, direction)) continue;
      SideProfile& profile = profiles[e][side];
      profile.angles[i % kEdgeDistances].push_back(angle(corners[i], direction));
      profile.gaps[i % kEdgeDistances].push_back(double{hits.distance[i]});
    }
    return profiles;
  }

 private:
  bool is_face_of_own_part(std::uint32_t triangle, std::uint32_t face,
                           const Vec3d& direction) const {
    if (triangle == KILN_NO_TRIANGLE || !(dot(direction, direction) > 0)) return false;
    return parts_ == nullptr || parts_->high[triangle] == parts_->low[face];
  }

  static double angle(const std::array<Vec3, 3>& corners, const Vec3d& direction) {
    const Vec3d a = to_double(corners[0]);
    const Vec3d normal = cross(to_double(corners[1]) - a, to_double(corners[2]) - a);
    const double cosine = dot(normal, direction) / length(normal);
    return std::acos(std::clamp(cosine, -1.0, 1.0)) * kDegreesPerRadian;
  }

  const Source::Impl& high_;
  const LowSurface& surface_;
  double max_edge_distance_;
  const Parts* parts_;
};

/// Blend width at an edge; infinity if neither side has an estimate.
double blend_width(const std::array<SideProfile, 2>& sides, double max_edge_distance,
                   double min_width) {
  const SideProfile::BevelEnd a = sides[0].find_bevel_end(max_edge_distance),
                              b = sides[1].find_bevel_end(max_edge_distance);
  if (!(std::min(a.bevel, b.bevel) < kNoBevel)) return kNoBevel;
  const double bevel = !(a.bevel < kNoBevel)   ? b.bevel
                       : !(b.bevel < kNoBevel) ? a.bevel
                                               : std::max(a.bevel, b.bevel);
  return std::clamp(
      std::max(kBlendWidthPerBevel * bevel, kBlendWidthPerGap * std::min(a.gap, b.gap)), min_width,
      max_edge_distance);
}

}  // namespace

Bevels find_bevels(const Source::Impl& high, const LowSurface& surface, const HardEdges& hard,
                   double reach, const Parts* parts) {
  const double diagonal = high.frame.diagonal * high.frame.scale;
  const double max_edge_distance = kMaxEdgeDistance * diagonal,
               min_width = kMinBlendWidth * diagonal;
  const std::size_t stride = 1 + hard.edges.size() / kMaxMeasuredEdges;
  const std::size_t measured_edges = (hard.edges.size() + stride - 1) / stride;
  const std::size_t points_per_edge = std::clamp<std::size_t>(
      kTargetRayCount / (2 * kEdgeDistances * measured_edges), 1, kMaxPointsPerEdge);
  const std::size_t batch_size =
      std::max<std::size_t>(1, kTargetRayCount / (2 * kEdgeDistances * points_per_edge));
  const BevelProbes probes(high, surface, max_edge_distance, parts);
  Bevels result;
  std::vector<double> hits;
  result.widths.assign(hard.edges.size(), 0.0F);
  for (std::size_t begin = 0; begin < measured_edges; begin += batch_size) {
    const std::size_t end = std::min(measured_edges, begin + batch_size);
    const auto profiles = probes.measure_profiles(hard, begin, end, stride, points_per_edge, reach);
    for (std::size_t e = begin; e < end; ++e) {
      const double width = blend_width(profiles[e - begin], max_edge_distance, min_width);
      if (!(width < kNoBevel)) continue;
      result.widths[e * stride] = static_cast<float>(width);
      hits.push_back(width);
    }
  }
  result.found = hits.size();
  if (!hits.empty()) result.median = static_cast<float>(median(hits));
  const float other =
      hits.empty() ? static_cast<float>(kDefaultBlendWidth * diagonal) : result.median;
  for (float& width : result.widths) width = width > 0 ? width : other;
  return result;
}

}  // namespace kiln
