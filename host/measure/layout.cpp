// Rates a UV layout: see kiln/layout.h.
#include "kiln/layout.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "cl/context.h"
#include "kiln/validate.h"
#include "mesh/frame.h"
#include "mesh/kernels_shared.h"
#include "mesh/low_surface.h"
#include "mesh/surface_links.h"
#include "mesh/vector.h"
#include "texel/texels.h"

namespace kiln {
namespace {

/// The affine mapping of a triangle from texels to points of the surface.
struct TexelMap {
  double area = 0;    ///< Area of the triangle on the surface
  double texels = 0;  ///< Signed area in texels; negative if mirrored
  Vec3d tangent_s{}, tangent_t{};

  TexelMap(const std::array<Vec3d, 3>& p, const std::array<std::array<double, 2>, 3>& st) {
    area = length(cross(p[1] - p[0], p[2] - p[0])) / 2;
    const double s1 = st[1][0] - st[0][0], t1 = st[1][1] - st[0][1];
    const double s2 = st[2][0] - st[0][0], t2 = st[2][1] - st[0][1];
    texels = (s1 * t2 - s2 * t1) / 2;
    const double scale = 1 / (2 * texels);
    tangent_s = ((p[1] - p[0]) * t2 - (p[2] - p[0]) * t1) * scale;
    tangent_t = ((p[2] - p[0]) * s1 - (p[1] - p[0]) * s2) * scale;
  }
};

/// Rates stretch, the change of texel density between adjacent triangles, and texel densities.
void rate_triangles(const Mesh& mesh, std::uint32_t width, std::uint32_t height,
                    LayoutRating& rating) {
  std::vector<TexelMap> maps;
  maps.reserve(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    std::array<Vec3d, 3> corners{};
    std::array<std::array<double, 2>, 3> st{};
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] = to_double(mesh.positions[mesh.triangles[t][k]]);
      const Vec2& uv = mesh.uvs[mesh.uv_triangles[t][k]];
      st[k] = {double{uv.x} * width, double{uv.y} * height};
    }
    const TexelMap map(corners, st);
    if (!(map.area > 0) || !std::isfinite(map.area) || !std::isfinite(map.texels)) {
      ++rating.degenerate;
    } else if (map.texels == 0) {
      ++rating.flat;
    } else {
      rating.mirrored += map.texels < 0 ? 1 : 0;
      maps.push_back(map);
    }
  }
  rating.triangles = maps.size();
  if (maps.empty()) return;
  double texels = 0, squared_stretch_sum = 0, max_stretch = 0, step_sum = 0;
  for (const TexelMap& map : maps) {
    const double a = dot(map.tangent_s, map.tangent_s);
    const double b = dot(map.tangent_s, map.tangent_t);
    const double c = dot(map.tangent_t, map.tangent_t);
    const double triangle_texels = std::abs(map.texels);
    rating.area += map.area;
    texels += triangle_texels;
    squared_stretch_sum += map.area * (a + c) / 2;
    max_stretch = std::max(max_stretch, std::sqrt(((a + c) + std::hypot(a - c, 2 * b)) / 2));
    step_sum += triangle_texels * (std::sqrt(a) + std::sqrt(c));
    const double density = std::sqrt(triangle_texels / map.area);
    rating.greatest_density = std::max(rating.greatest_density, density);
    rating.least_density =
        rating.least_density == 0 ? density : std::min(rating.least_density, density);
  }
  rating.mean_density = std::sqrt(texels / rating.area);
  rating.stretch_l2 = rating.mean_density * std::sqrt(squared_stretch_sum / rating.area);
  rating.stretch_linf = rating.mean_density * max_stretch;
  const double mean_step = step_sum / (2 * texels);
  double percent = 0;
  for (const TexelMap& map : maps) {
    for (const Vec3d& along : {map.tangent_s, map.tangent_t}) {
      percent += std::abs(map.texels) * 100 * std::abs(length(along) / mean_step - 1);
    }
  }
  rating.uniformity_percent = percent / (2 * texels);
}

void count_seams(const Mesh& mesh, const LowSurface& surface, LayoutRating& rating) {
  const SurfaceTopology topology = SurfaceTopology::of(surface);
  std::vector<std::uint8_t> chart_marks(topology.chart.size(), 0);
  const auto uv_at = [&](std::uint32_t t, std::uint32_t vertex) {
    for (std::size_t k = 0; k < 2; ++k) {
      if (topology.vertices[t][k] == vertex) return surface.triangles[t][k].uv;
    }
    return surface.triangles[t][2].uv;
  };
  for (const std::uint32_t t : surface.usable_triangles()) {
    std::uint8_t& chart = chart_marks[topology.chart[t]];
    rating.charts += chart == 0 ? 1 : 0;
    chart = 1;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t other = topology.neighbour[t][k];
      if (other == KILN_NO_TRIANGLE || other < t) continue;
      const std::size_t edge_start = (k + 1) % 3, to = (k + 2) % 3;
      const auto is_seam_side = [&](std::size_t corner) {
        return !(surface.triangles[t][corner].uv == uv_at(other, topology.vertices[t][corner]));
      };
      if (!is_seam_side(edge_start) && !is_seam_side(to)) continue;
      ++rating.seams;
      rating.seam_length += length(to_double(mesh.positions[mesh.triangles[t][to]]) -
                                   to_double(mesh.positions[mesh.triangles[t][edge_start]]));
    }
  }
}

}  // namespace

LayoutRating rate_layout(const Device& device, const Mesh& mesh, std::uint32_t width,
                         std::uint32_t height) {
  const auto start = std::chrono::steady_clock::now();
  validate(mesh);
  const LowSurface surface = LowSurface::of(mesh, Frame::of(mesh));
  TexelSampler sampler(context_of(device), surface, {width, height, 1});
  LayoutRating rating;
  rate_triangles(mesh, width, height, rating);
  count_seams(mesh, surface, rating);
  for (std::uint32_t b = 0; b < sampler.band_count(); ++b) sampler.sample(b);
  const TexelReport& report = sampler.report();
  rating.texels = report.texels;
  rating.used = static_cast<double>(report.texels) / (double{1} * width * height);
  if (report.samples != 0) {
    rating.overlap =
        static_cast<double>(report.overlapping_samples) / static_cast<double>(report.samples);
  }
  rating.warnings = report.warnings;
  rating.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return rating;
}

}  // namespace kiln
