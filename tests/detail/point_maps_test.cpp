// Maps of one point: the way between the meshes, what found it, UVs, edges and curvature.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <stdexcept>
#include <utility>

#include "image/gutter.h"
#include "kiln/session.h"
#include "mesh/curvature.h"
#include "mesh/kernels_shared.h"
#include "mesh/low_surface.h"
#include "mesh/vector.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

constexpr std::uint32_t kWidth = 64, kHeight = 48;

BakeOptions asking(std::vector<MapKind> maps) {
  BakeOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.encoding.gutter = 0;
  options.maps = std::move(maps);
  options.match.max_distance = Length::absolute(0.5);
  options.report.keep_match = true;
  return options;
}

const Image& image_of(const BakeResult& result, std::string_view name) {
  for (const BakedMap& map : result.maps) {
    if (map.kind.name == name) return map.image;
  }
  throw std::runtime_error("no such map");
}

Vec3d value_at(const Image& image, std::size_t i) {
  return {image.pixels[3 * i], image.pixels[3 * i + 1], image.pixels[3 * i + 2]};
}

/// The UV of a texel's centre.
std::array<double, 2> centre_of(std::size_t i) {
  return {(static_cast<double>(i % kWidth) + 0.5) / kWidth,
          1 - (static_cast<double>(i / kWidth) + 0.5) / kHeight};
}

/// A square around 0 at a height, facing +Z, whose UVs leave a border of a tenth.
Mesh sheet(std::uint32_t cells, double side, float z) {
  Mesh mesh = test::plane(cells, cells, side, side);
  for (Vec3& p : mesh.positions) p.z = z;
  for (Vec2& uv : mesh.uvs) uv = {0.1F + 0.8F * uv.x, 0.1F + 0.8F * uv.y};
  return mesh;
}

/// Place of a texel of sheet(., side, .).
Vec3d on_sheet(std::size_t i, double side) {
  const auto [u, v] = centre_of(i);
  return {((u - 0.1) / 0.8 - 0.5) * side, ((v - 0.1) / 0.8 - 0.5) * side, 0};
}

/// The low poly's point and frame at a texel, from the UVs by brute force.
struct LowPoint {
  Vec3d position{}, x_axis{}, y_axis{}, z_axis{};
};

bool find_low_point(const Mesh& low, const LowSurface& surface, NormalMapSpace space, std::size_t i,
                    LowPoint& found) {
  const auto [u, v] = centre_of(i);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto& [a, b, c] = surface.triangles[t];
    const double bx = double{b.uv.x} - a.uv.x, by = double{b.uv.y} - a.uv.y;
    const double cx = double{c.uv.x} - a.uv.x, cy = double{c.uv.y} - a.uv.y;
    const double area = bx * cy - cx * by;
    const double x = u - a.uv.x, y = v - a.uv.y;
    const double w1 = (x * cy - cx * y) / area, w2 = (bx * y - x * by) / area;
    if (!(w1 > 0.01 && w2 > 0.01 && w1 + w2 < 0.99)) continue;
    const auto mixed = [&](const Vec3& p, const Vec3& q, const Vec3& r) {
      return to_double(p) * (1 - w1 - w2) + to_double(q) * w1 + to_double(r) * w2;
    };
    const Triangle& corners = low.triangles[t];
    const Vec3d p = to_double(low.positions[corners[0]]), q = to_double(low.positions[corners[1]]),
                r = to_double(low.positions[corners[2]]);
    found.position = p * (1 - w1 - w2) + q * w1 + r * w2;
    if (space == NormalMapSpace::tangent) {
      found.z_axis = mixed(a.normal, b.normal, c.normal);
      found.x_axis = mixed(a.tangent, b.tangent, c.tangent);
      found.y_axis = cross(found.z_axis, found.x_axis) * double{a.sign};
    } else if (space == NormalMapSpace::object) {
      found.x_axis = {1, 0, 0};
      found.y_axis = {0, 1, 0};
      found.z_axis = {0, 0, 1};
    } else {
      found.z_axis = cross(q - p, r - p);
      found.z_axis = found.z_axis * (1 / length(found.z_axis));
      // Direction in which u grows fastest with v held.
      found.x_axis = ((q - p) * cy - (r - p) * by) * (area < 0 ? -1.0 : 1.0);
      found.x_axis = found.x_axis * (1 / length(found.x_axis));
      found.y_axis = cross(found.z_axis, found.x_axis);
    }
    return true;
  }
  return false;
}

TEST(PointMaps, DisplacingTheLowPolyGivesTheHighPoly) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(20000, true);
  const Source source(*test::device(), high);
  for (const bool mirrored : {false, true}) {
    Mesh low = test::BumpySphere::light(16, 9);
    if (mirrored) {
      for (Vec2& uv : low.uvs) uv.x = 1 - uv.x;
    }
    const LowSurface surface = LowSurface::of(low, Frame{});
    EXPECT_EQ(surface.triangles[0][0].sign, mirrored ? -1.0F : 1.0F);
    for (const auto& [space, method] : {std::pair(NormalMapSpace::tangent, MatchMethod::closest),
                                        std::pair(NormalMapSpace::tangent, MatchMethod::ray),
                                        std::pair(NormalMapSpace::object, MatchMethod::closest),
                                        std::pair(NormalMapSpace::face, MatchMethod::closest)}) {
      BakeOptions options = asking(
          {MapKind{"displacement"}, MapKind{"position"}, MapKind{"distance"}, MapKind{"height"}});
      options.encoding.space = space;
      options.match.method = method;
      const BakeResult baked = bake(source, low, options);
      std::size_t checked = 0;
      double sideways = 0;
      for (std::size_t i = 0; i < baked.coverage.size(); ++i) {
        LowPoint at;
        if (baked.coverage[i] != kCoverageBaked) continue;
        if (!find_low_point(low, surface, space, i, at)) continue;
        ++checked;
        const Vec3d way = value_at(image_of(baked, "displacement"), i);
        const Vec3d moved = at.position + at.x_axis * way.x + at.y_axis * way.y + at.z_axis * way.z;
        const Vec3d dense = value_at(image_of(baked, "position"), i);
        // Floats of 1: weights of corners, tangents and positions, over triangles of about 0.5.
        EXPECT_LT(length(moved - dense), 2e-5) << i;
        EXPECT_NEAR(image_of(baked, "distance").pixels[i], length(dense - at.position), 2e-5);
        sideways = std::max(sideways, std::abs(way.x));
        if (method != MatchMethod::ray) continue;
        // Along the ray the sign is beside the length.
        EXPECT_NEAR(image_of(baked, "distance").pixels[i],
                    std::abs(image_of(baked, "height").pixels[i]), 1e-5);
      }
      EXPECT_GT(checked, 2000U);
      if (method != MatchMethod::ray) {
        EXPECT_GT(sideways, 1e-3);
      }
    }
  }
}

TEST(PointMaps, DisplacementFlipsLikeNormals) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::BumpySphere::dense(2000, true));
  BakeOptions options = asking({MapKind{"displacement"}});
  options.match.method = MatchMethod::closest;  // rays go along the normal, where y is 0
  const BakeResult up = bake(source, test::BumpySphere::light(16, 9), options);
  options.encoding.flip_y = true;
  const BakeResult down = bake(source, test::BumpySphere::light(16, 9), options);
  double largest = 0;
  for (std::size_t i = 0; i < up.coverage.size(); ++i) {
    const Vec3d a = value_at(up.maps[0].image, i), b = value_at(down.maps[0].image, i);
    EXPECT_EQ(a.x, b.x);
    EXPECT_EQ(a.y, -b.y);
    EXPECT_EQ(a.z, b.z);
    largest = std::max(largest, std::abs(a.y));
  }
  EXPECT_GT(largest, 1e-4);
}

TEST(PointMaps, DistanceHasNoSign) {
  KILN_REQUIRE_DEVICE();
  for (const float z : {0.25F, -0.125F}) {
    const Source source(*test::device(), sheet(4, 1, z));
    const BakeResult baked = bake(source, sheet(2, 1, 0), asking({MapKind{"distance"}}));
    std::size_t texels = 0;
    for (std::size_t i = 0; i < baked.coverage.size(); ++i) {
      if (baked.coverage[i] != kCoverageBaked) continue;
      ++texels;
      EXPECT_NEAR(baked.maps[0].image.pixels[i], std::abs(z), 1e-6);
    }
    EXPECT_GT(texels, 1000U);
  }
}

TEST(PointMaps, ProvenanceIsTheMatchsStatus) {
  KILN_REQUIRE_DEVICE();
  using Colour = std::array<float, 3>;
  // One sheet above the low poly's left, one below its right; beside them the nearest points, if
  // near.
  Mesh high = sheet(4, 1, 0.25F);
  for (Vec3& p : high.positions) p.x = p.x / 2 - 0.25F;
  const Mesh right = sheet(4, 1, -0.125F);
  const auto first = static_cast<std::uint32_t>(high.positions.size());
  for (const Vec3& p : right.positions) high.positions.push_back({p.x / 2 + 0.25F, p.y, p.z});
  for (Triangle t : right.triangles) {
    high.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  high.normals.clear();
  high.normal_triangles.clear();
  high.uvs.clear();
  high.uv_triangles.clear();
  const Source source(*test::device(), high);
  for (const bool blended : {false, true}) {
    BakeOptions options = asking({MapKind{"provenance"}, MapKind::normal});
    options.match.max_distance = Length::absolute(0.27);
    options.match.fallback = {MatchMethod::closest};
    options.match.fallback_blend = blended ? 4 : 0;
    const BakeResult baked = bake(source, sheet(2, 1.5, 0), options);
    std::set<Colour> seen;
    for (std::size_t i = 0; i < baked.coverage.size(); ++i) {
      if (baked.coverage[i] == kCoverageEmpty) continue;
      const Vec3d value = value_at(image_of(baked, "provenance"), i);
      const Colour colour = {static_cast<float>(value.x), static_cast<float>(value.y),
                             static_cast<float>(value.z)};
      const Vec3d at = on_sheet(i, 1.5);
      Colour expected{};
      switch (baked.match->status[i]) {
        case KILN_STATUS_OUTWARD:
          expected = {0, 1, 0};
          EXPECT_LT(at.x, 1e-4);
          break;
        case KILN_STATUS_INWARD:
          expected = {0, 0, 1};
          EXPECT_GT(at.x, -1e-4);
          break;
        case KILN_STATUS_CLOSEST:
          expected = {0, 1, 1};
          EXPECT_GT(std::max(std::abs(at.x), std::abs(at.y)), 0.4999);
          break;
        case KILN_STATUS_MISS:
          expected = {1, 0, 1};
          break;
        default:
          ADD_FAILURE() << int{baked.match->status[i]};
      }
      EXPECT_EQ(colour, expected) << i;
      seen.insert(colour);
    }
    EXPECT_EQ(seen.size(), 4U);
  }
}

TEST(PointMaps, UvIsTheHighPolys) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(8, 8);  // u = x + 1/2, v = y + 1/2
  for (Vec3& p : high.positions) p.z = 0.25F;
  const Source source(*test::device(), high);
  const BakeResult baked = bake(source, sheet(2, 1, 0), asking({MapKind{"uv"}}));
  std::size_t texels = 0;
  for (std::size_t i = 0; i < baked.coverage.size(); ++i) {
    if (baked.coverage[i] != kCoverageBaked) continue;
    ++texels;
    const Vec3d at = on_sheet(i, 1), value = value_at(baked.maps[0].image, i);
    EXPECT_NEAR(value.x, at.x + 0.5, 1e-6);
    EXPECT_NEAR(value.y, at.y + 0.5, 1e-6);
    EXPECT_EQ(value.z, 0);
  }
  EXPECT_GT(texels, 1000U);
}

TEST(PointMaps, UvNeedsUvs) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(2, 2);
  high.uvs[0].x = std::numeric_limits<float>::quiet_NaN();
  const BakeResult baked =
      bake(Source(*test::device(), high), sheet(2, 1, 0), asking({MapKind{"uv"}}));
  for (const float value : baked.maps[0].image.pixels) EXPECT_TRUE(std::isfinite(value));
  high.uvs.clear();
  high.uv_triangles.clear();
  const Source source(*test::device(), high);
  try {
    bake(source, sheet(2, 1, 0), asking({MapKind{"uv"}}));
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input);
    EXPECT_NE(std::string(error.what()).find("no UVs"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("leave the map out"), std::string::npos);
  }
}

TEST(PointMaps, WireframeIsTheDistanceToTheNearestEdge) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = sheet(3, 1, 0);
  const Source source(*test::device(), high);
  const BakeResult baked = bake(source, sheet(2, 1, 0), asking({MapKind{"wireframe"}}));
  const double texel = std::sqrt(1 / (0.8 * kWidth * 0.8 * kHeight));
  std::size_t bright = 0, dark = 0;
  for (std::size_t i = 0; i < baked.coverage.size(); ++i) {
    if (baked.coverage[i] != kCoverageBaked) continue;
    const Vec3d at = on_sheet(i, 1);
    double nearest = 1;
    for (const Triangle& t : high.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d from = to_double(high.positions[t[k]]),
                    to = to_double(high.positions[t[(k + 1) % 3]]);
        const Vec3d way = to - from;
        const double part = std::clamp(dot(at - from, way) / dot(way, way), 0.0, 1.0);
        nearest = std::min(nearest, length(from + way * part - at));
      }
    }
    const double expected = std::max(0.0, 1 - nearest / texel);
    EXPECT_NEAR(baked.maps[0].image.pixels[i], expected, 1e-4) << i;  // floats of 1 over a texel
    bright += expected > 0.5 ? 1U : 0U;
    dark += expected == 0 ? 1U : 0U;
  }
  EXPECT_GT(bright, 100U);
  EXPECT_GT(dark, 500U);
}

TEST(PointMaps, CurvatureIsInWorldUnits) {
  KILN_REQUIRE_DEVICE();
  constexpr double kRadius = 3;
  const auto placed = [&](Mesh mesh) {
    for (Vec3& p : mesh.positions) p = {p.x + 7, p.y - 2, p.z};
    return mesh;
  };
  const Source source(*test::device(), placed(test::icosphere(5, kRadius)));
  const Mesh low = placed(test::uv_sphere(24, 12, kRadius));
  std::array<double, 2> means{};
  for (std::size_t k = 0; k < 2; ++k) {
    BakeOptions options = asking({MapKind{"curvature"}});
    options.curvature_radius =
        k == 0 ? Length::absolute(0.7) : Length::share(0.7 / source.stats().diagonal);
    const BakeResult baked = bake(source, low, options);
    double sum = 0, error = 0;
    std::size_t texels = 0;
    for (std::size_t i = 0; i < baked.coverage.size(); ++i) {
      if (baked.coverage[i] != kCoverageBaked) continue;
      ++texels;
      sum += baked.maps[0].image.pixels[i];
      error += std::abs(baked.maps[0].image.pixels[i] * kRadius - 1);
    }
    ASSERT_GT(texels, 2000U);
    EXPECT_LT(error / static_cast<double>(texels), 0.03);
    means[k] = sum / static_cast<double>(texels);
    // An integer format has the flat in its middle.
    const ValueRange range = baked.maps[0].ranges[0];
    EXPECT_EQ(range.low, -range.high);
    EXPECT_EQ(range.high, 1.5F);  // 1 / 0.7, rounded up
  }
  EXPECT_NEAR(means[0], means[1], 1e-6);
}

TEST(PointMaps, CurvatureShowsNoFacetsByDefault) {
  KILN_REQUIRE_DEVICE();
  // Spheres whose edges are 2%, 4% and 8% of the diagonal.
  for (const std::uint32_t levels : {4U, 3U, 2U}) {
    const Mesh high = test::icosphere(levels);
    const Source source(*test::device(), high);
    const BakeResult baked = bake(source, test::uv_sphere(24, 12), asking({MapKind{"curvature"}}));
    const double radius = 3 * facet_size(high.positions, high.triangles);
    EXPECT_NEAR(baked.report.curvature_radius, radius, 1e-5 * radius);
    EXPECT_NEAR(double{baked.maps[0].ranges[0].high}, 1 / radius, 0.1 / radius);
    double squares = 0;
    std::size_t texels = 0;
    for (std::size_t i = 0; i < baked.coverage.size(); ++i) {
      if (baked.coverage[i] != kCoverageBaked) continue;
      ++texels;
      squares += std::pow(baked.maps[0].image.pixels[i] - 1, 2);
    }
    ASSERT_GT(texels, 2000U);
    // A disc with a radius of R spacings of a grid holds pi R^2 of its points to within sqrt(0.46 R) (root mean
    // square; Kendall 1948); edges are clipped, which is smoother than points that are in or out. R is 3.
    EXPECT_LT(std::sqrt(squares / static_cast<double>(texels)),
              std::sqrt(0.46 * 3) / (std::numbers::pi * 3 * 3));
  }
  // Nothing is smooth: the share of the diagonal.
  const Mesh cube = test::cube();
  const Source source(*test::device(), cube);
  const BakeResult baked = bake(source, cube, asking({MapKind{"curvature"}}));
  EXPECT_NEAR(baked.report.curvature_radius, 0.005 * std::sqrt(3.0), 1e-7);
}

TEST(PointMaps, AreFollowedBySessions) {
  KILN_REQUIRE_DEVICE();
  for (const MatchMethod method : {MatchMethod::ray, MatchMethod::uv}) {
    BakeOptions options = asking({MapKind{"curvature"}, MapKind{"displacement"}, MapKind::mask,
                                  MapKind{"distance"}, MapKind{"provenance"}, MapKind{"uv"},
                                  MapKind{"wireframe"}, MapKind{"slope"}, MapKind::normal});
    options.match.method = method;
    options.report.keep_match = false;
    options.match.max_distance.reset();
    if (method != MatchMethod::uv) options.match.max_distance = Length::absolute(0.3);
    options.curvature_radius = Length::absolute(0.1);
    SessionOptions within;
    within.bounds = Bounds{{-0.5, -0.5, -0.25}, {0.5, 0.5, 0.25}};
    Mesh high = sheet(16, 1, 0);
    high.normals.assign(high.positions.size(), Vec3{0, 0, 1});
    high.normal_triangles = high.triangles;
    BakeSession session(*test::device(), high, sheet(2, 1, 0), options, within);
    session.bake();
    const auto compare = [&] {
      const BakeResult& live = session.bake();
      const Source again(*test::device(), session.high(), RayTraversal::automatic,
                         session.bounds());
      const BakeResult fresh = bake(again, sheet(2, 1, 0), options);
      ASSERT_EQ(live.maps.size(), fresh.maps.size());
      for (std::size_t m = 0; m < fresh.maps.size(); ++m) {
        EXPECT_EQ(live.maps[m].image.pixels, fresh.maps[m].image.pixels)
            << fresh.maps[m].kind.name << " by " << method.name;
      }
    };
    std::vector<Vec3> moved(high.positions.begin() + 40, high.positions.begin() + 90);
    for (Vec3& p : moved) p.z += 0.02F + 0.1F * p.x;
    session.set_positions(40, moved);
    compare();
    const std::vector<Vec3> turned(7, Vec3{0.6F, 0, 0.8F});  // of few texels
    session.set_normals(120, turned);
    compare();
  }
}

/// What views and layouts find has colours of its own.
TEST(PointMaps, ProvenanceOfViewsAndLayouts) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), sheet(4, 1, 0.0625F));
  for (const auto& [method, colour] : {std::pair{MatchMethod::views, std::array{1.0F, 0.5F, 0.0F}},
                                       {MatchMethod::uv, std::array{0.5F, 0.5F, 0.5F}}}) {
    BakeOptions options = asking({MapKind{"provenance"}});
    options.match.method = method;
    const BakeResult baked = bake(source, sheet(2, 1, 0), options);
    std::size_t found = 0;
    for (std::size_t i = 0; i < baked.coverage.size(); ++i) {
      if (baked.coverage[i] != kCoverageBaked) continue;
      const Vec3d value = value_at(image_of(baked, "provenance"), i);
      ++found;
      EXPECT_EQ(value.x, colour[0]) << i;
      EXPECT_EQ(value.y, colour[1]) << i;
      EXPECT_EQ(value.z, colour[2]) << i;
    }
    EXPECT_GT(found, 1000U) << method.name;
  }
}

}  // namespace
}  // namespace kiln
