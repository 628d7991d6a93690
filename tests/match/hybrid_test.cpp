// The hybrid's directions, against the formula as printed (Tarini, Cignoni, Scopigno 2003, section 3.4,
// equation 3) with visibility by brute force.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kiln/bake.h"
#include "match/visibility.h"
#include "mesh/frame.h"
#include "mesh/kernels_shared.h"
#include "mesh/vector.h"
#include "reference/visibility.h"
#include "support/environment.h"
#include "support/shapes.h"
#include "texel/texels.h"

namespace kiln {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

double angle(const Vec3d& a, const Vec3d& b) {
  return std::atan2(length(cross(a, b)), dot(a, b)) / kDegree;
}

Vec3d unit(const Vec3d& v) { return v * (1 / length(v)); }

/// unit((1 - s) v + s n) with s = sqrt(1 - |mean|^2), v the mean made unit.
Vec3d hybrid(const Vec3d& mean, const Vec3d& normal) {
  const double s = std::sqrt(1 - dot(mean, mean));
  return unit(unit(mean) * (1 - s) + normal * s);
}

TEST(Hybrid, FollowsTheFormulaOnTheBunny) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("bunny_high.ply");
  KILN_REQUIRE_DATA("bunny_low.obj");
  const Mesh low = load_mesh(*test::shared_data("bunny_low.obj"));
  const Mesh high = load_mesh(*test::shared_data("bunny_high.ply"));
  constexpr std::uint32_t kSize = 192;
  BakeOptions options;
  options.width = options.height = kSize;
  options.match.method = MatchMethod::hybrid;
  options.match.visibility.test = VisibilityTest::rays;
  options.match.visibility.smoothing = 0;
  options.match.visibility.directions = 200;
  options.match.max_distance = Length::share(0.02);
  options.report.keep_match = true;
  const Match match = *bake(Source(*test::device(), high), low, options).match;

  const Frame frame = Frame::of(high);
  const LowSurface surface = LowSurface::of(low, frame);
  const std::vector<Vec3> positions = frame.to_frame(low), dense = frame.to_frame(high);
  std::vector<reference::SeenDirection> directions;
  for (const ProbeDirection& d : probe_directions(options.match.visibility)) {
    const Vec3 toward = to_float(d.toward);
    directions.push_back({{toward.x, toward.y, toward.z}, d.weight});
  }
  cl::Context& context = context_of(*test::device());
  TexelSampler sampler(context, surface, {kSize, kSize, 1, 1U << 22});
  const TexelBand band = sampler.sample(0);
  const std::vector<float> points = band.points.download(context);
  const std::vector<std::uint32_t> triangle = band.triangle.download(context);
  const std::vector<std::uint32_t> index = band.texel_index.download(context);
  const double far = 0.001 * frame.diagonal * frame.scale;
  std::size_t compared = 0;
  double least_deviation = 1, most_deviation = 0, farthest = 0;
  for (std::size_t i = 0; i < band.sample_count; i += 23) {
    const auto plane = [&](std::size_t k) { return double{points[i + k * band.capacity]}; };
    const Vec3d p{plane(0), plane(1), plane(2)}, n{plane(3), plane(4), plane(5)};
    const std::size_t element = index[i];
    if (match.triangle[element] == KILN_NO_TRIANGLE) continue;
    ASSERT_LT(match.triangle[element], high.triangles.size()) << element;
    const Triangle& hit = high.triangles[match.triangle[element]];
    const Vec3d a = to_double(dense[hit[0]]);
    const Vec3d offset = a + (to_double(dense[hit[1]]) - a) * double{match.u[element]} +
                         (to_double(dense[hit[2]]) - a) * double{match.v[element]} - p;
    if (length(offset) <= far) continue;
    const auto& corners = surface.triangles[triangle[i]];
    const Vec3d up = unit(cross(to_double(corners[1].position) - to_double(corners[0].position),
                                to_double(corners[2].position) - to_double(corners[0].position)));
    const reference::SeenSum seen =
        reference::see(positions, low.triangles, {p.x, p.y, p.z}, {up.x, up.y, up.z}, directions,
                       KILN_VISIBILITY_LEAST_COSINE, 1.0 / 65536, 8, 1e-4);
    if (seen.doubtful > 0 || !(seen.weight > 0)) continue;
    const Vec3d mean = Vec3d{seen.sum[0], seen.sum[1], seen.sum[2]} * (1 / seen.weight);
    const Vec3d expected = hybrid(mean, unit(n));
    if (dot(expected, up) < KILN_VISIBILITY_LEAST_RISE) continue;  // is raised to it
    ++compared;
    const double deviation = std::sqrt(1 - dot(mean, mean));
    least_deviation = std::min(least_deviation, deviation);
    most_deviation = std::max(most_deviation, deviation);
    farthest = std::max(farthest, angle(expected, unit(n)));
    // Inward as well as outward.
    const Vec3d along = dot(offset, expected) < 0 ? -offset : offset;
    // Positions of 1e-7 over distances of 5e-4 and more: 0.02 degrees.
    EXPECT_LT(angle(along, expected), 0.1) << element;
  }
  EXPECT_GT(compared, 40U);
  // Places of several kinds, and directions that the normal is not.
  EXPECT_LT(least_deviation, 0.7);
  EXPECT_GT(most_deviation, 0.74);
  EXPECT_GT(farthest, 3);
}

TEST(Hybrid, OnAnOpenPlaneTheNormalWeighsThreeQuarters) {
  KILN_REQUIRE_DEVICE();
  // The mean of an open plane has the length 2/3: s = sqrt(5)/3.
  Mesh open = test::plane(2, 2);
  open.normals = {{0.6F, 0, 0.8F}};
  Mesh high = test::plane(1, 1, 8, 8);
  for (Vec3& p : high.positions) p.z = 0.3F;
  BakeOptions options;
  options.width = options.height = 32;
  options.match.method = MatchMethod::hybrid;
  options.match.visibility.directions = 2048;
  options.match.max_distance = Length::absolute(1);
  options.report.keep_match = true;
  const Vec3d expected = hybrid({0, 0, 2.0 / 3}, {0.6, 0, 0.8});
  for (const VisibilityAt at : {VisibilityAt::texel, VisibilityAt::vertex, VisibilityAt::face}) {
    options.match.visibility.at = at;
    const Match match = *bake(Source(*test::device(), high), open, options).match;
    for (const float distance : match.distance) {
      ASSERT_GT(distance, 0);
      // The rise to the plane 0.3 above says the angle to it; 2,048 directions know the mean to 1e-3.
      EXPECT_NEAR(0.3 / distance, expected.z, 2e-3);
    }
  }
}

}  // namespace
}  // namespace kiln
