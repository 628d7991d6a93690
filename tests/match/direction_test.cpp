// Directions that stand on faces and meet at hard edges, against exact perpendicular projection.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "hard_scenes.h"
#include "kiln/kiln.h"
#include "mesh/hard_edges.h"
#include "reference/ray.h"
#include "support/environment.h"
#include "support/hard_scene.h"
#include "support/shapes.h"
#include "texel/edge_turn.h"

namespace kiln {
namespace {

constexpr double kWidth = 0.01;  // the default, of the diagonal
constexpr double kDegrees = 180 / 3.14159265358979323846;

BakeOptions options_of(RayDirection direction, std::uint32_t size = 256) {
  BakeOptions options;
  options.width = options.height = size;
  options.space = NormalMapSpace::object;
  options.ray.direction = direction;
  return options;
}

/// The least distance from a place to a hard edge, by all edges.
double edge_distance(const HardEdges& hard, const Vec3d& p) {
  double least = 1e30;
  for (const HardEdges::Edge& edge : hard.edges) {
    const Vec3d along(edge.along), from(edge.from);
    const double at = std::clamp(dot(p - from, along) / dot(along, along), 0.0, 1.0);
    least = std::min(least, length(p - (from + along * at)));
  }
  return least;
}

struct Lean {
  double worst = 0, mean = 0;  ///< Sideways from the perpendicular, texels, beyond the transition
};

Lean lean(const test::HardBake& bake, const HardEdges& hard, double width) {
  Lean result;
  std::size_t counted = 0;
  for (std::size_t i = 0; i < bake.samples.size(); ++i) {
    const Vec3d p(bake.samples.position[i]), n(bake.samples.normal[i]);
    if (bake.samples.found[i] == 0 || edge_distance(hard, p) < width) continue;
    const Vec3d way = bake.samples.match[i] - p;
    const double sideways = length(way - n * dot(way, n)) / std::sqrt(bake.samples.area[i]);
    result.worst = std::max(result.worst, sideways);
    result.mean += sideways;
    ++counted;
  }
  result.mean /= static_cast<double>(counted);
  return result;
}

/// Flat faces: beyond the transition each place lies under its texel, so stamps are where they should be; and
/// no texel is missed, those of convex edges neither.
TEST(Direction, StandsOnFlatFaces) {
  KILN_REQUIRE_DEVICE();
  for (const std::string_view name : {"cube", "bracket", "bolt"}) {
    SCOPED_TRACE(name);
    const sample::HardScene scene = sample::hard_scene(name);
    const Source source(*test::device(), scene.high);
    const Frame& frame = impl_of(source).frame;
    const HardEdges hard = HardEdges::of(LowSurface::of(scene.low, frame));
    const double width = kWidth * frame.diagonal * frame.scale;
    const test::HardBake turned(source, scene.low, options_of(RayDirection::automatic));
    const test::HardBake averaged(source, scene.low, options_of(RayDirection::averaged));
    EXPECT_LT(lean(turned, hard, width).worst, 0.5);
    EXPECT_GT(lean(averaged, hard, width).worst, 0.5);
    EXPECT_EQ(turned.baked.report.missed, 0U);
  }
}

/// Against the outermost face along the light face's own normal, by the oracle: beyond the transition, mean
/// angle between normals.
TEST(Direction, GivesThePerpendicularsNormals) {
  KILN_REQUIRE_DEVICE();
  for (const std::string_view name : {"cube", "bracket"}) {
    SCOPED_TRACE(name);
    const sample::HardScene scene = sample::hard_scene(name);
    const Source source(*test::device(), scene.high);
    const Source::Impl& impl = impl_of(source);
    const HardEdges hard = HardEdges::of(LowSurface::of(scene.low, impl.frame));
    const double unit = impl.frame.diagonal * impl.frame.scale;
    const test::HardBake bake(source, scene.low, options_of(RayDirection::automatic));
    const Image& map = bake.baked.maps[0].image;
    double sum = 0;
    std::size_t counted = 0;
    for (std::size_t i = 0; i < bake.samples.size(); i += 97) {
      const Vec3 p = bake.samples.position[i], n = bake.samples.normal[i];
      if (edge_distance(hard, Vec3d(p)) < kWidth * unit) continue;
      const reference::RayHit hit = reference::cast_ray(
          impl.positions, impl.triangles, {p.x, p.y, p.z}, {n.x, n.y, n.z},
          {.t_min = -0.02 * unit, .t_max = 0.02 * unit, .greatest_first = true, .keep = 1});
      if (!hit.found) continue;
      const Triangle& corners = scene.high.normal_triangles[hit.triangle];
      const Vec3d exact = Vec3d(scene.high.normals[corners[0]]) * (1 - hit.u - hit.v) +
                          Vec3d(scene.high.normals[corners[1]]) * hit.u +
                          Vec3d(scene.high.normals[corners[2]]) * hit.v;
      const float* texel = &map.pixels[3 * bake.samples.element[i]];
      const Vec3d baked(2.0 * texel[0] - 1, 2.0 * texel[1] - 1, 2.0 * texel[2] - 1);
      const double cosine = dot(exact, baked) / (length(exact) * length(baked));
      sum += std::acos(std::clamp(cosine, -1.0, 1.0)) * kDegrees;
      ++counted;
    }
    EXPECT_GT(counted, 200U);
    EXPECT_LT(sum / static_cast<double>(counted), 1.0);
  }
}

/// Directions of one band, after they turned.
std::vector<float> directions_of(const LowSurface& surface, RayDirection direction, double width,
                                 std::uint32_t size) {
  cl::Context& context = context_of(*test::device());
  TexelSampler sampler(context, surface, {size, size});
  TexelBand band = sampler.sample(0);
  EdgeTurn(context, surface, direction, width).apply(context, band);
  std::vector<float> points = band.points.download(context);
  std::vector<float> result(6 * band.sample_count);
  for (std::size_t k = 0; k < 6; ++k) {
    for (std::size_t i = 0; i < band.sample_count; ++i) {
      result[6 * i + k] = points[k * band.capacity + i];
    }
  }
  return result;
}

/// The largest angle between directions of samples within `near` of each other, degrees.
double largest_step(const std::vector<float>& d, double near) {
  double largest = 0;
  for (std::size_t i = 0; i < d.size(); i += 6) {
    for (std::size_t j = i + 6; j < d.size(); j += 6) {
      const Vec3d way(d[i] - d[j], d[i + 1] - d[j + 1], d[i + 2] - d[j + 2]);
      if (dot(way, way) > near * near) continue;
      const double cosine =
          double{d[i + 3]} * d[j + 3] + double{d[i + 4]} * d[j + 4] + double{d[i + 5]} * d[j + 5];
      largest = std::max(largest, std::acos(std::clamp(cosine, -1.0, 1.0)) * kDegrees);
    }
  }
  return largest;
}

/// At a cube's edges the averaged direction leans 45 degrees (at corners 54.7), and turns over the width: the
/// smooth step's slope is 1.5 at most, so two samples `near` apart part by no more than
/// 2 * 1.5 * near / width * 54.7 degrees, and by what averaged directions themselves part.
TEST(Direction, IsContinuousAcrossHardEdges) {
  KILN_REQUIRE_DEVICE();
  const Mesh cube = test::cube(1);
  const LowSurface surface = LowSurface::of(cube, Frame::of(cube));
  const double width = 0.3, near = 0.02;
  const double averaged =
      largest_step(directions_of(surface, RayDirection::averaged, width, 96), near);
  const double turned =
      largest_step(directions_of(surface, RayDirection::automatic, width, 96), near);
  const double face = largest_step(directions_of(surface, RayDirection::face, width, 96), near);
  EXPECT_LT(turned, averaged + 3 * near / width * 54.7);
  EXPECT_NEAR(face, 90, 1e-3);
}

TEST(Direction, LeavesSmoothMeshesAlone) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::BumpySphere::dense(5000));
  const Mesh low = test::BumpySphere::light();
  const BakeResult automatic = bake(source, low, options_of(RayDirection::automatic, 128));
  const BakeResult averaged = bake(source, low, options_of(RayDirection::averaged, 128));
  EXPECT_EQ(automatic.maps[0].image.pixels, averaged.maps[0].image.pixels);
}

TEST(Direction, RefusesAWidthOfNothing) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::plane(2, 2));
  BakeOptions options = options_of(RayDirection::automatic, 8);
  options.ray.edge_width = Length::absolute(0);
  EXPECT_THROW(bake(source, test::plane(1, 1), options), Error);
}

}  // namespace
}  // namespace kiln
