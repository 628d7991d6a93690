// Maps and masks that jobs read from files, and hulls that they join to LOW.
#include "job/map_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <vector>

#include "job/stages.h"
#include "kiln/image_data.h"
#include "kiln/match.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

/// A texel of a saved match is covered if any of its samples found a point, whatever the numbers of samples along x and
/// y are.
TEST(MapFile, MasksOfMatchesHaveOneTexelForAllItsSamples) {
  const std::filesystem::path path = test::scratch_folder() / "a.match.exr";
  for (const std::uint32_t samples : {1U, 2U, 3U}) {
    Match match;
    match.width = 5 * samples;
    match.height = 3 * samples;
    match.samples = samples;
    match.source_triangles = 10;
    const std::size_t count = std::size_t{match.width} * match.height;
    match.triangle.assign(count, 0xFFFFFFFFU);
    match.u.assign(count, 0);
    match.v.assign(count, 0);
    match.distance.assign(count, 0);
    match.status.assign(count, 0);
    // One sample of texel (4, 0), the last one of texel (1, 2).
    match.triangle[4 * samples] = 9;
    match.triangle[std::size_t{match.width} * (3 * samples - 1) + 2 * samples - 1] = 0;
    save_match(match, path);
    const Image mask = load_mask(path);
    ASSERT_EQ(mask.width, 5U);
    ASSERT_EQ(mask.height, 3U);
    for (std::uint32_t y = 0; y < 3; ++y) {
      for (std::uint32_t x = 0; x < 5; ++x) {
        EXPECT_EQ(*mask.at(x, y), (x == 4 && y == 0) || (x == 1 && y == 2) ? 1 : 0)
            << samples << ": " << x << ' ' << y;
      }
    }
  }
}

TEST(JoinCollisionHulls, KeepsWhatTheLowPolySaysOfItself) {
  Mesh low = test::cube(1);
  low.name = "crate";
  low.material_files = {"crate.mtl", "more.mtl"};
  EXPECT_EQ(join_collision_hulls(low, {}).material_files, low.material_files);
  Mesh hulls = test::cube(2);
  hulls.name = "UCX_crate";
  const Mesh joined = join_collision_hulls(low, hulls);
  EXPECT_EQ(joined.name, "crate");
  EXPECT_EQ(joined.material_files, low.material_files);
  EXPECT_EQ(joined.triangles.size(), low.triangles.size() + hulls.triangles.size());
}

}  // namespace
}  // namespace kiln
