#include "unwrap/texel_detail.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "base/parallel.h"
#include "mesh/barycentric_projection.h"
#include "mesh/half_edge.h"
#include "mesh/triangle_spread.h"

namespace kiln {
namespace {

/// Number of samples on a low poly, at least one per triangle.
constexpr double kSamplesPerLowPoly = 8000;
/// Assumed share of the map that charts cover.
constexpr double kExpectedMapCoverage = 0.75;
constexpr std::size_t kTrianglesPerTask = 32;

/// Indices of triangles with finite corners.
std::vector<std::uint32_t> finite_triangles(const Mesh& mesh, const std::vector<Vec3>& positions) {
  std::vector<std::uint32_t> result;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& c = mesh.triangles[t];
    if (is_finite(positions[c[0]]) && is_finite(positions[c[1]]) && is_finite(positions[c[2]])) {
      result.push_back(t);
    }
  }
  return result;
}

std::vector<Triangle> pick_triangles(const std::vector<Triangle>& triangles,
                                     const std::vector<std::uint32_t>& which) {
  std::vector<Triangle> result;
  result.reserve(which.size());
  for (const std::uint32_t t : which) result.push_back(triangles[t]);
  return result;
}

/// Stratified sample points on a triangle. Each has a rotation for the texel-sized square around it. The pattern is
/// offset differently for each triangle.
struct TriangleSamples : TriangleSpread {
  double rotation;
  TriangleSamples(std::size_t triangle, std::size_t place)
      : TriangleSamples(static_cast<double>(triangle), static_cast<double>(place)) {}

 private:
  TriangleSamples(double t, double i)
      : TriangleSpread(i, 0.6180339887498949 * t, 0.4142135623730950 * t),
        rotation(0.5 * std::numbers::pi *
                 fraction_of(0.8191725133961645 * i + 0.7320508075688772 * t)) {}
};

}  // namespace

TexelDetail::TexelDetail(const Mesh& high)
    : frame_(Frame::of(high)),
      positions_(frame_.to_frame(high)),
      finite_triangles_(finite_triangles(high, positions_)),
      triangles_(pick_triangles(high.triangles, finite_triangles_)),
      normals_(corner_normals(high, positions_)),
      surface_(positions_, triangles_) {}

/// Finds the high poly's normal at the point nearest to `point`.
/// \returns false if the high poly faces away from `facing` there
bool TexelDetail::normal_at(const Vec3d& point, const Vec3d& facing, Vec3d& normal) const {
  const std::uint32_t t = surface_.nearest(to_float(point));
  const Triangle& c = triangles_[t];
  const std::array<double, 3> share = barycentric_projection(
      point, to_double(positions_[c[0]]), to_double(positions_[c[1]]), to_double(positions_[c[2]]));
  normal = {};
  for (std::size_t k = 0; k < 3; ++k) {
    normal += to_double(normals_.normals[normals_.triangles[finite_triangles_[t]][k]]) * share[k];
  }
  const double size = length(normal);
  if (!(size > 0)) return false;
  normal = normal * (1 / size);
  return dot(normal, facing) > 0;
}

/// Samples of one low poly.
class TexelDetail::LowPolySampler {
 public:
  LowPolySampler(const TexelDetail& detail, const Mesh& low, const FlatTriangles& flat)
      : detail_(detail),
        low_(low),
        flat_(flat),
        positions_(detail.frame_.to_frame(low)),
        normals_(corner_normals(low, positions_)),
        tangents_(corner_tangents()) {}

  double area(std::size_t t) const {
    const auto& [a, b, c] = flat_.corners[t];
    return 0.5 * cross(b - a, c - a);
  }

  /// The high poly's normal at a point of the layout, in the low poly's tangent frame.
  /// \param t  a nearby triangle, from which the walk to the point's triangle starts
  bool normal_at(std::uint32_t t, const Vec2d& at, Vec3d& normal) const {
    constexpr int kMaxWalkSteps = 200;
    for (int step = 0; step < kMaxWalkSteps && t != kNoIndex; ++step) {
      const std::array<Vec2d, 3>& c = flat_.corners[t];
      const double doubled_area = cross(c[1] - c[0], c[2] - c[0]);
      std::array<double, 3> share{};
      std::size_t most_negative = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec2d &a = c[(k + 1) % 3], &b = c[(k + 2) % 3];
        share[k] = cross(b - a, at - a) / doubled_area;
        if (share[k] < share[most_negative]) most_negative = k;
      }
      if (share[most_negative] >= 0) return interpolate_normal(t, share, normal);
      t = flat_.neighbours[t][(most_negative + 1) % 3];
    }
    return false;
  }

 private:
  /// For each corner, the direction of the layout's x axis on the surface, averaged over the triangles around the
  /// corner.
  std::vector<Vec3d> corner_tangents() const {
    struct CornerFrame {
      std::uint32_t position = 0;
      Vec2d at{};
      std::size_t corner = 0;
      auto key() const { return std::tie(position, at.x, at.y); }
    };
    std::vector<CornerFrame> corners;
    std::vector<Vec3d> corner_tangents_of_low(3 * low_.triangles.size()),
        result(corner_tangents_of_low.size());
    for (std::size_t t = 0; t < low_.triangles.size(); ++t) {
      const auto& [a, b, c] = flat_.corners[t];
      const double whole = cross(b - a, c - a);
      if (!(whole > 0)) continue;
      const Vec3d p = to_double(positions_[low_.triangles[t][0]]);
      const Vec3d tangent = (to_double(positions_[low_.triangles[t][1]]) - p) * (c - a).y -
                            (to_double(positions_[low_.triangles[t][2]]) - p) * (b - a).y;
      const double size = length(tangent);
      for (std::size_t k = 0; k < 3; ++k) {
        if (size > 0) corner_tangents_of_low[3 * t + k] = tangent * (1 / size);
        corners.push_back({low_.triangles[t][k], flat_.corners[t][k], 3 * t + k});
      }
    }
    std::stable_sort(corners.begin(), corners.end(),
                     [](const CornerFrame& a, const CornerFrame& b) { return a.key() < b.key(); });
    for (std::size_t i = 0; i < corners.size();) {
      std::size_t end = i;
      Vec3d sum{};
      for (; end < corners.size() && corners[end].key() == corners[i].key(); ++end) {
        sum += corner_tangents_of_low[corners[end].corner];
      }
      for (; i < end; ++i) result[corners[i].corner] = sum;
    }
    return result;
  }

  bool interpolate_normal(std::uint32_t t, const std::array<double, 3>& share,
                          Vec3d& normal) const {
    std::array<Vec3d, 3> p{};
    Vec3d low_normal{}, tangent{};
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = to_double(positions_[low_.triangles[t][k]]);
      low_normal += to_double(normals_.normals[normals_.triangles[t][k]]) * share[k];
      tangent += tangents_[3 * std::size_t{t} + k] * share[k];
    }
    Vec3d high_normal{};
    if (!detail_.normal_at(p[0] * share[0] + p[1] * share[1] + p[2] * share[2],
                           cross(p[1] - p[0], p[2] - p[0]), high_normal)) {
      return false;
    }
    const double height = length(low_normal);
    if (!(height > 0)) return false;
    low_normal = low_normal * (1 / height);
    tangent = tangent - low_normal * dot(tangent, low_normal);
    const double size = length(tangent);
    if (!(size > 0)) return false;
    tangent = tangent * (1 / size);
    normal = {dot(high_normal, tangent), dot(high_normal, cross(low_normal, tangent)),
              dot(high_normal, low_normal)};
    return true;
  }

  const TexelDetail& detail_;
  const Mesh& low_;
  const FlatTriangles& flat_;
  std::vector<Vec3> positions_;
  CornerNormals normals_;
  std::vector<Vec3d> tangents_;
};

std::vector<TexelErrors> TexelDetail::errors(const Mesh& low, const FlatTriangles& flat,
                                             std::uint32_t size, int threads) const {
  const LowPolySampler sampler(*this, low, flat);
  std::vector<TexelErrors> result(low.triangles.size(), TexelErrors{});
  double total_area = 0;
  for (std::size_t t = 0; t < result.size(); ++t) total_area += sampler.area(t);
  const double side = std::sqrt(total_area / kExpectedMapCoverage) / size;
  const auto measure_triangle = [&](std::uint32_t t) {
    const auto& [a, b, c] = flat.corners[t];
    const auto sample_count =
        1 + static_cast<std::size_t>(kSamplesPerLowPoly * sampler.area(t) / total_area);
    double matched_count = 0;
    for (std::size_t i = 0; i < sample_count; ++i) {
      const TriangleSamples at(t, i);
      const Vec2d p = a + (b - a) * at.u + (c - a) * at.v;
      Vec3d normal_at_sample{}, corner{};
      if (!sampler.normal_at(t, p, normal_at_sample)) continue;
      ++matched_count;
      for (std::size_t s = 0; s < kTexelSides.size(); ++s) {
        const double half_diagonal = std::sqrt(0.5) * side * kTexelSides[s];
        Vec3d mean{};
        for (int k = 0; k < 4; ++k) {
          const double angle = at.rotation + 0.5 * std::numbers::pi * k;
          const Vec2d q = p + Vec2d{std::cos(angle), std::sin(angle)} * half_diagonal;
          if (sampler.normal_at(t, q, corner)) mean += corner;
        }
        const double mean_length = length(mean);
        if (mean_length > 0) result[t][s] += length(normal_at_sample - mean * (1 / mean_length));
      }
    }
    for (double& error : result[t]) error = matched_count > 0 ? error / matched_count : 0;
  };
  const auto body = [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      if (sampler.area(t) > 0) measure_triangle(static_cast<std::uint32_t>(t));
    }
  };
  if (total_area > 0) parallel_for(result.size(), kTrianglesPerTask, body, threads);
  return result;
}

}  // namespace kiln
