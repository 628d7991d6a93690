// Ambient occlusion of parts by themselves.
#include <gtest/gtest.h>

#include <vector>

#include "detail/occlusion_scene.h"

namespace kiln {
namespace {

using test::add_disc;
using test::asking;
using test::ground;
using test::map_of;

/// A floor, a lid above it and a ball of walls: two parts. Part 0 is the floor with a wall.
struct Pair {
  Mesh floor = test::plane(5, 5, 2, 2), lid, both;
  Mesh low = ground(2);
  Parts parts;

  Pair() {
    test::add_rectangle(floor, {0.4F, -1, 0}, {0, 2, 0}, {0, 0, 0.5F});
    lid = test::plane(1, 1, 0.001, 0.001);
    lid.positions.clear();
    lid.triangles.clear();
    lid.normals.clear();
    lid.normal_triangles.clear();
    add_disc(lid, {0.1F, 0, 0.3F}, 0.3F, false);
    both = floor;
    add_disc(both, {0.1F, 0, 0.3F}, 0.3F, false);
    parts.count = 2;
    parts.names = {"floor", "lid"};
    parts.high.assign(both.triangles.size(), 1);
    std::fill_n(parts.high.begin(), floor.triangles.size(), 0U);
    parts.low.assign(low.triangles.size(), 0);
  }
};

BakeOptions options_of(std::uint32_t side, std::uint32_t samples) {
  BakeOptions options =
      asking({MapKind{"ao"}, MapKind{"bent_normal"}, MapKind{"shadow"}, MapKind{"normal"}}, side);
  options.samples = samples;
  options.light = {{0.2F, 0, 1}, 8};
  return options;
}

/// As if the other part were not there: to the bit.
TEST(OwnPart, IsWhatThePartAloneGives) {
  KILN_REQUIRE_DEVICE();
  const Pair scene;
  const Bounds bounds = Bounds::of(scene.both);
  const Source both(*test::device(), scene.both, RayTraversal::automatic, bounds);
  const Source alone(*test::device(), scene.floor, RayTraversal::automatic, bounds);
  for (const std::uint32_t samples : {1U, 2U}) {
    BakeOptions options = options_of(40, samples);
    const BakeResult wanted = bake(alone, scene.low, options);
    options.match.parts = &scene.parts;
    const BakeResult hidden = bake(both, scene.low, options);
    options.occlusion.own_part = true;
    const BakeResult own = bake(both, scene.low, options);
    for (const char* map : {"ao", "bent_normal", "shadow", "normal"}) {
      EXPECT_EQ(map_of(own, map).pixels, map_of(wanted, map).pixels) << map;
    }
    for (const char* map : {"ao", "bent_normal", "shadow"}) {
      EXPECT_NE(map_of(hidden, map).pixels, map_of(wanted, map).pixels) << map;
    }
  }
}

/// With an error to reach, other meshes, and several bands.
TEST(OwnPart, GoesWithOtherOptions) {
  KILN_REQUIRE_DEVICE();
  const Pair scene;
  const Bounds bounds = Bounds::of(scene.both);
  const Source both(*test::device(), scene.both, RayTraversal::automatic, bounds);
  const Source alone(*test::device(), scene.floor, RayTraversal::automatic, bounds);
  BakeOptions options = options_of(40, 1);
  options.maps = {MapKind{"ao"}};
  options.occlusion.max_error = 0.02;
  const BakeResult wanted = bake(alone, scene.low, options);
  options.match.parts = &scene.parts;
  options.occlusion.own_part = true;
  EXPECT_EQ(map_of(bake(both, scene.low, options), "ao").pixels, map_of(wanted, "ao").pixels);
  // Other meshes darken every part.
  options.occlusion.max_error = 0;
  options.occlusion.by_others = {&scene.lid};
  const BakeResult beside = bake(both, scene.low, options);
  options.occlusion.by_others.clear();
  options.occlusion.own_part = false;
  EXPECT_EQ(map_of(beside, "ao").pixels, map_of(bake(both, scene.low, options), "ao").pixels);
}

TEST(OwnPart, NeedsParts) {
  KILN_REQUIRE_DEVICE();
  const Pair scene;
  const Source source(*test::device(), scene.both);
  BakeOptions options = options_of(8, 1);
  options.occlusion.own_part = true;
  EXPECT_THROW(bake(source, scene.low, options), Error);
}

}  // namespace
}  // namespace kiln
