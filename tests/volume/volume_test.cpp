// The full-resolution contour: closed, oriented, of the right topology, and where the surface is.
#include "kiln/volume.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "kiln/contour.h"
#include "support/environment.h"
#include "support/volumes.h"
#include "volume/fine_surface.h"

namespace kiln {
namespace {

using test::make_float_volume;
using test::Topology;
using test::topology;

constexpr double kPi = std::numbers::pi;

Volume sphere(std::uint32_t side, double radius) {
  const double c = (side - 1) / 2.0;
  return make_float_volume({side, side, side}, [=](double x, double y, double z) {
    return test::sphere_field(x - c, y - c, z - c, radius);
  });
}

TEST(Contour, SphereIsClosedAndInItsPlace) {
  KILN_REQUIRE_DEVICE();
  ContourReport report;
  const Mesh mesh = contour(*test::device(), sphere(40, 15.3), {}, &report);
  const Topology t = topology(mesh);
  EXPECT_TRUE(t.is_closed_manifold());
  EXPECT_EQ(t.euler, 2);
  EXPECT_EQ(t.parts, 1U);
  EXPECT_EQ(report.quads * 2, mesh.triangles.size());
  EXPECT_EQ(report.vertices, mesh.positions.size());
  EXPECT_NEAR(test::enclosed_volume(mesh), 4.0 / 3 * kPi * std::pow(15.3, 3), 80);
  const double c = 19.5;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Vec3& p = mesh.positions[i];
    const double r = std::hypot(p.x - c, p.y - c, p.z - c);
    EXPECT_NEAR(r, 15.3, 0.02);
    const Vec3& n = mesh.normals[i];
    EXPECT_NEAR(std::hypot(n.x, n.y, n.z), 1, 1e-6);
    EXPECT_GT((n.x * (p.x - c) + n.y * (p.y - c) + n.z * (p.z - c)) / r, std::cos(0.02));
  }
}

TEST(Contour, TorusHasAHole) {
  KILN_REQUIRE_DEVICE();
  const Volume volume = make_float_volume({70, 30, 67}, [](double x, double y, double z) {
    return test::torus_field(x - 34.1, y - 14.7, z - 33.2, 22, 7.5);
  });
  const Topology t = topology(contour(*test::device(), volume));
  EXPECT_TRUE(t.is_closed_manifold());
  EXPECT_EQ(t.euler, 0);
  EXPECT_EQ(t.parts, 1U);
}

TEST(Contour, NoiseIsClosedManifold) {
  // Every ambiguous case, everywhere; and words of 64 voxels that end in all ways.
  KILN_REQUIRE_DEVICE();
  std::mt19937 random(7);
  for (const std::array<std::uint32_t, 3> size : {std::array{16U, 15U, 17U},
                                                  {62U, 9U, 8U},
                                                  {63U, 9U, 8U},
                                                  {64U, 5U, 8U},
                                                  {65U, 9U, 4U},
                                                  {130U, 7U, 6U},
                                                  {2U, 2U, 2U},
                                                  {2U, 30U, 3U}}) {
    const Volume volume = make_float_volume(
        size, [&](double, double, double) { return static_cast<int>(random() % 2001) - 1000; });
    for (const Inside inside : {Inside::above, Inside::below}) {
      ContourOptions options;
      options.iso = 0.5;
      options.inside = inside;
      const Mesh mesh = contour(*test::device(), volume, options);
      const Topology t = topology(mesh);
      EXPECT_EQ(t.border_edges, 0U);
      EXPECT_EQ(t.inconsistent_edges, 0U);
      EXPECT_EQ(t.crowded_edges, 0U);
      EXPECT_EQ(t.pinched_vertices, 0U);
      EXPECT_EQ(t.degenerate, 0U);
      EXPECT_GT(test::enclosed_volume(mesh), 0);
    }
  }
}

TEST(Contour, VerticesStayInTheirCells) {
  KILN_REQUIRE_DEVICE();
  std::mt19937 random(8);
  const Volume volume = make_float_volume(
      {20, 20, 20}, [&](double, double, double) { return static_cast<int>(random() % 7) - 3; });
  ContourReport report;
  const FineSurface surface = fine_surface(context_of(*test::device()), volume, {}, true, report);
  for (std::size_t i = 0; i < surface.keys.size(); ++i) {
    const CellPlace cell = unpack_cell_place(surface.keys[i]);
    for (std::size_t k = 0; k < 3; ++k) {
      const double local = surface.vertices[i].position[k] - (double{cell[k] * 1.0} - 1);
      ASSERT_GE(local, 0);
      ASSERT_LE(local, 1);
    }
  }
}

TEST(Contour, BoxHasSharpEdges) {
  // Faces between voxels, where the field is exact: vertices on faces, edges and corners alike.
  KILN_REQUIRE_DEVICE();
  const Volume volume = make_float_volume({24, 24, 24}, [](double x, double y, double z) {
    return test::box_field(x - 11.5, y - 11.5, z - 11.5, 6.2, 7.3, 5.1);
  });
  const Mesh mesh = contour(*test::device(), volume);
  EXPECT_TRUE(topology(mesh).is_closed_manifold());
  double worst = 0;
  for (const Vec3& p : mesh.positions) {
    worst = std::max(worst,
                     std::abs(test::box_field(p.x - 11.5, p.y - 11.5, p.z - 11.5, 6.2, 7.3, 5.1)));
  }
  RecordProperty("worst", std::to_string(worst));
  EXPECT_LT(worst, 0.35);
}

TEST(Contour, CutOffFlatAtAClosedBorder) {
  KILN_REQUIRE_DEVICE();
  // A slanted half space: the solid is a prism with corners of the volume.
  const Volume volume = make_float_volume(
      {12, 10, 9}, [](double x, double y, double z) { return 8.3 - x - 0.4 * y - 0.2 * z; });
  const Mesh mesh = contour(*test::device(), volume);
  const Topology t = topology(mesh);
  EXPECT_TRUE(t.is_closed_manifold());
  EXPECT_EQ(t.euler, 2);
  // 8.3 - 0.4 y - 0.2 z integrated over 9 x 8; edges are one cell wide, so nearly so.
  EXPECT_NEAR(test::enclosed_volume(mesh), 8.3 * 72 - 0.4 * 0.5 * 81 * 8 - 0.2 * 0.5 * 64 * 9, 6);
  for (const Vec3& p : mesh.positions) {
    EXPECT_GE(p.x, -1e-5);
    EXPECT_GE(p.y, -1e-5);
    EXPECT_GE(p.z, -1e-5);
    EXPECT_LE(p.y, 9 + 1e-5);
    EXPECT_LE(p.z, 8 + 1e-5);
  }
}

TEST(Contour, EndsAtAnOpenBorder) {
  KILN_REQUIRE_DEVICE();
  const Volume volume = make_float_volume(
      {12, 10, 9}, [](double x, double y, double z) { return 8.3 - x - 0.4 * y - 0.2 * z; });
  ContourOptions options;
  options.border = VolumeBorder::open;
  const Mesh mesh = contour(*test::device(), volume, options);
  const Topology t = topology(mesh);
  EXPECT_GT(t.border_edges, 0U);
  EXPECT_EQ(t.inconsistent_edges, 0U);
  EXPECT_EQ(t.crowded_edges, 0U);
  EXPECT_EQ(t.pinched_vertices, 0U);
  EXPECT_EQ(t.euler, 1);  // a disk
  for (const Vec3& p : mesh.positions) {
    EXPECT_NEAR(8.3 - p.x - 0.4 * p.y - 0.2 * p.z, 0, 1e-4);
  }
}

TEST(Contour, BelowIsAboveTurnedInsideOut) {
  KILN_REQUIRE_DEVICE();
  const Volume volume = sphere(20, 7.2);
  ContourOptions options;
  options.border = VolumeBorder::open;
  const Mesh above = contour(*test::device(), volume, options);
  options.inside = Inside::below;
  const Mesh below = contour(*test::device(), volume, options);
  ASSERT_EQ(above.positions, below.positions);
  EXPECT_NEAR(test::enclosed_volume(above), -test::enclosed_volume(below), 1e-2);
  for (std::size_t i = 0; i < above.normals.size(); ++i) {
    EXPECT_EQ(above.normals[i].x, -below.normals[i].x);
  }
}

template <typename T>
class ContourTypes : public ::testing::Test {};

template <typename T>
constexpr VoxelType voxel_type() {
  if constexpr (std::is_same_v<T, std::uint8_t>) return VoxelType::u8;
  if constexpr (std::is_same_v<T, std::int8_t>) return VoxelType::i8;
  if constexpr (std::is_same_v<T, std::uint16_t>) return VoxelType::u16;
  if constexpr (std::is_same_v<T, std::int16_t>) return VoxelType::i16;
  if constexpr (std::is_same_v<T, std::uint32_t>) return VoxelType::u32;
  if constexpr (std::is_same_v<T, std::int32_t>) return VoxelType::i32;
  if constexpr (std::is_same_v<T, double>) return VoxelType::f64;
  return VoxelType::f32;
}

using Types = ::testing::Types<std::uint8_t, std::int8_t, std::uint16_t, std::int16_t,
                               std::uint32_t, std::int32_t, float, double>;
TYPED_TEST_SUITE(ContourTypes, Types);

TYPED_TEST(ContourTypes, GiveTheSameMesh) {
  KILN_REQUIRE_DEVICE();
  const auto field = [](double x, double y, double z) {
    return std::floor(60 + 4 * test::sphere_field(x - 9.2, y - 8.9, z - 10.1, 6));
  };
  ContourOptions options;
  options.iso = 61.5;
  const Mesh expected = contour(*test::device(), make_float_volume({20, 19, 21}, field), options);
  const Mesh mesh =
      contour(*test::device(),
              test::make_volume<TypeParam>({20, 19, 21}, voxel_type<TypeParam>(), field), options);
  ASSERT_EQ(mesh.triangles.size(), expected.triangles.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    EXPECT_NEAR(mesh.positions[i].x, expected.positions[i].x, 1e-5);
    EXPECT_NEAR(mesh.positions[i].y, expected.positions[i].y, 1e-5);
    EXPECT_NEAR(mesh.positions[i].z, expected.positions[i].z, 1e-5);
  }
}

TEST(Contour, LargeIntegersAreNotRounded) {
  KILN_REQUIRE_DEVICE();
  const auto field = [](double x, double, double) { return 4.0e9 + 10 * x; };
  ContourOptions options;
  options.iso = 4.0e9 + 35;
  options.border = VolumeBorder::open;
  const Mesh mesh = contour(
      *test::device(), test::make_volume<std::uint32_t>({8, 4, 4}, VoxelType::u32, field), options);
  for (const Vec3& p : mesh.positions) EXPECT_NEAR(p.x, 3.5, 1e-6);
}

TEST(Contour, SlabsGiveTheSameBytes) {
  KILN_REQUIRE_DEVICE();
  const Volume smooth = make_float_volume(
      {33, 30, 41}, [](double x, double y, double z) { return test::gyroid_field(x, y, z, 13.7); });
  // Creases along z, near each other: what tells them from bends looks three voxels far.
  const Volume folded = make_float_volume({33, 30, 41}, [](double x, double y, double z) {
    const double fold = std::fmod(z + 0.37 * x + 0.21 * y, 7.3) - 3.65;
    return 1.4 - std::abs(fold) + 0.02 * std::sin(0.9 * x) * std::sin(0.8 * y + 0.7 * z);
  });
  auto& context = context_of(*test::device());
  for (const Volume* volume : {&smooth, &folded}) {
    ContourReport report;
    const FineSurface whole = fine_surface(context, *volume, {}, true, report);
    for (const std::size_t planes : {4U, 5U, 9U, 10U, 17U, 40U}) {
      const FineSurface parts =
          fine_surface(context, *volume, {}, true, report, planes * 33 * 30 * sizeof(float));
      ASSERT_EQ(whole.keys, parts.keys);
      EXPECT_EQ(std::memcmp(whole.vertices.data(), parts.vertices.data(),
                            whole.vertices.size() * sizeof(kiln_volume_vertex)),
                0);
    }
  }
}

TEST(Contour, AxesCarryToTheWorld) {
  KILN_REQUIRE_DEVICE();
  for (const double mirror : {1.0, -1.0}) {
    Volume volume = sphere(24, 8.6);
    volume.origin = {1e6, -2, 3};
    volume.axes = {{{0.5, 0.1, 0}, {0, 2 * mirror, 0}, {0, 0.3, 1}}};
    const Mesh mesh = contour(*test::device(), volume);
    EXPECT_TRUE(topology(mesh).is_closed_manifold());
    EXPECT_EQ(mesh.origin, volume.origin);
    EXPECT_NEAR(test::enclosed_volume(mesh), 4.0 / 3 * kPi * std::pow(8.6, 3), 30);  // |det| = 1
    // Normals are those of the ellipsoid: along the inverse transpose times the index-space one, so
    // at right angles to the triangles.
    double worst = 1;
    for (const Triangle& t : mesh.triangles) {
      const auto at = [&](std::size_t k) { return mesh.positions[t[k]]; };
      const Vec3 a = at(0), b = at(1), c = at(2);
      const double e[3] = {double{b.x} - a.x, double{b.y} - a.y, double{b.z} - a.z};
      const double f[3] = {double{c.x} - a.x, double{c.y} - a.y, double{c.z} - a.z};
      const double n[3] = {e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2],
                           e[0] * f[1] - e[1] * f[0]};
      const double length = std::hypot(n[0], n[1], n[2]);
      if (length < 0.05) continue;
      const Vec3 m = mesh.normals[t[0]];
      worst = std::min(worst, (n[0] * m.x + n[1] * m.y + n[2] * m.z) / length);
    }
    EXPECT_GT(worst, 0.9);
  }
}

TEST(Contour, TinyAndHugeFieldsHaveNormals) {
  KILN_REQUIRE_DEVICE();
  for (const double scale : {1e-30, 1e30}) {
    const Volume volume = make_float_volume({16, 16, 16}, [=](double x, double y, double z) {
      return scale * test::sphere_field(x - 7.5, y - 7.5, z - 7.5, 5.2);
    });
    const Mesh mesh = contour(*test::device(), volume);
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      const Vec3 &p = mesh.positions[i], &n = mesh.normals[i];
      EXPECT_GT(n.x * (p.x - 7.5) + n.y * (p.y - 7.5) + n.z * (p.z - 7.5), 0.9 * 5);
    }
  }
}

std::string message_of(const Volume& volume, const ContourOptions& options, ErrorCode code) {
  try {
    contour(*test::device(), volume, options);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code);
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

TEST(Contour, SaysWhatIsWrong) {
  KILN_REQUIRE_DEVICE();
  const Volume volume = test::make_volume<std::uint8_t>(
      {8, 8, 8}, VoxelType::u8, [](double x, double, double) { return 10 + 20 * x; });
  for (const double iso : {9.0, 10.0, 151.0, 1e9}) {
    const std::string message = message_of(volume, {.iso = iso}, ErrorCode::input);
    EXPECT_NE(message.find("between 10 and 150"), std::string::npos) << message;
  }
  EXPECT_NE(message_of(volume, {.iso = std::nan("")}, ErrorCode::usage).find("finite"),
            std::string::npos);
  const Volume flat = test::make_volume<std::uint16_t>({8, 8, 8}, VoxelType::u16,
                                                       [](double, double, double) { return 300; });
  EXPECT_NE(message_of(flat, {.iso = 300}, ErrorCode::input).find("constant: every voxel is 300"),
            std::string::npos);
  Volume thin = volume;
  thin.size = {8, 64, 1};
  EXPECT_NE(message_of(thin, {.iso = 50}, ErrorCode::input).find("8 x 64 x 1"), std::string::npos);
  Volume cut = volume;
  cut.voxels.pop_back();
  EXPECT_NE(message_of(cut, {.iso = 50}, ErrorCode::input).find("511 bytes"), std::string::npos);
  Volume level = volume;
  level.axes[2] = level.axes[1];
  EXPECT_NE(message_of(level, {.iso = 50}, ErrorCode::input).find("axes"), std::string::npos);
  const Volume nothing =
      make_float_volume({4, 4, 4}, [](double, double, double) { return std::nan(""); });
  EXPECT_NE(message_of(nothing, {.iso = 50}, ErrorCode::input).find("no finite voxel"),
            std::string::npos);
}

TEST(Contour, VoxelsThatAreNotFiniteAreOutside) {
  KILN_REQUIRE_DEVICE();
  Volume volume = sphere(20, 7.2);
  auto* values = reinterpret_cast<float*>(volume.voxels.data());
  const auto at = [](int x, int y, int z) { return (z * 20 + y) * 20 + x; };
  values[at(9, 9, 9)] = std::nanf("");
  values[at(9, 9, 16)] = std::numeric_limits<float>::infinity();
  values[at(9, 4, 9)] = -std::numeric_limits<float>::infinity();
  for (const Inside inside : {Inside::above, Inside::below}) {
    ContourReport report;
    const Mesh mesh = contour(*test::device(), volume, {.inside = inside}, &report);
    const Topology t = topology(mesh);
    EXPECT_TRUE(t.is_closed_manifold());
    ASSERT_EQ(report.warnings.size(), 1U);
    EXPECT_EQ(report.warnings[0].code, "non-finite-voxels");
    EXPECT_EQ(report.warnings[0].count, 3U);
    for (const Vec3& p : mesh.positions) EXPECT_TRUE(std::isfinite(p.x + p.y + p.z));
    for (const Vec3& n : mesh.normals) EXPECT_NEAR(std::hypot(n.x, n.y, n.z), 1, 1e-6);
  }
}

/// Infinite voxels on the solid's side are in it: a ball whose core is infinite is the ball.
TEST(Contour, InfiniteVoxelsOfTheSolidAreInside) {
  KILN_REQUIRE_DEVICE();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (const bool above : {true, false}) {
    const auto value = [&](double x, double y, double z, double core) {
      const double r = std::hypot(x - 9.5, y - 9.5, z - 9.5);
      return (r < core ? double{kInfinity} : 7.2 - r) * (above ? 1 : -1);
    };
    const ContourOptions options{.iso = 0, .inside = above ? Inside::above : Inside::below};
    const auto mesh_of = [&](double core, ContourReport* report) {
      const Volume volume = make_float_volume(
          {20, 20, 20}, [&](double x, double y, double z) { return value(x, y, z, core); });
      return contour(*test::device(), volume, options, report);
    };
    ContourReport report;
    // Four voxels below the surface no difference reaches the core: the same mesh.
    const Mesh whole = mesh_of(0, nullptr);
    const Mesh cored = mesh_of(3, &report);
    EXPECT_EQ(cored.triangles, whole.triangles);
    ASSERT_EQ(cored.positions.size(), whole.positions.size());
    EXPECT_EQ(cored.positions, whole.positions);
    ASSERT_EQ(report.warnings.size(), 1U);
    EXPECT_EQ(report.warnings[0].code, "non-finite-voxels");
    // Infinite up to the surface: it is a ball still, its surface between the voxels.
    const Mesh full = mesh_of(7.2, nullptr);
    EXPECT_TRUE(topology(full).is_closed_manifold());
    for (const Vec3& p : full.positions) {
      EXPECT_NEAR(std::hypot(p.x - 9.5, p.y - 9.5, p.z - 9.5), 7.2, 1.8);  // a voxel's diagonal
    }
  }
}

}  // namespace
}  // namespace kiln
