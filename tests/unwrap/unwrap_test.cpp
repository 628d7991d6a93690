// unwrap(): what its header promises, checked by the exact layout oracle.
#include "kiln/unwrap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "pack/rectangle_packing.h"
#include "reference/layout.h"
#include "support/environment.h"
#include "support/shapes.h"
#include "unwrap/pairing.h"

namespace kiln {
namespace {

using test::check_layout;
using test::LayoutFacts;

Mesh of(std::vector<Vec3> positions, std::vector<Triangle> triangles) {
  Mesh mesh;
  mesh.name = "test";
  mesh.positions = std::move(positions);
  mesh.triangles = std::move(triangles);
  return mesh;
}

/// Unwraps, and checks the layout against the oracle and the report.
LayoutFacts unwrapped(const Mesh& mesh, UnwrapOptions options = {}, Mesh* result = nullptr,
                      UnwrapReport* report_out = nullptr) {
  UnwrapReport report;
  if (options.method == UnwrapMethod::charts) options.method = UnwrapMethod::pairs;
  const Mesh out = unwrap(mesh, options, &report);
  EXPECT_EQ(out.positions.size(), mesh.positions.size());
  EXPECT_EQ(out.triangles, mesh.triangles);
  // A border below one texel means a grid that much finer, with a border of one step.
  const double finer = std::max(1.0, 1 / report.border_texels);
  const auto grid = static_cast<std::int64_t>(std::lround(options.size * finer));
  const auto border = static_cast<std::int64_t>(std::lround(report.border_texels * finer));
  EXPECT_GE(border, 1);
  const LayoutFacts facts = check_layout(out, grid, border, options.size);
  EXPECT_EQ(facts.first_fault, "");
  EXPECT_EQ(facts.charts, report.charts);
  EXPECT_NEAR(facts.coverage, report.coverage, 1e-9);
  EXPECT_NEAR(facts.density_spread, report.density_spread, 1e-4);
  if (finer == 1) {
    EXPECT_GE(facts.smallest_texels, 1 - 1e-9);
  }
  if (result != nullptr) *result = out;
  if (report_out != nullptr) *report_out = report;
  return facts;
}

bool warns(const std::vector<Warning>& warnings, const std::string& code, std::uint64_t count) {
  return std::any_of(warnings.begin(), warnings.end(),
                     [&](const Warning& w) { return w.code == code && w.count == count; });
}

TEST(Unwrap, OneTriangleFillsHalfTheMap) {
  const LayoutFacts facts = unwrapped(of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}));
  EXPECT_EQ(facts.charts, 1u);
  EXPECT_GT(facts.coverage, 0.49);
}

TEST(Unwrap, SquareOfTwoTrianglesIsOneChart) {
  Mesh out;
  const LayoutFacts facts =
      unwrapped(of({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {2, 3, 0}}), {}, &out);
  EXPECT_EQ(facts.charts, 1u);
  EXPECT_GT(facts.coverage, 0.99);
  EXPECT_NEAR(facts.density_spread, 0, 1e-6);
  // The shared edge is one edge in the texture too.
  EXPECT_EQ(out.uv_triangles[0][0], out.uv_triangles[1][2]);
  EXPECT_EQ(out.uv_triangles[0][2], out.uv_triangles[1][0]);
}

TEST(Unwrap, RectangleKeepsItsProportions) {
  Mesh out;
  unwrapped(of({{0, 0, 0}, {3, 0, 0}, {3, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {2, 3, 0}}), {}, &out);
  const auto side = [&](std::size_t a, std::size_t b) {
    const Vec2 &p = out.uvs[out.uv_triangles[0][a]], &q = out.uvs[out.uv_triangles[0][b]];
    return std::hypot(p.x - q.x, p.y - q.y);
  };
  EXPECT_NEAR(side(0, 1) / side(1, 2), 3, 0.02);
}

TEST(Unwrap, Tetrahedron) {
  const LayoutFacts facts = unwrapped(test::tetrahedron());
  EXPECT_EQ(facts.charts, 2u);
  EXPECT_EQ(facts.collapsed, 0u);
}

TEST(Unwrap, CubeIsSixEvenSquares) {
  const LayoutFacts facts = unwrapped(test::cube());
  EXPECT_EQ(facts.charts, 6u);
  EXPECT_NEAR(facts.density_spread, 0, 1e-3);
}

TEST(Unwrap, SphereAndTorusAreEvenAndDense) {
  for (const Mesh& mesh :
       {test::icosphere(4), test::torus(72, 24), test::BumpySphere::dense(5000)}) {
    const LayoutFacts facts = unwrapped(mesh);
    const auto triangles = mesh.triangles.size();
    EXPECT_LE(facts.charts, triangles / 2 + triangles / 50) << mesh.name;
    EXPECT_GT(facts.coverage, 0.75) << mesh.name;
    EXPECT_LT(facts.density_spread, 0.1) << mesh.name;  // Measured: 0.03 to 0.05.
  }
}

TEST(Unwrap, MoreCellsThanTheSkylineTakes) {
  const LayoutFacts facts = unwrapped(test::icosphere(5), {.size = 4096});
  EXPECT_GT(facts.coverage, 0.75);
}

TEST(Unwrap, BordersAsAsked) {
  for (const std::uint32_t border : {1u, 2u, 3u, 8u, 16u}) {
    UnwrapReport report;
    unwrapped(test::icosphere(2), {.size = 1000, .border_texels = border}, nullptr, &report);
    EXPECT_EQ(report.border_texels, border);
    EXPECT_TRUE(report.warnings.empty());
  }
}

TEST(Unwrap, TooManyTrianglesShrinkTheBorderAndThenTheGrid) {
  UnwrapReport report;
  unwrapped(test::icosphere(4), {.size = 256, .border_texels = 8}, nullptr, &report);
  EXPECT_GE(report.border_texels, 1);
  EXPECT_LT(report.border_texels, 8);
  EXPECT_TRUE(warns(report.warnings, "border-shrunk", report.charts));
  unwrapped(test::icosphere(4), {.size = 32}, nullptr, &report);
  EXPECT_LT(report.border_texels, 1);
  EXPECT_TRUE(warns(report.warnings, "border-shrunk", report.charts));
}

TEST(Unwrap, SinglesShareRectangles) {
  const LayoutFacts facts = unwrapped(test::random_soup(2000, 7));
  EXPECT_EQ(facts.charts, 2000u);
  EXPECT_GT(facts.coverage, 0.6);  // Half rectangles alone could not reach 0.5.
  EXPECT_LT(facts.density_spread, 0.15);
}

TEST(Unwrap, VerticesSplitByTheFileArePairedByPosition) {
  const LayoutFacts facts =
      unwrapped(of({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, 0}, {0, 1, 0}, {-0.0f, 0, 0}},
                   {{0, 1, 2}, {3, 4, 5}}));
  EXPECT_EQ(facts.charts, 1u);
}

TEST(Unwrap, TrianglesOfOppositeOrientationAreNotPaired) {
  const LayoutFacts flipped =
      unwrapped(of({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 3, 2}}));
  EXPECT_EQ(flipped.charts, 2u);
}

TEST(Unwrap, FanOfManyTrianglesAtOneEdge) {
  Mesh mesh = of({{0, 0, 0}, {0, 0, 1}}, {});
  for (std::uint32_t i = 0; i < 100; ++i) {
    const double angle = 0.0628 * i;
    mesh.positions.push_back(
        {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0.5f});
    mesh.triangles.push_back(i % 2 ? Triangle{0, 1, i + 2} : Triangle{1, 0, i + 2});
  }
  EXPECT_EQ(unwrapped(mesh).charts, 50u);
}

TEST(Unwrap, DegenerateTrianglesCoverNothingAndAreCounted) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  UnwrapReport report;
  const LayoutFacts facts = unwrapped(of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}, {nan, 0, 0}},
                                         {{0, 1, 3}, {0, 1, 2}, {0, 0, 2}, {0, 1, 4}}),
                                      {}, nullptr, &report);
  EXPECT_EQ(facts.collapsed, 3u);
  EXPECT_EQ(facts.charts, 1u);
  EXPECT_TRUE(warns(report.warnings, "degenerate-triangles", 3));
}

TEST(Unwrap, VeryUnequalTrianglesKeepATexelEach) {
  Mesh mesh = test::icosphere(2);
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(),
                        {{0, 0, 0}, {1e4f, 0, 0}, {0, 1e4f, 0}, {1, 1e-6f, 0}});
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 1, first + 3});  // A needle, 1e10 times as long as wide.
  EXPECT_EQ(unwrapped(mesh).collapsed, 0u);
}

TEST(Unwrap, SquaresAreAllAlike) {
  Mesh fan = test::plane(5, 3, 3, 0.2);  // far from square, and with a triangle left over
  fan.triangles.pop_back();
  fan.uv_triangles.pop_back();
  fan.normals.clear();
  fan.normal_triangles.clear();
  for (const Mesh& mesh : {test::plane(8, 8), fan, test::tetrahedron(), test::torus(20, 9)}) {
    for (const std::uint32_t size : {256U, 1000U}) {
      Mesh out;
      UnwrapReport report;
      unwrapped(mesh, {.method = UnwrapMethod::squares, .size = size}, &out, &report);
      // Rows and columns of squares, each with its border of 2 texels.
      const std::size_t squares = (mesh.triangles.size() + 1) / 2;
      EXPECT_EQ(report.charts, squares) << mesh.name;
      const auto across = static_cast<std::uint32_t>(std::ceil(std::sqrt(squares)));
      const double leg = size / across - 2;
      for (const Triangle& t : out.uv_triangles) {
        double u[2] = {1, 0}, v[2] = {1, 0};
        for (const std::uint32_t corner : t) {
          u[0] = std::min<double>(u[0], out.uvs[corner].x);
          u[1] = std::max<double>(u[1], out.uvs[corner].x);
          v[0] = std::min<double>(v[0], out.uvs[corner].y);
          v[1] = std::max<double>(v[1], out.uvs[corner].y);
        }
        ASSERT_NEAR((u[1] - u[0]) * size, leg, 1e-3) << mesh.name;
        ASSERT_NEAR((v[1] - v[0]) * size, leg, 1e-3) << mesh.name;
      }
      EXPECT_NEAR(report.coverage * size * size,
                  0.5 * leg * leg * static_cast<double>(mesh.triangles.size()), 1e-3);
    }
  }
}

TEST(Unwrap, AnyScaleGivesTheSameLayout) {
  const Mesh mesh = test::icosphere(2);
  const Mesh expected = unwrap(mesh, {.method = UnwrapMethod::pairs});
  for (const float scale : {0x1p-100f, 0x1p+100f}) {
    Mesh scaled = mesh;
    for (Vec3& p : scaled.positions) p = {p.x * scale, p.y * scale, p.z * scale};
    Mesh out;
    unwrapped(scaled, {}, &out);
    EXPECT_EQ(out.uvs, expected.uvs) << scale;
  }
}

TEST(Unwrap, KeepsEverythingButTheUvs) {
  Mesh mesh = test::torus(12, 8);
  mesh.origin = {1e6, 0, -5};
  mesh.groups.assign(mesh.triangles.size(), 0);
  mesh.group_names = {"ring"};
  const Mesh out = unwrap(mesh, {.method = UnwrapMethod::pairs});
  EXPECT_EQ(out.origin, mesh.origin);
  EXPECT_EQ(out.normals, mesh.normals);
  EXPECT_EQ(out.groups, mesh.groups);
  EXPECT_NE(out.uvs, mesh.uvs);
}

TEST(Unwrap, RefusesWhatItCannotDo) {
  const Mesh mesh = test::tetrahedron();
  const auto code = [](const Mesh& m, const UnwrapOptions& options) {
    try {
      unwrap(m, options);
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::internal;
  };
  EXPECT_EQ(code(mesh, {.size = 8}), ErrorCode::usage);
  EXPECT_EQ(code(mesh, {.size = 70000}), ErrorCode::usage);
  EXPECT_EQ(code(mesh, {.border_texels = 0}), ErrorCode::usage);
  EXPECT_EQ(code(mesh, {.size = 64, .border_texels = 17}), ErrorCode::usage);
  EXPECT_EQ(code(of({}, {}), {}), ErrorCode::input);
  EXPECT_EQ(code(of({{0, 0, 0}}, {{0, 0, 0}}), {}), ErrorCode::input);
  EXPECT_EQ(code(of({{0, 0, 0}}, {{0, 0, 9}}), {}), ErrorCode::input);
}

TEST(Unwrap, Bunny) {
  KILN_REQUIRE_DATA("bunny_low.obj");
  Mesh low = load_mesh(*test::shared_data("bunny_low.obj"));
  const LayoutFacts facts = unwrapped(low);
  EXPECT_EQ(facts.collapsed, 0u);
  EXPECT_GT(facts.coverage, 0.75);
  EXPECT_LT(facts.density_spread, 0.45);
  EXPECT_LT(facts.charts, low.triangles.size() * 11 / 20);
}

TEST(Packing, RefusesWhatDoesNotFit) {
  std::vector<PackPlace> places;
  EXPECT_TRUE(pack_rectangles(std::vector<PackSize>{{4, 4}, {4, 4}, {4, 4}, {4, 4}}, 8, places));
  EXPECT_FALSE(pack_rectangles(std::vector<PackSize>{{4, 4}, {4, 4}, {4, 4}, {4, 5}}, 8, places));
  EXPECT_FALSE(pack_rectangles(std::vector<PackSize>{{9, 1}}, 8, places));
  // Only the skyline fills the space beside the high one.
  EXPECT_TRUE(pack_rectangles(std::vector<PackSize>{{8, 4}, {4, 4}, {4, 2}, {4, 2}}, 8, places));
}

TEST(Pairing, PathsLeaveAlmostNoTriangleSingle) {
  // Each closed triangle mesh has a perfect pairing (Petersen 1891). Greedy choice alone leaves 178
  // of the 5,000 single.
  const Mesh mesh = test::BumpySphere::dense(5000);
  std::vector<TriangleShape> shapes;
  for (const Triangle& t : mesh.triangles) {
    shapes.push_back(
        triangle_shape(mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]));
  }
  const Pairing pairing = pair_triangles(mesh.positions, mesh.triangles, shapes);
  std::uint64_t paired = 0;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t other = pairing.partner[t];
    if (other == kNoIndex) continue;
    ++paired;
    ASSERT_EQ(pairing.partner[other], t);
    // The two run along the shared edge in opposite senses.
    const Triangle &a = mesh.triangles[t], &b = mesh.triangles[other];
    EXPECT_EQ(a[(pairing.apex[t] + 1) % 3], b[(pairing.apex[other] + 2) % 3]);
    EXPECT_EQ(a[(pairing.apex[t] + 2) % 3], b[(pairing.apex[other] + 1) % 3]);
  }
  EXPECT_EQ(paired, 2 * pairing.pairs);
  EXPECT_GE(paired, mesh.triangles.size() * 99 / 100);
}

}  // namespace
}  // namespace kiln
