// Tarini's measures, as the paper prints them (Tarini, Cignoni, Scopigno 2003, section 4): against closed
// forms, against brute force in double precision, and against figures found independently.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "kiln/assess.h"
#include "kiln/measure.h"
#include "mesh/charts.h"
#include "mesh/vector.h"
#include "reference/assess.h"
#include "reference/ray.h"
#include "shared/match.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

constexpr std::uint32_t kSize = 64;
using Map = std::function<Vec2(double, double)>;

/// One triangle at height z, so large that next to no ray passes beside it.
Mesh wide_triangle(float z) {
  Mesh mesh;
  mesh.name = "wide";
  mesh.positions = {{-200, -200, z}, {600, -200, z}, {-200, 600, z}};
  mesh.triangles = {{0, 1, 2}};
  return mesh;
}

/// A match of the unit square around the origin with wide_triangle: texels go to the map's place.
Match made_match(const Map& map) {
  Match match;
  match.width = match.height = kSize;
  match.source_triangles = 1;
  for (std::uint32_t row = 0; row < kSize; ++row) {
    for (std::uint32_t column = 0; column < kSize; ++column) {
      const Vec2 to = map((column + 0.5) / kSize - 0.5, 0.5 - (row + 0.5) / kSize);
      match.triangle.push_back(0);
      match.u.push_back((to.x + 200) / 800);
      match.v.push_back((to.y + 200) / 800);
      match.distance.push_back(0);
      match.status.push_back(KILN_STATUS_CLOSEST);
    }
  }
  return match;
}

Vec2 point(double x, double y) { return {static_cast<float>(x), static_cast<float>(y)}; }

MatchAssessment assess_plane(const Mesh& low, float height, const Map& map,
                             std::uint32_t directions = 12) {
  const Source source(*test::device(), wide_triangle(height));
  AssessOptions options;
  options.directions = directions;
  options.fields = true;
  return assess(source, low, made_match(map), options);
}

TEST(Tarini, APlaneOverAPlaneHasTheFiguresOfGeometry) {
  KILN_REQUIRE_DEVICE();
  const MatchAssessment a = assess_plane(test::plane(1, 1), 1, point, 4096);
  // A ray at the angle t to the normal meets the upper plane h tan t beside the match. The mean over the
  // hemisphere by the cosine: h pi / 2, the integral of sin t over that of cos t. Rays within 0.3 degrees
  // of the plane pass beside the triangle: less than 1% of it.
  EXPECT_NEAR(a.object_space.mean, std::numbers::pi / 2, 0.02 * std::numbers::pi / 2);
  EXPECT_GT(a.object_space.rms, a.object_space.mean);
  EXPECT_GT(a.object_space.share, 0.999);
  // sin t, by the cosine: 2/3, and the root of 1/2.
  EXPECT_NEAR(a.normalised_image_space.mean, 2.0 / 3, 1e-3);
  EXPECT_NEAR(a.normalised_image_space.rms, std::sqrt(0.5), 1e-3);
  EXPECT_EQ(a.normalised_image_space.share, 1);
  EXPECT_NEAR(a.image_space.mean, 2.0 / 3, 1e-3);
  EXPECT_NEAR(a.image_space.rms, std::sqrt(0.5), 1e-3);
  EXPECT_NEAR(a.match_distance.mean, 1, 1e-3);
  // One texel stands for all, since all see the same.
  EXPECT_NEAR(a.fields.normalised_image_space.pixels[2000], a.normalised_image_space.mean, 1e-4);
}

TEST(Tarini, BackFacesHideAndAreNotLookedAt) {
  KILN_REQUIRE_DEVICE();
  Mesh turned = wide_triangle(20);
  std::swap(turned.triangles[0][1], turned.triangles[0][2]);
  Match match = made_match(point);
  std::swap(match.u, match.v);
  AssessOptions options;
  options.directions = 64;
  options.fields = true;
  const Mesh low = test::plane(1, 1);
  const MatchAssessment a = assess(Source(*test::device(), turned), low, match, options);
  EXPECT_EQ(a.object_space.share, 0);
  EXPECT_EQ(a.object_space.mean, 0);
  EXPECT_EQ(a.fields.object_space.pixels[0], -1);
  // Figures of the low poly alone do not change.
  EXPECT_NEAR(a.image_space.mean, 20 * 2.0 / 3, 20 * 0.03);
  // Over a front face, the back face still hides it.
  Mesh both = wide_triangle(1);
  both.positions.insert(both.positions.end(), turned.positions.begin(), turned.positions.end());
  both.triangles.push_back({3, 5, 4});
  Match lower = made_match(point);
  lower.source_triangles = 2;
  EXPECT_LT(assess(Source(*test::device(), both), low, lower, options).object_space.share, 0.02);
}

TEST(Tarini, UniformityIsTheMeanOfAbsolutePercentages) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = test::plane(1, 1);
  const auto percent = [&](const Map& map) {
    return assess_plane(low, 0, map).uniformity.mean_percent;
  };
  // Single precision on a triangle of 800: steps of 1/64 are known to 1e-4 or so, 1%.
  EXPECT_NEAR(percent(point), 0, 0.5);
  EXPECT_NEAR(percent([](double x, double y) { return point(x / 2, y / 2); }), 50, 0.5);
  EXPECT_NEAR(percent([](double x, double y) { return point(2 * x, 2 * y); }), 100, 0.5);
  // 20% longer beside and 20% shorter below are 20%, not 0.
  EXPECT_NEAR(percent([](double x, double y) { return point(1.2 * x, 0.8 * y); }), 20, 0.5);
  // Turned and mirrored, distances stay.
  EXPECT_NEAR(percent([](double x, double y) { return point(y, x); }), 0, 0.5);
  const MatchAssessment half = assess_plane(
      low, 0, [](double x, double y) { return x < 0 ? point(x, y) : point(1.5 * x, 1.5 * y); });
  EXPECT_EQ(half.uniformity.pairs, 2U * kSize * (kSize - 1));
  EXPECT_NEAR(half.fields.uniformity.pixels[30 * kSize + 10], 0, 0.5);
  EXPECT_NEAR(half.fields.uniformity.pixels[30 * kSize + 50], 50, 0.5);
  EXPECT_EQ(half.uniformity_across_seams.pairs, 0U);
}

TEST(Tarini, UniformityAcrossSeamsStandsApart) {
  KILN_REQUIRE_DEVICE();
  // The square in two halves whose UVs change places: neighbours on the map are none on the surface.
  Mesh low = test::plane(2, 1);
  Mesh cut = low;
  cut.uvs.clear();
  cut.uv_triangles.clear();
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    Triangle uv{};
    double middle = 0;
    for (std::size_t k = 0; k < 3; ++k) middle += low.positions[low.triangles[t][k]].x / 3.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = low.positions[low.triangles[t][k]];
      uv[k] = static_cast<std::uint32_t>(cut.uvs.size());
      cut.uvs.push_back({p.x + (middle < 0 ? 1.0F : 0.0F), p.y + 0.5F});
    }
    cut.uv_triangles.push_back(uv);
  }
  const Map shrunk = [](double x, double y) {
    return point(0.9 * (x < 0 ? x + 0.5 : x - 0.5), 0.9 * y);
  };
  const MatchAssessment a = assess_plane(cut, 0, shrunk);
  EXPECT_NEAR(a.uniformity.mean_percent, 10, 0.5);
  EXPECT_EQ(a.uniformity.pairs, 2U * kSize * (kSize - 1) - kSize);
  // Each texel of the seam's two columns, whose texels lie one step apart.
  EXPECT_EQ(a.uniformity_across_seams.pairs, 2U * kSize);
  EXPECT_NEAR(a.uniformity_across_seams.mean_percent, 10, 0.5);
  // A match that parts at the seam alone: steps there are 1.9 instead of 1.
  const MatchAssessment parted = assess_plane(cut, 0, [](double x, double y) {
    return point((x < 0 ? x + 0.5 + 0.9 / kSize : x - 0.5), y);
  });
  EXPECT_NEAR(parted.uniformity.mean_percent, 0, 0.5);
  EXPECT_NEAR(parted.uniformity_across_seams.mean_percent, 90, 1);
}

// ---- by brute force -----------------------------------------------------------------------------

struct Rated {
  Mesh high, low;
  Match match;
  MatchAssessment assessment;
  std::vector<reference::AssessTexel> texels;
  std::vector<Vec3> directions;

  Rated(Mesh dense, Mesh light, MatchMethod method, std::uint32_t size, std::uint32_t count,
        Length reach)
      : high(std::move(dense)), low(std::move(light)) {
    const Source source(*test::device(), high);
    BakeOptions bake_with;
    bake_with.match.method = method;
    bake_with.width = bake_with.height = size;
    bake_with.match.max_distance = reach;
    bake_with.report.keep_match = true;
    match = *bake(source, low, bake_with).match;
    AssessOptions options;
    options.directions = count;
    options.fields = true;
    assessment = assess(source, low, match, options);
    texels = reference::assess_texels(high, low, match);
    directions = held_out_views(count, spread_views(12), 0.5);
  }
};

/// Every measure of the texels' sums, world units.
struct Totals {
  double seen = 0, across = 0, across_square = 0, met = 0, apart = 0, apart_square = 0;
  double normalised = 0, normalised_square = 0;
  void add(const reference::AssessTexel& t, const reference::RaySums& s) {
    seen += t.area * s.seen;
    across += t.area * s.across;
    across_square += t.area * s.across_square;
    met += t.area * s.met;
    apart += t.area * s.apart;
    apart_square += t.area * s.apart_square;
    double square = 0;
    for (std::size_t k = 0; k < 3; ++k) square += std::pow(t.match[k] - t.position[k], 2);
    normalised += t.area * s.across / std::sqrt(square);
    normalised_square += t.area * s.across_square / square;
  }
};

TEST(Tarini, AgreesWithBruteForceWhereThingsHideEachOther) {
  KILN_REQUIRE_DEVICE();
  for (const MatchMethod method : {MatchMethod::ray, MatchMethod::closest}) {
    // Tori hide parts of themselves. The dense one is open, and some of its faces are turned.
    Mesh low = test::torus(16, 8, 1, 0.6);
    for (Vec2& uv : low.uvs) uv = {uv.x * 0.97F + 0.0131F, uv.y * 0.97F + 0.0173F};
    Mesh high = test::torus(40, 20, 1, 0.62);
    high.normals.clear();
    high.normal_triangles.clear();
    high.uvs.clear();
    high.uv_triangles.clear();
    std::vector<Triangle> kept;
    for (std::size_t t = 0; t < high.triangles.size(); ++t) {
      if (t % 13 == 0) continue;
      if (t % 7 == 0) std::swap(high.triangles[t][1], high.triangles[t][2]);
      kept.push_back(high.triangles[t]);
    }
    high.triangles = kept;
    const Rated r(high, low, method, 28, 24, Length::share(0.1));
    const MatchAssessment& a = r.assessment;
    ASSERT_EQ(r.texels.size(), a.samples);
    Totals totals;
    std::size_t doubtful = 0, missed = 0, compared = 0;
    for (const reference::AssessTexel& texel : r.texels) {
      missed += texel.found ? 0 : 1;
      if (!texel.found) continue;
      const reference::RaySums sums = reference::view_texel(r.high, r.low, texel, r.directions);
      totals.add(texel, sums);
      doubtful += sums.near_edge ? 1 : 0;
      if (sums.near_edge || !(sums.met > 0)) continue;
      ++compared;
      // Single precision at coordinates of 2 world units and cosines down to 0.02: some 1e-5.
      EXPECT_NEAR(a.fields.object_space.pixels[texel.element], sums.apart / sums.met, 1e-4);
      EXPECT_NEAR(a.fields.image_space.pixels[texel.element], sums.across / sums.seen, 1e-5);
    }
    EXPECT_EQ(missed, a.missed);
    EXPECT_GT(compared, 300U);
    EXPECT_LE(doubtful, 20U);
    const double some = 2e-3;  // what the doubtful ones may change
    EXPECT_NEAR(a.object_space.mean / (totals.apart / totals.met), 1, some);
    EXPECT_NEAR(a.object_space.rms / std::sqrt(totals.apart_square / totals.met), 1, some);
    EXPECT_NEAR(a.object_space.share, totals.met / totals.seen, some);
    EXPECT_LT(a.object_space.share, 0.95) << "turned faces and gaps";
    EXPECT_NEAR(a.image_space.mean / (totals.across / totals.seen), 1, some);
    EXPECT_NEAR(a.image_space.rms / std::sqrt(totals.across_square / totals.seen), 1, some);
    EXPECT_NEAR(a.normalised_image_space.mean / (totals.normalised / totals.seen), 1, some);
    EXPECT_NEAR(a.normalised_image_space.rms / std::sqrt(totals.normalised_square / totals.seen), 1,
                some);
    std::uint64_t pairs = 0;
    const double percent =
        reference::uniformity_percent(r.texels, r.match, uv_charts(r.low), pairs);
    EXPECT_EQ(a.uniformity.pairs, pairs);
    EXPECT_NEAR(a.uniformity.mean_percent / percent, 1, 1e-4);
  }
}

TEST(Tarini, RaysLieAsThePixelsOfPicturesDo) {
  KILN_REQUIRE_DEVICE();
  // The paper's own way: pixels of orthogonal pictures, each with the texel that it shows.
  const Rated r(test::BumpySphere::dense(600), test::BumpySphere::light(12, 6), MatchMethod::ray,
                128, 12, Length::share(0.1));
  std::vector<const reference::AssessTexel*> at(r.match.triangle.size(), nullptr);
  for (const reference::AssessTexel& texel : r.texels) at[texel.element] = &texel;
  constexpr int kPixels = 96;
  double apart = 0, across = 0, pixels = 0;
  for (const Vec3& direction : r.directions) {
    const Vec3d d = to_double(direction);
    const Vec3d side = cross(d, std::abs(d.x) < 0.9 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0});
    const Vec3d right = side * (1 / length(side)), up = cross(d, right);
    for (int k = 0; k < kPixels * kPixels; ++k) {
      const double x = 2.2 * ((k % kPixels + 0.5) / kPixels - 0.5);
      const double y = 2.2 * ((k / kPixels + 0.5) / kPixels - 0.5);
      const Vec3d from = right * x + up * y + d * 4.0;
      const std::array<double, 3> origin = {from.x, from.y, from.z}, back = {-d.x, -d.y, -d.z};
      const reference::RaySearch search{.t_max = 8, .keep = -1};
      const auto low = reference::cast_ray(r.low.positions, r.low.triangles, origin, back, search);
      const auto high =
          reference::cast_ray(r.high.positions, r.high.triangles, origin, back, search);
      if (!low.found || !high.found) continue;
      const Triangle& t = r.low.uv_triangles[low.triangle];
      const auto uv = [&](auto axis) {
        return axis(r.low.uvs[t[0]]) * (1 - low.u - low.v) + axis(r.low.uvs[t[1]]) * low.u +
               axis(r.low.uvs[t[2]]) * low.v;
      };
      const double column = uv([](const Vec2& c) { return double{c.x}; }) * r.match.width;
      const double row = (1 - uv([](const Vec2& c) { return double{c.y}; })) * r.match.height;
      const auto* texel = at[std::min<std::size_t>(static_cast<std::size_t>(row), 127) * 128 +
                             std::min<std::size_t>(static_cast<std::size_t>(column), 127)];
      if (texel == nullptr || !texel->found) continue;
      const Vec3d f{texel->match[0], texel->match[1], texel->match[2]};
      const Vec3d p{texel->position[0], texel->position[1], texel->position[2]};
      // The texel's own ray, beside the pixel's by less than a texel: distances are those of texels.
      const std::array<double, 3> own = {p.x + 4 * d.x, p.y + 4 * d.y, p.z + 4 * d.z};
      const auto met = reference::cast_ray(r.high.positions, r.high.triangles, own, back, search);
      if (!met.found) continue;
      apart += length(f - (p + d * (4 - met.t)));
      across += length((f - p) - d * dot(f - p, d));
      ++pixels;
    }
  }
  ASSERT_GT(pixels, 50000);
  // Near the outline, where distances are longest, a pixel spans a third of them: 3%.
  EXPECT_NEAR(r.assessment.object_space.mean, apart / pixels, 0.03 * apart / pixels);
  EXPECT_NEAR(r.assessment.image_space.mean, across / pixels, 0.03 * across / pixels);
}

TEST(Tarini, AgreesWithBruteForceOnTheBunny) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("bunny_high.ply");
  KILN_REQUIRE_DATA("bunny_low.obj");
  const Rated r(load_mesh(*test::shared_data("bunny_high.ply")),
                load_mesh(*test::shared_data("bunny_low.obj")), MatchMethod::ray, 256, 12,
                Length::share(0.02));
  std::size_t compared = 0;
  for (std::size_t i = 0; i < r.texels.size() && compared < 60; i += 301) {
    const reference::AssessTexel& texel = r.texels[i];
    if (!texel.found) continue;
    const reference::RaySums sums = reference::view_texel(r.high, r.low, texel, r.directions);
    if (sums.near_edge || !(sums.met > 0)) continue;
    ++compared;
    // The bunny's diagonal is 0.25; single precision makes 1e-7 of it, aslant at a face a hundred times.
    EXPECT_NEAR(r.assessment.fields.object_space.pixels[texel.element], sums.apart / sums.met, 5e-6)
        << texel.element;
    EXPECT_NEAR(r.assessment.fields.image_space.pixels[texel.element], sums.across / sums.seen,
                2e-7);
  }
  EXPECT_EQ(compared, 60U);
  std::uint64_t pairs = 0;
  const double percent = reference::uniformity_percent(r.texels, r.match, uv_charts(r.low), pairs);
  // On edges, whose texel it is may differ; and free texels of small charts lie beside those of others.
  EXPECT_NEAR(static_cast<double>(r.assessment.uniformity.pairs), static_cast<double>(pairs),
              2e-3 * static_cast<double>(pairs));
  EXPECT_NEAR(r.assessment.uniformity.mean_percent / percent, 1, 0.01);
}

TEST(Tarini, TheBunnysFiguresAreThoseFoundIndependently) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("bunny_high.ply");
  KILN_REQUIRE_DATA("bunny_low.obj");
  // By another program, at 512 x 512 texels: object space in % of the diagonal, normalised, uniformity.
  struct Figures {
    MatchMethod method;
    double object_space, normalised, uniformity;
  };
  const Mesh low = load_mesh(*test::shared_data("bunny_low.obj"));
  const Source source(*test::device(), load_mesh(*test::shared_data("bunny_high.ply")));
  for (const Figures& known : {Figures{MatchMethod::closest, 0.0982, 0.657, 1.65},
                               Figures{MatchMethod::ray, 0.0982, 0.657, 1.35},
                               Figures{MatchMethod::visibility, 0.0972, 0.649, 1.11}}) {
    BakeOptions bake_with;
    bake_with.match.method = known.method;
    bake_with.width = bake_with.height = 512;
    bake_with.match.max_distance = Length::share(0.02);
    bake_with.report.keep_match = true;
    bake_with.report.recall = 0;
    const Match match = *bake(source, low, bake_with).match;
    AssessOptions options;
    options.directions = 32;
    const MatchAssessment a = assess(source, low, match, options);
    // Other directions, other edges between texels: as far as two such programs may differ.
    EXPECT_NEAR(100 * a.object_space.mean / a.diagonal, known.object_space,
                0.03 * known.object_space);
    EXPECT_NEAR(a.normalised_image_space.mean, known.normalised, 0.005);
    EXPECT_NEAR(a.uniformity.mean_percent, known.uniformity, 0.1 * known.uniformity);
  }
}

}  // namespace
}  // namespace kiln
