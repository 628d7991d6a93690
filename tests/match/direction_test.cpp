// Directions that stand on faces and meet at hard edges, against exact perpendicular projection.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "hard.h"
#include "hard_scenes.h"
#include "kiln/session.h"
#include "mesh/hard_edges.h"
#include "reference/ray.h"
#include "support/environment.h"
#include "support/hard_scene.h"
#include "support/shapes.h"
#include "texel/sample_directions.h"

namespace kiln {
namespace {

constexpr double kWidth = 0.01;  // of the diagonal: no edge of these scenes turns rays farther off
constexpr double kDegrees = 180 / 3.14159265358979323846;

BakeOptions options_of(RayDirection direction, std::uint32_t size = 256) {
  BakeOptions options;
  options.width = options.height = size;
  options.encoding.space = NormalMapSpace::object;
  options.match.ray.direction = direction;
  return options;
}

/// The least distance from a place to a hard edge, by all edges.
double edge_distance(const HardEdges& hard, const Vec3d& p) {
  double least = 1e30;
  for (const HardEdges::Edge& edge : hard.edges) {
    const Vec3d along = to_double(edge.along), from = to_double(edge.from);
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
    const Vec3d p = to_double(bake.samples.position[i]), n = to_double(bake.samples.normal[i]);
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
      if (edge_distance(hard, to_double(p)) < kWidth * unit) continue;
      const reference::RayHit hit = reference::cast_ray(
          impl.positions, impl.triangles, {p.x, p.y, p.z}, {n.x, n.y, n.z},
          {.t_min = -0.02 * unit, .t_max = 0.02 * unit, .greatest_first = true, .keep = 1});
      if (!hit.found) continue;
      const Triangle& corners = scene.high.normal_triangles[hit.triangle];
      const Vec3d exact = to_double(scene.high.normals[corners[0]]) * (1 - hit.u - hit.v) +
                          to_double(scene.high.normals[corners[1]]) * hit.u +
                          to_double(scene.high.normals[corners[2]]) * hit.v;
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
  const HardEdges hard = HardEdges::of(surface);
  const std::vector<float> widths(hard.edges.size(), static_cast<float>(width));
  if (direction == RayDirection::automatic) {
    SampleDirections(context, surface, hard, widths).set_directions(context, band);
  } else if (direction == RayDirection::face) {
    SampleDirections(context, surface, hard, {}).set_directions(context, band);
  }
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

/// The share of the averaged direction falls over each edge's own width, by the distance to the edge and not to its line:
/// against all edges, on a mesh whose faces go round corners.
TEST(Direction, TurnsByTheDistanceToTheNearestEdge) {
  KILN_REQUIRE_DEVICE();
  const sample::HardScene scene = sample::hard_scene("bracket");
  const LowSurface surface = LowSurface::of(scene.low, Frame::of(scene.high));
  const HardEdges hard = HardEdges::of(surface);
  std::vector<float> widths;
  for (std::size_t e = 0; e < hard.edges.size(); ++e)
    widths.push_back(0.02F + 0.01F * static_cast<float>(e % 5));
  cl::Context& context = context_of(*test::device());
  TexelSampler sampler(context, surface, {64, 64});
  TexelBand band = sampler.sample(0);
  const std::vector<float> before = band.points.download(context);
  SampleDirections(context, surface, hard, widths).set_directions(context, band);
  const std::vector<float> after = band.points.download(context);
  const std::vector<std::uint32_t> triangle = band.triangle.download(context);
  const std::vector<float> weights = band.barycentric.download(context);
  const std::size_t plane = band.capacity;
  std::size_t blended = 0;
  for (std::size_t i = 0; i < band.sample_count; ++i) {
    const auto at = [&](const std::vector<float>& planes, std::size_t first) {
      return Vec3d(planes[first * plane + i], planes[(first + 1) * plane + i],
                   planes[(first + 2) * plane + i]);
    };
    const Vec3d p = at(before, 0);
    double s = 1;
    for (std::size_t e = 0; e < hard.edges.size(); ++e) {
      const Vec3d along = to_double(hard.edges[e].along), from = to_double(hard.edges[e].from);
      const double share = std::clamp(dot(p - from, along) / dot(along, along), 0.0, 1.0);
      s = std::min(s, length(p - (from + along * share)) / widths[e]);
    }
    const double averaged = 1 - s * s * (3 - 2 * s);
    const auto& [a, b, c] = surface.triangles[triangle[i]];
    const double u = weights[i], v = weights[plane + i];
    const Vec3d own =
        to_double(a.normal) * (1 - u - v) + to_double(b.normal) * u + to_double(c.normal) * v;
    const Vec3d wanted = at(before, 3) * averaged + own * ((1 - averaged) / length(own));
    EXPECT_LT(length(at(after, 3) - wanted * (1 / length(wanted))), 1e-4) << i;
    blended += averaged > 0.1 && averaged < 0.9 ? 1 : 0;
  }
  EXPECT_GT(blended, 100U);
}

TEST(Direction, LeavesSmoothMeshesAlone) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::BumpySphere::dense(5000));
  const Mesh low = test::BumpySphere::light();
  const BakeResult automatic = bake(source, low, options_of(RayDirection::automatic, 128));
  const BakeResult averaged = bake(source, low, options_of(RayDirection::averaged, 128));
  EXPECT_EQ(automatic.maps[0].image.pixels, averaged.maps[0].image.pixels);
}

/// A cube of half-size 1 with edges rounded by `radius`, and `gap` larger all round.
Mesh rounded_cube(double radius, double gap = 0) {
  sample::HighPolyParts parts("rounded");
  const double half = 1 + gap;
  parts.rounded_box({}, {half, half, half}, radius, 8);
  return parts.mesh();
}

EdgeReport edges_of(const Mesh& high, const Mesh& low) {
  const Source source(*test::device(), high);
  const BakeResult result = bake(source, low, options_of(RayDirection::automatic, 16));
  EXPECT_NE(result.report.edges.edges, 0U);
  return result.report.edges;
}

/// A rounded edge of radius r is parallel to its face within 5 degrees from r (1 - sin 5 degrees) off the edge,
/// and facets of 5.6 degrees, and distances that are looked at, stand before that: two fifths of 0.8 r to 1.1 r.
TEST(Direction, FindsTheWidthOfBevels) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = test::cube(2);
  for (const double radius : {0.03, 0.06, 0.1}) {
    SCOPED_TRACE(radius);
    const EdgeReport edges = edges_of(rounded_cube(radius), low);
    EXPECT_EQ(edges.edges, 12U);
    EXPECT_EQ(edges.found, 12U);
    EXPECT_GT(edges.min_width, 0.4 * 0.8 * radius);
    EXPECT_LT(edges.max_width, 0.4 * 1.1 * radius);
  }
  // A sharp edge has none, and where both faces lie farther out, rays turn over twice as much.
  const EdgeReport sharp = edges_of(test::cube(2), low);
  EXPECT_EQ(sharp.found, 12U);
  EXPECT_NEAR(sharp.max_width, 0.0005 * std::sqrt(12), 1e-6);
  const EdgeReport farther = edges_of(rounded_cube(0.001, 0.04), low);
  EXPECT_NEAR(farther.min_width, 0.08, 1e-3);
  EXPECT_NEAR(farther.max_width, 0.08, 1e-3);
}

/// Red turns rays to the mesh's own normals, black to averaged ones.
TEST(Direction, FollowsPaint) {
  KILN_REQUIRE_DEVICE();
  const sample::HardScene scene = sample::hard_scene("cube");
  const Source source(*test::device(), scene.high);
  const auto baked = [&](RayDirection direction, const Mesh& low) {
    return bake(source, low, options_of(direction, 128)).maps[0].image.pixels;
  };
  Mesh low = scene.low;
  EXPECT_THROW(baked(RayDirection::painted, low), Error);
  // Directions agree to rounding, so a few texels at the borders of facets may find the next one.
  const auto apart = [&](RayDirection a, RayDirection b) {
    const std::vector<float> x = baked(a, low), y = baked(b, low);
    std::size_t differ = 0;
    for (std::size_t i = 0; i < x.size(); ++i) differ += std::abs(x[i] - y[i]) > 1e-4F ? 1 : 0;
    return static_cast<double>(differ) / static_cast<double>(x.size());
  };
  low.colors.assign(low.positions.size(), {255, 0, 0, 255});
  EXPECT_LT(apart(RayDirection::painted, RayDirection::face), 1e-3);
  EXPECT_GT(apart(RayDirection::painted, RayDirection::averaged), 0.05);
  low.colors.assign(low.positions.size(), {0, 255, 255, 255});
  EXPECT_LT(apart(RayDirection::painted, RayDirection::averaged), 1e-3);
}

/// Half the way between: at the middle of a face whose corners are 0.5, the direction is the mean of both.
TEST(Direction, BlendsPaint) {
  KILN_REQUIRE_DEVICE();
  Mesh cube = test::cube(1);
  cube.colors.assign(cube.positions.size(), {51, 0, 0, 255});  // a fifth
  cl::Context& context = context_of(*test::device());
  const LowSurface surface = LowSurface::of(cube, Frame::of(cube));
  TexelSampler sampler(context, surface, {32, 32});
  TexelBand band = sampler.sample(0);
  const std::vector<float> before = band.points.download(context);
  SampleDirections(context, surface).set_directions(context, band);
  const std::vector<float> after = band.points.download(context);
  const std::vector<std::uint32_t> triangle = band.triangle.download(context);
  const std::size_t plane = band.capacity;
  for (std::size_t i = 0; i < band.sample_count; ++i) {
    const auto at = [&](const std::vector<float>& planes) {
      return Vec3d(planes[3 * plane + i], planes[4 * plane + i], planes[5 * plane + i]);
    };
    const Vec3d own = to_double(surface.triangles[triangle[i]][0].normal);  // flat faces
    const Vec3d wanted = at(before) * 0.8 + own * 0.2;
    EXPECT_LT(length(at(after) - wanted * (1 / length(wanted))), 1e-5);
  }
}

/// A session whose high poly moves finds bevels anew.
TEST(Direction, SessionsFollowBevels) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = test::cube(2), before = rounded_cube(0.05), after = rounded_cube(0.1);
  SessionOptions session;
  session.bounds = Bounds::of(before);
  const BakeOptions options = options_of(RayDirection::automatic, 64);
  BakeSession moving(*test::device(), before, low, options, session);
  BakeSession fresh(*test::device(), after, low, options, session);
  const std::vector<float> first = moving.bake().maps[0].image.pixels;
  moving.set_positions(0, after.positions);
  moving.set_normals(0, after.normals);
  const BakeResult& moved = moving.bake();
  const BakeResult& wanted = fresh.bake();
  EXPECT_EQ(moved.maps[0].image.pixels, wanted.maps[0].image.pixels);
  EXPECT_NE(moved.maps[0].image.pixels, first);
  EXPECT_EQ(moved.report.edges.max_width, wanted.report.edges.max_width);
}

TEST(Direction, RefusesAWidthOfNothing) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::plane(2, 2));
  BakeOptions options = options_of(RayDirection::automatic, 8);
  options.match.ray.edge_width = Length::absolute(0);
  EXPECT_THROW(bake(source, test::plane(1, 1), options), Error);
}

}  // namespace
}  // namespace kiln
