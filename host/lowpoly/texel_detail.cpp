#include "lowpoly/texel_detail.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/parallel.h"
#include "lowpoly/point_shares.h"

namespace kiln {
namespace {

/// Places on a low poly; each triangle has one more, at least.
constexpr double kPlaces = 8000;
/// Share of a map that charts are expected to cover.
constexpr double kCovered = 0.75;
constexpr std::size_t kGrainOfTriangles = 32;

/// Triangles with finite corners.
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

std::vector<Triangle> those(const std::vector<Triangle>& triangles,
                            const std::vector<std::uint32_t>& which) {
  std::vector<Triangle> result;
  result.reserve(which.size());
  for (const std::uint32_t t : which) result.push_back(triangles[t]);
  return result;
}

double fraction(double value) { return value - std::floor(value); }

/// Places on a triangle, evenly spread: the sequence that follows from the plastic number (Roberts 2018), begun
/// elsewhere on each triangle.
struct Spread {
  double u, v, turn;
  Spread(std::size_t triangle, std::size_t place) {
    const auto t = static_cast<double>(triangle), i = static_cast<double>(place);
    u = fraction(0.5 + 0.7548776662466927 * i + 0.6180339887498949 * t);
    v = fraction(0.5 + 0.5698402909980532 * i + 0.4142135623730950 * t);
    turn = 0.5 * std::numbers::pi * fraction(0.8191725133961645 * i + 0.7320508075688772 * t);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
  }
};

}  // namespace

TexelDetail::TexelDetail(const Mesh& high)
    : frame_(Frame::of(high)),
      positions_(frame_.to_frame(high)),
      source_(finite_triangles(high, positions_)),
      triangles_(those(high.triangles, source_)),
      normals_(corner_normals(high, positions_)),
      surface_(positions_, triangles_) {}

/// \returns false where the nearest point faces away
bool TexelDetail::normal_at(const Vec3d& point, const Vec3d& facing, Vec3d& normal) const {
  const std::uint32_t t = surface_.nearest(to_float(point));
  const Triangle& c = triangles_[t];
  const std::array<double, 3> share =
      shares_of(point, Vec3d(positions_[c[0]]), Vec3d(positions_[c[1]]), Vec3d(positions_[c[2]]));
  normal = {};
  for (std::size_t k = 0; k < 3; ++k) {
    normal += Vec3d(normals_.normals[normals_.triangles[source_[t]][k]]) * share[k];
  }
  const double size = length(normal);
  if (!(size > 0)) return false;
  normal = normal * (1 / size);
  return dot(normal, facing) > 0;
}

std::vector<TexelErrors> TexelDetail::errors(const Mesh& low, std::uint32_t size,
                                             int threads) const {
  const std::vector<Vec3> positions = frame_.to_frame(low);
  std::vector<double> areas(low.triangles.size());
  double total = 0;
  for (std::size_t t = 0; t < areas.size(); ++t) {
    const Triangle& c = low.triangles[t];
    const Vec3d a(positions[c[0]]), b(positions[c[1]]), d(positions[c[2]]);
    const double area = 0.5 * length(cross(b - a, d - a));
    if (std::isfinite(area)) total += areas[t] = area;
  }
  const double side = std::sqrt(total / kCovered) / size;
  std::vector<TexelErrors> result(areas.size(), TexelErrors{});
  const auto look_at = [&](std::size_t t) {
    const Triangle& c = low.triangles[t];
    const Vec3d a(positions[c[0]]), across = Vec3d(positions[c[1]]) - a,
                                    up = Vec3d(positions[c[2]]) - a;
    const Vec3d facing = cross(across, up) * (0.5 / areas[t]);
    const Vec3d x = across * (1 / length(across)), y = cross(facing, x);
    const auto places = 1 + static_cast<std::size_t>(kPlaces * areas[t] / total);
    double seen = 0;
    for (std::size_t i = 0; i < places; ++i) {
      const Spread at(t, i);
      const Vec3d p = a + across * at.u + up * at.v;
      Vec3d middle, corner;
      if (!normal_at(p, facing, middle)) continue;
      ++seen;
      for (std::size_t s = 0; s < kTexelSides.size(); ++s) {
        const double reach = std::sqrt(0.5) * side * kTexelSides[s];
        Vec3d mean;
        for (int k = 0; k < 4; ++k) {
          const double angle = at.turn + 0.5 * std::numbers::pi * k;
          const Vec3d q = p + x * (reach * std::cos(angle)) + y * (reach * std::sin(angle));
          if (normal_at(q, facing, corner)) mean += corner;
        }
        const double most = length(mean);
        if (most > 0) result[t][s] += length(middle - mean * (1 / most));
      }
    }
    for (double& error : result[t]) error = seen > 0 ? error / seen : 0;
  };
  const auto body = [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      if (areas[t] > 0) look_at(t);
    }
  };
  if (total > 0) parallel_for(areas.size(), kGrainOfTriangles, body, threads);
  return result;
}

}  // namespace kiln
