// The third axis of tangent space, computed at pixels, or at corners.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "detail/occlusion_scene.h"
#include "kiln/measure.h"
#include "kiln/render.h"
#include "mesh/low_surface.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

/// A square whose corner normals lean outward, over a high poly whose one normal leans.
struct Pair {
  Mesh low = test::plane(1, 1, 1, 1), high = test::plane(1, 1, 1, 1);
  Vec3d wanted{0.3, 0.4, std::sqrt(0.75)};

  Pair() {
    low.normals.clear();
    for (const Vec3& p : low.positions) {
      Vec3d n(2 * p.x, 1.2 * p.y, 0.5);
      low.normals.push_back(to_float(n * (1 / length(n))));
    }
    low.normal_triangles = low.triangles;
    high.normals = {to_float(wanted)};
    high.normal_triangles.assign(high.triangles.size(), {0, 0, 0});
  }
};

constexpr std::uint32_t kSide = 16;

BakeOptions options_of(Bitangent bitangent) {
  BakeOptions options;
  options.width = options.height = kSide;
  options.encoding.gutter = 0;
  options.encoding.raw = true;
  options.encoding.bitangent = bitangent;
  options.match.max_distance = Length::absolute(0.2);
  return options;
}

/// In double precision from the corners: what a shader of either kind makes of each texel is the high poly's
/// normal.
TEST(Bitangent, IsUndoneByAShaderOfTheSameKind) {
  KILN_REQUIRE_DEVICE();
  const Pair scene;
  const Source source(*test::device(), scene.high);
  const LowSurface surface = LowSurface::of(scene.low, Frame::of(scene.high));
  double apart = 0;
  for (const Bitangent kind : {Bitangent::pixel, Bitangent::vertex}) {
    const BakeResult baked = bake(source, scene.low, options_of(kind));
    for (std::uint32_t row = 0; row < kSide; ++row) {
      for (std::uint32_t column = 0; column < kSide; ++column) {
        const double u = (column + 0.5) / kSide, v = 1 - (row + 0.5) / kSide;
        for (const auto& corners : surface.triangles) {
          const auto edge = [&](std::size_t i, std::size_t j) {
            return (double{corners[j].uv.x} - corners[i].uv.x) * (v - corners[i].uv.y) -
                   (double{corners[j].uv.y} - corners[i].uv.y) * (u - corners[i].uv.x);
          };
          const double a = edge(1, 2), b = edge(2, 0), c = edge(0, 1), all = a + b + c;
          if (a * all < 0 || b * all < 0 || c * all < 0) continue;
          const double weights[3] = {a / all, b / all, c / all};
          Vec3d n{}, t{}, at_corners{};
          for (std::size_t k = 0; k < 3; ++k) {
            const Vec3d normal = to_double(corners[k].normal),
                        tangent = to_double(corners[k].tangent);
            n += normal * weights[k];
            t += tangent * weights[k];
            at_corners += cross(normal, tangent) * (corners[k].sign * weights[k]);
          }
          const Vec3d at_pixel = cross(n, t) * double{corners[0].sign};
          const float* texel = baked.maps[0].image.at(column, row);
          const auto shaded = [&](const Vec3d& third) {
            const Vec3d sum =
                t * double{texel[0]} + third * double{texel[1]} + n * double{texel[2]};
            return sum * (1 / length(sum));
          };
          const Vec3d right = shaded(kind == Bitangent::pixel ? at_pixel : at_corners);
          EXPECT_NEAR(dot(right, scene.wanted), 1, 1e-6) << column << ", " << row;
          const Vec3d wrong = shaded(kind == Bitangent::pixel ? at_corners : at_pixel);
          apart = std::max(apart, std::acos(std::min(1.0, dot(wrong, scene.wanted))));
          break;
        }
      }
    }
  }
  EXPECT_GT(apart * 180 / 3.14159, 1);  // degrees: the two are not the same
}

/// The renderer undoes each kind.
TEST(Bitangent, IsRenderedTheSameWay) {
  KILN_REQUIRE_DEVICE();
  const Pair scene;
  const Source source(*test::device(), scene.high);
  RenderOptions view;
  view.azimuth_degrees = view.elevation_degrees = 0;
  view.size = 64;
  view.show_normals = true;
  const auto error = [&](Bitangent baked, Bitangent rendered) {
    BakeOptions options = options_of(baked);
    options.encoding.raw = false;
    options.encoding.gutter = 8;
    options.width = options.height = 64;
    const BakeResult result = bake(source, scene.low, options);
    NormalMap map{&result.maps[0].image};
    map.bitangent = rendered;
    const Scene low(*test::device(), scene.low, map), high(*test::device(), scene.high);
    const std::vector<ViewAngles> views = {{0, 0}};
    return NormalReference(high, scene.high, views, 64, false).compare(low).mean_degrees;
  };
  EXPECT_LT(error(Bitangent::vertex, Bitangent::vertex), 0.1);
  EXPECT_LT(error(Bitangent::pixel, Bitangent::pixel), 0.1);
  EXPECT_GT(error(Bitangent::vertex, Bitangent::pixel),
            5 * error(Bitangent::vertex, Bitangent::vertex));
}

/// Displacement is along the same axes.
TEST(Bitangent, OfDisplacement) {
  KILN_REQUIRE_DEVICE();
  Pair scene;
  for (Vec3& p : scene.high.positions) p.z += 0.05F;
  const Source source(*test::device(), scene.high);
  BakeOptions options = options_of(Bitangent::vertex);
  options.maps = {MapKind{"displacement"}};
  const BakeResult vertex = bake(source, scene.low, options);
  options.encoding.bitangent = Bitangent::pixel;
  EXPECT_NE(vertex.maps[0].image.pixels, bake(source, scene.low, options).maps[0].image.pixels);
}

}  // namespace
}  // namespace kiln
