// Cages: found ones against closed forms, shells and hulls, and what they change.
#include "kiln/cage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "hard.h"
#include "hard_scenes.h"
#include "support/environment.h"
#include "support/hard_scene.h"
#include "support/shapes.h"

namespace kiln {
namespace {

BakeOptions options_of(std::uint32_t size, RayDirection direction = RayDirection::automatic) {
  BakeOptions options;
  options.width = options.height = size;
  options.match.ray.direction = direction;
  return options;
}

/// A flat square, moved up, facing up or down.
Mesh sheet(float z, bool up, double side = 1) {
  Mesh mesh = test::plane(4, 4, side, side);
  for (Vec3& p : mesh.positions) p.z = z;
  if (up) return mesh;
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  for (Triangle& t : mesh.normal_triangles) std::swap(t[1], t[2]);
  for (Vec3& n : mesh.normals) n.z = -n.z;
  return mesh;
}

Mesh joined(Mesh a, const Mesh& b) {
  const auto first = static_cast<std::uint32_t>(a.positions.size());
  a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
  for (const Triangle& t : b.triangles) {
    a.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  a.uvs.clear();
  a.uv_triangles.clear();
  a.normals.clear();
  a.normal_triangles.clear();
  return a;
}

/// The least and the most that a shell lies over a flat mesh. \param shell  0 outer, 1 inner
std::pair<float, float> heights(const Mesh& cage, std::size_t shell) {
  const std::size_t half = cage.triangles.size() / 2;
  float least = 1e30F, most = -1e30F;
  for (std::size_t t = shell * half; t < (shell + 1) * half; ++t) {
    for (const std::uint32_t v : cage.triangles[t]) {
      least = std::min(least, cage.positions[v].z);
      most = std::max(most, cage.positions[v].z);
    }
  }
  return {least, most};
}

/// A wall with a sheet above that faces up, one below that faces away, and a roof over all.
TEST(Cage, LiesBetweenWhatItNeedsAndWhatIsNext) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = sheet(0, true);
  const Mesh walls = joined(sheet(0.01F, true), sheet(-0.05F, false));
  const Source open(*test::device(), walls);
  const FoundCage found = find_cage(open, low, options_of(64));
  EXPECT_EQ(found.conflicts, 0U);
  EXPECT_GT(found.samples, 200000U);
  EXPECT_GT(heights(found.mesh, 0).first, 0.01F);   // the face
  EXPECT_GT(heights(found.mesh, 1).first, -0.05F);  // the wall's other side
  EXPECT_LT(heights(found.mesh, 1).second, 0.0F);
  EXPECT_EQ(found.mesh.group_names, (std::vector<std::string>{"outer", "inner"}));

  // A roof of a part that begins close above: never into it.
  const float roof = 0.0125F;
  const Source closed(*test::device(),
                      joined(walls, joined(sheet(roof, false, 3), sheet(1, true, 3))));
  BakeOptions near = options_of(64);
  near.match.max_distance = Length::absolute(0.011);
  const FoundCage under = find_cage(closed, low, near);
  EXPECT_GT(heights(under.mesh, 0).first, 0.01F);
  EXPECT_LT(heights(under.mesh, 0).second, roof);
}

/// A part that lies below the mesh asks for depth, and its face is found.
TEST(Cage, ReachesIn) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = sheet(0, true);
  const Mesh high = joined(sheet(-0.04F, true), sheet(-0.3F, false));
  const Source source(*test::device(), high);
  const FoundCage found = find_cage(source, low, options_of(32));
  EXPECT_LT(heights(found.mesh, 1).second, -0.04F);
  EXPECT_GT(heights(found.mesh, 1).first, -0.3F);
  BakeOptions options = options_of(32);
  options.match.cage_mesh = &found.mesh;
  const BakeReport report = bake(source, low, options).report;
  EXPECT_EQ(report.missed, 0U);
  ASSERT_TRUE(report.cage_mesh.has_value());
  EXPECT_EQ(report.cage_mesh->kind, CageKind::shells);
  EXPECT_GT(report.cage_mesh->min_inward, 0.04);
  EXPECT_LT(report.cage_mesh->max_inward, 0.3);
}

/// Two walls that face each other, and a bar that begins close over one and ends behind the other: the part that it
/// passes through bounds how far a cage may take it in, or rays would begin behind the other wall.
TEST(Cage, EndsAtTheOppositeWallThatASolidPassesThrough) {
  KILN_REQUIRE_DEVICE();
  constexpr float kGap = 0.1F, kFoot = 0.005F, kEnd = 0.15F;
  Mesh low = sheet(0, true);
  const Mesh opposite = sheet(kGap, false);
  const auto first = static_cast<std::uint32_t>(low.positions.size());
  const std::size_t of_wall = low.triangles.size();
  low.normals.clear();
  low.normal_triangles.clear();
  for (Vec2& uv : low.uvs) uv.x *= 0.5F;
  low.positions.insert(low.positions.end(), opposite.positions.begin(), opposite.positions.end());
  for (const Vec2& uv : opposite.uvs) low.uvs.push_back({0.5F + 0.5F * uv.x, uv.y});
  for (const Triangle& t : opposite.triangles) {
    low.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    low.uv_triangles.push_back(low.triangles.back());
  }
  const auto wall = [](float z, bool up) { return sheet(z, up, 0.4); };
  Mesh bar = joined(wall(kFoot, false), wall(kEnd, true));
  // Its four sides.
  for (int k = 0; k < 4; ++k) {
    const float x[4] = {-0.2F, 0.2F, 0.2F, -0.2F}, y[4] = {-0.2F, -0.2F, 0.2F, 0.2F};
    const int l = (k + 1) % 4;
    const auto at = static_cast<std::uint32_t>(bar.positions.size());
    bar.positions.insert(
        bar.positions.end(),
        {{x[k], y[k], kFoot}, {x[l], y[l], kFoot}, {x[l], y[l], kEnd}, {x[k], y[k], kEnd}});
    bar.triangles.push_back({at, at + 1, at + 2});
    bar.triangles.push_back({at, at + 2, at + 3});
  }
  const Mesh high = joined(joined(sheet(0, true), sheet(kGap, false)), bar);
  BakeOptions options = options_of(64);
  options.match.max_distance = Length::absolute(0.02);
  const FoundCage found = find_cage(Source(*test::device(), high), low, options);
  EXPECT_EQ(found.conflicts, 0U);
  for (std::size_t t = 0; t < of_wall; ++t) {
    for (const std::uint32_t v : found.mesh.triangles[t]) {
      EXPECT_LT(found.mesh.positions[v].z, kGap) << t;
      EXPECT_GE(found.mesh.positions[v].z, 0) << t;
    }
  }
}

/// Rays end at the inner shell: what lies deeper is missed, what lies above it is found.
TEST(Cage, InnerShellEndsRays) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = sheet(0, true);
  const Source source(*test::device(), sheet(-0.1F, true));
  const auto missed = [&](float inner) {
    Mesh shells = joined(sheet(0.02F, true), sheet(inner, true));
    BakeOptions options = options_of(16);
    options.match.cage_mesh = &shells;
    options.match.max_distance = Length::absolute(1);
    return bake(source, low, options).report.missed;
  };
  EXPECT_EQ(missed(-0.11F), 0U);
  EXPECT_EQ(missed(-0.09F), 256U);
}

/// The cage found is the same whatever the distance, with nothing lost, on every scene.
TEST(Cage, FindsTheSameWhateverTheDistance) {
  KILN_REQUIRE_DEVICE();
  for (const std::string_view name : {"cube", "cylinder", "bracket", "bolt", "pipe", "assembly"}) {
    SCOPED_TRACE(name);
    const sample::HardScene scene = sample::hard_scene(name);
    const Source source(*test::device(), scene.high);
    std::vector<Image> maps;
    for (const double percent : {1.0, 10.0}) {
      BakeOptions options = options_of(192);
      options.encoding.space = NormalMapSpace::object;
      options.match.max_distance = Length::share(percent / 100);
      const FoundCage found = find_cage(source, scene.low, options);
      EXPECT_LT(found.conflicts, found.samples / 50);
      options.match.max_distance.reset();
      options.match.cage_mesh = &found.mesh;
      BakeResult result = bake(source, scene.low, options);
      EXPECT_LT(result.report.missed, result.report.samples / 500);
      ASSERT_TRUE(result.report.recall.has_value());
      EXPECT_LT(result.report.recall->lost, 0.02) << percent;
      maps.push_back(std::move(result.maps[0].image));
    }
    std::size_t differing = 0;
    for (std::size_t i = 0; i < maps[0].pixels.size(); i += 3) {
      double worst = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        worst = std::max(worst, std::abs(double{maps[0].pixels[i + c]} - maps[1].pixels[i + c]));
      }
      if (worst > 0.05) ++differing;
    }
    EXPECT_LT(differing, maps[0].pixels.size() / 3 / 200);
  }
}

/// Stamps that float, lie on the face and are sunk in are all taken in, by rays that reach 1%.
TEST(Cage, TakesInStampsAsAWhole) {
  KILN_REQUIRE_DEVICE();
  const sample::HardScene scene = sample::hard_scene("cube");
  const Source source(*test::device(), scene.high);
  BakeOptions options = options_of(256);
  options.match.max_distance = Length::share(0.01);
  const FoundCage found = find_cage(source, scene.low, options);
  options.match.max_distance.reset();
  options.match.cage_mesh = &found.mesh;
  const test::HardBake bake(source, scene.low, options);
  const Frame& frame = impl_of(source).frame;
  for (const sample::RaisedDisc& disc : scene.raised_discs) {
    // Half of the radius around its middle all rays stand straight and end on its top.
    const double wanted = disc.height * frame.scale;
    std::size_t counted = 0;
    for (std::size_t i = 0; i < bake.samples.size(); ++i) {
      const Vec3& p = bake.samples.position[i];
      const Vec3d off{p.x / frame.scale + frame.center[0] - disc.at.x,
                      p.y / frame.scale + frame.center[1] - disc.at.y,
                      p.z / frame.scale + frame.center[2] - disc.at.z};
      if (length(off) > disc.radius / 2) continue;
      ++counted;
      ASSERT_NE(bake.samples.found[i], 0);
      const Vec3d way = bake.samples.match[i] - to_double(bake.samples.position[i]);
      EXPECT_NEAR(length(way), wanted, 0.05 * wanted);
    }
    EXPECT_GT(counted, 20U);
  }
}

TEST(Cage, IsTheSameAfterAFile) {
  KILN_REQUIRE_DEVICE();
  const sample::HardScene scene = sample::hard_scene("assembly");
  const Source source(*test::device(), scene.high);
  const FoundCage found = find_cage(source, scene.low);
  const auto path = test::scratch_folder() / "cage.obj";
  save_obj(found.mesh, path);
  const Mesh read = load_mesh(path);
  ASSERT_EQ(read.positions, found.mesh.positions);
  ASSERT_EQ(read.triangles, found.mesh.triangles);
  BakeOptions options = options_of(128);
  options.match.cage_mesh = &found.mesh;
  const BakeResult own = bake(source, scene.low, options);
  options.match.cage_mesh = &read;
  EXPECT_EQ(bake(source, scene.low, options).maps[0].image.pixels, own.maps[0].image.pixels);

  // The inner shell may come first where it is named.
  Mesh turned = read;
  const std::size_t half = turned.triangles.size() / 2;
  std::rotate(turned.triangles.begin(),
              turned.triangles.begin() + static_cast<std::ptrdiff_t>(half), turned.triangles.end());
  std::rotate(turned.groups.begin(), turned.groups.begin() + static_cast<std::ptrdiff_t>(half),
              turned.groups.end());
  options.match.cage_mesh = &turned;
  EXPECT_EQ(bake(source, scene.low, options).maps[0].image.pixels, own.maps[0].image.pixels);
}

/// A hull of other triangles: rays start where their directions leave it.
TEST(Cage, MayBeAnyClosedHull) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = test::cube(1);
  const Source source(*test::device(), test::icosphere(3, 0.75));
  BakeOptions options = options_of(64, RayDirection::face);
  const Mesh hull = test::icosphere(2, 1.1);
  options.match.cage_mesh = &hull;
  const BakeResult result = bake(source, low, options);
  EXPECT_EQ(result.report.missed, 0U);
  EXPECT_EQ(result.report.cage, result.report.samples);
  ASSERT_TRUE(result.report.cage_mesh.has_value());
  EXPECT_EQ(result.report.cage_mesh->kind, CageKind::hull);
  // Along averaged directions: from a corner, and from the middle of a side.
  EXPECT_NEAR(result.report.cage_mesh->min_outward, 1.1 - std::sqrt(0.75), 0.04);
  EXPECT_NEAR(result.report.cage_mesh->max_outward, 0.6, 0.04);

  for (const double radius : {0.6, 0.8}) {  // inside of the cube, and through it
    const Mesh small = test::icosphere(2, radius);
    options.match.cage_mesh = &small;
    try {
      bake(source, low, options);
      ADD_FAILURE() << radius;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input);
      EXPECT_NE(std::string(error.what()).find("does not enclose"), std::string::npos);
      EXPECT_NE(std::string(error.what()).find("320 triangles"), std::string::npos) << error.what();
    }
  }
  Mesh inside_out = hull;
  for (Triangle& t : inside_out.triangles) std::swap(t[1], t[2]);
  options.match.cage_mesh = &inside_out;
  EXPECT_THROW(bake(source, low, options), Error);
}

/// Rays from a hull are twice as long as the hull is away, so that they reach as far below the low poly.
TEST(Cage, RaysFromAHullReachAsFarBelowAsItIsAbove) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = test::uv_sphere(48, 24), hull = test::icosphere(4, 1.1);
  for (const double radius : {0.92, 0.85}) {
    BakeOptions options = options_of(32);
    options.match.cage_mesh = &hull;
    const BakeReport report =
        bake(Source(*test::device(), test::icosphere(5, radius)), low, options).report;
    EXPECT_EQ(report.missed, radius > 0.9 ? 0 : report.samples) << radius;
  }
}

TEST(Cage, RefusesOptionsOutOfRange) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::cube());
  BakeOptions options = options_of(16);
  options.match.max_distance = Length::share(-1);
  EXPECT_THROW(find_cage(source, test::cube(), options), Error);
  EXPECT_THROW(offset_cage(test::cube(), std::nan("")), Error);
  const Mesh moved = offset_cage(test::cube(2), 0.3);
  for (const Vec3& p : moved.positions) {
    EXPECT_NEAR(std::abs(p.x), 1 + 0.3 / std::sqrt(3.0), 1e-6);
  }
}

}  // namespace
}  // namespace kiln
