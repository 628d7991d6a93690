// Rendered normals of a low poly at the places that pictures show, beside closed forms over a plane.
#include "measure/normal_probe.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "kiln/bake.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr std::uint32_t kPixels = 64;

/// The only one of these directions from which the plane of test::plane() is seen from its front.
const std::vector<ViewAngles> kAround = {{90, 0}, {180, 0}, {0, 0}, {270, 0}};

Vec3 tilted(double x_degrees, double y_degrees = 0) {
  return {static_cast<float>(std::sin(x_degrees * kDegree)),
          static_cast<float>(std::sin(y_degrees * kDegree)),
          static_cast<float>(std::sqrt(1 - std::pow(std::sin(x_degrees * kDegree), 2) -
                                       std::pow(std::sin(y_degrees * kDegree), 2)))};
}

/// A plane of one normal.
Mesh plane_with(const Vec3& normal) {
  Mesh mesh = test::plane(1, 1);
  mesh.normals = {normal};
  mesh.normal_triangles.assign(mesh.triangles.size(), Triangle{0, 0, 0});
  return mesh;
}

/// A map of encoded normals.
Image map_of(std::uint32_t width, std::uint32_t height,
             const std::function<Vec3(std::uint32_t, std::uint32_t)>& normal) {
  Image image{width, height, 3, {}};
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      const Vec3 n = normal(x, y);
      for (const float c : {n.x, n.y, n.z}) image.pixels.push_back(c / 2 + 0.5F);
    }
  }
  return image;
}

BakeOptions in_space(NormalMapSpace space, bool flip_y = false) {
  BakeOptions options;
  options.encoding.space = space;
  options.encoding.flip_y = flip_y;
  return options;
}

TEST(NormalProbe, PlacesAreWhatAPictureShowsOfBoth) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), plane_with(tilted(30)));
  const Mesh low = test::plane(1, 1);
  std::uint32_t seen = 0;
  for (const ViewAngles& view : kAround) {
    const NormalProbe probe(impl_of(source), low, nullptr, {view}, kPixels, true);
    if (probe.places() == 0) continue;
    ++seen;
    // The plane's side is 1 / sqrt(2) of its diagonal, which fills the picture at most.
    EXPECT_GT(probe.places(), kPixels * kPixels / 4);
    const NormalError error = probe.without_map();
    EXPECT_EQ(error.pixels, probe.places());
    EXPECT_NEAR(error.mean_degrees, 30, 1e-3);
    EXPECT_NEAR(error.max_degrees, 30, 1e-3);
  }
  EXPECT_EQ(seen, 1U);
  const NormalProbe all(impl_of(source), low, nullptr, kAround, kPixels, true);
  EXPECT_NEAR(all.without_map().mean_degrees, 30, 1e-3);
}

TEST(NormalProbe, MapsAreReadBetweenTexels) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), plane_with({0, 0, 1}));
  const NormalProbe probe(impl_of(source), test::plane(1, 1), nullptr, kAround, kPixels, true);
  // Normals of two texels: blended between their middles, and constant beyond these.
  double sum = 0;
  constexpr int kSteps = 10000;
  for (int i = 0; i < kSteps; ++i) {
    const double right = std::clamp(2 * (i + 0.5) / kSteps - 0.5, 0.0, 1.0);
    sum += std::atan2(right * std::sin(40 * kDegree), 1 - right + right * std::cos(40 * kDegree));
  }
  const double mean = sum / kSteps / kDegree;
  for (const bool across : {true, false}) {
    for (const bool turned : {false, true}) {
      const Image map = map_of(across ? 2 : 1, across ? 1 : 2, [&](auto x, auto y) {
        return (x + y == 1) != turned ? tilted(across ? 40 : 0, across ? 0 : 40) : Vec3{0, 0, 1};
      });
      const NormalError error = probe.with_map(map, in_space(NormalMapSpace::tangent));
      EXPECT_NEAR(error.mean_degrees, mean, 0.15) << across << turned;
      EXPECT_NEAR(error.max_degrees, 40, 0.01) << across << turned;
    }
  }
  // Of eight texels, between the fourth and the fifth.
  sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double right = std::clamp(8 * (i + 0.5) / kSteps - 3.5, 0.0, 1.0);
    sum += std::atan2(right * std::sin(40 * kDegree), 1 - right + right * std::cos(40 * kDegree));
  }
  for (const bool across : {true, false}) {
    const Image map = map_of(across ? 8 : 1, across ? 1 : 8, [&](auto x, auto y) {
      return x + y >= 4 ? tilted(across ? 40 : 0, across ? 0 : 40) : Vec3{0, 0, 1};
    });
    const NormalError error = probe.with_map(map, in_space(NormalMapSpace::tangent));
    EXPECT_NEAR(error.mean_degrees, sum / kSteps / kDegree, 0.3) << across;
    EXPECT_NEAR(error.max_degrees, 40, 0.01) << across;
  }
}

TEST(NormalProbe, MapsLieAsTheirUvsDo) {
  KILN_REQUIRE_DEVICE();
  // The quarter at low u and high v alone leans.
  Mesh high = test::plane(2, 2);
  high.normals = {{0, 0, 1}, tilted(30, 20)};
  high.normal_triangles.clear();
  for (const Triangle& t : high.triangles) {
    const Vec3 &a = high.positions[t[0]], &b = high.positions[t[1]], &c = high.positions[t[2]];
    const std::uint32_t leans = a.x + b.x + c.x < 0 && a.y + b.y + c.y > 0 ? 1 : 0;
    high.normal_triangles.push_back({leans, leans, leans});
  }
  const Source source(*test::device(), high);
  const NormalProbe probe(impl_of(source), test::plane(1, 1), nullptr, kAround, kPixels, true);
  const auto error = [&](bool right, bool bottom) {
    const Image map = map_of(64, 64, [&](auto x, auto y) {
      return (x >= 32) == right && (y >= 32) == bottom ? tilted(30, 20) : Vec3{0, 0, 1};
    });
    return probe.with_map(map, in_space(NormalMapSpace::tangent)).mean_degrees;
  };
  EXPECT_LT(error(false, false), 1);
  for (const auto& [right, bottom] :
       {std::pair(true, false), std::pair(false, true), std::pair(true, true)}) {
    EXPECT_GT(error(right, bottom), 10) << right << bottom;
  }
}

TEST(NormalProbe, MapsAreOfTheirSpaceAndConvention) {
  KILN_REQUIRE_DEVICE();
  const Vec3 leaning = tilted(10, 20);
  const Source source(*test::device(), plane_with(leaning));
  const NormalProbe probe(impl_of(source), test::plane(1, 1), nullptr, kAround, kPixels, true);
  const Image map = map_of(1, 1, [&](auto, auto) { return leaning; });
  const Image down = map_of(1, 1, [&](auto, auto) {
    return Vec3{leaning.x, -leaning.y, leaning.z};
  });
  for (const NormalMapSpace space :
       {NormalMapSpace::tangent, NormalMapSpace::object, NormalMapSpace::face}) {
    // The plane's faces may have another first edge than its tangent.
    if (space != NormalMapSpace::face) {
      EXPECT_LT(probe.with_map(map, in_space(space)).mean_degrees, 0.01);
      EXPECT_LT(probe.with_map(down, in_space(space, true)).mean_degrees, 0.01);
      EXPECT_NEAR(probe.with_map(down, in_space(space)).mean_degrees, 40, 0.01);
    }
    // Texels that are not finite are the low poly's normal.
    if (space == NormalMapSpace::object) continue;
    Image broken = map;
    broken.pixels[1] = std::nanf("");
    EXPECT_NEAR(probe.with_map(broken, in_space(space)).mean_degrees,
                probe.without_map().mean_degrees, 0.01);
  }
}

TEST(NormalProbe, AMapOfInfiniteSizeHasTheMatchedNormals) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), plane_with(tilted(25)));
  const NormalProbe probe(impl_of(source), test::plane(1, 1), nullptr, kAround, kPixels, true);
  EXPECT_NEAR(probe.without_map().mean_degrees, 25, 1e-3);
  BakeOptions options;
  options.encoding.flip_y = true;  // which no normal in the mesh's space obeys
  options.match.max_distance = Length::absolute(0.1);
  for (const MatchMethod method : {MatchMethod::ray, MatchMethod::closest, MatchMethod::uv}) {
    options.match.method = method;
    std::shared_ptr<const VisibilityField> field;
    const NormalProbe::InfiniteMap map = probe.infinite_map(options, field);
    EXPECT_EQ(map.missed, 0) << method.name;
    EXPECT_LT(map.error.mean_degrees, 0.01) << method.name;
    EXPECT_EQ(map.error.pixels, probe.places());
    ASSERT_EQ(map.normals.size(), std::size_t{3} * probe.places());
    EXPECT_NEAR(map.normals[0], tilted(25).x, 1e-5) << method.name;
  }
  // Out of reach all places are missed.
  Mesh far = plane_with(tilted(25));
  for (Vec3& p : far.positions) p.z = 0.4F;
  const Source away(*test::device(), far);
  const NormalProbe missing(impl_of(away), test::plane(1, 1), nullptr, kAround, kPixels, true);
  options.match.method = MatchMethod::ray;
  std::shared_ptr<const VisibilityField> field;
  EXPECT_EQ(missing.infinite_map(options, field).missed, 1);
}

/// A map is read with the bitangent that it was baked for: of the vertices, or of the pixel.
TEST(NormalProbe, BitangentsAreThoseOfTheMap) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), plane_with(tilted(20, -35)));
  // A low poly whose corners' normals lean all ways.
  Mesh low = test::plane(1, 1);
  low.normals = {tilted(40, 10), tilted(-35, 20), tilted(15, -45), tilted(-20, -30)};
  low.normal_triangles = low.triangles;
  const NormalProbe probe(impl_of(source), low, nullptr, kAround, kPixels, true);
  const auto error = [&](Bitangent baked_for, Bitangent read_as) {
    BakeOptions options;
    options.width = options.height = 128;
    options.maps = {MapKind::normal};
    options.match.max_distance = Length::absolute(0.2);
    options.encoding.bitangent = baked_for;
    const BakeResult baked = bake(source, low, options);
    options.encoding.bitangent = read_as;
    return probe.with_map(baked.map(MapKind::normal).image, options).mean_degrees;
  };
  for (const Bitangent kind : {Bitangent::pixel, Bitangent::vertex}) {
    const Bitangent other = kind == Bitangent::pixel ? Bitangent::vertex : Bitangent::pixel;
    EXPECT_LT(error(kind, kind), 0.1);
    EXPECT_GT(error(kind, other), 4 * error(kind, kind) + 0.2);
  }
}

}  // namespace
}  // namespace kiln
