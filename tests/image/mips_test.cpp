// Mip-maps: every texel against brute force, no bleeding, constants, gutters, files; how much better than
// ordinary box filtering on a real layout.
#include "image/mips.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfTiledInputFile.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstring>
#include <fstream>
#include <random>
#include <set>

#include "image/gutter.h"
#include "kiln/kiln.h"
#include "mesh/charts.h"
#include "mesh/low_surface.h"
#include "reference/mips.h"
#include "support/environment.h"
#include "support/shapes.h"
#include "texel/texels.h"

namespace kiln {
namespace {

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

/// Two unit quads, the second facing down and elsewhere, with UVs edge to edge.
Mesh two_quads() {
  Mesh mesh;
  mesh.name = "quads";
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                    {5, 0, 0}, {5, 1, 0}, {6, 1, 0}, {6, 0, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
  mesh.uvs = {{0, 0}, {0.5F, 0}, {0.5F, 1}, {0, 1}, {1, 0}, {1, 1}};
  mesh.uv_triangles = {{0, 1, 2}, {0, 2, 3}, {1, 2, 5}, {1, 5, 4}};
  return mesh;
}

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

// ---- through the bake ----------------------------------------------------------------------------

BakeOptions mip_bake(std::uint32_t width, std::uint32_t height) {
  BakeOptions options;
  options.width = width;
  options.height = height;
  options.mips = true;
  options.raw = true;
  return options;
}

TEST(BakedMips, OfOppositeChartsDoNotBleedAtAnyLevel) {
  KILN_REQUIRE_DEVICE();
  const Mesh mesh = two_quads();
  const Source source(*test::device(), mesh);
  for (const auto& [width, height] : {std::pair{64U, 64U}, {37U, 23U}, {1U, 9U}}) {
    BakeOptions options = mip_bake(width, height);
    options.space = NormalMapSpace::object;
    const BakeResult baked = bake(source, mesh, options);
    std::uint32_t size = std::max(width, height);
    for (const Image& image : baked.maps[0].mips) {
      size /= 2;
      EXPECT_EQ(std::max(image.width, image.height), size);
      for (std::size_t i = 0; i < std::size_t{image.width} * image.height; ++i) {
        EXPECT_EQ(image.pixels[3 * i], 0);
        EXPECT_EQ(image.pixels[3 * i + 1], 0);
        EXPECT_EQ(std::abs(image.pixels[3 * i + 2]), 1);
      }
    }
    EXPECT_EQ(size, 1U);
  }
}

TEST(BakedMips, HaveAGutterOfHalfTheWidthAtEveryLevelDownToTwo) {
  KILN_REQUIRE_DEVICE();
  Mesh mesh = test::plane(4, 4);
  for (Vec2& uv : mesh.uvs) uv = {0.25F + uv.x / 4, 0.25F + uv.y / 4};
  const Source source(*test::device(), mesh);
  for (const std::int32_t wanted : {16, 5, 1, 0, -1}) {
    BakeOptions options = mip_bake(256, 256);
    options.space = NormalMapSpace::object;  // the background is 0
    options.gutter = wanted;
    const BakeResult baked = bake(source, mesh, options);
    std::int32_t gutter = wanted;
    for (std::size_t k = 0; k < 5; ++k) {
      const Image& image = baked.maps[0].mips[k];
      gutter = gutter > 0 ? std::max(2, gutter / 2) : gutter;
      // The chart covers columns [a, b); on its middle row, left and right of it:
      const int a = static_cast<int>(image.width / 4), b = static_cast<int>(image.width / 2);
      for (int x = 0; x < static_cast<int>(image.width); ++x) {
        const int distance = std::max({a - x, x - b + 1, 0});
        const float* p = image.at(static_cast<std::size_t>(x), image.height * 5 / 8);
        EXPECT_EQ(p[2], distance <= gutter || gutter < 0 ? 1.0F : 0.0F)
            << "level " << k + 1 << " column " << x << " gutter " << gutter;
      }
    }
  }
}

TEST(BakedMips, CostNothingAndChangeNothingInTheMapItself) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(20000), low = test::BumpySphere::light();
  const Source source(*test::device(), high);
  BakeOptions options = mip_bake(96, 80);
  options.max_distance = Length::share(0.1);
  options.samples = 2;
  const BakeResult with = bake(source, low, options);
  options.mips = false;
  const BakeResult without = bake(source, low, options);
  EXPECT_EQ(with.maps[0].image.pixels, without.maps[0].image.pixels);
  EXPECT_EQ(with.coverage, without.coverage);
  EXPECT_TRUE(without.maps[0].mips.empty());
  EXPECT_EQ(with.maps[0].mips.size(), 6U);
}

TEST(BakedMips, FollowEveryPolicyAndEncoding) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(20000), low = test::BumpySphere::light();
  const Source source(*test::device(), high);
  for (const MissPolicy miss : {MissPolicy::keep, MissPolicy::fill, MissPolicy::mark}) {
    for (const NormalMapSpace space :
         {NormalMapSpace::tangent, NormalMapSpace::object, NormalMapSpace::face}) {
      for (const bool two : {false, true}) {
        if (two && space == NormalMapSpace::object) continue;
        BakeOptions options = mip_bake(100, 75);
        options.miss = miss;
        options.space = space;
        options.two_component = two;
        options.raw = false;
        options.max_distance = Length::share(0.003);  // so that some miss
        const BakeResult baked = bake(source, low, options);
        ASSERT_GT(baked.report.missed, 100U);
        std::size_t marked = 0, texels = 0;
        for (const Image& image : baked.maps[0].mips) {
          for (std::size_t i = 0; i < std::size_t{image.width} * image.height; ++i, ++texels) {
            const float* p = &image.pixels[3 * i];
            const double x = p[0] * 2 - 1, y = p[1] * 2 - 1, z = p[2] * 2 - 1;
            if (p[0] == 1 && p[1] == 0 && p[2] == 1) {
              ++marked;
            } else if (two) {
              EXPECT_EQ(p[2], 0);
              EXPECT_LT(x * x + y * y, 1 + 1e-6);
            } else if (p[0] != 0.5F || p[1] != 0.5F || p[2] != 0.5F) {
              EXPECT_NEAR(x * x + y * y + z * z, 1, 2e-6);
            }
          }
        }
        EXPECT_EQ(marked != 0, miss == MissPolicy::mark);
        EXPECT_LT(marked, texels / 2);
      }
    }
  }
}

// ---- against ordinary box filtering --------------------------------------------------------------

/// 2 x 2 means, made unit: what a tool does that has the image only. Sides are even.
Image box_filtered(const Image& fine) {
  Image coarse{fine.width / 2, fine.height / 2, 3, {}};
  for (std::size_t y = 0; y < coarse.height; ++y) {
    for (std::size_t x = 0; x < coarse.width; ++x) {
      std::array<double, 3> sum{};
      for (std::size_t k = 0; k < 4; ++k) {
        const float* p = fine.at(2 * x + k % 2, 2 * y + k / 2);
        for (std::size_t c = 0; c < 3; ++c) sum[c] += p[c] * 2.0 - 1;
      }
      const double norm = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
      for (const double c : sum) coarse.pixels.push_back(static_cast<float>(c / norm / 2 + 0.5));
    }
  }
  return coarse;
}

struct Bunny {
  Mesh high = load_mesh(*test::shared_data("bunny_high.ply"));
  Mesh low = load_mesh(*test::shared_data("bunny_low.obj"));
  BakeOptions options = [] {
    BakeOptions bunny;
    bunny.width = bunny.height = 1024;
    bunny.cage = Length::share(0.012444);
    bunny.max_distance = Length::share(0.024887);
    return bunny;
  }();
};

/// The chart of every texel of a map with one sample a texel.
ChartMap charts_of(const Mesh& low, std::uint32_t size) {
  cl::Context& context = context_of(*test::device());
  TexelSampler sampler(context, LowSurface::of(low, Frame()), {size, size});
  ChartMap charts(std::size_t{size} * size, 1);
  const std::vector<std::uint32_t> chart_of_triangle = uv_charts(low);
  for (std::uint32_t band = 0; band < sampler.band_count(); ++band) {
    charts.store(context, sampler.sample(band), size, chart_of_triangle);
  }
  return charts;
}

/// 1 for texels of a level that are covered in part, or by several charts (`several`), and that `wanted`
/// was baked in; else 0.
Image border_mask(const BakeResult& fine, const ChartMap& charts, std::uint32_t level, bool several,
                  const BakeResult& wanted) {
  const std::size_t fine_size = fine.maps[0].image.width;
  const std::uint32_t size = wanted.maps[0].image.width;
  Image mask{size, size, 1, {}};
  for (std::size_t y = 0; y < size; ++y) {
    for (std::size_t x = 0; x < size; ++x) {
      std::set<std::uint32_t> here;
      bool full = true;
      for (std::size_t k = 0; k < (std::size_t{1} << 2 * level); ++k) {
        const std::size_t fine_x = (x << level) + k % (std::size_t{1} << level);
        const std::size_t texel = ((y << level) + (k >> level)) * fine_size + fine_x;
        const std::uint8_t state = fine.coverage[texel];
        if (state == kCoverageBaked || state == kCoverageMissed) {
          here.insert(charts.chart[texel]);
        } else {
          full = false;
        }
      }
      const bool counts = several ? here.size() > 1 : here.size() == 1 && !full;
      const bool baked = wanted.coverage[y * size + x] == kCoverageBaked;
      mask.pixels.push_back(counts && baked ? 1.0F : 0.0F);
    }
  }
  return mask;
}

TEST(BakedMips, WhereChartsMeetAreNearerToASmallerBakeThanBoxFiltering) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("bunny_low.obj");
  Bunny bunny;
  // Small charts two texels apart. The smaller bake has one sample a texel, so that it is of one chart.
  bunny.low = unwrap(bunny.low, {.method = UnwrapMethod::pairs, .size = 1024});
  const ChartMap charts = charts_of(bunny.low, 1024);
  const Source source(*test::device(), bunny.high);
  for (const NormalMapSpace space : {NormalMapSpace::tangent, NormalMapSpace::object}) {
    bunny.options.space = space;
    bunny.options.width = bunny.options.height = 1024;
    bunny.options.mips = true;
    const BakeResult baked = bake(source, bunny.low, bunny.options);
    bunny.options.mips = false;
    Image boxed = baked.maps[0].image;
    for (std::uint32_t level = 1; level <= 5; ++level) {
      boxed = box_filtered(boxed);
      if (level < 3) continue;  // none of the smaller bake's centres lies in such a texel
      bunny.options.width = bunny.options.height = 1024U >> level;
      const BakeResult smaller = bake(source, bunny.low, bunny.options);
      const Image mask = border_mask(baked, charts, level, true, smaller);
      const Image& wanted = smaller.maps[0].image;
      const ImageDifference ours = compare_images(baked.maps[0].mips[level - 1], wanted, &mask);
      const ImageDifference box = compare_images(boxed, wanted, &mask);
      std::printf(
          "%s space, %3u^2, %llu texels where charts meet: %.2f degrees on average, box %.2f\n",
          space == NormalMapSpace::tangent ? "tangent" : "object", bunny.options.width,
          static_cast<unsigned long long>(ours.compared), ours.mean_angle_degrees,
          box.mean_angle_degrees);
      EXPECT_GT(ours.compared, 500U);
      EXPECT_LT(ours.mean_angle_degrees, 0.9 * box.mean_angle_degrees);
    }
  }
}

TEST(BakedMips, OfTexelsOfOneChartAreASmallerBakeWithAsManySamples) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("bunny_low.obj");
  Bunny bunny;
  const ChartMap charts = charts_of(bunny.low, 1024);
  const Source source(*test::device(), bunny.high);
  bunny.options.mips = true;
  const BakeResult baked = bake(source, bunny.low, bunny.options);
  bunny.options.mips = false;
  Image boxed = baked.maps[0].image;
  for (std::uint32_t level = 1; level <= 4; ++level) {
    boxed = box_filtered(boxed);
    bunny.options.width = bunny.options.height = 1024U >> level;
    bunny.options.samples = 1U << level;
    const BakeResult smaller = bake(source, bunny.low, bunny.options);
    const Image mask = border_mask(baked, charts, level, false, smaller);
    const Image& wanted = smaller.maps[0].image;
    const ImageDifference ours = compare_images(baked.maps[0].mips[level - 1], wanted, &mask);
    const ImageDifference box = compare_images(boxed, wanted, &mask);
    std::printf(
        "%3u^2, %llu texels that a chart covers in part: %.4f degrees on average, box %.2f\n",
        bunny.options.width, static_cast<unsigned long long>(ours.compared),
        ours.mean_angle_degrees, box.mean_angle_degrees);
    EXPECT_GT(ours.compared, 1000U);
    EXPECT_LT(ours.mean_angle_degrees, 0.01);
    EXPECT_GT(box.mean_angle_degrees, 0.2);
  }
}

// ---- files ---------------------------------------------------------------------------------------

Image noise(std::uint32_t width, std::uint32_t height, unsigned seed) {
  Image image{width, height, 3, std::vector<float>(std::size_t{width} * height * 3)};
  std::mt19937 random(seed);
  for (float& value : image.pixels) value = static_cast<float>(random() % 4097) / 2048 - 1;
  return image;
}

std::vector<Image> noise_mips(std::uint32_t width, std::uint32_t height) {
  std::vector<Image> mips;
  while (width > 1 || height > 1) {
    width = std::max(1U, width / 2);
    height = std::max(1U, height / 2);
    mips.push_back(noise(width, height, width));
  }
  return mips;
}

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(SaveMipmapped, EveryLevelComesBackAndLevel0ToAnyone) {
  const std::filesystem::path folder = test::scratch_folder();
  for (const ImageFormat format : {ImageFormat::exr_half, ImageFormat::exr_float}) {
    for (const auto& [width, height] :
         {std::pair{1U, 1U}, {64U, 64U}, {300U, 700U}, {513U, 1U}, {1U, 130U}}) {
      const Image image = noise(width, height, 0);
      const std::vector<Image> mips = noise_mips(width, height);
      const std::filesystem::path path = folder / "mips.exr";
      save_mipmapped(image, mips, path, {.format = format});
      EXPECT_EQ(load_image(path).pixels, image.pixels);

      Imf::TiledInputFile file(path.c_str());
      ASSERT_EQ(file.levelMode(), Imf::MIPMAP_LEVELS);
      ASSERT_EQ(static_cast<std::size_t>(file.numLevels()), mips.size() + 1);
      for (int level = 0; level < file.numLevels(); ++level) {
        const Image& expected = level == 0 ? image : mips[static_cast<std::size_t>(level) - 1];
        ASSERT_EQ(file.levelWidth(level), static_cast<int>(expected.width));
        ASSERT_EQ(file.levelHeight(level), static_cast<int>(expected.height));
        Image found = expected;
        std::fill(found.pixels.begin(), found.pixels.end(), 99.0F);
        Imf::FrameBuffer buffer;
        for (std::size_t c = 0; c < 3; ++c) {
          buffer.insert(std::array{"R", "G", "B"}[c],
                        Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(&found.pixels[c]), 12,
                                   12 * std::size_t{expected.width}));
        }
        file.setFrameBuffer(buffer);
        file.readTiles(0, file.numXTiles(level) - 1, 0, file.numYTiles(level) - 1, level);
        EXPECT_EQ(found.pixels, expected.pixels) << "level " << level;
      }
    }
  }
}

TEST(SaveMipmapped, GivesTheSameBytesOnAnyNumberOfThreads) {
  const std::filesystem::path folder = test::scratch_folder();
  const Image image = noise(513, 300, 1);
  const std::vector<Image> mips = noise_mips(513, 300);
  save_mipmapped(image, mips, folder / "1.exr", {.threads = 1});
  save_mipmapped(image, mips, folder / "2.exr", {.threads = 2});
  EXPECT_TRUE(bytes_of(folder / "1.exr") == bytes_of(folder / "2.exr"));
}

TEST(SaveMipmapped, RefusesWhatItCannotHoldBeforeAnythingIsWritten) {
  const std::filesystem::path path = test::scratch_folder() / "mips.exr";
  const Image image = noise(8, 4, 0);
  const std::vector<Image> good = noise_mips(8, 4);
  const auto code = [&](const std::vector<Image>& mips, ImageFormat format) {
    try {
      save_mipmapped(image, mips, path, {.format = format});
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::internal;
  };
  EXPECT_EQ(code(good, ImageFormat::png16), ErrorCode::usage);
  EXPECT_EQ(code({}, ImageFormat::exr_half), ErrorCode::usage);
  EXPECT_EQ(code({good[0], good[1]}, ImageFormat::exr_half), ErrorCode::usage);
  EXPECT_EQ(code({good[0], good[2], good[1]}, ImageFormat::exr_half), ErrorCode::usage);
  EXPECT_EQ(code({good[0], good[1], good[2], good[2]}, ImageFormat::exr_half), ErrorCode::usage);
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(SaveMipmapped, AFullDiskLeavesNoFile) {
  std::signal(SIGXFSZ, SIG_IGN);
  const std::filesystem::path folder = test::scratch_folder();
  const Image image = noise(256, 200, 0);
  const std::vector<Image> mips = noise_mips(256, 200);
  save_mipmapped(image, mips, folder / "whole.exr");
  const std::uintmax_t size = std::filesystem::file_size(folder / "whole.exr");
  std::filesystem::remove(folder / "whole.exr");
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  for (const std::uintmax_t share : {std::uintmax_t{1}, size / 2, size - 1}) {
    rlimit limit = before;
    limit.rlim_cur = share;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
    EXPECT_THROW(save_mipmapped(image, mips, folder / "map.exr"), Error) << share;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
    EXPECT_TRUE(std::filesystem::is_empty(folder));
  }
}

}  // namespace
}  // namespace kiln
