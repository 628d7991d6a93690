#include "volume/atlas.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/option.h"
#include "base/parallel.h"
#include "mesh/vector.h"
#include "pack/rectangle_packing.h"
#include "unwrap/pairing.h"
#include "volume/seams.h"

namespace kiln {
namespace {

constexpr std::uint32_t kNoPolygon = VertexTree::kNone;

/// The corner at which a triangle's longest side starts.
std::size_t find_longest_side(const SimplifiedIsosurface& low_poly, const Triangle& t) {
  std::array<double, 3> lengths;
  for (std::size_t k = 0; k < 3; ++k) {
    lengths[k] =
        length(to_double(low_poly.positions[t[k]]) - to_double(low_poly.positions[t[(k + 1) % 3]]));
  }
  return static_cast<std::size_t>(std::max_element(lengths.begin(), lengths.end()) -
                                  lengths.begin());
}

/// Corners of each chart: of a quad, a pair of triangles, or a single triangle.
std::vector<std::array<std::uint32_t, 4>> collect_chart_corners(
    const SimplifiedIsosurface& low_poly) {
  std::vector<std::array<std::uint32_t, 4>> charts;
  std::vector<Triangle> triangles;
  for (const SimplifiedIsosurface::Polygon& polygon : low_poly.polygons) {
    const auto& c = polygon.corners;
    if (polygon.is_quad()) {
      charts.push_back(c);
    } else {
      triangles.push_back({c[0], c[1], c[2]});
    }
  }
  std::vector<TriangleShape> triangle_shapes;
  triangle_shapes.reserve(triangles.size());
  for (const Triangle& t : triangles) {
    triangle_shapes.push_back(triangle_shape(low_poly.positions[t[0]], low_poly.positions[t[1]],
                                             low_poly.positions[t[2]]));
  }
  const Pairing pairing = pair_triangles(low_poly.positions, triangles, triangle_shapes);
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    const Triangle& t = triangles[i];
    const std::uint32_t other = pairing.partner[i];
    const std::size_t apex = other == kNoIndex ? 0 : pairing.apex[i];
    const std::uint32_t first = t[(apex + 1) % 3], second = t[(apex + 2) % 3];
    // Pairs are found by position, so the two triangles may use different vertices at the same
    // positions. Such triangles cannot form a quad.
    const bool is_paired =
        other != kNoIndex &&
        std::count(triangles[other].begin(), triangles[other].end(), first) == 1 &&
        std::count(triangles[other].begin(), triangles[other].end(), second) == 1;
    if (!is_paired) {
      // A single triangle's longest side becomes the diagonal of a square.
      const std::size_t k = find_longest_side(low_poly, t);
      charts.push_back({t[(k + 1) % 3], t[(k + 2) % 3], t[k], kNoPolygon});
    } else if (i < other) {
      charts.push_back({first, triangles[other][pairing.apex[other]], second, t[apex]});
    }
  }
  return charts;
}

/// Sides of a chart's rectangle in world units.
struct RectangleSize {
  double width, height;
};

RectangleSize rectangle_size(const SimplifiedIsosurface& low_poly,
                             const std::array<std::uint32_t, 4>& c) {
  const auto side = [&](std::size_t a, std::size_t b) {
    return length(to_double(low_poly.positions[c[a]]) - to_double(low_poly.positions[c[b]]));
  };
  if (c[3] == kNoPolygon) {
    // The rectangle is a square, since its diagonal has to pass through texel centres.
    const double longer = std::max(side(0, 1), side(1, 2));
    return {longer, longer};
  }
  return {std::max(side(0, 1), side(3, 2)), std::max(side(1, 2), side(0, 3))};
}

/// Distance between two corners of a rectangle in whole texels; at least 1.
std::uint32_t count_texel_steps(double length, double density, std::uint32_t max_steps) {
  return static_cast<std::uint32_t>(
      std::clamp(std::round(length * density), 1.0, double(max_steps)));
}

std::vector<PackSize> find_pack_sizes(const std::vector<RectangleSize>& rectangle_sizes,
                                      double density, std::uint32_t size, std::uint32_t border) {
  const std::uint32_t max_steps = size - 1 - 2 * border;
  std::vector<PackSize> result;
  result.reserve(rectangle_sizes.size());
  for (const RectangleSize& e : rectangle_sizes) {
    result.push_back({count_texel_steps(e.width, density, max_steps) + 1 + 2 * border,
                      count_texel_steps(e.height, density, max_steps) + 1 + 2 * border});
  }
  return result;
}

/// The largest density at which the rectangles fit, within a few percent; 0 if none fits.
double find_density(const std::vector<RectangleSize>& rectangle_sizes, std::uint32_t size,
                    std::uint32_t border, std::vector<PackPlace>& rectangle_places,
                    std::vector<PackSize>& sizes) {
  if (2 * border + 2 > size) return 0;
  const double texels = double(size) * size;
  const auto fits = [&](double density) {
    std::vector<PackSize> candidate_sizes = find_pack_sizes(rectangle_sizes, density, size, border);
    double area = 0;
    for (const PackSize& s : candidate_sizes) area += double(s.width) * s.height;
    if (area > texels) return false;
    std::vector<PackPlace> found;
    if (!pack_rectangles(candidate_sizes, size, found)) return false;
    rectangle_places = std::move(found);
    sizes = std::move(candidate_sizes);
    return true;
  };
  double longest = 0;
  for (const RectangleSize& e : rectangle_sizes) longest = std::max({longest, e.width, e.height});
  if (!(longest > 0)) return fits(0) ? 1 : 0;
  // Upper bound of the density: the total area fits exactly. The search starts slightly below it.
  double low = 0, high = size / longest;
  for (int round = 0; round < 40; ++round) {
    const double middle = round == 0 ? high : (low + high) / 2;
    double area = 0;
    for (const PackSize& s : find_pack_sizes(rectangle_sizes, middle, size, border)) {
      area += double(s.width) * s.height;
    }
    (area <= texels ? low : high) = middle;
    if (high - low < 1e-3 * high) break;
  }
  const double max_density = low;
  if (max_density > 0) {
    for (double share = 0.98; share > 0.6; share *= 0.97) {
      if (fits(max_density * share)) return max_density * share;
    }
    for (double share = 0.6; share > 0.01; share *= 0.8) {
      if (fits(max_density * share)) return max_density * share;
    }
  }
  return fits(0) ? 1e-30 : 0;
}

/// Barycentric coordinates of a triangle's 2nd and 3rd corner as affine functions of a point, projected along the
/// normal.
void set_projection_rows(const Vec3d& a, const Vec3d& b, const Vec3d& c, float rows[2][4],
                         float normal[3]) {
  const Vec3d e = b - a, f = c - a;
  const Vec3d n = cross(e, f);
  const double squared = dot(n, n);
  std::fill_n(&rows[0][0], 8, 0.0F);
  std::fill_n(normal, 3, 0.0F);
  if (!(squared > 0)) return;
  const Vec3d second = cross(f, n) * (1 / squared), third = cross(n, e) * (1 / squared);
  const Vec3 s = to_float(second), t = to_float(third);
  const Vec3 unit = to_float(n * (1 / std::sqrt(squared)));
  const float values[2][4] = {{s.x, s.y, s.z, static_cast<float>(-dot(second, a))},
                              {t.x, t.y, t.z, static_cast<float>(-dot(third, a))}};
  std::copy_n(&values[0][0], 8, &rows[0][0]);
  normal[0] = unit.x;
  normal[1] = unit.y;
  normal[2] = unit.z;
}

/// Barycentric coordinates as affine functions of a texel's position in the chart.
void set_weight_rows(const float* a, const float* b, const float* c, float rows[2][3]) {
  const double ex = double{b[0]} - a[0], ey = double{b[1]} - a[1];
  const double fx = double{c[0]} - a[0], fy = double{c[1]} - a[1];
  // The determinant is not 0, since the corners are those of a rectangle
  const double determinant = ex * fy - ey * fx;
  const double second[2] = {fy / determinant, -fx / determinant};
  const double third[2] = {-ey / determinant, ex / determinant};
  for (int k = 0; k < 2; ++k) {
    rows[0][k] = static_cast<float>(second[k]);
    rows[1][k] = static_cast<float>(third[k]);
  }
  rows[0][2] = static_cast<float>(-second[0] * a[0] - second[1] * a[1]);
  rows[1][2] = static_cast<float>(-third[0] * a[0] - third[1] * a[1]);
}

kiln_volume_chart make_chart(const SimplifiedIsosurface& low_poly,
                             const std::array<std::uint32_t, 4>& corners, const PackSize& size,
                             const PackPlace& place, std::uint32_t map, std::uint32_t border) {
  kiln_volume_chart chart{};
  chart.size[0] = place.turned ? size.height : size.width;
  chart.size[1] = place.turned ? size.width : size.height;
  chart.place[0] = place.x;
  chart.place[1] = map - place.y - chart.size[1];  // rows of the map start at the top
  chart.corners = corners[3] == kNoPolygon ? 3 : 4;
  chart.triangles = chart.corners - 2;
  const auto b = static_cast<float>(border);
  const float right = static_cast<float>(chart.size[0] - 1) - b;
  const float bottom = static_cast<float>(chart.size[1] - 1) - b;
  // Corners counter-clockwise with v upwards: from the lower left, or from the lower right in charts rotated
  // by 90 degrees.
  const float ring[4][2] = {{b, bottom}, {right, bottom}, {right, b}, {b, b}};
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t from = (k + (place.turned ? 1 : 0)) % 4;
    chart.texel[k][0] = ring[from][0];
    chart.texel[k][1] = ring[from][1];
    chart.corner[k] = corners[k] == kNoPolygon ? 0 : corners[k];
  }
  for (std::uint32_t k = 0; k < chart.triangles; ++k) {
    const auto at = [&](std::uint32_t c) { return to_double(low_poly.positions[corners[c]]); };
    set_projection_rows(at(0), at(1 + k), at(2 + k), chart.project[k], chart.normal[k]);
    set_weight_rows(chart.texel[0], chart.texel[1 + k], chart.texel[2 + k], chart.weights[k]);
  }
  // A degenerate triangle uses the projection direction of the chart's other triangle.
  for (std::uint32_t k = 0; k < chart.triangles; ++k) {
    const float* n = chart.normal[k];
    if (n[0] != 0 || n[1] != 0 || n[2] != 0) continue;
    const Vec3& v = low_poly.normals[corners[0]];
    const float given[3] = {v.x, v.y, v.z};
    std::copy_n(given, 3, chart.normal[k]);
  }
  return chart;
}

std::vector<RectangleSize> rectangle_sizes_of(
    const SimplifiedIsosurface& low_poly,
    const std::vector<std::array<std::uint32_t, 4>>& corners) {
  std::vector<RectangleSize> rectangle_sizes;
  rectangle_sizes.reserve(corners.size());
  for (const auto& c : corners) rectangle_sizes.push_back(rectangle_size(low_poly, c));
  return rectangle_sizes;
}

}  // namespace

Mesh polygon_mesh(const SimplifiedIsosurface& low_poly, const Volume& volume) {
  Mesh mesh;
  mesh.name = volume.name;
  mesh.origin = volume.origin;
  mesh.positions = low_poly.positions;
  mesh.normals = low_poly.normals;
  for (const auto& c : collect_chart_corners(low_poly)) {
    mesh.triangles.push_back({c[0], c[1], c[2]});
    if (c[3] != kNoPolygon) mesh.triangles.push_back({c[0], c[2], c[3]});
  }
  mesh.normal_triangles = mesh.triangles;
  return mesh;
}

std::uint32_t find_atlas_size(const SimplifiedIsosurface& low_poly, double texels_per_unit,
                              std::uint32_t border) {
  constexpr std::uint32_t kAtlasSizeStep = 16, kMaxAtlasSize = 8192;
  const std::vector<RectangleSize> rectangle_sizes =
      rectangle_sizes_of(low_poly, collect_chart_corners(low_poly));
  const std::vector<PackSize> sizes =
      find_pack_sizes(rectangle_sizes, texels_per_unit, kMaxAtlasSize, border);
  double area = 0;
  std::uint32_t side = kAtlasSizeStep;
  for (const PackSize& size : sizes) {
    area += double(size.width) * size.height;
    side = std::max({side, size.width, size.height});
  }
  side =
      std::max(side, static_cast<std::uint32_t>(std::min<double>(std::sqrt(area), kMaxAtlasSize)));
  std::vector<PackPlace> rectangle_places;
  for (; side < kMaxAtlasSize; side += std::max(kAtlasSizeStep, side / 50)) {
    side = (side + kAtlasSizeStep - 1) / kAtlasSizeStep * kAtlasSizeStep;
    if (side < kMaxAtlasSize && pack_rectangles(sizes, side, rectangle_places)) return side;
  }
  return kMaxAtlasSize;
}

Atlas make_atlas(const SimplifiedIsosurface& low_poly, const Volume& volume, std::uint32_t size,
                 std::uint32_t border) {
  const auto corners = collect_chart_corners(low_poly);
  const std::vector<RectangleSize> rectangle_sizes = rectangle_sizes_of(low_poly, corners);
  Atlas atlas;
  std::vector<PackPlace> rectangle_places;
  std::vector<PackSize> sizes;
  for (atlas.border = border; atlas.border > 0; --atlas.border) {
    atlas.texels_per_unit =
        find_density(rectangle_sizes, size, atlas.border, rectangle_places, sizes);
    if (atlas.texels_per_unit > 0) break;
  }
  if (atlas.border == 0) {
    const std::string map =
        "a map of " + std::to_string(size) + " x " + std::to_string(size) + " texels";
    if (!low_poly.is_goal_reached) {
      throw Error(
          ErrorCode::input,
          "The topology of volume '" + volume.name + "' needs " + std::to_string(low_poly.faces) +
              " faces, more than requested, and their " + std::to_string(corners.size()) +
              " charts are too many for " + map +
              ": use only the outer surface, with gaps closed (" + option("outer_only") + " and " +
              option("outer_gap") +
              "), "
              "or leave small parts out (" +
              option("min_part") + "). Or allow that parts, holes and handles are lost (see " +
              option("keep_topology") + "), or ask for a larger map (" + option("size") + ").");
    }
    throw Error(ErrorCode::usage, "The low poly has " + std::to_string(corners.size()) +
                                      " charts, too many for " + map +
                                      ": ask for a larger map, or for fewer faces or a larger "
                                      "error.");
  }
  Mesh& mesh = atlas.mesh;
  mesh.name = volume.name;
  mesh.origin = volume.origin;
  mesh.positions = low_poly.positions;
  mesh.normals = low_poly.normals;
  atlas.charts.reserve(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    kiln_volume_chart chart =
        make_chart(low_poly, corners[i], sizes[i], rectangle_places[i], size, atlas.border);
    chart.first_texel = static_cast<std::uint32_t>(atlas.texels);
    atlas.texels += std::uint64_t{chart.size[0]} * chart.size[1];
    chart.first_ring = static_cast<std::uint32_t>(atlas.ring_texels);
    atlas.ring_texels += ring_texels(chart);
    chart.triangle = static_cast<std::uint32_t>(mesh.triangles.size());
    const auto first_uv = static_cast<std::uint32_t>(mesh.uvs.size());
    for (std::uint32_t k = 0; k < chart.corners; ++k) {
      const double x = chart.place[0] + double{chart.texel[k][0]} + 0.5;
      const double y = chart.place[1] + double{chart.texel[k][1]} + 0.5;
      mesh.uvs.push_back({static_cast<float>(x / size), static_cast<float>(1 - y / size)});
    }
    for (std::uint32_t k = 0; k < chart.triangles; ++k) {
      mesh.triangles.push_back({corners[i][0], corners[i][1 + k], corners[i][2 + k]});
      mesh.uv_triangles.push_back({first_uv, first_uv + 1 + k, first_uv + 2 + k});
    }
    atlas.charts.push_back(chart);
  }
  mesh.normal_triangles = mesh.triangles;
  return atlas;
}

}  // namespace kiln
