// Points that stretch a mesh's box, and coordinates too coarse for its edges.
#include "mesh/steps.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "mesh/usable.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using Places = std::vector<Vec3d>;

/// A grid of cells of a side, wavy, in a place of the world.
struct Grid {
  Mesh mesh = test::plane(20, 20);
  Places places;

  Grid(double side, const Vec3d& at, bool in_floats) {
    for (const Vec3& p : mesh.positions) {
      const double x = (p.x + 0.5) * 20, y = (p.y + 0.5) * 20;
      Vec3d place{at.x + x * side * 1.07, at.y + y * side * 1.03, at.z + side * std::sin(x * y)};
      if (in_floats) place = to_double(to_float(place));
      places.push_back(place);
    }
  }

  std::string stored() const {
    const auto place = [&](std::uint32_t v) { return places[v]; };
    const FloatGrid grid(mesh.triangles, place);
    return coarse_steps({mesh.triangles, [](std::size_t) { return true; }, place,
                         [&](std::uint32_t v) { return grid.step(place(v)); }},
                        "stored");
  }
};

TEST(Steps, TellsFloatsFromDoubles) {
  const Vec3d utm{500000.3, 4500000.3, 300};
  const std::string coarse = Grid(0.8, utm, true).stored();
  // Between 2^22 and 2^23 floats are half a unit apart.
  EXPECT_NE(coarse.find("stored in steps of 0.5"), std::string::npos) << coarse;
  EXPECT_NE(coarse.find("near 45000"), std::string::npos) << coarse;
  EXPECT_NE(coarse.find("double precision"), std::string::npos) << coarse;
  EXPECT_EQ(Grid(0.8, utm, false).stored(), "");
  EXPECT_EQ(Grid(0.8, {0, 0, 0}, true).stored(), "");
  // 256 steps of a half are 128 units; edges are 1 to 2 sides long.
  EXPECT_NE(Grid(60, utm, true).stored(), "");
  EXPECT_EQ(Grid(200, utm, true).stored(), "");
}

TEST(Steps, TakesNoGridForRounding) {
  // Whole metres, and middles of cells of a metre: floats hold them exactly.
  for (const double middle : {0.0, 0.5}) {
    Grid grid(1, {0, 0, 0}, false);
    for (std::size_t i = 0; i < grid.places.size(); ++i) {
      grid.places[i] = {500000 + double(i % 21) + middle, 4500000 + double(i / 21) + middle,
                        300 + std::sin(double(i))};
    }
    EXPECT_EQ(grid.stored(), "") << middle;
  }
}

TEST(Steps, TextOfNineDigitsHoldsFloats) {
  Grid grid(0.8, {500000.3, 4500000.3, 300}, true);
  for (Vec3d& p : grid.places) {
    const auto text = [](double x) {
      char digits[32];
      std::snprintf(digits, sizeof digits, "%.9g", x);
      return std::stod(digits);
    };
    p = {text(p.x), text(p.y), text(p.z)};
  }
  EXPECT_NE(grid.stored().find("steps of 0.5"), std::string::npos) << grid.stored();
}

/// A wavy sheet of side 1 and 800 triangles around 0, and one triangle that reaches far out.
Mesh with_outlier(float far) {
  Mesh mesh = test::plane(20, 20);
  for (Vec3& p : mesh.positions) p.z = 0.02F * std::sin(17 * p.x) * std::cos(13 * p.y);
  mesh.positions.push_back({far, 0.25F, 0.5F});
  mesh.triangles.push_back({0, 1, 441});
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  return mesh;
}

TEST(Steps, NamesWhatStretchesTheFrame) {
  // Edges are 0.05 long: 256 steps of 2^-25 of the frame from a diagonal of 6,500 on.
  for (const float far : {2e4F, 1e20F}) {
    const Mesh mesh = with_outlier(far);
    const std::string coarse = coarse_steps(mesh, Frame::of(mesh));
    EXPECT_NE(coarse.find("Vertex 441 at ("), std::string::npos) << far << ": " << coarse;
    EXPECT_NE(coarse.find("rounded in steps of"), std::string::npos) << coarse;
  }
  for (const float far : {1e6F, 1e7F}) {  // These do not set the frame.
    const Mesh mesh = with_outlier(far);
    const std::string stretched = coarse_steps(mesh, Frame::of(mesh));
    EXPECT_NE(stretched.find("Vertex 441 at ("), std::string::npos) << far << ": " << stretched;
    EXPECT_EQ(stretched.find("rounded in steps of"), std::string::npos) << stretched;
  }
  for (const float far : {1.0F, 1000.0F}) {
    const Mesh mesh = with_outlier(far);
    EXPECT_EQ(coarse_steps(mesh, Frame::of(mesh)), "") << far;
  }
}

TEST(Steps, NamesWhatStretchesTheBox) {
  const auto stretched = [](float far) {
    const Mesh mesh = with_outlier(far);
    return describe_stretched_box({mesh.triangles,
                                   [](std::size_t) { return true; },
                                   [&](std::uint32_t v) { return to_double(mesh.positions[v]); },
                                   {}});
  };
  for (const float far : {1e6F, 1e7F, 1e20F}) {
    const std::string text = stretched(far);
    EXPECT_NE(text.find("Vertex 441 at ("), std::string::npos) << text;
    EXPECT_NE(text.find("move or remove it"), std::string::npos) << text;
  }
  // Three quarters of the sheet's vertices lie within 0.57 of its middle.
  for (const float far : {1.0F, 1000.0F, 50000.0F}) EXPECT_EQ(stretched(far), "") << far;
}

TEST(Steps, OrdinaryMeshesAreFine) {
  for (Mesh mesh : {test::icosphere(6), test::cube(), test::torus(64, 32), test::plane(1, 1)}) {
    for (const double scale : {1e-30, 1.0, 1e30}) {
      Mesh moved = mesh;
      for (Vec3& p : moved.positions) p = to_float(to_double(p) * scale);
      EXPECT_EQ(coarse_steps(moved, Frame::of(moved)), "") << mesh.name << scale;
    }
    // A low poly in the frame of a much larger high poly.
    EXPECT_EQ(coarse_steps(mesh, Frame::of(mesh, {{-50, -50, -50}, {50, 50, 50}})), "");
  }
}

TEST(Frame, LeavesOutWhatStretchesTheBox) {
  Mesh sheet = with_outlier(1);
  sheet.triangles.pop_back();
  const Frame expected = Frame::of(sheet);
  for (const float far : {-1e6F, 1e6F, 1e10F}) {
    const Mesh mesh = with_outlier(far);
    const Frame frame = Frame::of(mesh);
    EXPECT_EQ(frame.center, expected.center) << far;
    EXPECT_EQ(frame.diagonal, expected.diagonal) << far;
    const std::vector<Vec3> places = frame.to_frame(mesh), without = expected.to_frame(sheet);
    for (std::size_t i = 0; i < 441; ++i) EXPECT_EQ(places[i], without[i]) << i;
    EXPECT_TRUE(std::isfinite(places[441].x));
  }
  // A box all the same where it may be meant, and where squares of its size are beyond single precision.
  for (const float far : {50000.0F, 1e20F}) {
    EXPECT_GE(Frame::of(with_outlier(far)).diagonal, double{far}) << far;
  }
}

TEST(Frame, IsThatOfTrianglesWithArea) {
  const Mesh plain = test::icosphere(3);
  const Frame expected = Frame::of(plain);
  const std::vector<Vec3> places = expected.to_frame(plain);
  Mesh mesh = plain;
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  // Far out: a vertex that nothing uses, and corners on a line, which rounding takes off it.
  mesh.positions.insert(
      mesh.positions.end(),
      {{1e7F, 3e6F, -7}, {1e7F, 1e6F, 3e6F}, {2e7F, 2e6F, 6e6F}, {4e7F, 4e6F, 12e6F}});
  mesh.triangles.push_back({first + 1, first + 2, first + 3});
  mesh.triangles.push_back({0, 0, first + 1});
  ASSERT_EQ(count_without_area(mesh.positions, mesh.triangles), 2U);
  const Frame frame = Frame::of(mesh);
  EXPECT_EQ(frame.center, expected.center);
  EXPECT_EQ(frame.scale, expected.scale);
  EXPECT_EQ(frame.diagonal, expected.diagonal);
  const std::vector<Vec3> moved = frame.to_frame(mesh);
  for (std::size_t i = 0; i < first; ++i) EXPECT_EQ(moved[i], places[i]);
  for (std::size_t i = first; i < moved.size(); ++i) EXPECT_TRUE(std::isnan(moved[i].x)) << i;
  EXPECT_EQ(count_without_area(moved, mesh.triangles), 2U);
}

TEST(Area, IsNoneWithinRounding) {
  const Vec3d far{500000.3, 4500000.3, 300.1}, step{0.1, 0.7, 0.3};
  EXPECT_FALSE(has_area(far, far + step, far + step * 3.0));
  EXPECT_FALSE(has_area({}, {0.1, 0.3, 0}, {0.2, 0.6, 0}));
  EXPECT_FALSE(has_area(far, far, far + step));
  EXPECT_FALSE(has_area({NAN, 0, 0}, {1, 0, 0}, {0, 1, 0}));
  EXPECT_TRUE(has_area(far, far + step, far + step * 3.0 + Vec3d{0, 0, 1e-7}));
  for (const double scale : {1e-200, 1.0, 1e200}) {
    EXPECT_TRUE(has_area(Vec3d{0, 0, 0}, Vec3d{scale, 0, 0}, Vec3d{0, scale, 0})) << scale;
    EXPECT_TRUE(has_area(Vec3d{0, 0, 0}, Vec3d{scale, 0, 0}, Vec3d{0, scale * 1e-9, 0})) << scale;
  }
}

TEST(LocalOrigin, IsNearTheMiddleOfWhatIsFar) {
  using Place = std::array<double, 3>;
  EXPECT_EQ(local_origin({10, -12, 15.9}, 1), Place{});
  EXPECT_EQ(local_origin({500000.7, 4500000.7, 300.1}, 1.15), (Place{500000, 4500000, 300}));
  // The same for boxes that differ a little.
  EXPECT_EQ(local_origin({500000.6, 4500000.6, 300.05}, 1.2), (Place{500000, 4500000, 300}));
  EXPECT_EQ(local_origin({1e30, 0, 0}, 0), Place{});
}

}  // namespace
}  // namespace kiln
