// Directions of visibility against the brute-force oracle and against what geometry says, and the field
// that texels make of them.
#include "match/visibility.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "kiln/match.h"
#include "kiln/render.h"
#include "mesh/frame.h"
#include "mesh/kernels_shared.h"
#include "mesh/surface_links.h"
#include "reference/ray.h"
#include "reference/visibility.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using Point = std::array<double, 3>;
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kStart = 1.0 / 65536;  // where rays begin, host/match/visibility.cpp

Point point(const Vec3& v) { return {v.x, v.y, v.z}; }

double angle(const Vec3d& a, const Vec3d& b) {
  return std::atan2(length(cross(a, b)), dot(a, b)) / kDegree;
}

/// Triangles without UVs, as a low poly whose UVs do not matter.
Mesh with_uvs(Mesh mesh) {
  mesh.uvs = {{0, 0}, {1, 0}, {0, 1}};
  mesh.uv_triangles.assign(mesh.triangles.size(), {0, 1, 2});
  return mesh;
}

void add_quad(Mesh& mesh, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), {a, b, c, d});
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
}

/// A floor at z = 0 and a wall at x = 0 that faces it, both as large as `size`.
Mesh corner(float size) {
  Mesh mesh;
  mesh.name = "corner";
  add_quad(mesh, {0, -size, 0}, {size, -size, 0}, {size, size, 0}, {0, size, 0});
  add_quad(mesh, {0, -size, 0}, {0, size, 0}, {0, size, size}, {0, -size, size});
  return mesh;
}

/// A round pit in a plate: its floor at z = -depth.
Mesh pit(float radius, float depth) {
  constexpr int kSides = 96;
  Mesh mesh;
  mesh.name = "pit";
  for (int i = 0; i < kSides; ++i) {
    const auto at = [&](int k, float r, float z) {
      const double phi = 2 * std::numbers::pi * k / kSides;
      return Vec3{static_cast<float>(r * std::cos(phi)), static_cast<float>(r * std::sin(phi)), z};
    };
    add_quad(mesh, at(i, radius, 0), at(i, 1, 0), at(i + 1, 1, 0), at(i + 1, radius, 0));
    add_quad(mesh, at(i, radius, -depth), at(i, radius, 0), at(i + 1, radius, 0),
             at(i + 1, radius, -depth));
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(),
                          {{0, 0, -depth}, at(i, radius, -depth), at(i + 1, radius, -depth)});
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

/// A probe on a mesh in a frame of its own.
struct Scene {
  Mesh mesh;
  Frame frame;
  LowSurface surface;
  std::vector<ProbeDirection> directions;

  explicit Scene(Mesh given, std::uint32_t count = 512)
      : mesh(given.uvs.empty() ? with_uvs(std::move(given)) : std::move(given)),
        frame(Frame::of(mesh)),
        surface(LowSurface::of(mesh, frame)),
        directions(probe_directions({.directions = count})) {}

  VisibilityProbe probe(Traversal traversal = Traversal::automatic,
                        std::uint32_t view_size = 256) const {
    return {context_of(*test::device()), surface, directions, view_size, traversal};
  }
  Vec3 in_frame(const Vec3d& p) const {
    return to_float(Vec3d{p.x - frame.center[0], p.y - frame.center[1], p.z - frame.center[2]} *
                    frame.scale);
  }
};

struct Seen {
  Vec3d sum{};
  double weight;
};

enum class By { views, rays };

std::vector<Seen> see(VisibilityProbe& probe, const std::vector<Vec3>& positions,
                      const std::vector<Vec3>& normals, By by) {
  VisibilityProbe::ProbedPoints places = probe.make_points(positions, normals);
  if (by == By::rays) {
    probe.add_directions_by_rays(places);
  } else {
    probe.add_directions_by_views(places);
  }
  const std::vector<float> sums = places.sums.download(context_of(*test::device()));
  const std::size_t plane = places.capacity;
  std::vector<Seen> result;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    result.push_back({{sums[i], sums[i + plane], sums[i + 2 * plane]}, sums[i + 3 * plane]});
  }
  return result;
}

/// Places spread over a mesh's triangles.
void scatter(const Scene& scene, std::size_t count, std::vector<Vec3>& positions,
             std::vector<Vec3>& normals) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(0.02, 0.98);
  const std::vector<Vec3> corners = scene.frame.to_frame(scene.mesh);
  while (positions.size() < count) {
    const Triangle& t = scene.mesh.triangles[random() % scene.mesh.triangles.size()];
    double u = share(random);
    double v = share(random);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const Vec3d a = to_double(corners[t[0]]);
    const Vec3d b = to_double(corners[t[1]]) - a;
    const Vec3d c = to_double(corners[t[2]]) - a;
    const Vec3d normal = cross(b, c);
    if (!(length(normal) > 0)) continue;
    positions.push_back(to_float(a + b * u + c * v));
    normals.push_back(to_float(normal * (1 / length(normal))));
  }
}

TEST(Visibility, RaysAddUpWhatTheOracleDoes) {
  KILN_REQUIRE_DEVICE();
  std::size_t doubts = 0;
  std::size_t count = 0;
  for (const Mesh& mesh :
       {test::torus(24, 12), pit(0.3F, 0.5F), corner(1), test::random_soup(120, 3, 0.5)}) {
    const Scene scene(mesh, 200);
    std::vector<Vec3> positions, normals;
    scatter(scene, 150, positions, normals);
    const std::vector<Vec3> corners = scene.frame.to_frame(scene.mesh);
    std::vector<reference::SeenDirection> directions;
    for (const ProbeDirection& d : scene.directions) {
      const Vec3 toward = to_float(d.toward);  // as the device has it
      directions.push_back({point(toward), d.weight});
    }
    // Positions are scaled by a power of two before rays begin; the scene fills half the unit ball.
    double radius = 0;
    for (const Vec3& p : corners) radius = std::max(radius, length(to_double(p)));
    const double scale = std::exp2(-2 - std::floor(std::log2(radius)));
    for (const Traversal traversal : {Traversal::cpu, Traversal::gpu}) {
      VisibilityProbe probe = scene.probe(traversal);
      const std::vector<Seen> seen = see(probe, positions, normals, By::rays);
      for (std::size_t i = 0; i < positions.size(); ++i) {
        const reference::SeenSum expected = reference::see(
            corners, scene.mesh.triangles, point(positions[i]), point(normals[i]), directions,
            KILN_VISIBILITY_LEAST_COSINE, kStart / scale, 4 / scale, 1e-5);
        // Rounding: 200 sums of at most 100 in single precision, and what is in doubt.
        const double tolerance = 200 * 100 * 0x1p-24 + expected.doubtful;
        doubts += expected.doubtful > 0 ? 1 : 0;
        ++count;
        ASSERT_NEAR(seen[i].weight, expected.weight, tolerance) << mesh.name << " " << i;
        const Vec3d sum{expected.sum[0], expected.sum[1], expected.sum[2]};
        ASSERT_LE(length(seen[i].sum - sum), 2 * tolerance) << mesh.name << " " << i;
      }
    }
  }
  EXPECT_LT(doubts, count / 10);
}

TEST(Visibility, ViewsComeCloseToRays) {
  KILN_REQUIRE_DEVICE();
  for (const Mesh& mesh : {pit(0.3F, 0.5F), test::BumpyTorus::light()}) {
    const Scene scene(mesh);
    std::vector<Vec3> positions, normals;
    scatter(scene, 1000, positions, normals);
    double last = 90;
    std::vector<Seen> exact;  // rays have no pixels
    for (const std::uint32_t size : {64U, 256U}) {
      VisibilityProbe probe = scene.probe(Traversal::automatic, size);
      if (exact.empty()) exact = see(probe, positions, normals, By::rays);
      const std::vector<Seen> views = see(probe, positions, normals, By::views);
      double sum = 0;
      std::size_t counted = 0;
      for (std::size_t i = 0; i < exact.size(); ++i) {
        if (!(exact[i].weight > 0)) continue;
        sum += angle(exact[i].sum, views[i].sum);
        ++counted;
      }
      const double mean = sum / static_cast<double>(counted);
      EXPECT_GT(counted, positions.size() * 9 / 10);
      EXPECT_LT(mean, size == 64 ? 4 : 1) << mesh.name << " " << size;
      EXPECT_LT(mean, last) << "more pixels must help: " << mesh.name << " " << size;
      last = mean;
    }
  }
}

TEST(Visibility, VectorsAndSingleSamplesAgreeToTheBit) {
  KILN_REQUIRE_DEVICE();
  const Scene scene(test::BumpyTorus::light());
  std::vector<Vec3> positions, normals;
  scatter(scene, 1001, positions, normals);
  std::vector<std::vector<Seen>> all;
  for (const Traversal traversal : {Traversal::cpu, Traversal::gpu, Traversal::cpu}) {
    VisibilityProbe probe = scene.probe(traversal);
    all.push_back(see(probe, positions, normals, By::views));
  }
  for (std::size_t i = 0; i < positions.size(); ++i) {
    for (const std::size_t other : {1U, 2U}) {
      ASSERT_EQ(all[0][i].weight, all[other][i].weight);
      ASSERT_EQ(length(all[0][i].sum - all[other][i].sum), 0);
    }
  }
}

TEST(Visibility, AnOpenPlaneIsSeenAlongItsNormal) {
  KILN_REQUIRE_DEVICE();
  const Scene scene(test::plane(3, 3));
  VisibilityProbe probe = scene.probe();
  const std::vector<Vec3> at = {scene.in_frame({0.1, 0.05, 0})};
  for (const By by : {By::views, By::rays}) {
    const Seen seen = see(probe, at, {{0, 0, 1}}, by)[0];
    EXPECT_LT(angle(seen.sum, {0, 0, 1}), 0.5);
    // Half of all directions see it, by a mean cosine of 1/2; their mean has the length 2/3.
    EXPECT_NEAR(seen.weight, 128, 1);
    EXPECT_NEAR(length(seen.sum) / seen.weight, 2.0 / 3, 0.005);
  }
}

TEST(Visibility, ASphereIsSeenAlongItsNormals) {
  KILN_REQUIRE_DEVICE();
  const Scene scene(test::icosphere(3));
  std::vector<Vec3> positions, normals;
  scatter(scene, 500, positions, normals);
  VisibilityProbe probe = scene.probe();
  for (const By by : {By::views, By::rays}) {
    const std::vector<Seen> seen = see(probe, positions, normals, by);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      ASSERT_LT(angle(seen[i].sum, to_double(normals[i])), by == By::rays ? 1 : 3) << i;
    }
  }
}

TEST(Visibility, ACornerIsSeenFromItsOpenQuarter) {
  KILN_REQUIRE_DEVICE();
  // Mean direction of a floor beside a wall that hides half of all directions: the integral of d (d . n) over the open
  // quarter is (2/3, 0, pi/3), so the direction leans away from the wall by atan(2/pi) = 32.48 degrees.
  const Scene scene(corner(1), 1024);
  VisibilityProbe probe = scene.probe(Traversal::automatic, 512);
  const std::vector<Vec3> at = {scene.in_frame({0.02, 0, 0})};
  const double expected = std::atan2(2, std::numbers::pi);
  const Vec3d direction{std::sin(expected), 0, std::cos(expected)};
  for (const By by : {By::views, By::rays}) {
    const Seen seen = see(probe, at, {{0, 0, 1}}, by)[0];
    EXPECT_LT(angle(seen.sum, direction), 1)
        << seen.sum.x << " " << seen.sum.y << " " << seen.sum.z;
  }
}

TEST(Visibility, TheFloorOfAPitSeesItsMouth) {
  KILN_REQUIRE_DEVICE();
  constexpr float kRadius = 0.3F;
  constexpr float kDepth = 0.5F;
  const Scene scene(pit(kRadius, kDepth), 2048);
  VisibilityProbe probe = scene.probe();
  const std::vector<Vec3> at = {scene.in_frame({0.001, 0.002, -kDepth})};
  // A cone of half-angle a: the mean's length is 2/3 (1 - cos^3 a) / sin^2 a, the weight N sin^2 a / 4.
  const double cosine = kDepth / std::hypot(kRadius, kDepth);
  const double sine2 = 1 - cosine * cosine;
  for (const By by : {By::views, By::rays}) {
    const Seen seen = see(probe, at, {{0, 0, 1}}, by)[0];
    EXPECT_LT(angle(seen.sum, {0, 0, 1}), 1);
    EXPECT_NEAR(length(seen.sum) / seen.weight, 2.0 / 3 * (1 - cosine * cosine * cosine) / sine2,
                0.01);
    EXPECT_NEAR(seen.weight, 512 * sine2, 512 * 0.015);
  }
}

TEST(Visibility, PixelsOfAnItemBufferCountAsRaysDo) {
  KILN_REQUIRE_DEVICE();
  const Scene scene(test::torus(24, 12));
  VisibilityProbe probe = scene.probe(Traversal::automatic, 512);
  const std::vector<float> corners = probe.corners();
  const std::vector<Vec3> at = scene.frame.to_frame(scene.mesh);
  std::vector<Vec3> middles, normals;
  for (const Triangle& t : scene.mesh.triangles) {
    const Vec3d a = to_double(at[t[0]]), b = to_double(at[t[1]]), c = to_double(at[t[2]]);
    middles.push_back(to_float((a + b + c) * (1.0 / 3)));
    const Vec3d normal = cross(b - a, c - a);
    normals.push_back(to_float(normal * (1 / length(normal))));
  }
  const std::vector<Seen> seen = see(probe, middles, normals, By::rays);
  double worst = 0;
  double sum = 0;
  for (std::size_t t = 0; t < middles.size(); ++t) {
    Vec3d total{};
    for (std::size_t k = 0; k < 3; ++k) {
      const float* c = &corners[12 * t + 4 * k];
      total += Vec3d{c[0], c[1], c[2]};
      // No corner gets more than the whole, nor directions that are longer than their weight.
      ASSERT_GE(c[3], length(Vec3d{c[0], c[1], c[2]}) * 0.9999);
    }
    const double error = angle(total, seen[t].sum);
    worst = std::max(worst, error);
    sum += error;
  }
  // Pixels average over the face, rays begin at its middle.
  EXPECT_LT(sum / static_cast<double>(middles.size()), 1);
  EXPECT_LT(worst, 8);
}

TEST(Visibility, LikelyViewsDrawTheDirection) {
  KILN_REQUIRE_DEVICE();
  Scene scene(test::plane(1, 1));
  scene.directions =
      probe_directions({.likelihood = ViewLikelihood::list,
                        .likelihoods = {{{1, 0, 1}, 1}, {{-1, 0, 1}, 0}, {{0, 0, -1}, 0}}});
  EXPECT_LT(scene.directions.size(), 300U);
  VisibilityProbe probe = scene.probe();
  const Seen seen = see(probe, {scene.in_frame({0, 0, 0})}, {{0, 0, 1}}, By::views)[0];
  EXPECT_GT(seen.sum.x, 0.3 * seen.sum.z);
  EXPECT_NEAR(seen.sum.y, 0, 0.02 * seen.sum.z);
  for (const ProbeDirection& d : probe_directions({.likelihood = ViewLikelihood::horizon})) {
    ASSERT_NEAR(d.weight, 1 - d.toward.y * d.toward.y, 1e-6);
  }
  for (const ProbeDirection& d : probe_directions({.likelihood = ViewLikelihood::up})) {
    ASSERT_NEAR(d.weight, (1 + d.toward.y) / 2, 1e-6);
  }
}

TEST(Visibility, RefusesWhatItCannotDo) {
  const auto refused = [](const VisibilityOptions& options) {
    try {
      check_visibility(options);
    } catch (const Error& error) {
      return error.code() == ErrorCode::usage;
    }
    return false;
  };
  EXPECT_TRUE(refused({.directions = 0}));
  EXPECT_TRUE(refused({.directions = 4097}));
  EXPECT_TRUE(refused({.view_size = 15}));
  EXPECT_TRUE(refused({.smoothing = 257}));
  EXPECT_TRUE(refused({.likelihood = ViewLikelihood::list}));
  EXPECT_TRUE(refused({.likelihood = ViewLikelihood::list, .likelihoods = {{{0, 0, 0}, 1}}}));
  EXPECT_TRUE(refused({.likelihood = ViewLikelihood::list, .likelihoods = {{{0, 0, 1}, -1}}}));
  EXPECT_FALSE(refused({}));
  EXPECT_THROW(
      probe_directions({.likelihood = ViewLikelihood::list, .likelihoods = {{{0, 0, 1}, 0}}}),
      Error);
}

}  // namespace
}  // namespace kiln
