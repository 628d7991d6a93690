#include "volume/chart_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "image/gutter.h"
#include "mesh/frame.h"
#include "mesh/low_shading.h"
#include "mesh/low_surface.h"
#include "mesh/vector.h"
#include "unwrap/unwrap_charts.h"
#include "volume/atlas.h"
#include "volume/normal_splat.h"

namespace kiln {
namespace {

constexpr std::uint32_t kMapSizeStep = 16, kMaxMapSize = 8192;
/// Expected share of the map that large charts cover.
constexpr double kExpectedCoverage = 0.7;
/// Minimum share of the requested density that is accepted.
constexpr double kMinDensityShare = 0.95;
/// Resolution of the intermediate map, which has a chart for each polygon, divided by that of the final map with large
/// charts.
constexpr double kPolygonMapScale = 2;
/// Padding of each polygon's chart in the intermediate map, in texels. One texel suffices: the map
/// is read inside polygons alone, whose corners lie on texel centres.
constexpr std::uint32_t kPolygonBorder = 1;
/// Sample points per texel along each axis.
constexpr int kPointsPerAxis = 2;
constexpr std::size_t kRowsPerTask = 16;

double surface_area(const SimplifiedIsosurface& low_poly) {
  double area = 0;
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const Vec3d at = to_double(low_poly.positions[a]);
    area += 0.5 * length(cross(to_double(low_poly.positions[b]) - at,
                               to_double(low_poly.positions[c]) - at));
  };
  for (const SimplifiedIsosurface::Polygon& polygon : low_poly.polygons) {
    const auto& c = polygon.corners;
    add(c[0], c[1], c[2]);
    if (polygon.is_quad()) add(c[0], c[2], c[3]);
  }
  return area;
}

/// Reads the intermediate map at a point of a triangle.
class PolygonTexels {
 public:
  PolygonTexels(const Atlas& atlas, const Image& map)
      : map_(map), corner_texels_(atlas.mesh.triangles.size()) {
    for (const kiln_volume_chart& chart : atlas.charts) {
      for (std::uint32_t k = 0; k < chart.triangles; ++k) {
        const std::array<std::uint32_t, 3> corners = {0, 1 + k, 2 + k};
        for (std::size_t c = 0; c < 3; ++c) {
          corner_texels_[chart.triangle + k][c] = {
              double{chart.texel[corners[c]][0]} + chart.place[0],
              double{chart.texel[corners[c]][1]} + chart.place[1]};
        }
      }
    }
  }

  Vec3d normal(std::size_t triangle, const std::array<double, 3>& weights) const {
    double x = 0, y = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      x += weights[c] * corner_texels_[triangle][c][0];
      y += weights[c] * corner_texels_[triangle][c][1];
    }
    const auto texel_before = [](double at, std::uint32_t count) {
      return static_cast<std::uint32_t>(std::clamp(std::floor(at), 0.0, count - 2.0));
    };
    const std::uint32_t x0 = texel_before(x, map_.width), y0 = texel_before(y, map_.height);
    const double fx = x - x0, fy = y - y0;
    const auto read = [&](std::uint32_t column, std::uint32_t row) {
      const float* p = &map_.pixels[3 * (std::size_t{row} * map_.width + column)];
      return Vec3d(p[0], p[1], p[2]);
    };
    return (read(x0, y0) * (1 - fx) + read(x0 + 1, y0) * fx) * (1 - fy) +
           (read(x0, y0 + 1) * (1 - fx) + read(x0 + 1, y0 + 1) * fx) * fy;
  }

 private:
  const Image& map_;
  /// For each triangle, the texel positions of its corners
  std::vector<std::array<std::array<double, 2>, 3>> corner_texels_;
};

/// Corners of a triangle in texels of the final map; rows are counted from the top.
struct PlacedTriangle {
  std::array<double, 3> x, y;
  double area = 0;  ///< Doubled area; 0: degenerate

  PlacedTriangle(const Mesh& mesh, std::size_t triangle, std::uint32_t size) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2& uv = mesh.uvs[mesh.uv_triangles[triangle][k]];
      x[k] = double{uv.x} * size;
      y[k] = (1 - double{uv.y}) * size;
    }
    area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
  }

  std::array<double, 3> weights(double px, double py) const {
    const double second = ((px - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (py - y[0])) / area;
    const double third = ((x[1] - x[0]) * (py - y[0]) - (px - x[0]) * (y[1] - y[0])) / area;
    return {1 - second - third, second, third};
  }
};

bool is_inside_triangle(const std::array<double, 3>& weights) {
  return weights[0] >= 0 && weights[1] >= 0 && weights[2] >= 0;
}

/// Sums over the triangles that cover a texel.
struct TexelSum {
  Vec3d sum{};
  std::uint32_t triangle = 0;  ///< The first triangle that covers the texel
  std::uint32_t sample_count = 0;
};

/// Converts a normal to the values of the map, as kiln_volume_map_encode does.
Vec3d encode_value(const Vec3d& normal, const kiln_low_shading& low,
                   std::array<double, 3> weights) {
  double sum = 0;
  for (double& w : weights) sum += w = std::max(w, 0.0);
  const auto at = [&](const kiln_float* corners) {
    Vec3d normal_sum{};
    for (std::size_t c = 0; c < 3; ++c) {
      const float* p = corners + 3 * c;
      normal_sum += Vec3d(p[0], p[1], p[2]) * (weights[c] / sum);
    }
    return normal_sum;
  };
  const Vec3d n = at(low.normal), t = at(low.tangent), b = cross(n, t) * double{low.sign};
  const Vec3d across = cross(b, n);
  Vec3d value(dot(normal, across), dot(normal, cross(n, t)), dot(normal, cross(t, b)));
  if (dot(t, across) < 0) value = -value;
  const double size = length(value);
  return size > 0 ? value * (1 / size) : Vec3d{0, 0, 1};
}

/// Adds the normals at sample points in rows `first` to `last` - 1 of the map.
void accumulate_rows(const std::vector<PlacedTriangle>& placed_triangles,
                     const PolygonTexels& polygon_texels, std::uint32_t size, std::size_t first,
                     std::size_t last, std::vector<TexelSum>& gathered) {
  const auto cell = [](double at, std::size_t low, std::size_t high) {
    return static_cast<std::size_t>(
        std::clamp(std::floor(at), static_cast<double>(low), static_cast<double>(high)));
  };
  for (std::uint32_t t = 0; t < placed_triangles.size(); ++t) {
    const PlacedTriangle& p = placed_triangles[t];
    if (!(p.area != 0)) continue;
    const auto [left, right] = std::minmax({p.x[0], p.x[1], p.x[2]});
    const auto [top, bottom] = std::minmax({p.y[0], p.y[1], p.y[2]});
    if (bottom < static_cast<double>(first) || top >= static_cast<double>(last)) continue;
    const std::size_t x1 = cell(right, 0, size - 1), y1 = cell(bottom, first, last - 1);
    for (std::size_t y = cell(top, first, last - 1); y <= y1; ++y) {
      for (std::size_t x = cell(left, 0, size - 1); x <= x1; ++x) {
        for (int point = 0; point < kPointsPerAxis * kPointsPerAxis; ++point) {
          const int column = point % kPointsPerAxis, row = point / kPointsPerAxis;
          const double px = static_cast<double>(x) + (column + 0.5) / kPointsPerAxis;
          const double py = static_cast<double>(y) + (row + 0.5) / kPointsPerAxis;
          const std::array<double, 3> weights = p.weights(px, py);
          if (!is_inside_triangle(weights)) continue;
          TexelSum& texel = gathered[y * size + x];
          if (texel.sample_count++ == 0) texel.triangle = t;
          texel.sum += polygon_texels.normal(t, weights);
        }
      }
    }
  }
}

}  // namespace

ChartLayout lay_out_charts(const SimplifiedIsosurface& low_poly, const Volume& volume,
                           std::uint32_t size, std::uint32_t border, const TexelDetail* detail,
                           KnownCharts* known) {
  UnwrapOptions options;
  options.method = UnwrapMethod::charts;
  options.size = size;
  options.border_texels = std::min(2 * border, size / 4);
  ChartLayout layout;
  layout.mesh =
      unwrap_for(polygon_mesh(low_poly, volume), options, detail, &layout.unwrapped, known);
  layout.texels_per_unit = size * std::sqrt(layout.unwrapped.coverage / surface_area(low_poly));
  return layout;
}

ChartLayout lay_out_charts_at(const SimplifiedIsosurface& low_poly, const Volume& volume,
                              double texels_per_unit, std::uint32_t border, std::uint32_t& size,
                              const TexelDetail* detail) {
  const auto size_for = [&](double side) {
    const double steps = std::ceil(std::min<double>(side, kMaxMapSize) / kMapSizeStep);
    return kMapSizeStep * std::max(1U, static_cast<std::uint32_t>(steps));
  };
  size = size_for(texels_per_unit * std::sqrt(surface_area(low_poly) / kExpectedCoverage));
  KnownCharts known_charts;
  ChartLayout layout = lay_out_charts(low_poly, volume, size, border, detail, &known_charts);
  const double density_ratio = layout.texels_per_unit / texels_per_unit;
  if (density_ratio > kMinDensityShare || size == kMaxMapSize) return layout;
  size = size_for(size / density_ratio);
  return lay_out_charts(low_poly, volume, size, border, detail, &known_charts);
}

Image make_chart_map(cl::Context& context, const FineSurface& surface,
                     const SimplifiedIsosurface& low_poly, const Volume& volume,
                     const ChartLayout& layout, double spacing, const ExtractOptions& options,
                     std::uint64_t& splatted) {
  ExtractOptions polygon_map_options = options;
  polygon_map_options.size =
      find_atlas_size(low_poly, kPolygonMapScale * layout.texels_per_unit, kPolygonBorder);
  polygon_map_options.space = NormalMapSpace::object;
  polygon_map_options.flip_y = false;
  polygon_map_options.raw = true;
  const Atlas atlas = make_atlas(low_poly, volume, polygon_map_options.size, kPolygonBorder);
  const Image polygon_map =
      splat_normals(context, surface, low_poly, atlas, atlas.texels_per_unit * spacing,
                    polygon_map_options, splatted);
  const PolygonTexels polygon_texels(atlas, polygon_map);
  const Mesh& mesh = layout.mesh;  // The triangles have the same order as in the intermediate map
  std::vector<PlacedTriangle> placed_triangles;
  placed_triangles.reserve(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    placed_triangles.emplace_back(mesh, t, options.size);
  const std::uint32_t size = options.size;
  std::vector<TexelSum> texel_sums(std::size_t{size} * size);
  const auto accumulate = [&](std::size_t begin, std::size_t end) {
    accumulate_rows(placed_triangles, polygon_texels, size, begin, end, texel_sums);
  };
  parallel_for(size, kRowsPerTask, accumulate);

  std::vector<kiln_low_shading> low_poly_shading;
  if (options.space == NormalMapSpace::tangent) {
    low_poly_shading = low_shading(LowSurface::of(mesh, Frame::of(mesh)));
  }
  Image image{size, size, 3, std::vector<float>(3 * texel_sums.size(), 0.0F)};
  std::vector<std::uint8_t> coverage(texel_sums.size(), kCoverageEmpty);
  for (std::size_t i = 0; i < texel_sums.size(); ++i) {
    const TexelSum& texel = texel_sums[i];
    if (texel.sample_count == 0) continue;
    coverage[i] = kCoverageBaked;
    const double sum_length = length(texel.sum);
    Vec3d value = sum_length > 0 ? texel.sum * (1 / sum_length) : Vec3d{0, 0, 1};
    if (!low_poly_shading.empty()) {
      const std::size_t row = i / size;
      const double x = static_cast<double>(i % size) + 0.5, y = static_cast<double>(row) + 0.5;
      value = encode_value(value, low_poly_shading[texel.triangle],
                           placed_triangles[texel.triangle].weights(x, y));
    }
    const Vec3 stored = to_float(value);
    image.pixels[3 * i] = stored.x;
    image.pixels[3 * i + 1] = stored.y;
    image.pixels[3 * i + 2] = stored.z;
  }
  GutterOptions gutter;
  gutter.texels = static_cast<std::int32_t>(options.border_texels);
  fill_gutter(context, image, coverage, gutter);
  const float y_scale = options.flip_y ? -1.0F : 1.0F;
  const float scale = options.raw ? 1.0F : 0.5F, offset = options.raw ? 0.0F : 0.5F;
  for (std::size_t i = 0; i < texel_sums.size(); ++i) {
    float* p = &image.pixels[3 * i];
    if (coverage[i] == kCoverageEmpty) {
      p[0] = p[1] = offset;
      p[2] = 1;
      continue;
    }
    p[0] = p[0] * scale + offset;
    p[1] = p[1] * y_scale * scale + offset;
    p[2] = p[2] * scale + offset;
  }
  return image;
}

}  // namespace kiln
