// Volumes that are extracted again and again, and that change: to the byte what a fresh extraction gives.
#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <vector>

#include "kiln/contour.h"
#include "kiln/volume.h"
#include "support/environment.h"
#include "support/volumes.h"

namespace kiln {
namespace {

/// Empty where two results are the same to the byte, else what differs.
std::string difference(const ExtractResult& a, const ExtractResult& b) {
  const auto same = [](const auto& x, const auto& y) {
    return x.size() == y.size() &&
           (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof x[0]) == 0);
  };
  if (!same(a.mesh.positions, b.mesh.positions)) return "positions";
  if (!same(a.mesh.triangles, b.mesh.triangles)) return "triangles";
  if (!same(a.mesh.uvs, b.mesh.uvs)) return "uvs";
  if (!same(a.mesh.uv_triangles, b.mesh.uv_triangles)) return "uv triangles";
  if (!same(a.mesh.normals, b.mesh.normals)) return "normals";
  if (!same(a.normal_map.pixels, b.normal_map.pixels)) return "map";
  if (a.report.clusters != b.report.clusters) return "clusters";
  if (a.report.contour.quads != b.report.contour.quads) return "quads";
  if (a.report.contour.filled_voxels != b.report.contour.filled_voxels) return "filled voxels";
  if (a.report.warnings.size() != b.report.warnings.size()) return "warnings";
  return {};
}

/// Two crossed tori, with ripples; a size that is no multiple of anything.
double field(double x, double y, double z) {
  const double tori = std::max(test::torus_field(x - 23.2, y - 20.7, z - 26.1, 14.5, 4.2),
                               test::torus_field(y - 20.7, z - 26.1, x - 23.2, 12.5, 3.1));
  return tori + 0.4 * std::sin(0.9 * x) * std::sin(0.8 * y) * std::sin(0.7 * z);
}

constexpr std::array<std::uint32_t, 3> kSize = {47, 43, 53};

template <typename T>
Volume scene(VoxelType type, double scale, double shift) {
  return test::make_volume<T>(kSize, type, [=](double x, double y, double z) {
    const double value = shift + scale * field(x, y, z);
    return std::is_integral_v<T> ? std::clamp(value, 0.0, 255.0) : value;
  });
}

/// A ball of outside is cut out of the volume.
template <typename T>
std::vector<std::byte> crater(const Volume& volume, const VolumeRegion& region, double empty) {
  std::vector<T> values;
  const auto* from = reinterpret_cast<const T*>(volume.voxels.data());
  for (std::uint32_t z = 0; z < region.size[2]; ++z) {
    for (std::uint32_t y = 0; y < region.size[1]; ++y) {
      for (std::uint32_t x = 0; x < region.size[0]; ++x) {
        double r = 0;
        const std::uint32_t at[3] = {x, y, z};
        for (std::size_t k = 0; k < 3; ++k) {
          const double half = (region.size[k] - 1) / 2.0;
          r += (at[k] - half) * (at[k] - half) / (half * half + 0.01);
        }
        const std::size_t index =
            (std::size_t{region.first[2] + z} * volume.size[1] + region.first[1] + y) *
                volume.size[0] +
            region.first[0] + x;
        values.push_back(r < 1 ? static_cast<T>(empty) : from[index]);
      }
    }
  }
  std::vector<std::byte> bytes(values.size() * sizeof(T));
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

ExtractOptions small_map(std::uint32_t faces, const ContourOptions& contour = {}) {
  ExtractOptions options;
  options.contour = contour;
  options.faces = faces;
  options.size = 256;
  return options;
}

TEST(VolumeSession, EveryNumberOfFacesIsAFreshExtraction) {
  KILN_REQUIRE_DEVICE();
  const Volume volume = scene<float>(VoxelType::f32, 1, 0);
  const VolumeSession session(*test::device(), volume);
  for (const std::uint32_t faces : {2000U, 300U, 900U}) {
    const ExtractOptions options = small_map(faces);
    EXPECT_EQ(difference(session.extract(options), extract(*test::device(), volume, options)), "")
        << faces;
  }
  ExtractOptions options = small_map(0);
  options.error = 0.3;
  options.space = NormalMapSpace::object;
  EXPECT_EQ(difference(session.extract(options), extract(*test::device(), volume, options)), "");
}

/// Craters, one after another, with some kind of voxels and of contour.
template <typename T>
void check_craters(VoxelType type, double scale, double shift, double empty,
                   const ContourOptions& contour) {
  Volume volume = scene<T>(type, scale, shift);
  VolumeSession session(*test::device(), volume, contour);
  const ExtractOptions options = small_map(700, contour);
  // In the middle; at the volume's lower and upper ends; a single voxel; nothing new.
  const VolumeRegion regions[] = {{{9, 12, 20}, {13, 11, 12}}, {{18, 15, 0}, {10, 12, 14}},
                                  {{10, 3, 44}, {25, 30, 9}},  {{23, 7, 26}, {1, 1, 1}},
                                  {{23, 7, 26}, {1, 1, 1}},    {{0, 0, 0}, {47, 43, 2}}};
  std::uint64_t kept = 0;
  for (const VolumeRegion& region : regions) {
    session.update(region, crater<T>(session.volume(), region, empty));
    kept += session.last_update().kept;
    EXPECT_EQ(session.last_update().kept + session.last_update().vertices,
              session.extract(options).report.contour.vertices);
    EXPECT_EQ(
        difference(session.extract(options), extract(*test::device(), session.volume(), options)),
        "")
        << region.first[2];
  }
  EXPECT_GT(kept, 1000U);
}

TEST(VolumeSession, CratersAreFreshExtractions) {
  KILN_REQUIRE_DEVICE();
  check_craters<float>(VoxelType::f32, 1, 0, -4, {});
  check_craters<std::uint8_t>(VoxelType::u8, 12, 128, 0, {.iso = 128});
  check_craters<double>(VoxelType::f64, 1, 0, -4, {.iso = 0.1});
}

TEST(VolumeSession, CratersInAnOpenBorderBelowAndOutside) {
  KILN_REQUIRE_DEVICE();
  check_craters<float>(VoxelType::f32, 1, 0, -4, {.border = VolumeBorder::open});
  check_craters<float>(VoxelType::f32, -1, 0, 4, {.inside = Inside::below});
  // A hole lets the outside in: signs change far from the voxels.
  check_craters<float>(VoxelType::f32, 1, 0, -4, {.outer_only = true});
  check_craters<float>(VoxelType::f32, 1, 0, -4, {.outer_only = true, .outer_gap = 1});
}

TEST(VolumeSession, VoxelsThatAreNotFiniteFollowTheWholeVolume) {
  KILN_REQUIRE_DEVICE();
  Volume volume = scene<float>(VoxelType::f32, 1, 0);
  auto* voxels = reinterpret_cast<float*>(volume.voxels.data());
  std::mt19937 random(3);
  for (int i = 0; i < 40; ++i) voxels[random() % (47 * 43 * 53)] = std::nanf("");
  VolumeSession session(*test::device(), volume);
  // A new lowest voxel stands for them everywhere.
  const VolumeRegion region{{20, 20, 4}, {2, 2, 2}};
  const std::vector<float> low(8, -300.0F);
  session.update(region, std::as_bytes(std::span(low)));
  EXPECT_EQ(session.last_update().kept, 0U);
  const ExtractOptions options = small_map(900);
  EXPECT_EQ(
      difference(session.extract(options), extract(*test::device(), session.volume(), options)),
      "");
}

TEST(VolumeSession, RefusedChangesChangeNothing) {
  KILN_REQUIRE_DEVICE();
  const Volume volume = test::make_float_volume({20, 20, 20}, [](double x, double y, double z) {
    return test::sphere_field(x - 9.5, y - 9.5, z - 9.5, 6.3);
  });
  VolumeSession session(*test::device(), volume);
  const auto code = [&](const VolumeRegion& region, const std::vector<float>& values) {
    try {
      session.update(region, std::as_bytes(std::span(values)));
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::internal;
  };
  EXPECT_EQ(code({{19, 0, 0}, {2, 1, 1}}, {1, 1}), ErrorCode::usage);
  EXPECT_EQ(code({{0, 0, 20}, {1, 1, 1}}, {1}), ErrorCode::usage);
  EXPECT_EQ(code({{0, 0, 0}, {1, 0, 1}}, {}), ErrorCode::usage);
  EXPECT_EQ(code({{0, 0, 0}, {2, 1, 1}}, {1}), ErrorCode::usage);
  // Nothing of the surface would be left.
  EXPECT_EQ(code({{0, 0, 0}, {20, 20, 20}}, std::vector<float>(8000, -1.0F)), ErrorCode::input);
  EXPECT_EQ(session.volume().voxels, volume.voxels);
  const ExtractOptions options = small_map(200);
  EXPECT_EQ(difference(session.extract(options), extract(*test::device(), volume, options)), "");
  ExtractOptions other = options;
  other.contour.iso = 1;
  EXPECT_THROW(session.extract(other), Error);
}

}  // namespace
}  // namespace kiln
