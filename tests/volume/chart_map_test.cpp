// Low polys of volumes by large charts: few vertices, and a map that is as good as that of the polygons.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "kiln/contour.h"
#include "kiln/measure.h"
#include "kiln/plan.h"
#include "kiln/render.h"
#include "kiln/unwrap.h"
#include "kiln/volume.h"
#include "reference/layout.h"
#include "support/environment.h"
#include "support/volumes.h"

namespace kiln {
namespace {

constexpr double kDegrees = 57.29577951308232;

Volume ball(std::uint32_t side, double radius) {
  const double c = (side - 1) / 2.0;
  return test::make_float_volume({side, side, side}, [=](double x, double y, double z) {
    return test::sphere_field(x - c, y - c, z - c, radius);
  });
}

ExtractOptions by_charts(std::uint32_t faces, std::uint32_t size) {
  ExtractOptions options;
  options.faces = faces;
  options.size = size;
  options.unwrap = UnwrapMethod::charts;
  return options;
}

/// Mean angle between a raw object-space map and the ball's own normals, degrees, at points of the low
/// poly's triangles, read bilinearly.
double error_of_ball(const ExtractResult& result, std::uint32_t side) {
  const Mesh& mesh = result.mesh;
  const Image& map = result.normal_map;
  const double c = (side - 1) / 2.0;
  double sum = 0, count = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const auto& w : {std::array{1 / 3.0, 1 / 3.0, 1 / 3.0}, std::array{0.9, 0.05, 0.05},
                          std::array{0.05, 0.9, 0.05}, std::array{0.0, 0.5, 0.5}}) {
      double u = 0, v = 0, p[3] = {0, 0, 0};
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec2 uv = mesh.uvs[mesh.uv_triangles[t][k]];
        const Vec3 at = mesh.positions[mesh.triangles[t][k]];
        u += w[k] * uv.x, v += w[k] * uv.y;
        p[0] += w[k] * at.x, p[1] += w[k] * at.y, p[2] += w[k] * at.z;
      }
      const double x = u * map.width - 0.5, y = (1 - v) * map.height - 0.5;
      const auto x0 = static_cast<std::size_t>(std::clamp(std::floor(x), 0.0, map.width - 2.0));
      const auto y0 = static_cast<std::size_t>(std::clamp(std::floor(y), 0.0, map.height - 2.0));
      double n[3] = {0, 0, 0};
      for (std::size_t k = 0; k < 4; ++k) {
        const double weight =
            ((k & 1) != 0 ? x - static_cast<double>(x0) : 1 - x + static_cast<double>(x0)) *
            ((k & 2) != 0 ? y - static_cast<double>(y0) : 1 - y + static_cast<double>(y0));
        const float* texel = map.at(x0 + (k & 1), y0 + (k >> 1));
        for (std::size_t i = 0; i < 3; ++i) n[i] += weight * texel[i];
      }
      const double radial[3] = {p[0] - c, p[1] - c, p[2] - c};
      const double dot = n[0] * radial[0] + n[1] * radial[1] + n[2] * radial[2];
      const double size =
          std::hypot(n[0], n[1], n[2]) * std::hypot(radial[0], radial[1], radial[2]);
      sum += kDegrees * std::acos(std::clamp(dot / size, -1.0, 1.0));
      ++count;
    }
  }
  return sum / count;
}

TEST(VolumeCharts, HaveFewVerticesAndTheLayoutOfUnwrap) {
  KILN_REQUIRE_DEVICE();
  const ExtractOptions options = by_charts(600, 256);
  const ExtractResult result = extract(*test::device(), ball(40, 15), options);
  const Mesh& mesh = result.mesh;
  EXPECT_LT(static_cast<double>(split_vertices(mesh)),
            1.7 * static_cast<double>(mesh.positions.size()));
  const std::int64_t grid = std::int64_t{1} << 24;
  const test::LayoutFacts facts =
      test::check_layout(mesh, grid, 2 * options.border_texels * grid / options.size, options.size);
  EXPECT_EQ(facts.first_fault, "");
  EXPECT_EQ(facts.charts, result.report.charts);
  EXPECT_NEAR(facts.coverage, result.report.coverage, 1e-9);
  EXPECT_EQ(mesh.triangles.size(), result.report.faces);

  // The same surface as by polygons.
  ExtractOptions pairs = options;
  pairs.unwrap = UnwrapMethod::pairs;
  const ExtractResult other = extract(*test::device(), ball(40, 15), pairs);
  EXPECT_EQ(mesh.positions, other.mesh.positions);
  EXPECT_EQ(mesh.triangles, other.mesh.triangles);
}

TEST(VolumeCharts, HoldTheSurfacesNormals) {
  KILN_REQUIRE_DEVICE();
  const Volume volume = ball(40, 15);
  ExtractOptions options = by_charts(400, 160);
  options.space = NormalMapSpace::object;
  options.raw = true;
  const double charts = error_of_ball(extract(*test::device(), volume, options), 40);
  options.unwrap = UnwrapMethod::pairs;
  const double pairs = error_of_ball(extract(*test::device(), volume, options), 40);
  // Measured: 0.45 and 0.42 degrees.
  EXPECT_LT(charts, 1.2 * pairs);
  EXPECT_LT(charts, 0.6);
}

TEST(VolumeCharts, TangentAndObjectSpaceSayTheSame) {
  KILN_REQUIRE_DEVICE();
  const Volume volume = ball(32, 11);
  ExtractOptions options = by_charts(300, 128);
  const ExtractResult tangent = extract(*test::device(), volume, options);
  options.space = NormalMapSpace::object;
  const ExtractResult object = extract(*test::device(), volume, options);
  const Scene turned(*test::device(), tangent.mesh, {&tangent.normal_map, NormalMapSpace::tangent});
  const Scene plain(*test::device(), object.mesh, {&object.normal_map, NormalMapSpace::object});
  RenderOptions picture;
  picture.size = 128;
  picture.samples = 1;
  picture.show_normals = true;
  EXPECT_LT(compare_normals(turned.draw(picture), plain.draw(picture)).mean_degrees, 0.6);
  options.space = NormalMapSpace::tangent;
  options.flip_y = true;
  const Image flipped = extract(*test::device(), volume, options).normal_map;
  double worst = 0;
  for (std::size_t i = 1; i < flipped.pixels.size(); i += 3) {
    const float sum = flipped.pixels[i] + tangent.normal_map.pixels[i];
    worst = std::max(worst, std::abs(double{sum} - 1));
  }
  EXPECT_LT(worst, 1e-6);
}

TEST(VolumeCharts, TexelsMayFollowDetail) {
  KILN_REQUIRE_DEVICE();
  // A ball with ripples on one side.
  const Volume volume = test::make_float_volume({48, 48, 48}, [](double x, double y, double z) {
    const double ripple = x > 24 ? 0.5 * std::sin(1.3 * y) * std::sin(1.3 * z) : 0;
    return test::sphere_field(x - 23.5, y - 23.5, z - 23.5, 18) + ripple;
  });
  ExtractOptions options = by_charts(500, 256);
  const ExtractResult even = extract(*test::device(), volume, options);
  options.density = TexelDensity::detail;
  const ExtractResult uneven = extract(*test::device(), volume, options);
  EXPECT_EQ(even.mesh.positions, uneven.mesh.positions);
  const auto right_of_map = [](const Mesh& mesh) {
    double right = 0, all = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const Vec2 &a = mesh.uvs[mesh.uv_triangles[t][0]], &b = mesh.uvs[mesh.uv_triangles[t][1]],
                 &c = mesh.uvs[mesh.uv_triangles[t][2]];
      const double area = std::abs((double{b.x} - a.x) * (double{c.y} - a.y) -
                                   (double{c.x} - a.x) * (double{b.y} - a.y));
      float x = 0;
      for (const std::uint32_t v : mesh.triangles[t]) x += mesh.positions[v].x / 3;
      all += area;
      if (x > 24) right += area;
    }
    return right / all;
  };
  EXPECT_GT(right_of_map(uneven.mesh), 1.1 * right_of_map(even.mesh));
  const std::int64_t grid = std::int64_t{1} << 24;
  const test::LayoutFacts facts = test::check_layout(
      uneven.mesh, grid, 2 * options.border_texels * grid / options.size, options.size);
  EXPECT_EQ(facts.first_fault, "");
  options.unwrap = UnwrapMethod::pairs;
  EXPECT_THROW(extract(*test::device(), volume, options), Error);
}

TEST(VolumeCharts, ChooseTheirSize) {
  KILN_REQUIRE_DEVICE();
  ExtractOptions options = by_charts(300, 1024);
  options.choose.size = true;
  const ExtractResult result = extract(*test::device(), ball(40, 15), options);
  EXPECT_EQ(result.report.used.size % 16, 0U);
  EXPECT_EQ(result.normal_map.width, result.report.used.size);
  EXPECT_GT(result.report.texels_per_cell, 0.9);
  EXPECT_LT(result.report.texels_per_cell, 1.5);
}

}  // namespace
}  // namespace kiln
