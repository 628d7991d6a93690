// Maps beside normals: what they hold is what the match says and the closed form says.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "image/gutter.h"
#include "kiln/session.h"
#include "kiln/validate.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

constexpr float kAbove = 0.25F, kBelow = -0.125F;

/// Two sheets that do not touch, over x < 0 and over x > 0, at two heights over the plane z = 0.
Mesh two_sheets() {
  Mesh high = test::plane(4, 4);
  for (Vec3& p : high.positions) p = {p.x / 2 - 0.25F, p.y, kAbove};
  Mesh right = test::plane(4, 4);
  const auto first = static_cast<std::uint32_t>(high.positions.size());
  for (Vec3& p : right.positions) high.positions.push_back({p.x / 2 + 0.25F, p.y, kBelow});
  for (Triangle t : right.triangles) {
    for (std::uint32_t& corner : t) corner += first;
    high.triangles.push_back(t);
  }
  high.normals.clear();
  high.normal_triangles.clear();
  high.uvs.clear();
  high.uv_triangles.clear();
  high.name = "sheets";
  return high;
}

BakeOptions asking(std::vector<MapKind> maps) {
  BakeOptions options;
  options.width = 64;
  options.height = 48;
  options.encoding.gutter = 3;
  options.maps = std::move(maps);
  options.match.max_distance = Length::absolute(0.5);
  options.report.keep_match = true;
  return options;
}

const BakedMap& map_of(const BakeResult& result, std::string_view name) {
  for (const BakedMap& map : result.maps) {
    if (map.kind.name == name) return map;
  }
  throw std::runtime_error("no such map");
}

Mesh inset_plane(double width = 1, double height = 1) {
  Mesh low = test::plane(2, 2, width, height);
  for (Vec2& uv : low.uvs) uv = {0.1F + 0.8F * uv.x, 0.1F + 0.8F * uv.y};
  return low;
}

TEST(Maps, HoldTheClosedFormOverAPlane) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), two_sheets());
  const BakeResult baked =
      bake(source, inset_plane(),
           asking({MapKind{"height"}, MapKind{"position"}, MapKind{"slope"}, MapKind{"id"}}));
  ASSERT_EQ(baked.maps.size(), 4U);
  const Image& height = map_of(baked, "height").image;
  const Image& position = map_of(baked, "position").image;
  const Image& slope = map_of(baked, "slope").image;
  const Image& id = map_of(baked, "id").image;
  ASSERT_EQ(height.channels, 1U);
  ASSERT_EQ(position.channels, 3U);
  std::set<std::array<float, 3>> left, right;
  std::size_t texels = 0;
  for (std::uint32_t y = 0; y < height.height; ++y) {
    for (std::uint32_t x = 0; x < height.width; ++x) {
      const std::size_t i = std::size_t{y} * height.width + x;
      if (baked.coverage[i] != kCoverageBaked) continue;
      ++texels;
      // The texel's centre on the plane, from its UV.
      const double at_x = ((x + 0.5) / height.width - 0.1) / 0.8 - 0.5;
      const double at_y = (1 - (y + 0.5) / height.height - 0.1) / 0.8 - 0.5;
      const float z = at_x < 0 ? kAbove : kBelow;
      EXPECT_NEAR(height.pixels[i], z, 1e-6);
      EXPECT_NEAR(position.pixels[3 * i], at_x, 1e-6);
      EXPECT_NEAR(position.pixels[3 * i + 1], at_y, 1e-6);
      EXPECT_NEAR(position.pixels[3 * i + 2], z, 1e-6);
      EXPECT_NEAR(slope.pixels[i], 90, 1e-4);  // from +Y to +Z
      (at_x < 0 ? left : right)
          .insert({id.pixels[3 * i], id.pixels[3 * i + 1], id.pixels[3 * i + 2]});
    }
  }
  EXPECT_GT(texels, 1000U);
  // One colour a part, far apart, and none black.
  ASSERT_EQ(left.size(), 1U);
  ASSERT_EQ(right.size(), 1U);
  double apart = 0;
  for (std::size_t c = 0; c < 3; ++c) apart += std::abs((*left.begin())[c] - (*right.begin())[c]);
  EXPECT_GT(apart, 0.5);
  EXPECT_GT((*left.begin())[0] + (*left.begin())[1] + (*left.begin())[2], 0.1F);
}

/// Against the saved match, in double precision: position, distance and normal by barycentrics.
TEST(Maps, HoldWhatTheMatchSays) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::BumpySphere::dense(20000, true);
  for (Vec3& p : high.positions) p = {3 * p.x + 7, 3 * p.y - 2, 3 * p.z};
  Mesh low = test::BumpySphere::light(24, 12);
  for (Vec3& p : low.positions) p = {3 * p.x + 7, 3 * p.y - 2, 3 * p.z};
  const Source source(*test::device(), high);
  BakeOptions options = asking({MapKind{"height"}, MapKind{"position"}, MapKind{"slope"}});
  options.encoding.gutter = 0;
  const BakeResult baked = bake(source, low, options);
  const Match& match = *baked.match;
  std::size_t checked = 0;
  for (std::size_t i = 0; i < baked.coverage.size(); ++i) {
    if (baked.coverage[i] != kCoverageBaked) continue;
    ++checked;
    const Triangle& corners = high.triangles[match.triangle[i]];
    const Triangle& shading = high.normal_triangles[match.triangle[i]];
    const double w[3] = {1.0 - match.u[i] - match.v[i], match.u[i], match.v[i]};
    double at[3] = {}, normal[3] = {};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = high.positions[corners[k]];
      const Vec3& n = high.normals[shading[k]];
      const double size = std::sqrt(double{n.x} * n.x + double{n.y} * n.y + double{n.z} * n.z);
      at[0] += w[k] * p.x, at[1] += w[k] * p.y, at[2] += w[k] * p.z;
      normal[0] += w[k] * n.x / size, normal[1] += w[k] * n.y / size,
          normal[2] += w[k] * n.z / size;
    }
    // Positions are rounded to the working frame once: half a unit in the last place of 10.
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(map_of(baked, "position").image.pixels[3 * i + c], at[c], 4e-6);
    }
    EXPECT_EQ(map_of(baked, "height").image.pixels[i], match.distance[i]);
    const double length =
        std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    const double degrees = std::acos(normal[1] / length) * 180 / 3.14159265358979323846;
    EXPECT_NEAR(map_of(baked, "slope").image.pixels[i], degrees, 1e-3);
  }
  EXPECT_GT(checked, 2000U);
}

TEST(Maps, MissesStandForTheLowPoly) {
  KILN_REQUIRE_DEVICE();
  Mesh high = two_sheets();
  high.triangles.resize(high.triangles.size() / 2);  // the left sheet alone
  const Source source(*test::device(), high);
  BakeOptions options = asking({MapKind{"height"}, MapKind{"position"}, MapKind{"id"}});
  options.encoding.gutter = 0;
  const BakeResult baked = bake(source, inset_plane(), options);
  std::size_t missed = 0;
  for (std::size_t i = 0; i < baked.coverage.size(); ++i) {
    if (baked.coverage[i] != kCoverageMissed) continue;
    ++missed;
    EXPECT_EQ(map_of(baked, "height").image.pixels[i], 0.0F);
    EXPECT_NEAR(map_of(baked, "position").image.pixels[3 * i + 2], 0, 1e-7);
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_EQ(map_of(baked, "id").image.pixels[3 * i + c], 0.0F);
  }
  EXPECT_GT(missed, 500U);
}

TEST(Maps, MaskNeedsNoOtherMap) {
  KILN_REQUIRE_DEVICE();
  Mesh high = two_sheets();
  high.triangles.resize(high.triangles.size() - 10);
  const Source source(*test::device(), high);
  const BakeResult beside = bake(source, inset_plane(), asking({MapKind::normal, MapKind::mask}));
  const BakeResult alone = bake(source, inset_plane(), asking({MapKind::mask}));
  ASSERT_EQ(alone.maps.size(), 1U);
  EXPECT_EQ(alone.maps[0].image.pixels, map_of(beside, "mask").image.pixels);
  EXPECT_EQ(alone.coverage, beside.coverage);
  EXPECT_EQ(alone.report.gutter_texels, beside.report.gutter_texels);
  EXPECT_EQ(alone.report.missed, beside.report.missed);
  EXPECT_GT(alone.report.missed, 0U);
}

/// Names are not averaged: not by samples, not by padding, and there is no mip chain.
TEST(Maps, IdsAreNeverMixed) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), two_sheets());
  for (const MissPolicy miss : {MissPolicy::keep, MissPolicy::fill, MissPolicy::mark}) {
    BakeOptions options = asking({MapKind{"id"}, MapKind{"height"}});
    options.width = options.height = 37;  // the edge between the sheets crosses texels
    options.samples = 4;
    options.encoding.gutter = -1;
    options.encoding.mips = true;
    options.encoding.miss = miss;
    options.report.keep_match = false;
    const BakeResult baked = bake(source, inset_plane(1.1, 1.1), options);
    const BakedMap& id = map_of(baked, "id");
    std::set<std::array<float, 3>> colours;
    for (std::size_t i = 0; i < baked.coverage.size(); ++i) {
      colours.insert(
          {id.image.pixels[3 * i], id.image.pixels[3 * i + 1], id.image.pixels[3 * i + 2]});
    }
    colours.erase({0, 0, 0});  // missed
    colours.erase({1, 0, 1});  // ... and marked
    EXPECT_EQ(colours.size(), 2U) << "miss policy " << static_cast<int>(miss);
    EXPECT_TRUE(id.mips.empty());
    EXPECT_EQ(map_of(baked, "height").mips.size(), 5U);  // 18, 9, 4, 2, 1
  }
}

TEST(Maps, SamplesAreAveraged) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), two_sheets());
  BakeOptions options = asking({MapKind{"height"}});
  options.width = options.height = 5;
  options.samples = 4;
  options.encoding.gutter = 0;
  Mesh low = test::plane(1, 1);
  const BakeResult baked = bake(source, low, options);
  // Samples of the middle one of five columns lie two left and two right of the step.
  for (std::size_t y = 0; y < 5; ++y) {
    const float expected[5] = {kAbove, kAbove, (kAbove + kBelow) / 2, kBelow, kBelow};
    for (std::size_t x = 0; x < 5; ++x) {
      EXPECT_NEAR(baked.maps[0].image.pixels[5 * y + x], expected[x], 1e-6) << x << ", " << y;
    }
  }
}

TEST(Maps, AreFollowedBySessions) {
  KILN_REQUIRE_DEVICE();
  for (const MatchMethod method : {MatchMethod::ray, MatchMethod::uv}) {
    Mesh high = test::plane(16, 16);
    for (Vec2& uv : high.uvs) uv = {0.1F + 0.8F * uv.x, 0.1F + 0.8F * uv.y};
    BakeOptions options =
        asking({MapKind{"height"}, MapKind::normal, MapKind{"position"}, MapKind{"slope"}});
    options.match.method = method;
    options.report.keep_match = false;
    options.match.max_distance.reset();
    if (method != MatchMethod::uv) options.match.max_distance = Length::absolute(0.3);
    SessionOptions within;
    within.bounds = Bounds{{-0.5, -0.5, -0.25}, {0.5, 0.5, 0.25}};
    BakeSession session(*test::device(), high, inset_plane(), options, within);
    session.bake();
    std::vector<Vec3> moved(high.positions.begin() + 40, high.positions.begin() + 90);
    for (Vec3& p : moved) p.z += 0.02F + 0.1F * p.x;
    session.set_positions(40, moved);
    const BakeResult& live = session.bake();
    const Source again(*test::device(), session.high(), RayTraversal::automatic, session.bounds());
    const BakeResult fresh = bake(again, inset_plane(), options);
    ASSERT_EQ(live.maps.size(), fresh.maps.size());
    for (std::size_t m = 0; m < fresh.maps.size(); ++m) {
      EXPECT_EQ(live.maps[m].image.pixels, fresh.maps[m].image.pixels)
          << fresh.maps[m].kind.name << " by " << method.name;
    }
  }
}

TEST(Maps, RangesAreOfTheHighPolyAndTheOptionsAlone) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::BumpySphere::dense(2000, true);
  high.positions.push_back({900, 900, 900});  // of no triangle
  const Source source(*test::device(), high);
  const std::vector<MapKind> kinds = {
      MapKind{"position"},  MapKind{"height"},    MapKind{"displacement"}, MapKind{"distance"},
      MapKind{"curvature"}, MapKind{"convexity"}, MapKind{"slope"},        MapKind::normal};
  BakeOptions options = asking(kinds);
  options.match.max_distance = Length::absolute(0.123);
  options.curvature_radius = Length::absolute(0.3);
  // Two parts of one object.
  Mesh upper = test::BumpySphere::light(8, 4), lower = upper;
  const auto half = [](Mesh& mesh, bool first) {
    for (std::vector<Triangle>* of :
         {&mesh.triangles, &mesh.uv_triangles, &mesh.normal_triangles}) {
      const auto middle = of->begin() + static_cast<std::ptrdiff_t>(of->size() / 2);
      first ? of->erase(middle, of->end()) : of->erase(of->begin(), middle);
    }
  };
  half(upper, true);
  half(lower, false);
  const BakeResult one = bake(source, upper, options), other = bake(source, lower, options);
  for (std::size_t m = 0; m < kinds.size(); ++m) {
    ASSERT_EQ(one.maps[m].ranges.size(), one.maps[m].info.channels) << kinds[m].name;
    for (std::size_t c = 0; c < one.maps[m].ranges.size(); ++c) {
      EXPECT_EQ(one.maps[m].ranges[c].low, other.maps[m].ranges[c].low) << kinds[m].name;
      EXPECT_EQ(one.maps[m].ranges[c].high, other.maps[m].ranges[c].high) << kinds[m].name;
    }
    // Tangent frames are oblique where the low poly is coarse: components may be longer than the way.
    if (kinds[m] == MapKind{"displacement"}) continue;
    EXPECT_EQ(beyond_range(one.maps[m], one.coverage).texels, 0U) << kinds[m].name;
  }
  const auto range = [&](const char* name, std::size_t channel) {
    return map_of(one, name).ranges[channel];
  };
  EXPECT_EQ(range("height", 0).high, 0.13F);
  EXPECT_EQ(range("height", 0).low, -0.13F);
  EXPECT_EQ(range("displacement", 2).low, -0.13F);
  EXPECT_EQ(range("distance", 0).low, 0);
  EXPECT_EQ(range("distance", 0).high, 0.13F);
  EXPECT_EQ(range("curvature", 0).low, -3.4F);  // 1 / 0.3, rounded outward
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(range("convexity", c).low, 0);
    EXPECT_EQ(range("convexity", c).high, 3.4F);
    float least = 1e9F, most = -1e9F;
    for (std::size_t v = 0; v + 1 < high.positions.size(); ++v) {
      const Vec3& p = high.positions[v];
      const float at = c == 0 ? p.x : c == 1 ? p.y : p.z;
      least = std::min(least, at);
      most = std::max(most, at);
    }
    EXPECT_LE(range("position", c).low, least);
    EXPECT_GT(range("position", c).low, least - 0.2F);
    EXPECT_GE(range("position", c).high, most);
    EXPECT_LT(range("position", c).high, most + 0.2F);
  }
  EXPECT_EQ(range("slope", 0).high, 180);

  options.encoding.ranges = {{MapKind{"height"}, {-0.001F, 0.002F}}};
  const BakeResult given = bake(source, upper, options);
  EXPECT_EQ(map_of(given, "height").ranges[0].low, -0.001F);
  const RangeExcess excess = beyond_range(map_of(given, "height"), given.coverage);
  EXPECT_GT(excess.texels, 0U);
  const std::size_t texel = excess.x + std::size_t{excess.y} * options.width;
  EXPECT_EQ(map_of(given, "height").image.pixels[texel], excess.value);
  for (const MapRange& wrong :
       {MapRange{MapKind{"height"}, {1, 1}}, MapRange{MapKind{"ao"}, {0, 1}},
        MapRange{MapKind::normal, {0, 1}},
        MapRange{MapKind{"height"}, {0, std::numeric_limits<float>::infinity()}}}) {
    options.encoding.ranges = {wrong};
    EXPECT_THROW(validate(options), Error);
  }
}

/// A mesh without an extent along an axis has its one value in the middle of that axis' range, which 8 bits store as
/// one half.
TEST(Maps, OneValueAlongAnAxisIsTheMiddleOfItsRange) {
  KILN_REQUIRE_DEVICE();
  for (const float height : {0.0F, 5.0F, -0.7F}) {
    for (const std::size_t axis : {0U, 1U, 2U}) {
      Mesh high = test::plane(4, 4), low = test::plane(1, 1);
      for (Mesh* const mesh : {&high, &low}) {
        for (Vec3& p : mesh->positions) {
          p = axis == 2   ? Vec3{p.x, p.y, height}
              : axis == 1 ? Vec3{p.y, height, p.x}
                          : Vec3{height, p.x, p.y};
        }
        mesh->normals.clear();
        mesh->normal_triangles.clear();
      }
      const BakeResult baked =
          bake(Source(*test::device(), high), low, asking({MapKind{"position"}}));
      ASSERT_EQ(baked.maps[0].ranges.size(), 3U);
      for (std::size_t c = 0; c < 3; ++c) {
        const ValueRange range = baked.maps[0].ranges[c];
        EXPECT_LT(range.low, range.high) << height << " " << axis << " " << c;
        if (c == axis) EXPECT_NEAR((range.low + range.high) / 2, height, 1e-6);
      }
    }
  }
}

TEST(Maps, NormalsOfSeveralSpacesAreThoseOfBakesOfEach) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::BumpySphere::dense(2000, true));
  const Mesh low = test::BumpySphere::light(8, 4);
  BakeOptions options = asking({MapKind::normal, MapKind{"normal_object"}, MapKind{"normal_face"}});
  options.encoding.miss = MissPolicy::mark;
  options.encoding.mips = true;
  const BakeResult together = bake(source, low, options);
  options.maps = {MapKind::normal};
  for (const auto& [space, name] : {std::pair{NormalMapSpace::tangent, "normal"},
                                    {NormalMapSpace::object, "normal_object"},
                                    {NormalMapSpace::face, "normal_face"}}) {
    options.encoding.space = space;
    const BakeResult alone = bake(source, low, options);
    const BakedMap& map = map_of(together, name);
    EXPECT_EQ(map.image.pixels, alone.maps[0].image.pixels) << name;
    ASSERT_EQ(map.mips.size(), alone.maps[0].mips.size());
    for (std::size_t level = 0; level < map.mips.size(); ++level) {
      EXPECT_EQ(map.mips[level].pixels, alone.maps[0].mips[level].pixels) << name << level;
    }
  }
  // Two components of object space say nothing of the third.
  options.encoding.space = NormalMapSpace::tangent;
  options.encoding.two_component = true;
  EXPECT_NO_THROW(validate(options));
  options.maps.push_back(MapKind{"normal_object"});
  EXPECT_THROW(validate(options), Error);
}

TEST(Maps, ConvexityIsCurvatureInTwoChannels) {
  KILN_REQUIRE_DEVICE();
  BakeOptions options = asking({MapKind{"curvature"}, MapKind{"convexity"}});
  options.curvature_radius = Length::share(0.005);  // facets show, which bend both ways
  const BakeResult baked = bake(Source(*test::device(), test::BumpySphere::dense(2000, true)),
                                test::BumpySphere::light(8, 4), options);
  const std::vector<float>& bend = map_of(baked, "curvature").image.pixels;
  const std::vector<float>& apart = map_of(baked, "convexity").image.pixels;
  std::size_t convex = 0, concave = 0;
  for (std::size_t i = 0; i < bend.size(); ++i) {
    if (baked.coverage[i] != kCoverageBaked) continue;
    EXPECT_EQ(apart[3 * i], std::max(bend[i], 0.0F));
    EXPECT_EQ(apart[3 * i + 1], std::max(-bend[i], 0.0F));
    EXPECT_EQ(apart[3 * i + 2], std::abs(bend[i]));
    convex += bend[i] > 0 ? 1 : 0;
    concave += bend[i] < 0 ? 1 : 0;
  }
  EXPECT_GT(convex, 100U);
  EXPECT_GT(concave, 10U);
}

TEST(Maps, AnUnknownOneNamesThoseThereAre) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), two_sheets());
  try {
    bake(source, inset_plane(), asking({MapKind{"heigth"}}));
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::usage);
    EXPECT_NE(std::string(error.what()).find("'heigth'"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("height"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace kiln
