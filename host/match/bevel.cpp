#include "match/bevel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "accel/ray.h"
#include "base/parallel.h"
#include "match/host_correspondence.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

constexpr std::size_t kRings = 24;        // distances from an edge
constexpr std::size_t kMostPlaces = 8;    // along an edge
constexpr std::size_t kMostEdges = 4096;  // that are looked at
constexpr std::size_t kRays = 1 << 18;    // altogether, about
// Shares of the high poly's diagonal.
constexpr double kFarthestEdge = 0.04, kLeast = 0.0005, kUnknown = 0.01;
constexpr double kParallel = 5;        // degrees
constexpr double kNearUsual = 1.25;    // times the usual angle, on faces that are nowhere parallel
constexpr double kShareOfBevel = 0.4;  // over which rays turn
constexpr double kShareOfGap = 2;
constexpr double kDegrees = 180 / 3.14159265358979323846;
constexpr double kNone = std::numeric_limits<double>::infinity();

double ring_distance(std::size_t ring, double farthest) {
  const double share = static_cast<double>(ring + 1) / kRings;
  return farthest * share * share;
}

/// The middle one; infinity of none.
double median(std::vector<double> values) {
  if (values.empty()) return kNone;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// A place on a face of the low poly, beside one of its edges. Outside of the face: no direction.
struct Place {
  Vec3 position, direction;
};

/// The place `share` along an edge and `off` it, on one of its faces.
Place place_beside(const std::array<LowSurface::Corner, 3>& face, const HardEdges::Edge& edge,
                   double share, double off) {
  const Vec3d along(edge.along), a(face[0].position);
  const Vec3d ab = Vec3d(face[1].position) - a, ac = Vec3d(face[2].position) - a;
  const Vec3d normal = cross(ab, ac);
  Vec3d inward = cross(normal, along);
  const Vec3d middle = a + (ab + ac) * (1.0 / 3);
  if (dot(inward, middle - Vec3d(edge.from)) < 0) inward = inward * -1;
  const Vec3d p = Vec3d(edge.from) + along * share + inward * (off / length(inward));
  const double area = dot(normal, normal);
  const double u = dot(cross(p - a, ac), normal) / area, v = dot(cross(ab, p - a), normal) / area;
  if (!(u >= 0 && v >= 0 && u + v <= 1)) return {};
  const Vec3d direction =
      Vec3d(face[0].normal) * (1 - u - v) + Vec3d(face[1].normal) * u + Vec3d(face[2].normal) * v;
  const double size = length(direction);
  if (!(size > 1e-6)) return {};
  return {to_float(p), to_float(direction * (1 / size))};
}

/// Angles and gaps that rays found along one side of an edge.
struct Profile {
  std::array<std::vector<double>, kRings> angles, gaps;

  struct End {
    double bevel = kNone;  ///< Distance at which the bevel ends; infinity: none found
    double gap = 0;        ///< Distance of the high poly there, outward
  };

  End end(double farthest) const {
    std::array<double, kRings> middle{};
    std::size_t last = 0;
    for (std::size_t r = 0; r < kRings; ++r) {
      middle[r] = median(angles[r]);
      if (middle[r] < kNone) last = r;
    }
    std::vector<double> outer;  // half of the way
    for (std::size_t r = 0; r <= last; ++r) {
      if (middle[r] < kNone && 2 * ring_distance(r, 1) >= ring_distance(last, 1)) {
        outer.push_back(middle[r]);
      }
    }
    const double parallel = std::max(kParallel, kNearUsual * median(outer));
    for (std::size_t r = 0; r < kRings && !outer.empty(); ++r) {
      if (!(middle[r] <= parallel)) continue;
      // A bevel that ends before the first ring is none.
      return {r == 0 ? 0 : ring_distance(r, farthest), std::max(0.0, median(gaps[r]))};
    }
    return {};
  }
};

/// Rays from places beside edges, and what they find.
class Probes {
 public:
  Probes(const Source::Impl& high, const LowSurface& surface, double farthest, const Parts* parts)
      : high_(high), surface_(surface), farthest_(farthest), parts_(parts) {}

  /// Profiles of both sides of edges [begin, end) of a list.
  std::vector<std::array<Profile, 2>> look(const HardEdges& hard, std::size_t begin,
                                           std::size_t end, std::size_t stride, std::size_t places,
                                           double reach) const {
    const std::size_t rays_per_side = places * kRings;
    const auto count = static_cast<std::uint32_t>((end - begin) * 2 * rays_per_side);
    std::vector<float> planes(7 * std::size_t{count}, 0.0F);
    parallel_for(count, 4096, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        const HardEdges::Edge& edge = hard.edges[(begin + i / (2 * rays_per_side)) * stride];
        const std::size_t side = i / rays_per_side % 2, along = i / kRings % places;
        const Place place =
            place_beside(surface_.triangles[edge.faces[side]], edge,
                         (static_cast<double>(along) + 0.5) / static_cast<double>(places),
                         ring_distance(i % kRings, farthest_));
        const Vec3 &p = place.position, &d = place.direction;
        const float values[6] = {p.x, p.y, p.z, d.x, d.y, d.z};
        for (std::size_t k = 0; k < 6; ++k) planes[k * count + i] = values[k];
      }
    });
    cl::Context& context = context_of(high_.device);
    const cl::Array<float> points(context, std::span<const float>(planes));
    DeviceCorrespondence met(context, count);
    RayQuery query;
    query.t_min = -static_cast<float>(reach);
    query.t_max = static_cast<float>(reach);
    query.outermost = true;
    high_.rays().intersect(points, count, count, query, met);
    const HostCorrespondence found(context, met, count);
    std::vector<std::array<Profile, 2>> profiles(end - begin);
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3d direction{planes[3 * std::size_t{count} + i], planes[4 * std::size_t{count} + i],
                            planes[5 * std::size_t{count} + i]};
      const std::size_t e = i / (2 * rays_per_side), side = i / rays_per_side % 2;
      const std::uint32_t face = hard.edges[(begin + e) * stride].faces[side];
      if (!counts(found.triangle[i], face, direction)) continue;
      Profile& profile = profiles[e][side];
      profile.angles[i % kRings].push_back(angle(found.triangle[i], direction));
      profile.gaps[i % kRings].push_back(double{found.distance[i]});
    }
    return profiles;
  }

 private:
  bool counts(std::uint32_t triangle, std::uint32_t face, const Vec3d& direction) const {
    if (triangle == KILN_NO_TRIANGLE || !(dot(direction, direction) > 0)) return false;
    return parts_ == nullptr || parts_->high[triangle] == parts_->low[face];
  }

  double angle(std::uint32_t triangle, const Vec3d& direction) const {
    const Triangle& t = high_.triangles[triangle];
    const Vec3d a(high_.positions[t[0]]);
    const Vec3d normal = cross(Vec3d(high_.positions[t[1]]) - a, Vec3d(high_.positions[t[2]]) - a);
    const double cosine = dot(normal, direction) / length(normal);
    return std::acos(std::clamp(cosine, -1.0, 1.0)) * kDegrees;
  }

  const Source::Impl& high_;
  const LowSurface& surface_;
  double farthest_;
  const Parts* parts_;
};

/// Over what rays turn at an edge; infinity where no side says.
double width_of(const std::array<Profile, 2>& sides, double farthest, double least) {
  const Profile::End a = sides[0].end(farthest), b = sides[1].end(farthest);
  if (!(std::min(a.bevel, b.bevel) < kNone)) return kNone;
  const double bevel = !(a.bevel < kNone)   ? b.bevel
                       : !(b.bevel < kNone) ? a.bevel
                                            : std::max(a.bevel, b.bevel);
  return std::clamp(std::max(kShareOfBevel * bevel, kShareOfGap * std::min(a.gap, b.gap)), least,
                    farthest);
}

}  // namespace

Bevels find_bevels(const Source::Impl& high, const LowSurface& surface, const HardEdges& hard,
                   double reach, const Parts* parts) {
  const double diagonal = high.frame.diagonal * high.frame.scale;
  const double farthest = kFarthestEdge * diagonal, least = kLeast * diagonal;
  const std::size_t stride = 1 + hard.edges.size() / kMostEdges;
  const std::size_t looked = (hard.edges.size() + stride - 1) / stride;
  const std::size_t places = std::clamp<std::size_t>(kRays / (2 * kRings * looked), 1, kMostPlaces);
  const std::size_t at_once = std::max<std::size_t>(1, kRays / (2 * kRings * places));
  const Probes probes(high, surface, farthest, parts);
  Bevels result;
  std::vector<double> found;
  result.widths.assign(hard.edges.size(), 0.0F);
  for (std::size_t begin = 0; begin < looked; begin += at_once) {
    const std::size_t end = std::min(looked, begin + at_once);
    const auto profiles = probes.look(hard, begin, end, stride, places, reach);
    for (std::size_t e = begin; e < end; ++e) {
      const double width = width_of(profiles[e - begin], farthest, least);
      if (!(width < kNone)) continue;
      result.widths[e * stride] = static_cast<float>(width);
      found.push_back(width);
    }
  }
  result.found = found.size();
  if (!found.empty()) result.median = static_cast<float>(median(found));
  const float other = found.empty() ? static_cast<float>(kUnknown * diagonal) : result.median;
  for (float& width : result.widths) width = width > 0 ? width : other;
  return result;
}

}  // namespace kiln
