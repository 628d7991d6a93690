// Several maps of one kind in a bake, with settings of their own. The oracle is the bake that makes each alone.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "kiln/session.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

struct Variants : testing::Test {
  void SetUp() override {
    KILN_REQUIRE_DEVICE();
    high = test::torus(48, 24);
    high.material_names = {"north", "south"};
    for (const Triangle& t : high.triangles) {
      high.materials.push_back(high.positions[t[0]].z > 0 ? 0 : 1);
    }
    low = test::torus(24, 12);
    options.width = options.height = 48;
    options.maps = {MapKind{"normal"}, MapKind{"ao"}};
    options.occlusion.rays = 16;
  }
  BakeResult bake_of(const BakeOptions& with) const {
    return bake(Source(*test::device(), high), low, with);
  }
  /// A bake of one map, whose own settings are those of all.
  BakedMap alone(MapKind kind, const BakeOptions& with) const {
    BakeOptions one = with;
    one.variants.clear();
    one.maps = {kind};
    one.report.errors = false;  // It is the map that is compared.
    return bake_of(one).map(kind);
  }

  Mesh high, low;
  BakeOptions options;
};

TEST_F(Variants, AreTheMapsThatBakesOfEachAloneMake) {
  OcclusionOptions near = options.occlusion, linear = options.occlusion;
  near.distance = Length::share(0.05);
  linear.distance = Length::share(0.3);
  linear.falloff = OcclusionFalloff::linear;
  OcclusionOptions exact;
  exact.max_error = 0.05;
  options.report.errors = true;
  options.variants = {
      {.name = "ao_near", .kind = "ao", .occlusion = near},
      {.name = "ao_linear", .kind = "ao", .occlusion = linear},
      {.name = "ao_exact", .kind = "ao", .occlusion = exact},
      {.name = "bent_near", .kind = "bent_normal", .occlusion = near},
      {.name = "thin", .kind = "thickness", .occlusion = near},
      {.name = "fine", .kind = "curvature", .curvature_radius = Length::share(0.02)},
      {.name = "coarse", .kind = "curvature", .curvature_radius = Length::share(0.05)},
      {.name = "sunny", .kind = "shadow", .light = ShadowLight{{1, 1, 0}, 5}},
      {.name = "materials", .kind = "id", .id_by = IdBy::material},
      {.name = "parts", .kind = "id", .id_by = IdBy::part}};
  const BakeResult all = bake_of(options);
  options.report.errors = false;  // they change no texel
  for (const MapKind plain : options.maps) {
    EXPECT_EQ(all.map(plain).image.pixels, alone(plain, options).image.pixels) << plain.name;
  }
  for (const MapVariant& variant : options.variants) {
    SCOPED_TRACE(variant.name);
    BakeOptions one = options;
    if (variant.occlusion) one.occlusion = *variant.occlusion;
    if (variant.light) one.light = *variant.light;
    if (variant.id_by) one.id_by = *variant.id_by;
    one.curvature_radius = variant.curvature_radius;
    const BakedMap expected = alone(variant.kind, one);
    const BakedMap& map = all.map(MapKind{std::string_view(variant.name)});
    EXPECT_EQ(map.image.pixels, expected.image.pixels);
    EXPECT_EQ(map.ids.size(), expected.ids.size());
    EXPECT_EQ(map.curvature_radius, expected.curvature_radius);
    ASSERT_EQ(map.ranges.size(), expected.ranges.size());
    for (std::size_t c = 0; c < map.ranges.size(); ++c) {
      EXPECT_EQ(map.ranges[c].high, expected.ranges[c].high);
    }
  }
  EXPECT_NE(all.map("ao_near").image.pixels, all.map("ao").image.pixels);
  EXPECT_EQ(all.map("materials").ids.size(), 2U);
  EXPECT_TRUE(all.report.ids.empty()) << "which is of the map id";
  // Each has its own error, and the one that was to be reached is.
  for (const char* name : {"ao", "ao_near", "ao_exact", "bent_near", "thin", "fine"}) {
    const auto error = std::find_if(all.report.errors.begin(), all.report.errors.end(),
                                    [&](const MapError& other) { return other.kind.name == name; });
    ASSERT_NE(error, all.report.errors.end()) << name;
    EXPECT_GT(error->texels, 0U) << name;
    if (std::string_view(name) == "ao_exact") EXPECT_LE(error->rms / 255, 0.05);
  }
}

TEST_F(Variants, FollowTheSession) {
  OcclusionOptions near = options.occlusion;
  near.distance = Length::share(0.1);
  options.variants = {{.name = "ao_near", .kind = "ao", .occlusion = near}};
  BakeSession session(*test::device(), high, low, options);
  session.bake();
  std::vector<Vec3> moved(high.positions.begin(), high.positions.begin() + 50);
  for (Vec3& p : moved) p.z *= 1.02F;
  session.set_positions(0, moved);
  const Image now = session.bake().map("ao_near").image;
  BakeOptions one = options;
  one.occlusion = near;
  one.variants.clear();
  one.maps = {MapKind{"ao"}};
  BakeSession other(*test::device(), high, low, one);
  other.bake();
  other.set_positions(0, moved);
  EXPECT_EQ(now.pixels, other.bake().map("ao").image.pixels);
}

TEST_F(Variants, ThatCannotBeAreRefused) {
  const auto refused = [&](MapVariant variant) {
    BakeOptions wrong = options;
    wrong.variants = {std::move(variant)};
    try {
      bake_of(wrong);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refused({.name = "ao", .kind = "ao"}).find("another map's name"), std::string::npos);
  EXPECT_NE(refused({.name = "x", .kind = "nothing"}).find("'nothing'"), std::string::npos);
  EXPECT_NE(refused({.name = "x y", .kind = "ao"}).find("'x y'"), std::string::npos);
  EXPECT_NE(refused({.name = "x", .kind = "normal", .occlusion = OcclusionOptions{}})
                .find("does not use"),
            std::string::npos);
  EXPECT_NE(refused({.name = "x", .kind = "ao", .occlusion = OcclusionOptions{.rays = 0}})
                .find("`occlusion.rays`"),
            std::string::npos);
  options.encoding.two_component = true;
  EXPECT_NE(refused({.name = "x", .kind = "normal_object"}).find("normals above the surface"),
            std::string::npos);
  options.encoding.two_component = false;
  EXPECT_NE(refused({.name = "x", .kind = "visibility"}).find("match by visibility"),
            std::string::npos);
}

}  // namespace
}  // namespace kiln
