// The maps of visibility: v and s of each texel (Tarini et al., figure 4), against brute force in double.
#include <gtest/gtest.h>

#include <cmath>

#include "kiln/session.h"
#include "match/visibility.h"
#include "mesh/frame.h"
#include "mesh/kernels_shared.h"
#include "reference/visibility.h"
#include "support/environment.h"
#include "support/shapes.h"
#include "texel/texels.h"

namespace kiln {
namespace {

constexpr std::uint32_t kWidth = 48, kHeight = 40;

const Image& image_of(const BakeResult& result, std::string_view name) {
  for (const BakedMap& map : result.maps) {
    if (map.kind.name == name) return map.image;
  }
  throw std::runtime_error("no such map");
}

BakeOptions asking(MatchMethod method) {
  BakeOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.encoding.gutter = 0;
  options.match.method = method;
  options.maps = {MapKind{"visibility"}, MapKind{"deviation"}};
  options.match.max_distance = Length::absolute(0.2);
  options.match.visibility.test = VisibilityTest::rays;
  options.match.visibility.smoothing = 0;
  options.match.visibility.directions = 40;
  return options;
}

TEST(VisibilityMaps, HoldWhatBruteForceFinds) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpyTorus::dense(8000), low = test::BumpyTorus::light(24, 12);
  const BakeOptions options = asking(MatchMethod::hybrid);
  const Source source(*test::device(), high);
  const BakeResult result = bake(source, low, options);
  const Image& v = image_of(result, "visibility");
  const Image& s = image_of(result, "deviation");
  ASSERT_EQ(v.channels, 3U);
  ASSERT_EQ(s.channels, 1U);

  cl::Context& context = context_of(*test::device());
  const Frame frame = Frame::of(high);
  const LowSurface surface = LowSurface::of(low, frame);
  const std::vector<Vec3> positions = frame.to_frame(low);
  std::vector<reference::SeenDirection> directions;
  for (const ProbeDirection& d : probe_directions(options.match.visibility)) {
    const Vec3 toward = to_float(d.toward);
    directions.push_back({{toward.x, toward.y, toward.z}, d.weight});
  }
  TexelSampler sampler(context, surface, {kWidth, kHeight, 1, 1U << 20});
  const TexelBand band = sampler.sample(0);
  const std::vector<float> points = band.points.download(context);
  const std::vector<std::uint32_t> triangle = band.triangle.download(context);
  const std::vector<std::uint32_t> index = band.texel_index.download(context);
  std::size_t compared = 0, hidden = 0;
  for (std::size_t i = 0; i < band.sample_count; ++i) {
    const std::array<double, 3> place = {points[i], points[i + band.capacity],
                                         points[i + 2 * std::size_t{band.capacity}]};
    const auto& t = surface.triangles[triangle[i]];
    const Vec3d up = cross(to_double(t[1].position) - to_double(t[0].position),
                           to_double(t[2].position) - to_double(t[0].position));
    const Vec3d normal = up * (1 / length(up));
    const reference::SeenSum seen =
        reference::see(positions, low.triangles, place, {normal.x, normal.y, normal.z}, directions,
                       KILN_VISIBILITY_LEAST_COSINE, 1.0 / 65536, 8, 1e-4);
    if (seen.doubtful > 0 || !(seen.weight > 0)) continue;
    ++compared;
    double square = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double expected = seen.sum[c] / seen.weight;
      square += expected * expected;
      // Sums of 40 floats of up to 1: 40 x 2^-24, and the normals' own rounding.
      ASSERT_NEAR(v.pixels[3 * std::size_t{index[i]} + c], expected, 2e-5) << i;
    }
    // |v| stays under 0.99, where s changes by 7 times what v does at most.
    ASSERT_LT(square, 0.98);
    ASSERT_NEAR(s.pixels[index[i]], std::sqrt(1 - square), 4e-4) << i;
    if (square > 0.55) ++hidden;  // an open plane has 4/9
  }
  EXPECT_GT(compared, kWidth * kHeight / 2);
  EXPECT_GT(hidden, 0U) << "the torus hides its own inside";
}

TEST(VisibilityMaps, AreOfThePlaceAndNotOfTheMethod) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(4000), low = test::BumpySphere::light(16, 8);
  const Source source(*test::device(), high);
  const BakeResult one = bake(source, low, asking(MatchMethod::visibility));
  const BakeResult other = bake(source, low, asking(MatchMethod::hybrid));
  EXPECT_EQ(one.maps[0].image.pixels, other.maps[0].image.pixels);
  // Places where nothing is found have directions all the same.
  BakeOptions near = asking(MatchMethod::visibility);
  near.match.max_distance = Length::absolute(1e-4);
  const BakeResult missed = bake(source, low, near);
  EXPECT_GT(missed.report.missed, missed.report.samples / 2);
  EXPECT_EQ(one.maps[0].image.pixels, missed.maps[0].image.pixels);
  // With fallbacks, which leave no directions.
  near.match.fallback = {MatchMethod::closest};
  EXPECT_EQ(bake(source, low, near).maps[0].image.pixels, one.maps[0].image.pixels);
  // At vertices, and in a session that bakes the same again.
  BakeOptions vertices = asking(MatchMethod::visibility);
  vertices.match.visibility.at = VisibilityAt::vertex;
  const BakeResult at_vertices = bake(source, low, vertices);
  EXPECT_NE(at_vertices.maps[0].image.pixels, one.maps[0].image.pixels);
  BakeSession session(*test::device(), high, low, vertices);
  const BakeResult fresh =
      bake(Source(*test::device(), session.high(), RayTraversal::automatic, session.bounds()), low,
           vertices);
  EXPECT_EQ(session.bake().maps[0].image.pixels, fresh.maps[0].image.pixels);
}

TEST(VisibilityMaps, NeedAMatchByVisibility) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(2000), low = test::BumpySphere::light(16, 8);
  const Source source(*test::device(), high);
  BakeOptions options = asking(MatchMethod::ray);
  EXPECT_THROW(bake(source, low, options), Error);
  options = asking(MatchMethod::visibility);
  options.maps = {MapKind::normal};
  options.report.keep_match = true;
  const BakeResult baked = bake(source, low, options);
  options.report.keep_match = false;
  options.match.saved = &*baked.match;
  options.maps = {MapKind{"deviation"}};
  EXPECT_THROW(bake(source, low, options), Error);
}

}  // namespace
}  // namespace kiln
