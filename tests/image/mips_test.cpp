// Mip-maps: every texel against brute force, constants, charts.
#include "image/mips.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include "image/gutter.h"
#include "image/two_quads.h"
#include "kiln/render.h"
#include "kiln/unwrap.h"
#include "mesh/charts.h"
#include "reference/mips.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using test::two_quads;

struct Scene {
  Image image;
  std::vector<std::uint8_t> coverage;
  ChartMap charts;

  std::vector<MipLevel> mips(const MipOptions& options = {.unit_vectors = true}) const {
    return make_mips(image, coverage, charts, options);
  }
  reference::MipBase base(bool with_missed) const {
    reference::MipBase base;
    base.width = static_cast<int>(image.width);
    base.height = static_cast<int>(image.height);
    for (std::size_t i = 0; i < coverage.size(); ++i) {
      const bool counts =
          coverage[i] == kCoverageBaked || (with_missed && coverage[i] == kCoverageMissed);
      base.chart.push_back(counts ? static_cast<int>(charts.chart[i]) : -1);
      base.area.push_back(charts.weight.empty() ? 1 : charts.weight[i]);
      const float* p = &image.pixels[i * image.channels];
      base.value.push_back({p[0], p[1], p[2]});
    }
    return base;
  }
};

std::array<float, 3> random_unit(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const double x = normal(random), y = normal(random), z = normal(random);
  const double length = std::sqrt(x * x + y * y + z * z);
  return {static_cast<float>(x / length), static_cast<float>(y / length),
          static_cast<float>(z / length)};
}

/// Charts are the cells around random points, with empty texels and missed ones strewn in. Normals are
/// random around each chart's own, or that one everywhere.
Scene random_scene(std::uint32_t width, std::uint32_t height, std::uint32_t charts, unsigned seed,
                   bool constant, std::uint32_t samples = 1) {
  std::mt19937 random(seed);
  const std::size_t texels = std::size_t{width} * height;
  Scene scene{{width, height, 3, std::vector<float>(texels * 3)},
              std::vector<std::uint8_t>(texels),
              ChartMap(texels, samples)};
  struct Cell {
    double x, y;
    std::array<float, 3> normal;
  };
  std::vector<Cell> cells;
  for (std::uint32_t i = 0; i < charts; ++i) {
    cells.push_back({static_cast<double>(random() % width), static_cast<double>(random() % height),
                     random_unit(random)});
  }
  for (std::size_t i = 0; i < texels; ++i) {
    const auto x = static_cast<double>(i % width), y = static_cast<double>(i / width);
    std::size_t best = 0;
    double nearest = 1e30, second = 1e30;
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const double d = std::hypot(cells[c].x - x, cells[c].y - y);
      if (d < nearest) {
        second = nearest, nearest = d, best = c;
      } else {
        second = std::min(second, d);
      }
    }
    scene.charts.chart[i] = static_cast<std::uint32_t>(best);
    if (samples > 1) {
      scene.charts.weight[i] = static_cast<std::uint16_t>(1 + random() % (samples * samples));
    }
    // A gap at some of the borders; missed texels in places.
    const bool empty = second - nearest < 2 && (best & 1U) != 0;
    const bool missed = random() % 9 == 0;
    scene.coverage[i] = empty ? kCoverageEmpty : missed ? kCoverageMissed : kCoverageBaked;
    std::array<float, 3> n = cells[best].normal;
    if (!constant) {
      const std::array<float, 3> other = random_unit(random);
      double length = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        n[c] += 0.8F * other[c];
        length += double{n[c]} * n[c];
      }
      for (float& c : n) c = static_cast<float>(c / std::sqrt(length));
    }
    std::copy(n.begin(), n.end(), &scene.image.pixels[i * 3]);
  }
  return scene;
}

double length(const float* p) {
  return std::sqrt(double{p[0]} * p[0] + double{p[1]} * p[1] + double{p[2]} * p[2]);
}

/// All levels of a scene against the oracle.
void expect_as_by_brute_force(const Scene& scene, bool missed_have_values) {
  const std::vector<MipLevel> levels = scene.mips(
      {.unit_vectors = true, .missed_have_values = missed_have_values, .missed = {1, -1, 1, 0}});
  const reference::MipBase base = scene.base(missed_have_values);
  const reference::MipBase with_missed = scene.base(true);
  std::uint32_t width = scene.image.width, height = scene.image.height;
  int level = 0;
  for (const MipLevel& mip : levels) {
    ++level;
    width = std::max(1U, width / 2);
    height = std::max(1U, height / 2);
    ASSERT_EQ(mip.image.width, width);
    ASSERT_EQ(mip.image.height, height);
    ASSERT_EQ(mip.coverage.size(), std::size_t{width} * height);
    const auto across = reference::mip_overlaps(base.width, level);
    const auto down = reference::mip_overlaps(base.height, level);
    for (std::size_t y = 0; y < height; ++y) {
      for (std::size_t x = 0; x < width; ++x) {
        const auto shares = reference::mip_shares(base, across[x], down[y]);
        const int winner = reference::mip_winner(shares);
        const float* p = mip.image.at(x, y);
        const std::uint8_t coverage = mip.coverage[y * width + x];
        if (winner < 0) {
          const bool touched = !reference::mip_shares(with_missed, across[x], down[y]).empty();
          EXPECT_EQ(coverage, touched ? kCoverageMissed : kCoverageEmpty);
          EXPECT_EQ(p[0], touched ? 1 : 0);
          continue;
        }
        ASSERT_EQ(coverage, kCoverageBaked) << level << ": " << x << ", " << y;
        ASSERT_NEAR(length(p), 1, 1e-6);
        const std::array<double, 3>& mean = shares.at(winner).mean;
        const double mean_length =
            std::sqrt(mean[0] * mean[0] + mean[1] * mean[1] + mean[2] * mean[2]);
        // Each level rounds the mean to single precision (2^-25 a component at most), and there are
        // ten levels at most; making it unit divides that by the mean's length.
        const double tolerance = 1e-6 + 10 * std::ldexp(1.0, -25) / mean_length;
        for (std::size_t c = 0; c < 3; ++c) {
          ASSERT_NEAR(p[c], mean[c] / mean_length, tolerance)
              << "level " << level << " texel " << x << ", " << y;
        }
      }
    }
  }
  EXPECT_EQ(width * height, 1U);
}

TEST(Mips, AreWhatBruteForceFindsFromLevel0) {
  unsigned seed = 1;
  for (const auto& [width, height] : {std::pair{64U, 64U},
                                      {64U, 16U},
                                      {1U, 1U},
                                      {2U, 2U},
                                      {3U, 3U},
                                      {5U, 7U},
                                      {1U, 37U},
                                      {100U, 1U},
                                      {33U, 2U},
                                      {257U, 129U}}) {
    SCOPED_TRACE(std::to_string(width) + "x" + std::to_string(height));
    expect_as_by_brute_force(random_scene(width, height, 9, ++seed, false), true);
    expect_as_by_brute_force(random_scene(width, height, 3, ++seed, false, 4), false);
  }
}

TEST(Mips, WithMoreChartsThanTexelsAreStillRight) {
  // Every texel a chart of its own: many parts in each texel of the coarse levels, all of equal area.
  Scene scene = random_scene(32, 32, 1, 5, false);
  for (std::size_t i = 0; i < scene.charts.chart.size(); ++i) {
    scene.charts.chart[i] = static_cast<std::uint32_t>(i * 7919 % 1024);
  }
  expect_as_by_brute_force(scene, true);
}

TEST(Mips, OfConstantChartsAreConstantToTheLastBit) {
  const auto expect_constant = [](const Scene& scene) {
    for (const MipLevel& level : scene.mips()) {
      for (std::size_t i = 0; i < level.coverage.size(); ++i) {
        if (level.coverage[i] != kCoverageBaked) continue;
        ASSERT_EQ(std::memcmp(&level.image.pixels[i * 3], scene.image.pixels.data(), 12), 0)
            << level.image.width << "x" << level.image.height << " texel " << i;
      }
    }
  };
  expect_constant(random_scene(64, 64, 1, 101, true));
  expect_constant(random_scene(257, 129, 1, 102, true, 4));
  expect_constant(random_scene(1, 77, 1, 103, true));
  expect_constant(random_scene(1023, 511, 1, 104, true));
  // Many normals: of those in single precision, most are not quite unit.
  for (unsigned seed = 0; seed < 500; ++seed) expect_constant(random_scene(9, 5, 1, seed, true));
  // Zeros keep their sign.
  Scene zeros = random_scene(7, 5, 1, 3, true);
  for (std::size_t i = 0; i < 35; ++i) {
    zeros.coverage[i] = kCoverageBaked;
    zeros.image.pixels[3 * i] = -0.0F;
    zeros.image.pixels[3 * i + 1] = 0.0F;
    zeros.image.pixels[3 * i + 2] = -1.0F;
  }
  for (const MipLevel& level : zeros.mips()) {
    EXPECT_TRUE(std::signbit(level.image.pixels[0]));
    EXPECT_FALSE(std::signbit(level.image.pixels[1]));
  }
}

TEST(Mips, OfTwoChartsSideBySideNeverMix) {
  for (const std::uint32_t split : {1U, 31U, 32U, 63U, 100U, 128U}) {
    for (const auto& [width, height] : {std::pair{129U, 17U}, {256U, 8U}}) {
      Scene scene = random_scene(width, height, 1, 9, true);
      for (std::size_t i = 0; i < scene.coverage.size(); ++i) {
        const bool right = i % width >= split;
        scene.coverage[i] = kCoverageBaked;
        scene.charts.chart[i] = right ? 0 : 1;
        const std::array<float, 3> n = {0.6F, 0, right ? 0.8F : -0.8F};
        std::copy(n.begin(), n.end(), &scene.image.pixels[i * 3]);
      }
      for (const MipLevel& level : scene.mips()) {
        for (std::size_t i = 0; i < level.coverage.size(); ++i) {
          EXPECT_EQ(level.image.pixels[3 * i], 0.6F);
          EXPECT_EQ(std::abs(level.image.pixels[3 * i + 2]), 0.8F);
        }
      }
    }
  }
}

TEST(Mips, WhereVectorsCancelTakeTheFirst) {
  for (const std::uint32_t size : {2U, 4U, 16U}) {
    Scene scene = random_scene(size, size, 1, 9, true);
    for (std::size_t i = 0; i < scene.coverage.size(); ++i) {
      scene.coverage[i] = kCoverageBaked;
      scene.image.pixels[3 * i] = i % 2 == 0 ? 1.0F : -1.0F;
      scene.image.pixels[3 * i + 1] = scene.image.pixels[3 * i + 2] = 0;
    }
    for (const MipLevel& level : scene.mips()) {
      for (std::size_t i = 0; i < level.coverage.size(); ++i) {
        EXPECT_EQ(level.image.pixels[3 * i], 1.0F);
      }
    }
  }
}

TEST(Mips, OfOtherMapsAreMeans) {
  for (std::uint32_t channels = 1; channels <= 4; ++channels) {
    Scene scene = random_scene(2, 2, 1, 1, true);
    std::fill(scene.coverage.begin(), scene.coverage.end(), std::uint8_t{kCoverageBaked});
    scene.coverage[3] = kCoverageEmpty;
    scene.image.channels = channels;
    scene.image.pixels.clear();
    for (const float value : {3.0F, 4.0F, 8.0F, 1000.0F}) {
      for (std::uint32_t c = 0; c < channels; ++c) {
        scene.image.pixels.push_back(value + static_cast<float>(c));
      }
    }
    const std::vector<MipLevel> levels = scene.mips({.unit_vectors = false});
    ASSERT_EQ(levels.size(), 1U);
    for (std::uint32_t c = 0; c < channels; ++c) {
      EXPECT_EQ(levels[0].image.pixels[c], 5.0F + static_cast<float>(c));
    }
  }
}

// ---- charts --------------------------------------------------------------------------------------

TEST(Charts, AreConnectedBySharedEdges) {
  EXPECT_EQ(uv_charts(two_quads()), (std::vector<std::uint32_t>{0, 0, 1, 1}));
  // A corner is not an edge.
  Mesh corner = two_quads();
  corner.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {2, 1, 0}, {1, 2, 0}};
  corner.triangles = {{0, 1, 2}, {2, 3, 4}};
  corner.uvs = {{0, 0}, {1, 0}, {1, 1}, {2, 1}, {1, 2}};
  corner.uv_triangles = corner.triangles;
  EXPECT_EQ(uv_charts(corner), (std::vector<std::uint32_t>{0, 1}));
}

TEST(Charts, AreTheSameForSplitVertices) {
  const Mesh whole = test::plane(5, 4);
  Mesh split = whole;
  split.positions.clear();
  split.uvs.clear();
  for (std::size_t t = 0; t < whole.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      split.triangles[t][k] = split.uv_triangles[t][k] =
          static_cast<std::uint32_t>(split.positions.size());
      split.positions.push_back(whole.positions[whole.triangles[t][k]]);
      split.uvs.push_back(whole.uvs[whole.uv_triangles[t][k]]);
    }
  }
  EXPECT_EQ(uv_charts(split), std::vector<std::uint32_t>(whole.triangles.size(), 0));
}

TEST(Charts, AreWhatAFloodFillFinds) {
  const UnwrapOptions pairs{.method = UnwrapMethod::pairs};
  std::vector<Mesh> meshes = {test::cube(), test::uv_sphere(20, 10),
                              unwrap(test::icosphere(2), pairs), unwrap(test::torus(20, 9), pairs)};
  std::mt19937 random(4);
  Mesh shuffled = meshes[2];
  for (std::size_t i = shuffled.triangles.size() - 1; i > 0; --i) {
    const std::size_t j = random() % (i + 1);
    std::swap(shuffled.triangles[i], shuffled.triangles[j]);
    std::swap(shuffled.uv_triangles[i], shuffled.uv_triangles[j]);
  }
  meshes.push_back(shuffled);
  for (const Mesh& mesh : meshes) EXPECT_EQ(uv_charts(mesh), reference::charts(mesh)) << mesh.name;
  const std::vector<std::uint32_t> cube = uv_charts(meshes[0]);
  EXPECT_EQ(*std::max_element(cube.begin(), cube.end()), 5U);
}

// Each third triangle, as if it were a texture set: the charts of a mesh that has no other triangles.
TEST(Charts, OfSomeTrianglesAreThoseOfAMeshOfThem) {
  const Mesh mesh = unwrap(test::torus(20, 9), {.method = UnwrapMethod::pairs});
  std::vector<std::uint32_t> some;
  Mesh alone = mesh;
  alone.triangles.clear();
  alone.uv_triangles.clear();
  for (std::uint32_t t = 1; t < mesh.triangles.size(); t += 3) {
    some.push_back(t);
    alone.triangles.push_back(mesh.triangles[t]);
    alone.uv_triangles.push_back(mesh.uv_triangles[t]);
  }
  const std::vector<std::uint32_t> charts = uv_charts(mesh, some), expected = uv_charts(alone);
  ASSERT_EQ(charts.size(), mesh.triangles.size());
  ASSERT_GT(*std::max_element(expected.begin(), expected.end()), 10U);
  for (std::size_t t = 0; t < charts.size(); ++t) {
    EXPECT_EQ(charts[t], t % 3 == 1 ? expected[t / 3] : 0U) << t;
  }
}

}  // namespace
}  // namespace kiln
