// Exactness of bakes: on analytic surfaces, and against the reference bake.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "kiln/bake.h"
#include "kiln/image.h"
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

/// Places of a low poly, and the exact normals where their rays meet the exact surface.
struct Places {
  struct Place {
    std::size_t triangle;
    double u, v;
    Vec3d normal{};
  };
  LowSurface low;
  std::vector<Place> places;

  /// \param surface  signed: above 0 outside the exact surface
  template <typename Surface, typename Normal>
  Places(const Mesh& mesh, const Surface& surface, const Normal& exact_normal)
      : low(LowSurface::of(mesh, Frame())) {  // identity: world units
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (int i = 0; i < 40000; ++i) {
      Place place{random() % low.triangles.size(), uniform(random), 0, {}};
      place.v = uniform(random);
      if (place.u + place.v > 1) place.u = 1 - place.u, place.v = 1 - place.v;
      const Vec3d point = mix(place, &LowSurface::Corner::position);
      Vec3d direction = mix(place, &LowSurface::Corner::direction);
      direction = direction * (1 / length(direction));
      // The low poly lies within 0.1 of the surface everywhere: bisection on the ray.
      double inside = -0.15;
      double outside = 0.15;
      for (int step = 0; step < 50; ++step) {
        const double middle = (inside + outside) / 2;
        (surface(point + direction * middle) > 0 ? outside : inside) = middle;
      }
      place.normal = exact_normal(point + direction * inside);
      places.push_back(place);
    }
  }

  Vec3d mix(const Place& at, Vec3 LowSurface::Corner::*member) const {
    const auto& corners = low.triangles[at.triangle];
    return to_double(corners[0].*member) * (1 - at.u - at.v) +
           to_double(corners[1].*member) * at.u + to_double(corners[2].*member) * at.v;
  }
};

/// Mean angle between a map, looked up at places of the low poly, and the exact normals there.
double mean_error(const Places& all, const BakeResult& baked, bool tangent_space) {
  double sum = 0;
  int count = 0;
  for (const Places::Place& at : all.places) {
    const auto& corners = all.low.triangles[at.triangle];
    const double w = 1 - at.u - at.v;
    const Vec2 uv = {
        static_cast<float>(corners[0].uv.x * w + corners[1].uv.x * at.u + corners[2].uv.x * at.v),
        static_cast<float>(corners[0].uv.y * w + corners[1].uv.y * at.u + corners[2].uv.y * at.v)};
    Vec3d value{};
    if (!look_up(baked, uv, value)) continue;
    if (tangent_space) {
      const Vec3d n = all.mix(at, &LowSurface::Corner::normal);
      const Vec3d t = all.mix(at, &LowSurface::Corner::tangent);
      const Vec3d b = cross(n, t) * double{corners[0].sign};
      value = t * value.x + b * value.y + n * value.z;
    }
    sum += angle_degrees(value, at.normal);
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
  const double tube = std::hypot(ring - test::BumpyTorus::kMajorRadius, p.y);
  // The angles as shapes.h has them: around the axis, and around the tube from the outer equator.
  const double v = std::atan2(p.y, ring - test::BumpyTorus::kMajorRadius);
  // Which way u runs is found from the high poly's first vertices in a test below.
  const double u = std::atan2(-p.z, p.x);
  return tube - test::BumpyTorus::kMinorRadius - test::BumpyTorus::height(u, v);
}
Vec3d torus_normal(const Vec3d& p) { return from_test(test::BumpyTorus::exact_normal(to_test(p))); }

/// A body of a formula, its low poly and what is exact of it: made once for both spaces.
struct Body {
  Mesh low;
  Source source;
  Places places;
};

class Accuracy : public testing::TestWithParam<NormalMapSpace> {
 protected:
  static void TearDownTestSuite() {
    the_sphere.reset();
    the_torus.reset();
  }

  static const Body& sphere() {
    if (!the_sphere) {
      Mesh low = test::BumpySphere::light();
      Places places(low, sphere_surface, sphere_normal);
      the_sphere = std::make_unique<Body>(
          Body{std::move(low), Source(*test::device(), test::BumpySphere::dense(1000000)),
               std::move(places)});
    }
    return *the_sphere;
  }

  static const Body& torus() {
    if (the_torus) return *the_torus;
    const Mesh high = test::BumpyTorus::dense(1000000);
    for (std::size_t i = 0; i < high.positions.size(); i += 997) {
      EXPECT_NEAR(torus_surface(to_double(high.positions[i])), 0, 1e-6)
          << "the test's own surface is off";
    }
    Mesh low = test::BumpyTorus::light();
    Places places(low, torus_surface, torus_normal);
    the_torus = std::make_unique<Body>(
        Body{std::move(low), Source(*test::device(), high), std::move(places)});
    return *the_torus;
  }

  static void expect_exact(const Body& body, const char* name) {
    double last = 100;
    for (const std::uint32_t size : {128U, 256U, 512U, 1024U}) {
      BakeOptions options;
      options.width = options.height = size;
      options.match.max_distance = Length::absolute(0.15);
      options.encoding.space = GetParam();
      options.report.recall = 0;  // another measure
      const BakeResult baked = bake(body.source, body.low, options);
      EXPECT_EQ(baked.report.missed, 0U);
      const double error = mean_error(body.places, baked, GetParam() == NormalMapSpace::tangent);
      RecordProperty("degrees_at_" + std::to_string(size), std::to_string(error));
      std::printf("%s, %u^2: mean %.4f degrees\n", name, size, error);
      EXPECT_LT(error, last);
      last = error;
    }
    EXPECT_LT(last, 0.2);
  }

 private:
  static inline std::unique_ptr<Body> the_sphere, the_torus;
};

TEST_P(Accuracy, OfABumpySphereIsUnderAFifthOfADegreeAndFallsWithResolution) {
  KILN_REQUIRE_DEVICE();
  expect_exact(sphere(), "bumpy sphere");
}

TEST_P(Accuracy, OfABumpyTorusIsUnderAFifthOfADegreeAndFallsWithResolution) {
  KILN_REQUIRE_DEVICE();
  expect_exact(torus(), "bumpy torus");
}

INSTANTIATE_TEST_SUITE_P(Spaces, Accuracy,
                         testing::Values(NormalMapSpace::tangent, NormalMapSpace::object));

/// The bunny with the reference's own rays (see the data's README).
BakeOptions blender_options() {
  BakeOptions options;
  options.width = options.height = 1024;
  options.match.cage = Length::share(0.012444);
  options.match.max_distance = Length::share(0.024887);
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
  Image mask{1024, 1024, 1, std::vector<float>(std::size_t{1024} * 1024)};
  std::uint64_t counted = 0, beyond = 0;
  for (std::size_t i = 0; i < mask.pixels.size(); ++i) {
    const float* p = &reference.pixels[i * reference.channels];
    const bool theirs = p[0] + p[1] + p[2] > 0.1F;
    mask.pixels[i] = baked.coverage[i] == 1 && theirs ? 1.0F : 0.0F;
    if (mask.pixels[i] == 0) continue;
    ++counted;
    const float* q = &baked.maps[0].image.pixels[3 * i];
    beyond += angle_degrees(Vec3d(2 * p[0] - 1, 2 * p[1] - 1, 2 * p[2] - 1),
                            Vec3d(2 * q[0] - 1, 2 * q[1] - 1, 2 * q[2] - 1)) > 0.5;
  }
  EXPECT_GT(counted, baked.report.texels * 98 / 100);
  const ImageDifference difference = compare_images(baked.maps[0].image, reference, &mask);
  std::printf(
      "against Blender: mean %.3f, 95%% %.3f, 99%% %.3f, max %.1f degrees over %llu texels, %llu "
      "beyond "
      "0.5\n",
      difference.mean_angle_degrees, difference.p95_angle_degrees, difference.p99_angle_degrees,
      difference.max_angle_degrees, static_cast<unsigned long long>(difference.compared_texels),
      static_cast<unsigned long long>(beyond));
  EXPECT_LT(difference.mean_angle_degrees, 0.5);
  EXPECT_LT(difference.p99_angle_degrees, 5);
}

}  // namespace
}  // namespace kiln
