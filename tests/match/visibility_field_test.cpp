// Fields of visibility directions on maps: across seams, filled, and turned.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "kiln/bake.h"
#include "match/visibility.h"
#include "match/visibility_scene.h"
#include "mesh/frame.h"
#include "mesh/kernels_shared.h"
#include "mesh/surface_links.h"
#include "reference/visibility.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using test::Cell;
using test::folded;
using test::grid;
using test::kCell;
using test::kDegree;
using test::whole_map;

double angle(const Vec3d& a, const Vec3d& b) {
  return std::atan2(length(cross(a, b)), dot(a, b)) / kDegree;
}

/// A field on the host.
struct Field {
  std::uint32_t width, height;
  std::vector<float> values;
  VisibilityReport report;

  Field(const Mesh& mesh, std::uint32_t map_width, std::uint32_t map_height,
        const VisibilityOptions& options)
      : width(map_width), height(map_height) {
    cl::Context& context = context_of(*test::device());
    const LowSurface surface = LowSurface::of(mesh, Frame::of(mesh));
    const VisibilityField field(context, surface, width, height, options, Traversal::automatic,
                                report);
    values = field.field().download(context);
    EXPECT_EQ(field.field_width(), width);
  }
  Vec3d at(int x, int y) const {
    const float* v =
        &values[4 * (static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x))];
    return {v[0], v[1], v[2]};
  }
  bool covered(int x, int y) const {
    return values[4 * (static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)) + 3] > 0;
  }
};

/// Quads on their own, `gap` texels apart, every other one turned by a quarter.
Vec2 cut_map(int c, int r, int i, int j, int gap) {
  const bool turned = (c + r) % 2 == 1;
  const int x = turned ? 1 - j : i;
  const int y = turned ? i : j;
  return {static_cast<float>(8 + (kCell + gap) * c + kCell * x),
          static_cast<float>(8 + (kCell + gap) * r + kCell * y)};
}

/// Place of a quad's texel (x, y) on the cut map.
Cell cut_texel(int c, int r, int x, int y, int gap) {
  const bool turned = (c + r) % 2 == 1;
  return {8 + (kCell + gap) * c + (turned ? kCell - 1 - y : x),
          8 + (kCell + gap) * r + (turned ? x : y)};
}

TEST(VisibilityField, IsTheSameHoweverTheSurfaceIsCut) {
  KILN_REQUIRE_DEVICE();
  constexpr int kColumns = 6;
  constexpr int kRows = 3;
  constexpr int kGap = 3;
  const Mesh whole = grid(kColumns, kRows, folded, whole_map, 256, 128);
  const Mesh cut = grid(
      kColumns, kRows, folded, [](int c, int r, int i, int j) { return cut_map(c, r, i, j, kGap); },
      256, 128);
  VisibilityOptions options;
  options.smoothing = 24;
  const Field one(whole, 256, 128, options);
  const Field many(cut, 256, 128, options);
  options.smoothing = 0;
  const Field rough(whole, 256, 128, options);
  double worst = 0;
  double moved = 0;
  for (int r = 0; r < kRows; ++r) {
    for (int c = 0; c < kColumns; ++c) {
      for (int y = 0; y < kCell; ++y) {
        for (int x = 0; x < kCell; ++x) {
          const auto [i, j] = cut_texel(c, r, x, y, kGap);
          const Vec3d expected = one.at(8 + kCell * c + x, 8 + kCell * r + y);
          ASSERT_TRUE(many.covered(i, j));
          worst = std::max(worst, angle(expected, many.at(i, j)));
          moved = std::max(moved, angle(expected, rough.at(8 + kCell * c + x, 8 + kCell * r + y)));
        }
      }
    }
  }
  RecordProperty("worst_degrees", std::to_string(worst));
  EXPECT_LT(worst, 0.001) << "degrees";
  EXPECT_GT(moved, 5) << "smoothing across the folds must change something for this to be a test";
}

TEST(VisibilityField, HasNoSeamOnAMeshOfManyCharts) {
  KILN_REQUIRE_DEVICE();
  // A torus, cut into a chart a quad, whose parameters change from quad to quad.
  constexpr int kColumns = 16;
  constexpr int kRows = 8;
  constexpr int kSide = 12;
  constexpr int kGap = 4;
  const auto on_torus = [](int c, int r) {
    const double a = 2 * std::numbers::pi * (c % kColumns) / kColumns;
    const double b = 2 * std::numbers::pi * (r % kRows) / kRows;
    const double radius = 1 + 0.5 * std::cos(b);
    return Vec3{static_cast<float>(radius * std::cos(a)), static_cast<float>(radius * std::sin(a)),
                static_cast<float>(0.5 * std::sin(b))};
  };
  const auto map = [&](int gap) {
    return grid(
        kColumns, kRows, on_torus,
        [gap](int c, int r, int i, int j) {
          return Vec2{static_cast<float>((kSide + gap) * c + kSide * i),
                      static_cast<float>((kSide + gap) * r + kSide * j)};
        },
        256, 128);
  };
  VisibilityOptions options;
  options.smoothing = 16;
  const Field one(map(0), 256, 128, options);
  const Field many(map(kGap), 256, 128, options);
  double worst = 0;
  double sum = 0;
  double step_inside = 0;
  double step_across = 0;
  for (int r = 0; r < kRows; ++r) {
    for (int c = 0; c < kColumns; ++c) {
      const auto texel = [&](int x, int y) {
        return many.at((kSide + kGap) * c + x, (kSide + kGap) * r + y);
      };
      for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
          const double error = angle(one.at(kSide * c + x, kSide * r + y), texel(x, y));
          worst = std::max(worst, error);
          sum += error;
          if (x + 1 < kSide)
            step_inside = std::max(step_inside, angle(texel(x, y), texel(x + 1, y)));
        }
        const int next = (c + 1) % kColumns;
        const Vec3d across = many.at((kSide + kGap) * next, (kSide + kGap) * r + y);
        step_across = std::max(step_across, angle(texel(kSide - 1, y), across));
      }
    }
  }
  RecordProperty("worst_degrees", std::to_string(worst));
  RecordProperty("step_inside", std::to_string(step_inside));
  RecordProperty("step_across", std::to_string(step_across));
  RecordProperty("mean_degrees", std::to_string(sum / (kColumns * kRows * kSide * kSide)));
  // The whole map goes on in its parameters, the cut one in the surface.
  EXPECT_LT(worst, 0.6);
  EXPECT_LT(sum / (kColumns * kRows * kSide * kSide), 0.02);
  EXPECT_LT(step_across, 1.2 * step_inside) << "a step at a seam is one like any other";
}

TEST(SurfaceWalk, GoesStraightOverFoldsAndSeams) {
  const Mesh mesh = grid(
      4, 1, folded, [](int c, int r, int i, int j) { return cut_map(c, r, i, j, 5); }, 256, 64);
  const LowSurface surface = LowSurface::of(mesh, Frame::of(mesh));
  const SurfaceTopology topology = SurfaceTopology::of(surface);
  EXPECT_EQ(*std::max_element(topology.chart.begin(), topology.chart.end()), 3U);
  const auto uv = [](double x, double y) { return std::array<double, 2>{x / 256, 1 - y / 64}; };
  // From 10, 20 of the first quad 60 texels to the right and 5 down: 6, 25 of the third.
  const SurfacePlace place =
      walk_surface(surface, topology, 1, uv(8 + 10, 8 + 20), uv(8 + 70, 8 + 25));
  ASSERT_NE(place.triangle, KILN_NO_TRIANGLE);
  EXPECT_EQ(place.triangle / 2, 2U);
  EXPECT_NEAR(place.u * 256, 8 + 2 * (kCell + 5) + 6, 1e-3);
  EXPECT_NEAR((1 - place.v) * 64, 8 + 25, 1e-3);
  // Into the turned one: its x runs down.
  const SurfacePlace turned =
      walk_surface(surface, topology, 1, uv(8 + 10, 8 + 20), uv(8 + 40, 8 + 25));
  EXPECT_EQ(turned.triangle / 2, 1U);
  EXPECT_NEAR(turned.u * 256, 8 + (kCell + 5) + kCell - 25, 1e-3);
  EXPECT_NEAR((1 - turned.v) * 64, 8 + 8, 1e-3);
  // Over the mesh's border.
  EXPECT_EQ(walk_surface(surface, topology, 1, uv(8 + 10, 8 + 20), uv(8 + 10, 8 + 40)).triangle,
            KILN_NO_TRIANGLE);
}

/// Two spheres, one within the other, side by side on the map.
Mesh nested_spheres() {
  Mesh mesh = test::uv_sphere(24, 12);
  const Mesh inner = test::uv_sphere(24, 12, 0.5);
  const auto vertices = static_cast<std::uint32_t>(mesh.positions.size());
  const auto uvs = static_cast<std::uint32_t>(mesh.uvs.size());
  mesh.positions.insert(mesh.positions.end(), inner.positions.begin(), inner.positions.end());
  for (const Triangle& t : inner.triangles) {
    mesh.triangles.push_back({t[0] + vertices, t[1] + vertices, t[2] + vertices});
  }
  for (const Triangle& t : inner.uv_triangles) {
    mesh.uv_triangles.push_back({t[0] + uvs, t[1] + uvs, t[2] + uvs});
  }
  for (Vec2& uv : mesh.uvs) uv.x *= 0.5F;
  for (const Vec2& uv : inner.uvs) mesh.uvs.push_back({0.5F + 0.5F * uv.x, uv.y});
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  return mesh;
}

TEST(VisibilityField, WhatNothingSeesKeepsItsNormal) {
  KILN_REQUIRE_DEVICE();
  const Mesh mesh = nested_spheres();
  for (const VisibilityAt at : {VisibilityAt::texel, VisibilityAt::vertex, VisibilityAt::face}) {
    for (const VisibilityTest test : {VisibilityTest::views, VisibilityTest::rays}) {
      BakeOptions options;
      options.width = 128;
      options.height = 64;
      options.match.method = MatchMethod::visibility;
      options.match.visibility.at = at;
      options.match.visibility.test = test;
      options.match.visibility.directions = 64;
      options.match.max_distance = Length::share(0.05);
      const BakeResult result = bake(Source(*test::device(), mesh), mesh, options);
      ASSERT_TRUE(result.report.visibility);
      const VisibilityReport& report = *result.report.visibility;
      // Half of all: the inner sphere.
      EXPECT_NEAR(static_cast<double>(report.without), 0.5 * static_cast<double>(report.places),
                  0.01 * static_cast<double>(report.places));
      EXPECT_EQ(report.unseen, report.without);
      EXPECT_EQ(report.by_rays, test == VisibilityTest::rays);
      EXPECT_EQ(result.report.missed, 0U);
    }
  }
}

/// A sheet of steep folds, whose valleys hide most of what their sides see.
Mesh accordion() {
  Mesh mesh;
  mesh.name = "accordion";
  for (int i = 0; i < 7; ++i) {
    const float x = 0.3F * static_cast<float>(i);
    const float z = i % 2 == 0 ? 0.0F : 0.6F;
    mesh.positions.push_back({x, 0, z});
    mesh.positions.push_back({x, 1.5F, z});
    if (i == 0) continue;
    const auto at = static_cast<std::uint32_t>(2 * i);
    mesh.triangles.push_back({at - 2, at, at + 1});
    mesh.triangles.push_back({at - 2, at + 1, at - 1});
  }
  mesh.uvs = {{0, 0}, {1, 0}, {0, 1}};
  mesh.uv_triangles.assign(mesh.triangles.size(), {0, 1, 2});
  return mesh;
}

TEST(VisibilityField, VerticesGoByWhatSeesTheirFaces) {
  KILN_REQUIRE_DEVICE();
  for (const Mesh& mesh : {accordion(), test::torus(12, 6), test::cube()}) {
    const Frame frame = Frame::of(mesh);
    const LowSurface surface = LowSurface::of(mesh, frame);
    VisibilityOptions options;
    options.at = VisibilityAt::vertex;
    options.directions = 200;
    std::vector<reference::SeenDirection> directions;
    for (const ProbeDirection& d : probe_directions(options)) {
      directions.push_back({{d.toward.x, d.toward.y, d.toward.z}, d.weight});
    }
    const std::vector<Vec3> corners = frame.to_frame(mesh);
    const std::vector<reference::SeenSum> expected = reference::see_around_vertices(
        corners, mesh.triangles, directions, 8, KILN_VISIBILITY_LEAST_COSINE, 1e-6, 10);
    for (const VisibilityTest test :
         {VisibilityTest::automatic, VisibilityTest::views, VisibilityTest::rays}) {
      options.test = test;
      VisibilityReport report;
      const VisibilityField field(context_of(*test::device()), surface, 64, 64, options,
                                  Traversal::automatic, report);
      EXPECT_EQ(report.by_rays, test == VisibilityTest::rays);
      const std::vector<float> means = field.field().download(context_of(*test::device()));
      double sum = 0;
      for (std::size_t i = 0; i < 3 * mesh.triangles.size(); ++i) {
        const reference::SeenSum& e = expected[mesh.triangles[i / 3][i % 3]];
        const Vec3d mean = Vec3d{e.sum[0], e.sum[1], e.sum[2]} * (1 / e.weight);
        const Vec3d found{means[4 * i], means[4 * i + 1], means[4 * i + 2]};
        sum += angle(found, mean);
        // If a fold hides part of a face, 16, 64 or some 100 places tell its edge to within a tenth of it.
        ASSERT_LT(angle(found, mean), 2) << mesh.name << " " << i;
        ASSERT_NEAR(length(found), length(mean), 0.03) << mesh.name << " " << i;
      }
      EXPECT_LT(sum / static_cast<double>(3 * mesh.triangles.size()), 0.8) << mesh.name;
    }
  }
}

TEST(VisibilityField, FillsTexelsThatNothingSees) {
  KILN_REQUIRE_DEVICE();
  // Views from above only: the lower half of a sphere is seen by none, and takes its rim's directions.
  const Mesh mesh = test::uv_sphere(48, 24);
  VisibilityOptions visibility;
  visibility.likelihood = ViewLikelihood::list;
  visibility.likelihoods = {{{0, 1, 0}, 1},      {{0.3F, -1, 0}, 0},  {{-0.3F, -1, 0}, 0},
                            {{0, -1, 0.3F}, 0},  {{0, -1, -0.3F}, 0}, {{1, -0.2F, 0}, 0},
                            {{-1, -0.2F, 0}, 0}, {{0, -0.2F, 1}, 0},  {{0, -0.2F, -1}, 0}};
  visibility.smoothing = 0;
  const Field field(mesh, 128, 64, visibility);
  const Field all(mesh, 128, 64, {.directions = 64});
  EXPECT_EQ(all.report.unseen, 0U);
  EXPECT_GT(field.report.unseen, field.report.places / 20);
  EXPECT_EQ(field.report.without, 0U);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 128; ++x)
      ASSERT_EQ(field.covered(x, y), all.covered(x, y)) << x << " " << y;
  }
}

/// The samples of a bake as the field turns them, beside those that it was given.
struct Directed {
  std::vector<float> given, turned;
  std::vector<std::uint32_t> triangle;
  std::vector<float> field;
  std::uint32_t count = 0, capacity = 0;
  LowSurface surface;

  Directed(const Mesh& mesh, const VisibilityOptions& options, bool hybrid, std::uint32_t width,
           std::uint32_t height, std::uint32_t samples)
      : surface(LowSurface::of(mesh, Frame::of(mesh))) {
    cl::Context& context = context_of(*test::device());
    VisibilityReport report;
    const VisibilityField all(context, surface, width, height, options, Traversal::automatic,
                              report);
    TexelSampler sampler(context, surface, {width, height, samples, 1U << 22});
    const TexelBand band = sampler.sample(0);
    cl::Array<float> out(context, std::size_t{7} * band.capacity);
    all.write_directed_samples(band, samples, hybrid, out, band.capacity);
    given = band.points.download(context);
    turned = out.download(context);
    triangle = band.triangle.download(context);
    field = all.field().download(context);
    count = band.sample_count;
    capacity = band.capacity;
  }
  Vec3d direction(const std::vector<float>& planes, std::size_t i) const {
    return {planes[i + 3 * std::size_t{capacity}], planes[i + 4 * std::size_t{capacity}],
            planes[i + 5 * std::size_t{capacity}]};
  }
  Vec3d normal(std::size_t i) const {
    const auto& t =
        surface.triangles.at(triangle[i]);  // throws where the sampler left it unwritten
    const Vec3d n = cross(to_double(t[1].position) - to_double(t[0].position),
                          to_double(t[2].position) - to_double(t[0].position));
    return n * (1 / length(n));
  }
};

TEST(VisibilityField, DirectionsAreUnitAndNeverLeadUnderTheSurface) {
  KILN_REQUIRE_DEVICE();
  // Walls so steep that the mean of both sides of a ridge leads along them.
  const auto steep = [](int column, int row) {
    return Vec3{0.06F * static_cast<float>(column), static_cast<float>(row),
                column % 2 == 0 ? 0.0F : 1.0F};
  };
  const Mesh mesh = grid(6, 3, steep, whole_map, 256, 128);
  for (const bool hybrid : {false, true}) {
    for (const VisibilityAt at : {VisibilityAt::texel, VisibilityAt::vertex, VisibilityAt::face}) {
      for (const std::uint32_t samples : {1U, 3U}) {
        VisibilityOptions options;
        options.at = at;
        options.directions = 128;
        options.smoothing = 64;
        const Directed directed(mesh, options, hybrid, 120, 64, samples);
        ASSERT_GT(directed.count, 1000U);
        for (std::size_t i = 0; i < directed.count; ++i) {
          const Vec3d d = directed.direction(directed.turned, i);
          ASSERT_NEAR(length(d), 1, 1e-5);
          ASSERT_GT(dot(d, directed.normal(i)), KILN_VISIBILITY_LEAST_RISE * 0.99);
          for (const std::size_t plane : {0U, 1U, 2U, 6U}) {
            const std::size_t at_plane = i + plane * directed.capacity;
            ASSERT_EQ(directed.given[at_plane], directed.turned[at_plane]);
          }
        }
      }
    }
  }
}

TEST(VisibilityField, SubsamplesTakeNothingFromOtherCharts) {
  KILN_REQUIRE_DEVICE();
  // Charts that touch on the map, but not on the surface: rows swap places.
  VisibilityOptions options;
  options.directions = 128;
  const Mesh whole = grid(6, 3, folded, whole_map, 256, 128);
  const Mesh cut = grid(
      6, 3, folded,
      [](int c, int r, int i, int j) { return cut_map((c * 5 + 2 * r) % 6, r, i, j, 0); }, 256,
      128);
  const Directed one(whole, options, false, 256, 128, 2);
  const Directed many(cut, options, false, 256, 128, 2);
  ASSERT_EQ(one.count, many.count);
  const auto key = [](const Directed& d, std::size_t i) {
    std::array<long, 3> result{};
    for (std::size_t k = 0; k < 3; ++k) {
      result[k] = std::lround(1e4 * double{d.given[i + k * d.capacity]});
    }
    return result;
  };
  std::map<std::array<long, 3>, std::size_t> place;
  for (std::size_t i = 0; i < one.count; ++i) place[key(one, i)] = i;
  std::size_t found = 0;
  double worst = 0;
  for (std::size_t i = 0; i < many.count; ++i) {
    const auto at = place.find(key(many, i));
    if (at == place.end()) continue;
    ++found;
    worst = std::max(worst,
                     angle(one.direction(one.turned, at->second), many.direction(many.turned, i)));
  }
  EXPECT_GT(found, one.count * 9 / 10);
  RecordProperty("worst_degrees", std::to_string(worst));
  EXPECT_LT(worst, 0.001);
}

TEST(VisibilityField, HybridGoesFromVisibilityToTheNormal) {
  KILN_REQUIRE_DEVICE();
  const Mesh mesh = grid(6, 3, folded, whole_map, 256, 128);
  VisibilityOptions options;
  options.at = VisibilityAt::vertex;
  const Directed plain(mesh, options, false, 256, 128, 1);
  const Directed hybrid(mesh, options, true, 256, 128, 1);
  double least = 1;
  double most = 0;
  for (std::size_t i = 0; i < plain.count; ++i) {
    const Vec3d v = plain.direction(plain.turned, i);
    const Vec3d n = plain.direction(plain.given, i);
    const Vec3d h = hybrid.direction(hybrid.turned, i);
    // Between the two, in their plane.
    const double whole = angle(n, v);
    ASSERT_LE(std::abs(angle(n, h) + angle(h, v) - whole), 0.1) << i;
    if (whole < 2) continue;
    least = std::min(least, angle(h, v) / whole);
    most = std::max(most, angle(h, v) / whole);
  }
  // Deeper in the fold visibility counts for more.
  EXPECT_LT(least, most - 0.03);
}

}  // namespace
}  // namespace kiln
