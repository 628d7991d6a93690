// Fields of visibility directions on maps: across seams, filled, turned, and what bakes make of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include "kiln/kiln.h"
#include "match/visibility.h"
#include "mesh/frame.h"
#include "mesh/kernels_shared.h"
#include "mesh/surface_links.h"
#include "reference/ray.h"
#include "reference/visibility.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
using Cell = std::pair<int, int>;

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

/// A grid of quads, each with UVs of its own: `place` says where the texels of a quad's corners (i, j) of
/// {0, 1}^2 lie on a map of the given size.
Mesh grid(int columns, int rows, const std::function<Vec3(int, int)>& position,
          const std::function<Vec2(int, int, int, int)>& place, float width, float height) {
  Mesh mesh;
  mesh.name = "grid";
  for (int r = 0; r <= rows; ++r) {
    for (int c = 0; c <= columns; ++c) mesh.positions.push_back(position(c, r));
  }
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const auto vertex = [&](int i, int j) {
        return static_cast<std::uint32_t>((r + j) * (columns + 1) + c + i);
      };
      const auto first = static_cast<std::uint32_t>(mesh.uvs.size());
      for (const auto& [i, j] : {Cell{0, 0}, Cell{1, 0}, Cell{1, 1}, Cell{0, 1}}) {
        const Vec2 texel = place(c, r, i, j);
        mesh.uvs.push_back({texel.x / width, 1 - texel.y / height});
      }
      mesh.triangles.push_back({vertex(0, 0), vertex(1, 0), vertex(1, 1)});
      mesh.triangles.push_back({vertex(0, 0), vertex(1, 1), vertex(0, 1)});
      mesh.uv_triangles.push_back({first, first + 1, first + 2});
      mesh.uv_triangles.push_back({first, first + 2, first + 3});
    }
  }
  return mesh;
}

constexpr int kCell = 32;

/// Strips of unit squares folded to and fro, row upon row: lengths stay, so texels can.
Vec3 folded(int column, int row) {
  const auto c = static_cast<float>(column);
  return {0.75F * c, static_cast<float>(row), column % 2 == 0 ? 0.0F : 0.66143783F};
}

Vec2 whole_map(int c, int r, int i, int j) {
  return {static_cast<float>(8 + kCell * (c + i)), static_cast<float>(8 + kCell * (r + j))};
}

/// Quads on their own, `gap` texels apart, every other one turned by a quarter.
Vec2 cut_map(int c, int r, int i, int j, int gap) {
  const bool turned = (c + r) % 2 == 1;
  const int x = turned ? 1 - j : i;
  const int y = turned ? i : j;
  return {static_cast<float>(8 + (kCell + gap) * c + kCell * x),
          static_cast<float>(8 + (kCell + gap) * r + kCell * y)};
}

/// Where the texel (x, y) of a quad lies on the cut map.
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
      options.method = MatchMethod::visibility;
      options.visibility.at = at;
      options.visibility.test = test;
      options.visibility.directions = 64;
      options.max_distance = Length::share(0.05);
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
    all.direct(band, samples, hybrid, out, band.capacity);
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
    const auto& t = surface.triangles[triangle[i]];
    const Vec3d n = cross(Vec3d(t[1].position) - Vec3d(t[0].position),
                          Vec3d(t[2].position) - Vec3d(t[0].position));
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

TEST(VisibilityBake, FindsWhatTheOracleFinds) {
  KILN_REQUIRE_DEVICE();
  Mesh low = grid(4, 2, folded, whole_map, 256, 128);
  low.name = "low";
  // The dense one: the same strip with more folds on it.
  const Mesh high = grid(
      40, 20,
      [](int c, int r) {
        const double x = c / 10.0;
        const double fold = x - 2 * std::floor(x / 2);
        const double z = 0.66143783 * (fold < 1 ? fold : 2 - fold);
        return Vec3{static_cast<float>(0.75 * x), static_cast<float>(0.1 * r),
                    static_cast<float>(z + 0.03 * std::sin(2.1 * c + 1.3 * r))};
      },
      whole_map, 4096, 2048);
  BakeOptions options;
  options.width = 256;
  options.height = 128;
  options.method = MatchMethod::visibility;
  options.visibility.test = VisibilityTest::rays;
  options.visibility.smoothing = 0;
  options.visibility.directions = 48;
  options.max_distance = Length::absolute(0.2);
  options.keep_match = true;
  const Source source(*test::device(), high);
  const BakeResult result = bake(source, low, options);

  // Everything again, in double precision and by brute force.
  const Frame frame = Frame::of(high);
  const LowSurface surface = LowSurface::of(low, frame);
  const std::vector<Vec3> low_positions = frame.to_frame(low);
  const std::vector<Vec3> high_positions = frame.to_frame(high);
  std::vector<reference::SeenDirection> directions;
  for (const ProbeDirection& d : probe_directions(options.visibility)) {
    const Vec3 toward = to_float(d.toward);
    directions.push_back({{toward.x, toward.y, toward.z}, d.weight});
  }
  TexelSampler sampler(context_of(*test::device()), surface, {256, 128, 1, 1U << 22});
  const TexelBand band = sampler.sample(0);
  cl::Context& context = context_of(*test::device());
  const std::vector<float> points = band.points.download(context);
  const std::vector<std::uint32_t> triangle = band.triangle.download(context);
  const std::vector<std::uint32_t> index = band.texel_index.download(context);
  std::size_t doubtful = 0;
  std::size_t found = 0;
  std::size_t compared = 0;
  for (std::size_t i = 0; i < band.sample_count; ++i) {
    const std::array<double, 3> place = {points[i], points[i + band.capacity],
                                         points[i + 2 * std::size_t{band.capacity}]};
    const auto& t = surface.triangles[triangle[i]];
    const Vec3d up = cross(Vec3d(t[1].position) - Vec3d(t[0].position),
                           Vec3d(t[2].position) - Vec3d(t[0].position));
    const Vec3d normal = up * (1 / length(up));
    const reference::SeenSum seen =
        reference::see(low_positions, low.triangles, place, {normal.x, normal.y, normal.z},
                       directions, KILN_VISIBILITY_LEAST_COSINE, 1.0 / 65536, 8, 1e-4);
    if (seen.doubtful > 0) {
      ++doubtful;
      continue;
    }
    Vec3d d{seen.sum[0], seen.sum[1], seen.sum[2]};
    d = d * (1 / length(d));
    const double rise = dot(d, normal);
    if (rise < KILN_VISIBILITY_LEAST_RISE) {
      d = d + normal * (KILN_VISIBILITY_LEAST_RISE - rise);
      d = d * (1 / length(d));
    }
    reference::RaySearch search;
    const double reach = 0.2 * frame.scale;
    search.t_min = -reach;
    search.t_max = reach;
    search.nearest_outward_first = true;
    search.keep = 1;
    const reference::RayHit hit =
        reference::cast_ray(high_positions, high.triangles, place, {d.x, d.y, d.z}, search);
    ++compared;
    const std::uint32_t ours = result.match->triangle[index[i]];
    ASSERT_EQ(ours != KILN_NO_TRIANGLE, hit.found) << i;
    if (!hit.found) continue;
    ++found;
    if (ours == hit.triangle) continue;
    ASSERT_NEAR(result.match->distance[index[i]] * frame.scale, hit.t, 1e-5) << i;
  }
  EXPECT_GT(found, compared / 2);
  EXPECT_LT(doubtful, compared / 3);
  EXPECT_GT(compared, 5000U);
}

TEST(VisibilityBake, AllWaysFindTheSurface) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpyTorus::dense(40000);
  const Mesh low = test::BumpyTorus::light();
  const Source source(*test::device(), high);
  const auto mean_error = [&](const BakeResult& result) {
    // Of the point found to the exact surface's normal there: how well the map shows it.
    return result.report.mean_abs_distance;
  };
  BakeOptions options;
  options.width = 300;  // neither square nor a multiple of anything
  options.height = 170;
  options.max_distance = Length::absolute(0.1);
  const double ray = mean_error(bake(source, low, options));
  for (const MatchMethod method : {MatchMethod::visibility, MatchMethod::hybrid}) {
    for (const VisibilityAt at : {VisibilityAt::texel, VisibilityAt::vertex, VisibilityAt::face}) {
      for (const VisibilityTest test : {VisibilityTest::views, VisibilityTest::rays}) {
        for (const std::uint32_t samples : {1U, 2U}) {
          options.method = method;
          options.samples = samples;
          options.visibility.at = at;
          options.visibility.test = test;
          options.visibility.directions = 100;
          const BakeResult result = bake(source, low, options);
          EXPECT_EQ(result.report.missed, 0U);
          EXPECT_NEAR(mean_error(result), ray, 0.2 * ray);
          EXPECT_GT(result.report.visibility->mean_deviation, 0.5);
          EXPECT_LT(result.report.visibility->mean_deviation, 0.8);
        }
      }
    }
  }
}

TEST(VisibilityBake, LargeMapsTakeASmallerField) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpyTorus::dense(20000);
  const Mesh low = test::BumpyTorus::light();
  BakeOptions options;
  options.width = 4200;
  options.height = 40;
  options.gutter = 0;
  options.method = MatchMethod::visibility;
  options.visibility.directions = 32;
  options.max_distance = Length::absolute(0.1);
  const BakeResult result = bake(Source(*test::device(), high), low, options);
  EXPECT_EQ(result.report.visibility->width, 1400U);
  EXPECT_EQ(result.report.visibility->height, 14U);
  EXPECT_EQ(result.report.missed, 0U);
}

TEST(VisibilityBake, TakesImperfectLightMeshes) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::icosphere(4);
  const Source source(*test::device(), high);
  // A vertex that is nowhere, a triangle without area, three triangles at an edge, and one inside out.
  Mesh low = test::uv_sphere(24, 12);
  low.positions[30].y = std::nanf("");
  low.triangles.push_back({5, 5, 6});
  low.uv_triangles.push_back({5, 5, 6});
  low.triangles.push_back(low.triangles[40]);
  low.uv_triangles.push_back(low.uv_triangles[40]);
  std::swap(low.triangles[60][0], low.triangles[60][1]);
  std::swap(low.uv_triangles[60][0], low.uv_triangles[60][1]);
  low.normals.clear();
  low.normal_triangles.clear();
  // And one that no texel lies on.
  Mesh nowhere = test::uv_sphere(24, 12);
  for (Vec2& uv : nowhere.uvs) uv = {0.5F + 1e-3F * uv.x, 0.5F + 1e-3F * uv.y};
  BakeOptions options;
  options.width = options.height = 64;
  options.max_distance = Length::share(0.1);
  for (const MatchMethod method : {MatchMethod::visibility, MatchMethod::hybrid}) {
    for (const VisibilityAt at : {VisibilityAt::texel, VisibilityAt::vertex, VisibilityAt::face}) {
      for (const VisibilityTest test : {VisibilityTest::views, VisibilityTest::rays}) {
        options.method = method;
        options.visibility.at = at;
        options.visibility.test = test;
        options.visibility.directions = 32;
        const BakeResult result = bake(source, low, options);
        EXPECT_GT(result.report.samples, 3000U);
        EXPECT_LT(result.report.missed, result.report.samples / 20);
        for (const float value : result.maps[0].image.pixels) ASSERT_TRUE(std::isfinite(value));
        EXPECT_EQ(bake(source, nowhere, options).report.samples, 0U);
      }
    }
  }
  options.width = options.height = 1;
  EXPECT_LE(bake(source, low, options).report.samples, 1U);
}

TEST(VisibilityBake, StopsWhereItIsTold) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpyTorus::dense(20000);
  const Mesh low = test::BumpyTorus::light();
  const Source source(*test::device(), high);
  for (const VisibilityTest test : {VisibilityTest::views, VisibilityTest::rays}) {
    BakeOptions options;
    options.width = options.height = 128;
    options.max_distance = Length::absolute(0.1);
    options.method = MatchMethod::hybrid;
    options.visibility.test = test;
    double last = -1;
    int asked = 0;
    options.progress = [&](double done, std::string_view) {
      EXPECT_GE(done, last);
      last = done;
      ++asked;
      return true;
    };
    EXPECT_FALSE(bake(source, low, options).cancelled);
    EXPECT_EQ(last, 1);
    EXPECT_GT(asked, 15);
    asked = 0;
    options.progress = [&](double done, std::string_view stage) {
      ++asked;
      return stage != "visibility" || done < 0.2;
    };
    const BakeResult stopped = bake(source, low, options);
    EXPECT_TRUE(stopped.cancelled);
    EXPECT_TRUE(stopped.maps.empty());
    EXPECT_GT(asked, 5);
  }
}

TEST(SwitchedMethods, AreMeasuredWhereTheyMeet) {
  KILN_REQUIRE_DEVICE();
  // Rays find the middle of the plane, nearest points a rim of it, and what is farther keeps its normal.
  Mesh high = test::plane(20, 20, 0.8, 0.8);
  for (Vec3& p : high.positions) p.z += 0.03F;
  high.normals = {{0.6F, 0, 0.8F}};
  const Mesh low = test::plane(2, 2);
  const Source source(*test::device(), high);
  BakeOptions options;
  options.width = options.height = 200;
  options.space = NormalMapSpace::object;
  options.max_distance = Length::absolute(0.05);
  EXPECT_FALSE(bake(source, low, options).report.switches);
  options.fallback = {MatchMethod::closest};
  const double leap = std::acos(0.8) / kDegree;
  for (const MatchMethod method : {MatchMethod::ray, MatchMethod::visibility}) {
    options.method = method;
    const BakeResult result = bake(source, low, options);
    ASSERT_TRUE(result.report.switches);
    // 160 texels a side of rays, and 8 more all around within sqrt(0.05^2 - 0.03^2) = 0.04.
    const double inner = 4 * 160;
    const double outer = 4 * 176;
    EXPECT_NEAR(static_cast<double>(result.report.switches->sides), inner + outer, 40);
    EXPECT_NEAR(result.report.switches->mean_degrees, leap * outer / (inner + outer), 1);
    EXPECT_NEAR(result.report.switches->elsewhere_degrees, 0, 1e-3);
  }
  // Far enough, nothing is missed, and no seam is left.
  options.max_distance = Length::absolute(0.5);
  const BakeResult all = bake(source, low, options);
  EXPECT_EQ(all.report.missed, 0U);
  EXPECT_GT(all.report.switches->sides, 600U);
  EXPECT_NEAR(all.report.switches->mean_degrees, 0, 1e-3);
}

TEST(VisibilityBake, ViewsDecideWhatRaysLeave) {
  KILN_REQUIRE_DEVICE();
  // A light plane wider than the dense one: past its rim only slanted lines find it.
  Mesh high = test::plane(20, 20, 0.9, 0.9);
  for (Vec3& p : high.positions) p.z += 0.05F;
  const Mesh low = test::plane(2, 2);
  const Source source(*test::device(), high);
  BakeOptions options;
  options.width = options.height = 128;
  options.method = MatchMethod::hybrid;
  options.max_distance = Length::absolute(0.1);
  const BakeResult rays = bake(source, low, options);
  EXPECT_GT(rays.report.missed, rays.report.samples / 10);
  options.fallback = {MatchMethod::views};
  options.views.count = 64;
  options.views.refine = false;
  const BakeResult both = bake(source, low, options);
  EXPECT_GT(both.report.viewed, rays.report.missed / 10);
  EXPECT_EQ(both.report.viewed + both.report.missed, rays.report.missed);
  EXPECT_TRUE(both.report.views);
  options.method = MatchMethod::views;
  EXPECT_THROW(bake(source, low, options), Error);
}

}  // namespace
}  // namespace kiln
