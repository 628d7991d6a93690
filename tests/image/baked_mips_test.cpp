// Mip-maps of bakes: no bleeding, gutters, policies; how much better than ordinary box filtering on a
// real layout.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>
#include <vector>

#include "image/gutter.h"
#include "image/mips.h"
#include "image/stored_values.h"
#include "image/two_quads.h"
#include "kiln/bake.h"
#include "kiln/image.h"
#include "kiln/unwrap.h"
#include "mesh/charts.h"
#include "mesh/low_surface.h"
#include "support/environment.h"
#include "support/shapes.h"
#include "texel/texels.h"

namespace kiln {
namespace {

using test::two_quads;

// ---- through the bake ----------------------------------------------------------------------------

BakeOptions mip_bake(std::uint32_t width, std::uint32_t height) {
  BakeOptions options;
  options.width = width;
  options.height = height;
  options.encoding.mips = true;
  options.encoding.raw = true;
  return options;
}

TEST(BakedMips, OfOppositeChartsDoNotBleedAtAnyLevel) {
  KILN_REQUIRE_DEVICE();
  const Mesh mesh = two_quads();
  const Source source(*test::device(), mesh);
  for (const auto& [width, height] : {std::pair{64U, 64U}, {37U, 23U}, {1U, 9U}}) {
    BakeOptions options = mip_bake(width, height);
    options.encoding.space = NormalMapSpace::object;
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
    options.encoding.space = NormalMapSpace::object;  // the background is 0
    options.encoding.gutter = wanted;
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
  options.match.max_distance = Length::share(0.1);
  options.samples = 2;
  const BakeResult with = bake(source, low, options);
  options.encoding.mips = false;
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
        options.encoding.miss = miss;
        options.encoding.space = space;
        options.encoding.two_component = two;
        options.encoding.raw = false;
        options.match.max_distance = Length::share(0.003);  // so that some miss
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
    bunny.match.cage = Length::share(0.012444);
    bunny.match.max_distance = Length::share(0.024887);
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
    bunny.options.encoding.space = space;
    bunny.options.width = bunny.options.height = 1024;
    bunny.options.encoding.mips = true;
    const BakeResult baked = bake(source, bunny.low, bunny.options);
    bunny.options.encoding.mips = false;
    Image boxed = baked.maps[0].image;
    for (std::uint32_t level = 1; level <= 5; ++level) {
      boxed = box_filtered(boxed);
      if (level < 3) continue;  // none of the smaller bake's centres lies in such a texel
      bunny.options.width = bunny.options.height = 1024U >> level;
      const BakeResult smaller = bake(source, bunny.low, bunny.options);
      Image mask = border_mask(baked, charts, level, true, smaller);
      // Charts without a centre have texels of the smaller bake that are mostly others' here.
      const std::uint32_t side = 1024U >> level;
      const LowSurface surface = LowSurface::of(bunny.low, Frame());
      for (const AssignedTexel& texel :
           SmallCharts::of(surface, TexelPieces::of(surface, side, side), side, side, 1).texels) {
        *mask.at(texel.column, texel.row) = 0;
      }
      const Image& wanted = smaller.maps[0].image;
      const ImageDifference ours = compare_images(baked.maps[0].mips[level - 1], wanted, &mask);
      const ImageDifference box = compare_images(boxed, wanted, &mask);
      std::printf(
          "%s space, %3u^2, %llu texels where charts meet: %.2f degrees on average, box %.2f\n",
          space == NormalMapSpace::tangent ? "tangent" : "object", bunny.options.width,
          static_cast<unsigned long long>(ours.compared_texels), ours.mean_angle_degrees,
          box.mean_angle_degrees);
      EXPECT_GT(ours.compared_texels, 500U);
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
  bunny.options.encoding.mips = true;
  const BakeResult baked = bake(source, bunny.low, bunny.options);
  bunny.options.encoding.mips = false;
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
        bunny.options.width, static_cast<unsigned long long>(ours.compared_texels),
        ours.mean_angle_degrees, box.mean_angle_degrees);
    EXPECT_GT(ours.compared_texels, 1000U);
    EXPECT_LT(ours.mean_angle_degrees, 0.01);
    EXPECT_GT(box.mean_angle_degrees, 0.2);
  }
}

/// A texel of two charts counts by the samples of the larger one: of a level's texel the chart with more samples is
/// shown.
TEST(BakedMips, TexelsOfTwoChartsCountByTheirSamples) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(1, 1, 2, 2), low;
  for (Vec3& p : high.positions) p.z = 0.1F + 0.05F * p.x;
  high.normals.clear();
  high.normal_triangles.clear();
  // Charts from columns 0 to 2.75 and 2.75 to 8 of a map of 8 texels; v of the second is mirrored, so that they part.
  constexpr float kBorder = 2.75F / 8;
  for (const auto& [left, right, mirrored] :
       {std::tuple{0.0F, kBorder, false}, {kBorder, 1.0F, true}}) {
    const auto first = static_cast<std::uint32_t>(low.positions.size());
    for (const auto& [u, v] : {std::pair{left, 0.0F}, {right, 0.0F}, {right, 1.0F}, {left, 1.0F}}) {
      low.positions.push_back({u - 0.5F, (mirrored ? 1 - v : v) - 0.5F, 0});
      low.uvs.push_back({u, v});
    }
    for (const Triangle& t : {Triangle{0, 1, 2}, Triangle{0, 2, 3}}) {
      low.triangles.push_back({first + t[0], first + t[1], first + t[2]});
      if (mirrored) std::swap(low.triangles.back()[1], low.triangles.back()[2]);
      low.uv_triangles.push_back(low.triangles.back());
    }
  }
  BakeOptions options;
  options.width = options.height = 8;
  options.samples = 4;
  options.maps = {MapKind{"height"}};
  options.encoding.mips = true;
  options.encoding.gutter = 0;
  options.match.max_distance = Length::absolute(0.5);
  const BakeResult baked = bake(Source(*test::device(), high), low, options);
  ASSERT_EQ(baked.report.missed, 0U);
  const Image& image = baked.maps[0].image;
  const Image& level = baked.maps[0].mips.at(0);
  // Of level 1's texel 1 the first chart has 12 samples of a row's 32 beside the second one's 20: texel 3's value. Texel 2
  // is mostly of the first chart.
  for (std::uint32_t y = 0; y < 4; ++y) {
    EXPECT_NEAR(level.at(1, y)[0], image.at(3, 2 * y)[0], 1e-5) << y;
    EXPECT_GT(std::abs(image.at(3, 2 * y)[0] - image.at(2, 2 * y)[0]), 1e-3);
  }
}

/// What integer formats store: colours in sRGB, numbers as shares of their range, the image and all its levels alike.
TEST(BakedMips, AreStoredAsTheImageIs) {
  BakedMap map;
  map.image = {2, 2, 1, {-1, 0, 1, 3}};
  map.mips = {{1, 1, 1, {1}}};
  map.ranges = {{-1, 3}};
  map.info.type = MapType::signed_scalar;
  BakedMap color = map, constant = map;
  constant.ranges = {{2, 2}};
  constant.image.pixels = {2, 2, 2, 2};
  to_stored(constant, ImageFormat::png8);
  EXPECT_EQ(constant.image.pixels, std::vector<float>(4, 0.5F)) << "one value is the middle";
  to_stored(map, ImageFormat::png16);
  EXPECT_EQ(map.image.pixels, (std::vector<float>{0, 0.25F, 0.5F, 1}));
  EXPECT_EQ(map.mips[0].pixels, std::vector<float>{0.5F});
  EXPECT_TRUE(map.stored);
  color.info.type = MapType::color;
  color.ranges = {{0, 1}, {0, 1}, {0, 1}};
  color.image = {1, 1, 3, {0.5F, 0.0F, 1.0F}};
  color.mips = {{1, 1, 3, {0.5F, 0.0F, 1.0F}}};
  to_stored(color, ImageFormat::exr_half);
  EXPECT_EQ(color.image.pixels[0], 0.5F) << "formats of floats store linear light";
  EXPECT_FALSE(color.stored);
  to_stored(color, ImageFormat::png8);
  EXPECT_NEAR(color.image.pixels[0], 1.055 * std::pow(0.5, 1 / 2.4) - 0.055, 1e-5);
  EXPECT_EQ(color.mips[0].pixels, color.image.pixels);
}

}  // namespace
}  // namespace kiln
