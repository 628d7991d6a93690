#include "accel/bounding_prism.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/symmetric.h"
#include "base/vectors.h"

namespace kiln::bvh {
namespace {

// Number of candidate directions of sides: kEvenSides evenly spaced ones, and those parallel to the 3 edges of the
// largest triangle.
constexpr std::size_t kSideCandidates = 16, kEvenSides = 13;
// Margin for extents, which are computed in single precision
constexpr double kPrismMargin = KILN_BVH_PRISM_MARGIN + 1e-6;
constexpr double kMaxSlabDistance = 2;
constexpr double kMinSideSine = 1e-6;  // minimum sine of the angle between two sides

/// Statistics of the triangles, from which candidate directions of the axis are derived.
struct TriangleStatistics {
  Matrix3 spread{};  ///< Covariance of the corners
  /// Sum of outer products of normals, weighted by area
  Matrix3 normals{};
  std::size_t largest_corner = 0;  ///< First corner of the largest triangle
  double longest_edge = 0;         ///< Longest edge
  double min_doubled_area = std::numeric_limits<double>::infinity();  ///< Smallest doubled area
};

void add_square(Matrix3& m, const Vec3d& v, double weight) {
  const double a[] = {v.x, v.y, v.z};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) m[i][j] += weight * a[i] * a[j];
  }
}

TriangleStatistics triangle_statistics_of(const Corners& corners) {
  TriangleStatistics statistics;
  Vec3d mean{};
  const std::size_t count = corners.x.size();
  for (std::size_t i = 0; i < count; ++i) mean += corners.at(i);
  mean = mean * (1 / static_cast<double>(count));
  double max_area = -1;
  for (std::size_t i = 0; i < count; i += 3) {
    const Vec3d a = corners.at(i), b = corners.at(i + 1), c = corners.at(i + 2);
    for (const Vec3d& p : {a, b, c}) {
      add_square(statistics.spread, p - mean, 1 / static_cast<double>(count));
    }
    const Vec3d normal = cross(b - a, c - a);
    const double area = length(normal);
    if (area > 0) add_square(statistics.normals, normal, 1 / area);
    statistics.longest_edge =
        std::max({statistics.longest_edge, length(b - a), length(c - b), length(a - c)});
    statistics.min_doubled_area = std::min(statistics.min_doubled_area, area);
    if (area > max_area) {
      max_area = area;
      statistics.largest_corner = i;
    }
  }
  return statistics;
}

/// The eigenvectors of the smallest and of the largest eigenvalue.
std::array<Vec3d, 2> smallest_and_largest_axis(Matrix3 m) {
  Matrix3 v;
  diagonalise(m, v);
  std::size_t smallest_column = 0, largest_column = 0;
  for (std::size_t k = 1; k < 3; ++k) {
    if (m[k][k] < m[smallest_column][smallest_column]) smallest_column = k;
    if (m[k][k] > m[largest_column][largest_column]) largest_column = k;
  }
  const auto column = [&](std::size_t k) { return Vec3d{v[0][k], v[1][k], v[2][k]}; };
  return {column(smallest_column), column(largest_column)};
}

struct PlanePoint {
  double x, y;
};
double cross2(const PlanePoint& a, const PlanePoint& b) { return a.x * b.y - a.y * b.x; }

/// Normals of the candidate sides, in the plane of e and f. kEvenSides of them are at equal angles after the corners
/// are scaled to unit covariance, so that thin shapes are sampled as densely as compact ones. The other sides are
/// parallel to the edges of the largest triangle.
std::array<PlanePoint, kSideCandidates> sides_of(const Corners& corners,
                                                 const TriangleStatistics& statistics,
                                                 const Vec3d& e, const Vec3d& f) {
  const auto spread = [&](const Vec3d& a, const Vec3d& b) {
    const double u[] = {a.x, a.y, a.z}, v[] = {b.x, b.y, b.z};
    double sum = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) sum += u[i] * statistics.spread[i][j] * v[j];
    }
    return sum;
  };
  // Cholesky factor l of the covariance matrix l lᵀ. A direction d of the shape scaled to unit covariance corresponds
  // to l⁻ᵀ d.
  constexpr double kMinSpread = kPrismMargin * kPrismMargin;
  const double l00 = std::sqrt(std::max(spread(e, e), 0.0) + kMinSpread);
  const double l10 = spread(e, f) / l00;
  const double l11 = std::sqrt(std::max(spread(f, f) - l10 * l10, 0.0) + kMinSpread);
  std::array<PlanePoint, kSideCandidates> sides{};
  const auto unit = [](double x, double y) {
    const double size = std::sqrt(x * x + y * y);
    return size > 0 ? PlanePoint{x / size, y / size} : PlanePoint{1, 0};
  };
  for (std::size_t k = 0; k < kEvenSides; ++k) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(k) / kEvenSides;
    const double y = std::sin(angle) / l11;
    sides[k] = unit((std::cos(angle) - l10 * y) / l00, y);
  }
  std::array<PlanePoint, 3> corner{};
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3d p = corners.at(statistics.largest_corner + k);
    corner[k] = {dot(p, e), dot(p, f)};
  }
  const PlanePoint ab{corner[1].x - corner[0].x, corner[1].y - corner[0].y};
  const PlanePoint ac{corner[2].x - corner[0].x, corner[2].y - corner[0].y};
  const double turn = cross2(ab, ac) < 0 ? -1 : 1;
  for (std::size_t k = 0; k < 3; ++k) {
    const PlanePoint &from = corner[k], &to = corner[(k + 1) % 3];
    sides[kEvenSides + k] = unit(turn * (to.y - from.y), turn * (from.x - to.x));
  }
  return sides;
}

/// Largest extent of the corners along each side's normal.
std::array<float, kSideCandidates> largest_extents(
    const Corners& corners, const std::array<Vec3d, kSideCandidates>& axis_candidates) {
  constexpr std::size_t kGroups = kSideCandidates / 4;
  Float4 wx[kGroups], wy[kGroups], wz[kGroups], most[kGroups];
  for (std::size_t g = 0; g < kGroups; ++g) {
    const Vec3 a = to_float(axis_candidates[4 * g]), b = to_float(axis_candidates[4 * g + 1]);
    const Vec3 c = to_float(axis_candidates[4 * g + 2]), d = to_float(axis_candidates[4 * g + 3]);
    wx[g] = Float4{a.x, b.x, c.x, d.x};
    wy[g] = Float4{a.y, b.y, c.y, d.y};
    wz[g] = Float4{a.z, b.z, c.z, d.z};
    most[g] = splat(-std::numeric_limits<float>::infinity());
  }
  for (std::size_t i = 0; i < corners.x.size(); ++i) {
    const Float4 x = splat(corners.x[i]), y = splat(corners.y[i]), z = splat(corners.z[i]);
    for (std::size_t g = 0; g < kGroups; ++g) {
      most[g] = upper(most[g], x * wx[g] + y * wy[g] + z * wz[g]);
    }
  }
  std::array<float, kSideCandidates> extents{};
  for (std::size_t k = 0; k < kSideCandidates; ++k)
    extents[k] = most[k / 4][static_cast<int>(k % 4)];
  return extents;
}

/// Indices of three candidate sides that form a triangle around all corners.
struct Base {
  std::array<std::size_t, 3> side{};
  double half_area = std::numeric_limits<double>::infinity();
};

/// Finds the three sides that minimise the surface of a prism of a given height.
Base smallest_base(const std::array<PlanePoint, kSideCandidates>& sides,
                   const std::array<double, kSideCandidates>& ends, double height) {
  Base best;
  for (std::size_t i = 0; i < kSideCandidates; ++i) {
    for (std::size_t j = i + 1; j < kSideCandidates; ++j) {
      const double ij = cross2(sides[i], sides[j]);
      if (!(std::abs(ij) > kMinSideSine)) continue;
      for (std::size_t k = j + 1; k < kSideCandidates; ++k) {
        const double jk = cross2(sides[j], sides[k]), ki = cross2(sides[k], sides[i]);
        const double sign = ij > 0 ? 1 : -1;
        if (!(jk * sign > kMinSideSine) || !(ki * sign > kMinSideSine)) continue;
        // Sines of the triangle's angles, which are proportional to its edges.
        const double a = jk * sign, b = ki * sign, c = ij * sign;
        const double sum = a * ends[i] + b * ends[j] + c * ends[k];
        const double scale = sum / (a * b * c);
        const double half_area = scale * (sum + height * (a + b + c)) / 2;
        if (half_area < best.half_area) best = {{i, j, k}, half_area};
      }
    }
  }
  return best;
}

Prism prism_along(const Corners& corners, const TriangleStatistics& statistics, const Vec3d& axis) {
  const Vec3d other = std::abs(axis.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  Vec3d e = cross(axis, other);
  e = e * (1 / length(e));
  const Vec3d f = cross(axis, e);
  const std::array<PlanePoint, kSideCandidates> sides = sides_of(corners, statistics, e, f);
  std::array<Vec3d, kSideCandidates> axis_candidates{};
  for (std::size_t k = 0; k < kSideCandidates; ++k)
    axis_candidates[k] = e * sides[k].x + f * sides[k].y;
  std::array<double, kSideCandidates> ends{};
  const std::array<float, kSideCandidates> reached = largest_extents(corners, axis_candidates);
  for (std::size_t k = 0; k < kSideCandidates; ++k) ends[k] = double{reached[k]} + kPrismMargin;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (std::size_t i = 0; i < corners.x.size(); ++i) {
    const double at = dot(corners.at(i), axis);
    low = std::min(low, at);
    high = std::max(high, at);
  }
  low -= kPrismMargin;
  high += kPrismMargin;
  const Base base = smallest_base(sides, ends, high - low);
  Prism prism;
  if (!std::isfinite(base.half_area)) return prism;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t i = base.side[k], j = base.side[(k + 1) % 3];
    const double det = cross2(sides[i], sides[j]);
    const double x = (ends[i] * sides[j].y - ends[j] * sides[i].y) / det;
    const double y = (sides[i].x * ends[j] - sides[j].x * ends[i]) / det;
    prism.corners[k] = e * x + f * y + axis * low;
    prism.corners[k + 3] = e * x + f * y + axis * high;
    prism.normals[k] = axis_candidates[i];
    prism.ends[k] = ends[i];
  }
  prism.normals[3] = -axis;
  prism.ends[3] = -low;
  prism.normals[4] = axis;
  prism.ends[4] = high;
  for (const Vec3d& p : prism.corners) {
    if (!(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) <= kMaxSlabDistance))
      return prism;
  }
  prism.half_area = base.half_area;
  return prism;
}

/// Sets the slack by which prism_may_hit_between() widens the interval: see kernels/accel/prism.clh.
void set_slack(const Corners& corners, const TriangleStatistics& statistics, Prism& prism) {
  const double edge = statistics.longest_edge;
  const double weight = (0x1p-21 * edge * edge + 4 * 0x1p-18 * edge) / statistics.min_doubled_area;
  prism.slack = 4 * 3 * edge * weight + 0x1p-15;
  double smallest_squared_cosine =
      1;  // smallest squared cosine between a triangle's normal and the axis
  for (std::size_t i = 0; i < corners.x.size(); i += 3) {
    const Vec3d a = corners.at(i);
    const Vec3d normal = cross(corners.at(i + 1) - a, corners.at(i + 2) - a);
    const double along = dot(normal, prism.normals[4]);
    smallest_squared_cosine =
        std::min(smallest_squared_cosine, along * along / dot(normal, normal));
  }
  const double cosine = std::sqrt(smallest_squared_cosine),
               sine = std::sqrt(1 - smallest_squared_cosine);
  prism.tilt = 2 * (sine + 1 - cosine) + 1e-5;  // margin for single precision
}

}  // namespace

Prism fit_prism(const Corners& corners) {
  const TriangleStatistics statistics = triangle_statistics_of(corners);
  const std::array<Vec3d, 2> spread = smallest_and_largest_axis(statistics.spread);
  Prism best;
  for (const Vec3d& axis :
       {smallest_and_largest_axis(statistics.normals)[1], spread[0], spread[1]}) {
    const Prism prism = prism_along(corners, statistics, axis);
    if (prism.half_area < best.half_area) best = prism;
  }
  set_slack(corners, statistics, best);
  return best;
}

kiln_bvh_prism prism_of(const Prism& prism) {
  kiln_bvh_prism packed_prism{};
  for (std::size_t k = 0; k < KILN_BVH_WIDTH; ++k) {
    const Vec3 corner = to_float(prism.corners[std::min<std::size_t>(k, 5)]);
    packed_prism.corner[0][k] = corner.x;
    packed_prism.corner[1][k] = corner.y;
    packed_prism.corner[2][k] = corner.z;
    const std::size_t p = std::min<std::size_t>(k, 4);
    const Vec3 normal = to_float(prism.normals[p]);
    packed_prism.plane[0][k] = normal.x;
    packed_prism.plane[1][k] = normal.y;
    packed_prism.plane[2][k] = normal.z;
    packed_prism.plane[3][k] = static_cast<float>(prism.ends[p]);
  }
  packed_prism.slack = static_cast<float>(prism.slack);
  packed_prism.tilt = static_cast<float>(prism.tilt);
  return packed_prism;
}

}  // namespace kiln::bvh
