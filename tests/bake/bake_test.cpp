// The whole library: accuracy on analytic surfaces and against the reference bake, policies,
// determinism, cancelling.
#include "kiln/bake.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "kiln/kiln.h"
#include "mesh/low_surface.h"
#include "mesh/vector.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

double angle_degrees(const Vec3d& a, const Vec3d& b) {
  return std::atan2(length(cross(a, b)), dot(a, b)) * 180 / M_PI;
}

/// A bilinear look-up as a renderer does it; false where a texel of the footprint was not baked.
bool look_up(const BakeResult& baked, const Vec2& uv, Vec3d& value) {
  const Image& image = baked.maps[0].image;
  const double x = uv.x * image.width - 0.5;
  const double y = (1 - uv.y) * image.height - 0.5;
  const auto x0 = static_cast<long>(std::floor(x));
  const auto y0 = static_cast<long>(std::floor(y));
  value = {};
  for (long dy = 0; dy < 2; ++dy) {
    for (long dx = 0; dx < 2; ++dx) {
      const long px = x0 + dx;
      const long py = y0 + dy;
      if (px < 0 || py < 0 || px >= static_cast<long>(image.width) ||
          py >= static_cast<long>(image.height)) {
        return false;
      }
      const auto ux = static_cast<std::size_t>(px);
      const auto uy = static_cast<std::size_t>(py);
      if (baked.coverage[uy * image.width + ux] != 1) return false;
      const double weight = (dx ? x - x0 : 1 - (x - x0)) * (dy ? y - y0 : 1 - (y - y0));
      const float* p = image.at(ux, uy);
      value += Vec3d(p[0] * 2 - 1, p[1] * 2 - 1, p[2] * 2 - 1) * weight;
    }
  }
  return true;
}

/// Mean angle between a map, looked up at random points of the low poly, and the exact normal where
/// the point's ray meets the exact surface.
/// \param surface  signed: above 0 outside the exact surface
template <typename Surface, typename Normal>
double mean_error(const Mesh& low, const BakeResult& baked, bool tangent_space,
                  const Surface& surface, const Normal& exact_normal) {
  Frame frame;  // identity: world units
  const LowSurface prepared = LowSurface::of(low, frame);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  double sum = 0;
  int count = 0;
  for (int i = 0; i < 40000; ++i) {
    const auto& corners = prepared.triangles[random() % prepared.triangles.size()];
    double u = uniform(random);
    double v = uniform(random);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const auto mix = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
      return Vec3d(a) * (1 - u - v) + Vec3d(b) * u + Vec3d(c) * v;
    };
    const Vec2 uv = {static_cast<float>(corners[0].uv.x * (1 - u - v) + corners[1].uv.x * u +
                                        corners[2].uv.x * v),
                     static_cast<float>(corners[0].uv.y * (1 - u - v) + corners[1].uv.y * u +
                                        corners[2].uv.y * v)};
    Vec3d value;
    if (!look_up(baked, uv, value)) continue;
    if (tangent_space) {
      const Vec3d n = mix(corners[0].normal, corners[1].normal, corners[2].normal);
      const Vec3d t = mix(corners[0].tangent, corners[1].tangent, corners[2].tangent);
      const Vec3d b = cross(n, t) * corners[0].sign;
      value = t * value.x + b * value.y + n * value.z;
    }
    const Vec3d point = mix(corners[0].position, corners[1].position, corners[2].position);
    Vec3d direction = mix(corners[0].direction, corners[1].direction, corners[2].direction);
    direction = direction * (1 / length(direction));
    // The low poly lies within 0.1 of the surface everywhere: bisection on the ray.
    double inside = -0.15;
    double outside = 0.15;
    for (int step = 0; step < 50; ++step) {
      const double middle = (inside + outside) / 2;
      (surface(point + direction * middle) > 0 ? outside : inside) = middle;
    }
    sum += angle_degrees(value, exact_normal(point + direction * inside));
    ++count;
  }
  EXPECT_GT(count, 20000);
  return sum / count;
}

test::Vec3d to_test(const Vec3d& v) { return {v.x, v.y, v.z}; }
Vec3d from_test(const test::Vec3d& v) { return {v.x, v.y, v.z}; }

double sphere_surface(const Vec3d& p) {
  return length(p) - test::BumpySphere::radius(to_test(p * (1 / length(p))));
}
Vec3d sphere_normal(const Vec3d& p) {
  return from_test(test::BumpySphere::exact_normal(to_test(p)));
}

double torus_surface(const Vec3d& p) {
  const double ring = std::hypot(p.x, p.z);
  const double tube = std::hypot(ring - test::BumpyTorus::major_radius, p.y);
  // The angles as shapes.h has them: around the axis, and around the tube from the outer equator.
  const double v = std::atan2(p.y, ring - test::BumpyTorus::major_radius);
  // Which way u runs is found from the high poly's first vertices in a test below.
  const double u = std::atan2(-p.z, p.x);
  return tube - test::BumpyTorus::minor_radius - test::BumpyTorus::height(u, v);
}
Vec3d torus_normal(const Vec3d& p) { return from_test(test::BumpyTorus::exact_normal(to_test(p))); }

class Accuracy : public testing::TestWithParam<NormalMapSpace> {};

BakeResult bake_pair(const Mesh& high, const Mesh& low, std::uint32_t size, NormalMapSpace space) {
  const Source source(*test::device(), high);
  BakeOptions options;
  options.width = options.height = size;
  options.max_distance = Length::absolute(0.15);
  options.space = space;
  return bake(source, low, options);
}

TEST_P(Accuracy, OfABumpySphereIsUnderAFifthOfADegreeAndFallsWithResolution) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(1000000);
  const Mesh low = test::BumpySphere::light();
  double last = 100;
  for (const std::uint32_t size : {128U, 256U, 512U, 1024U}) {
    const BakeResult baked = bake_pair(high, low, size, GetParam());
    EXPECT_EQ(baked.report.missed, 0U);
    const double error = mean_error(low, baked, GetParam() == NormalMapSpace::tangent,
                                    sphere_surface, sphere_normal);
    RecordProperty("degrees_at_" + std::to_string(size), std::to_string(error));
    std::printf("bumpy sphere, %u^2: mean %.4f degrees\n", size, error);
    EXPECT_LT(error, last);
    last = error;
  }
  EXPECT_LT(last, 0.2);
}

TEST_P(Accuracy, OfABumpyTorusIsUnderAFifthOfADegreeAndFallsWithResolution) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpyTorus::dense(1000000);
  for (std::size_t i = 0; i < high.positions.size(); i += 997) {
    ASSERT_NEAR(torus_surface(Vec3d(high.positions[i])), 0, 1e-6)
        << "the test's own surface is off";
  }
  const Mesh low = test::BumpyTorus::light();
  double last = 100;
  for (const std::uint32_t size : {128U, 256U, 512U, 1024U}) {
    const BakeResult baked = bake_pair(high, low, size, GetParam());
    EXPECT_EQ(baked.report.missed, 0U);
    const double error =
        mean_error(low, baked, GetParam() == NormalMapSpace::tangent, torus_surface, torus_normal);
    std::printf("bumpy torus, %u^2: mean %.4f degrees\n", size, error);
    EXPECT_LT(error, last);
    last = error;
  }
  EXPECT_LT(last, 0.2);
}

INSTANTIATE_TEST_SUITE_P(Spaces, Accuracy,
                         testing::Values(NormalMapSpace::tangent, NormalMapSpace::object));

/// The bunny with the reference's own rays (see the data's README).
BakeOptions blender_options() {
  BakeOptions options;
  options.width = options.height = 1024;
  options.cage = Length::share(0.012444);
  options.max_distance = Length::share(0.024887);
  return options;
}

TEST(Reference, BunnyAgreesWithBlendersBake) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("bunny_blender_normal.exr");
  const Mesh high = load_mesh(*test::shared_data("bunny_high.ply"));
  const Mesh low = load_mesh(*test::shared_data("bunny_low.obj"));
  const Source source(*test::device(), high);
  const BakeResult baked = bake(source, low, blender_options());
  const Image reference = load_image(*test::shared_data("bunny_blender_normal.exr"));
  Image mask{1024, 1024, 1, std::vector<float>(1024 * 1024)};
  std::uint64_t counted = 0;
  for (std::size_t i = 0; i < mask.pixels.size(); ++i) {
    const float* p = &reference.pixels[i * reference.channels];
    const bool theirs = p[0] + p[1] + p[2] > 0.1F;
    mask.pixels[i] = baked.coverage[i] == 1 && theirs ? 1.0F : 0.0F;
    counted += baked.coverage[i] == 1 && theirs;
  }
  EXPECT_GT(counted, baked.report.texels * 98 / 100);
  const ImageDifference difference = compare_images(baked.maps[0].image, reference, &mask);
  std::printf(
      "against Blender: mean %.3f, 95%% %.3f, 99%% %.3f, max %.1f degrees over %llu texels\n",
      difference.mean_angle_degrees, difference.p95_angle_degrees, difference.p99_angle_degrees,
      difference.max_angle_degrees, static_cast<unsigned long long>(difference.compared));
  EXPECT_LT(difference.mean_angle_degrees, 0.5);
  EXPECT_LT(difference.p99_angle_degrees, 5);
}

struct Pair {
  Mesh high = test::BumpySphere::dense(20000);
  Mesh low = test::BumpySphere::light();
};

BakeOptions small_options(std::uint32_t size = 128) {
  BakeOptions options;
  options.width = options.height = size;
  options.max_distance = Length::absolute(0.15);
  return options;
}

TEST(Bake, IsTheSameForAnyOrderOfTheDenseTriangles) {
  KILN_REQUIRE_DEVICE();
  Pair pair;
  // The exact normals are given, since summing computed ones in another order moves the last bit.
  pair.high = test::BumpySphere::dense(20000, true);
  const BakeResult expected = bake(Source(*test::device(), pair.high), pair.low, small_options());
  std::mt19937 random(5);
  std::vector<std::size_t> order(pair.high.triangles.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), random);
  Mesh shuffled = pair.high;
  for (std::size_t i = 0; i < order.size(); ++i) {
    shuffled.triangles[i] = pair.high.triangles[order[i]];
    shuffled.normal_triangles[i] = pair.high.normal_triangles[order[i]];
  }
  const BakeResult result = bake(Source(*test::device(), shuffled), pair.low, small_options());
  // Where a ray meets an edge, another of the triangles that share it may win: the same normal but for
  // rounding.
  const ImageDifference difference =
      compare_images(expected.maps[0].image, result.maps[0].image, nullptr);
  EXPECT_LT(difference.max_angle_degrees, 0.01);
  EXPECT_EQ(expected.coverage, result.coverage);
}

TEST(Bake, MovesWithTheScene) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const BakeResult expected = bake(Source(*test::device(), pair.high), pair.low, small_options());
  for (const double scale : {1e-30, 1e-3, 1e3, 1e30}) {
    Mesh high = pair.high;
    Mesh low = pair.low;
    for (Mesh* mesh : {&high, &low}) {
      for (Vec3& p : mesh->positions) p = to_float(Vec3d(p) * scale);
      mesh->origin = {1e6 * scale, 0, -1e6 * scale};
    }
    BakeOptions options = small_options();
    options.max_distance = Length::absolute(0.15 * scale);
    const BakeResult result = bake(Source(*test::device(), high), low, options);
    const ImageDifference difference =
        compare_images(expected.maps[0].image, result.maps[0].image, nullptr);
    EXPECT_LT(difference.mean_angle_degrees, 0.001) << scale;
    EXPECT_EQ(expected.report.texels, result.report.texels);
    EXPECT_NEAR(result.report.mean_abs_distance / scale / expected.report.mean_abs_distance, 1,
                1e-4);
  }
}

TEST(Bake, SupersamplingTakesEverySampleAndStaysClose) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  BakeOptions options = small_options(100);
  const BakeResult one = bake(source, pair.low, options);
  options.samples = 3;
  const BakeResult nine = bake(source, pair.low, options);
  EXPECT_GE(nine.report.texels, one.report.texels);
  EXPECT_NEAR(static_cast<double>(nine.report.samples) / static_cast<double>(one.report.samples), 9,
              0.1);
  EXPECT_LT(compare_images(one.maps[0].image, nine.maps[0].image).mean_angle_degrees, 1);
}

TEST(Bake, KeptMatchSaysWhatTheReportSays) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  BakeOptions options = small_options(96);
  options.samples = 2;
  options.keep_match = true;
  options.max_distance = Length::absolute(0.01);  // some miss
  const BakeResult result = bake(source, pair.low, options);
  ASSERT_TRUE(result.match);
  const Match& match = *result.match;
  EXPECT_EQ(match.width, 192U);
  std::array<std::uint64_t, 5> counts{};
  for (std::size_t i = 0; i < match.status.size(); ++i) {
    ++counts.at(match.status[i]);
    if (match.triangle[i] == 0xFFFFFFFFU) continue;
    EXPECT_LT(match.triangle[i], pair.high.triangles.size());
    EXPECT_GE(match.u[i], 0);
    EXPECT_GE(match.v[i], 0);
    EXPECT_LE(match.u[i] + match.v[i], 1 + 1e-6);
    EXPECT_LE(std::abs(match.distance[i]), 0.01 * (1 + 1e-5));
    EXPECT_EQ(match.distance[i] >= 0, match.status[i] == 1);
  }
  EXPECT_EQ(counts[1], result.report.outward);
  EXPECT_EQ(counts[2], result.report.inward);
  EXPECT_EQ(counts[4], result.report.missed);
  EXPECT_GT(counts[1], 1000U);
  EXPECT_GT(counts[2], 1000U);
  EXPECT_GT(counts[4], 1000U);

  options.keep_match = false;
  options.match = &match;
  const BakeResult again = bake(source, pair.low, options);
  EXPECT_EQ(again.maps[0].image.pixels, result.maps[0].image.pixels);
  EXPECT_EQ(again.coverage, result.coverage);
}

TEST(Bake, MissPoliciesDoWhatTheySay) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  BakeOptions options = small_options();
  options.max_distance = Length::absolute(0.01);
  const BakeResult keep = bake(source, pair.low, options);
  options.miss = MissPolicy::mark;
  const BakeResult mark = bake(source, pair.low, options);
  options.miss = MissPolicy::fill;
  const BakeResult fill = bake(source, pair.low, options);
  std::uint64_t missed = 0;
  for (std::size_t i = 0; i < keep.coverage.size(); ++i) {
    const float* k = &keep.maps[0].image.pixels[i * 3];
    const float* m = &mark.maps[0].image.pixels[i * 3];
    const float* f = &fill.maps[0].image.pixels[i * 3];
    if (keep.coverage[i] == 1) {
      EXPECT_TRUE(std::equal(k, k + 3, m) && std::equal(k, k + 3, f));
    } else if (keep.coverage[i] == 2) {
      ++missed;
      // The low poly's own normal is straight up in its own frame.
      EXPECT_NEAR(k[0], 0.5, 1e-4);
      EXPECT_NEAR(k[1], 0.5, 1e-4);
      EXPECT_NEAR(k[2], 1, 1e-4);
      EXPECT_EQ((std::array{m[0], m[1], m[2]}), (std::array{1.0F, 0.0F, 1.0F}));
      const Vec3d value(f[0] * 2 - 1, f[1] * 2 - 1, f[2] * 2 - 1);
      EXPECT_NEAR(length(value), 1, 1e-4);
    }
  }
  EXPECT_GT(missed, 1000U);
  bool warned = false;
  for (const Warning& warning : keep.report.warnings) warned |= warning.code == "many-misses";
  EXPECT_TRUE(warned);
}

TEST(Bake, FlipYTurnsGreenAndTwoComponentsDropBlue) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  BakeOptions options = small_options();
  const BakeResult plain = bake(source, pair.low, options);
  options.flip_y = true;
  const BakeResult flipped = bake(source, pair.low, options);
  options.flip_y = false;
  options.two_component = true;
  const BakeResult two = bake(source, pair.low, options);
  for (std::size_t i = 0; i < plain.coverage.size(); ++i) {
    const float* p = &plain.maps[0].image.pixels[i * 3];
    const float* f = &flipped.maps[0].image.pixels[i * 3];
    const float* t = &two.maps[0].image.pixels[i * 3];
    EXPECT_FLOAT_EQ(p[0], f[0]);
    EXPECT_NEAR(p[1], 1 - f[1], 1e-6);
    EXPECT_EQ(t[2], 0);
    if (p[2] > 0.5F) {
      EXPECT_NEAR(t[0], p[0], 1e-6);
    }
  }
}

TEST(Bake, TwoComponentsCountWhatPointsBelowTheSurface) {
  KILN_REQUIRE_DEVICE();
  // A plane under waves so steep that some of their normals, turned by 75 degrees, point below it.
  const Mesh low = test::plane(1, 1);
  Mesh high = test::plane(32, 32);
  high.normals.clear();
  for (const Vec3& p : high.positions) {
    const double angle = 1.9 * std::sin(9 * double{p.x});
    high.normals.push_back(
        {static_cast<float>(std::sin(angle)), 0, static_cast<float>(std::cos(angle))});
  }
  high.normal_triangles = high.triangles;
  const Source source(*test::device(), high);
  for (const NormalMapSpace space : {NormalMapSpace::face, NormalMapSpace::tangent}) {
    BakeOptions options = small_options();
    options.space = space;
    options.raw = true;
    const BakeResult whole = bake(source, low, options);
    std::uint64_t below = 0;
    for (std::size_t i = 0; i < whole.coverage.size(); ++i) {
      const bool baked = whole.coverage[i] == 1;
      below += baked && whole.maps[0].image.pixels[3 * i + 2] <= 0 ? 1 : 0;
    }
    ASSERT_GT(below, 100U);
    const auto counted = [](const BakeResult& result) {
      std::uint64_t count = 0;
      for (const Warning& warning : result.report.warnings) {
        if (warning.code == "below-surface") count += warning.count;
      }
      return count;
    };
    EXPECT_EQ(counted(whole), 0U);
    options.two_component = true;
    EXPECT_EQ(counted(bake(source, low, options)), below);
  }
  // Where all point up, there is nothing to say.
  BakeOptions options = small_options();
  options.two_component = true;
  for (const Warning& warning : bake(Source(*test::device(), low), low, options).report.warnings) {
    EXPECT_NE(warning.code, "below-surface");
  }
}

TEST(Bake, CageFindsTheOuterSurfaceFirst) {
  KILN_REQUIRE_DEVICE();
  // Two sheets above a plane, both facing up: the cage ray meets the upper one first.
  Mesh high = test::plane(1, 1, 4, 4);
  const Mesh upper = high;
  const auto offset = static_cast<std::uint32_t>(high.positions.size());
  for (Vec3& p : high.positions) p.z = 0.1F;
  for (const Vec3& p : upper.positions) high.positions.push_back({p.x, p.y, 0.3F});
  for (const Triangle& t : upper.triangles) {
    high.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
    high.normal_triangles.push_back(high.normal_triangles[0]);
  }
  high.uvs.clear();
  high.uv_triangles.clear();
  const Mesh low = test::plane(2, 2, 1, 1);
  const Source source(*test::device(), high);
  BakeOptions options;
  options.width = options.height = 16;
  options.keep_match = true;
  const auto distance = [&] {
    const BakeResult result = bake(source, low, options);
    EXPECT_EQ(result.report.missed, 0U);
    return result.match->distance[8 * 16 + 8];
  };
  options.max_distance = Length::absolute(1);
  options.ray.rule = RayRule::nearest;
  EXPECT_NEAR(distance(), 0.1, 1e-6) << "the ray from the surface meets the lower sheet first";
  options.ray.rule = RayRule::outermost;
  EXPECT_NEAR(distance(), 0.3, 1e-6) << "a viewer sees the upper sheet";
  options.cage = Length::absolute(0.5);
  EXPECT_NEAR(distance(), 0.3, 1e-6);
  options.cage = Length::absolute(0.2);
  EXPECT_NEAR(distance(), 0.1, 1e-6);
  options.cage.reset();
  Mesh cage = low;
  for (Vec3& p : cage.positions) p.z += 0.5F;
  options.cage_mesh = &cage;
  EXPECT_NEAR(distance(), 0.3, 1e-6);
  for (Vec3& p : cage.positions) p.z = 0.25F;
  EXPECT_NEAR(distance(), 0.1, 1e-6);
}

TEST(Bake, SkipsFacesTurnedAwayUnlessTwoSided) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(1, 1, 4, 4);
  for (Vec3& p : high.positions) p.z = 0.1F;
  for (Triangle& t : high.triangles) std::swap(t[1], t[2]);
  high.normals.clear();
  high.normal_triangles.clear();
  const Mesh low = test::plane(1, 1, 1, 1);
  const Source source(*test::device(), high);
  BakeOptions options;
  options.width = options.height = 16;
  options.max_distance = Length::absolute(1);
  EXPECT_EQ(bake(source, low, options).report.missed, 256U);
  options.two_sided = true;
  EXPECT_EQ(bake(source, low, options).report.outward, 256U);
  options.cage = Length::absolute(0.5);
  EXPECT_EQ(bake(source, low, options).report.cage, 256U);
  options.two_sided = false;
  EXPECT_EQ(bake(source, low, options).report.missed, 256U);
}

TEST(Bake, HardEdgesLeaveNoGaps) {
  KILN_REQUIRE_DEVICE();
  // A cube inside a larger rounded one: with split normals, rays along the faces' normals would leave
  // the edges without a match; the continuous field finds something everywhere.
  const Mesh high = test::icosphere(5, 1.0);
  const Mesh low = test::cube(1.0);
  const Source source(*test::device(), high);
  BakeOptions options;
  options.width = options.height = 128;
  options.max_distance = Length::absolute(2);
  const BakeResult result = bake(source, low, options);
  EXPECT_EQ(result.report.missed, 0U);
}

TEST(Bake, CancelsAndReportsProgressInOrder) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  BakeOptions options = small_options(2048);
  std::vector<double> seen;
  options.progress = [&](double done, std::string_view) {
    seen.push_back(done);
    return true;
  };
  EXPECT_FALSE(bake(source, pair.low, options).cancelled);
  EXPECT_GT(seen.size(), 4U);
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
  EXPECT_EQ(seen.back(), 1.0);
  int calls = 0;
  options.progress = [&](double, std::string_view) { return ++calls < 2; };
  const BakeResult cancelled = bake(source, pair.low, options);
  EXPECT_TRUE(cancelled.cancelled);
  EXPECT_TRUE(cancelled.maps.empty());
  EXPECT_EQ(calls, 2);
}

TEST(Bake, RefusesParametersOutOfRange) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  const auto expect_usage = [&](const char* name, const auto& change) {
    BakeOptions options = small_options();
    change(options);
    try {
      bake(source, pair.low, options);
      ADD_FAILURE() << name << " was accepted";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage) << error.what();
    }
  };
  expect_usage("width 0", [](BakeOptions& o) { o.width = 0; });
  expect_usage("height 16385", [](BakeOptions& o) { o.height = 16385; });
  expect_usage("samples 0", [](BakeOptions& o) { o.samples = 0; });
  expect_usage("no maps", [](BakeOptions& o) { o.maps.clear(); });
  expect_usage("distance 0", [](BakeOptions& o) { o.max_distance = Length::share(0); });
  expect_usage("distance NaN", [](BakeOptions& o) { o.max_distance = Length::share(NAN); });
  expect_usage("cage -1", [](BakeOptions& o) { o.cage = Length::share(-1); });
  expect_usage("gutter -2", [](BakeOptions& o) { o.gutter = -2; });
}

TEST(Bake, WorksAtTheSmallestSizes) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  BakeOptions options = small_options();
  for (const auto& [width, height] : {std::pair{1U, 1U}, {1U, 7U}, {65U, 1U}, {3U, 2U}}) {
    options.width = width;
    options.height = height;
    const BakeResult result = bake(source, pair.low, options);
    EXPECT_EQ(result.maps[0].image.pixels.size(), std::size_t{width} * height * 3);
    for (float value : result.maps[0].image.pixels) EXPECT_TRUE(std::isfinite(value));
  }
}

/// A square in the plane y = 0 whose sides have vertices of their own; UVs of the upper side in the left half
/// of the map. The corners run from 0 to 1.
Mesh two_sided_card(std::uint32_t cells) {
  Mesh mesh;
  mesh.name = "card";
  for (int side = 0; side < 2; ++side) {
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    for (std::uint32_t y = 0; y <= cells; ++y) {
      for (std::uint32_t x = 0; x <= cells; ++x) {
        const float u = static_cast<float>(x) / static_cast<float>(cells);
        const float v = static_cast<float>(y) / static_cast<float>(cells);
        mesh.positions.push_back({u, 0, v});
        mesh.uvs.push_back({u * 0.4F + (side == 0 ? 0.05F : 0.55F), v * 0.9F + 0.05F});
      }
    }
    for (std::uint32_t y = 0; y < cells; ++y) {
      for (std::uint32_t x = 0; x < cells; ++x) {
        const std::uint32_t a = base + y * (cells + 1) + x;
        const std::uint32_t b = a + 1, c = a + cells + 1, d = c + 1;
        if (side == 0) {  // +Y
          mesh.triangles.push_back({a, c, b});
          mesh.triangles.push_back({b, c, d});
        } else {
          mesh.triangles.push_back({a, b, c});
          mesh.triangles.push_back({b, d, c});
        }
      }
    }
  }
  mesh.uv_triangles = mesh.triangles;
  return mesh;
}

TEST(Bake, CardsWithoutThicknessKeepTheirSides) {
  KILN_REQUIRE_DEVICE();
  // At every vertex the two sides' normals cancel out: each takes its own face's.
  const Source source(*test::device(), two_sided_card(8));
  BakeOptions options;
  options.width = options.height = 32;
  options.space = NormalMapSpace::object;
  options.gutter = 0;
  const BakeResult result = bake(source, two_sided_card(1), options);
  EXPECT_GT(result.report.samples, 500U);
  EXPECT_EQ(result.report.missed, 0U);
  for (std::size_t y = 0; y < 32; ++y) {
    for (std::size_t x = 0; x < 32; ++x) {
      if (result.coverage[y * 32 + x] != 1) continue;
      const float expected = x < 16 ? 1.0F : 0.0F;
      ASSERT_NEAR(result.maps[0].image.at(x, y)[1], expected, 1e-6) << x << ", " << y;
    }
  }
}

TEST(Bake, TwoSidedTurnsNormalsTowardsTheLightMesh) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(6, 6);
  for (Triangle& t : high.triangles) std::swap(t[1], t[2]);
  high.uvs.clear();
  high.uv_triangles.clear();
  high.normals.clear();
  high.normal_triangles.clear();
  const Source source(*test::device(), high);
  BakeOptions options;
  options.width = options.height = 16;
  options.gutter = 0;
  EXPECT_EQ(bake(source, test::plane(1, 1), options).report.missed, 256U);
  options.two_sided = true;
  for (const MatchMethod method : {MatchMethod::ray, MatchMethod::views}) {
    options.method = method;
    const BakeResult result = bake(source, test::plane(1, 1), options);
    EXPECT_EQ(result.report.missed, 0U);
    for (std::size_t i = 0; i < 256; ++i) {
      ASSERT_NEAR(result.maps[0].image.pixels[i * 3 + 2], 1, 1e-6);
    }
  }
}

}  // namespace
}  // namespace kiln
