// Settings that extract() chooses where it is asked to.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "kiln/contour.h"
#include "kiln/volume.h"
#include "support/environment.h"
#include "support/volumes.h"

namespace kiln {
namespace {

Volume gyroid(std::uint32_t side, double period) {
  return test::make_float_volume({side, side, side}, [=](double x, double y, double z) {
    return test::gyroid_field(x, y, z, period);
  });
}

Volume ball(std::uint32_t side, double radius) {
  const double c = (side - 1) / 2.0;
  return test::make_float_volume({side, side, side}, [=](double x, double y, double z) {
    return test::sphere_field(x - c, y - c, z - c, radius);
  });
}

ExtractOptions automatic() {
  ExtractOptions options;
  options.choose = {.error = true, .topology = true, .min_part = true, .size = true};
  return options;
}

TEST(Automatic, ChoosesATwentiethAndATexelACell) {
  KILN_REQUIRE_DEVICE();
  for (const Volume& volume : {gyroid(72, 45), ball(60, 24.3)}) {
    const ExtractResult result = extract(*test::device(), volume, automatic());
    const ExtractReport& report = result.report;
    EXPECT_LE(report.faces, report.contour.quads / 10 + 1);
    EXPECT_GT(report.faces, report.contour.quads / 25);
    EXPECT_NEAR(static_cast<double>(report.used.aimed_faces),
                static_cast<double>(report.contour.quads) / 10, 1.01);
    EXPECT_GE(report.used.error, 0.1);
    EXPECT_TRUE(report.used.keep_topology);
    EXPECT_EQ(report.used.min_part, 0);
    EXPECT_EQ(report.used.size % 16, 0U);
    EXPECT_EQ(result.normal_map.width, report.used.size);
    EXPECT_GT(report.texels_per_cell, 0.85);
    EXPECT_LT(report.texels_per_cell, 1.3);
    EXPECT_TRUE(test::topology(result.mesh).is_closed_manifold());
  }
}

TEST(Automatic, LeavesSpecksOutOfItsOwnAccordWhereTheyAreNoise) {
  // A ball with 144 specks, then with 60: these may be meant.
  KILN_REQUIRE_DEVICE();
  for (const int rows : {12, 5}) {
    const Volume volume = test::make_float_volume({70, 70, 60}, [&](double x, double y, double z) {
      const double a = std::fmod(x + 2, 5.5) - 2.75, b = std::fmod(y + 2, 5.5) - 2.75;
      const bool there = y < 5.5 * rows - 2;
      return std::max(test::sphere_field(x - 34, y - 34, z - 28, 24.2),
                      there ? test::sphere_field(a, b, z - 56, 1.3) : -9.0);
    });
    const ExtractResult result = extract(*test::device(), volume, automatic());
    const bool noise = result.report.parts > 100;
    EXPECT_EQ(noise, rows == 12) << result.report.parts;
    EXPECT_EQ(result.report.used.min_part, noise ? 0.01 : 0);
    EXPECT_EQ(result.report.dropped_parts, noise ? result.report.parts - 1 : 0);
    EXPECT_EQ(test::topology(result.mesh).parts, noise ? 1U : result.report.parts);
  }
}

TEST(Automatic, LetsTheTopologyGoWhereItHoldsTooMuch) {
  // Noise about the iso value: handles everywhere.
  KILN_REQUIRE_DEVICE();
  std::mt19937 random(5);
  const Volume volume = test::make_float_volume({48, 48, 48}, [&](double x, double y, double z) {
    const double noise = static_cast<double>(random() % 1000) / 1000 - 0.5;
    return test::sphere_field(x - 23.5, y - 23.5, z - 23.5, 17) + 14 * noise;
  });
  const ExtractResult result = extract(*test::device(), volume, automatic());
  const ExtractUsed& used = result.report.used;
  EXPECT_FALSE(used.keep_topology);
  EXPECT_GT(used.kept_faces, 2 * used.aimed_faces);
  EXPECT_LE(result.report.faces, used.aimed_faces);
  ExtractOptions given = automatic();
  given.choose.topology = false;
  // As chosen; a few of these are mended away.
  const ExtractReport kept = extract(*test::device(), volume, given).report;
  EXPECT_LE(kept.faces, used.kept_faces);
  EXPECT_GE(kept.faces + 2 * kept.mended, used.kept_faces);
}

TEST(Automatic, HeadComesOutWithoutFurtherOptions) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("head_t1.nrrd");
  const Volume volume = test::halved(load_volume(*test::shared_data("head_t1.nrrd")));
  ExtractOptions options = automatic();
  options.contour.iso = 40;
  const ExtractResult result = extract(*test::device(), volume, options);
  EXPECT_GT(result.report.dropped_parts, 4000U);
  EXPECT_LE(result.report.faces, result.report.contour.quads / 10);
  EXPECT_NEAR(result.report.texels_per_cell, 1, 0.15);
  EXPECT_LE(result.report.used.size, 4096U);
}

}  // namespace
}  // namespace kiln
