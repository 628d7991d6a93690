// The outside that can be reached: against a search voxel by voxel, and the surfaces it leaves.
#include "volume/outer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "kiln/contour.h"
#include "kiln/error.h"
#include "kiln/limits.h"
#include "kiln/volume.h"
#include "support/environment.h"
#include "support/volumes.h"

namespace kiln {
namespace {

using test::make_float_volume;
using Size = std::array<std::uint32_t, 3>;

/// A volume of flags, searched the plain way.
struct Flags {
  Size size;
  std::vector<char> solid;

  std::size_t at(int x, int y, int z) const {
    return (std::size_t(z) * size[1] + std::size_t(y)) * size[0] + std::size_t(x);
  }
  bool within(int x, int y, int z) const {
    return x >= 0 && y >= 0 && z >= 0 && x < int(size[0]) && y < int(size[1]) && z < int(size[2]);
  }
  template <typename Visit>
  void for_all(const Visit& visit) const {
    for (int z = 0; z < int(size[2]); ++z) {
      for (int y = 0; y < int(size[1]); ++y) {
        for (int x = 0; x < int(size[0]); ++x) visit(x, y, z);
      }
    }
  }
  /// True if any voxel of the cube around a voxel is set.
  Flags dilated(int radius) const {
    Flags result{size, std::vector<char>(solid.size())};
    for_all([&](int x, int y, int z) {
      if (solid[at(x, y, z)] == 0) return;
      for (int c = z - radius; c <= z + radius; ++c) {
        for (int b = y - radius; b <= y + radius; ++b) {
          for (int a = x - radius; a <= x + radius; ++a) {
            if (within(a, b, c)) result.solid[at(a, b, c)] = 1;
          }
        }
      }
    });
    return result;
  }
  /// The voxels that are not set and reached from without.
  Flags reached() const {
    std::vector<int> label(solid.size(), -1);
    std::vector<std::size_t> border;
    for_all([&](int x, int y, int z) {
      if (solid[at(x, y, z)] != 0 || label[at(x, y, z)] >= 0) return;
      const int region = int(border.size());
      border.push_back(0);
      std::vector<std::array<int, 3>> stack = {{x, y, z}};
      label[at(x, y, z)] = region;
      while (!stack.empty()) {
        const std::array<int, 3> p = stack.back();
        stack.pop_back();
        bool edge = false;
        for (int k = 0; k < 3; ++k) edge = edge || p[k] == 0 || p[k] + 1 == int(size[k]);
        border[region] += edge ? 1 : 0;
        for (int k = 0; k < 3; ++k) {
          for (const int step : {-1, 1}) {
            std::array<int, 3> q = p;
            q[k] += step;
            if (!within(q[0], q[1], q[2])) continue;
            const std::size_t i = at(q[0], q[1], q[2]);
            if (solid[i] != 0 || label[i] >= 0) continue;
            label[i] = region;
            stack.push_back(q);
          }
        }
      }
    });
    std::size_t most = 0;
    for (const std::size_t count : border) most = std::max(most, count);
    Flags result{size, std::vector<char>(solid.size())};
    for (std::size_t i = 0; i < solid.size(); ++i) {
      result.solid[i] = label[i] >= 0 && most > 0 && border[label[i]] * 20 >= most ? 1 : 0;
    }
    return result;
  }
};

TEST(Outer, IsWhatASearchFinds) {
  std::mt19937 random(5);
  for (const Size size : {Size{9, 8, 7}, Size{62, 5, 6}, Size{63, 9, 4}, Size{64, 3, 20},
                          Size{130, 11, 37}, Size{2, 2, 2}}) {
    for (const double density : {0.05, 0.3, 0.6, 0.69, 0.75, 0.95}) {
      for (const int gap : {0, 1, 2}) {
        Flags flags{size, {}};
        const double share = gap == 0 ? density : density / std::pow(3, gap);
        for (std::size_t i = 0; i < std::size_t{size[0]} * size[1] * size[2]; ++i) {
          flags.solid.push_back(std::uniform_real_distribution<double>()(random) < share ? 1 : 0);
        }
        CellGrid cells(size);
        const auto word = [&](int x, int y, int z) -> std::uint64_t& {
          return cells.plane(std::uint32_t(z) +
                             1)[(std::size_t(y) + 1) * cells.row_words() + (x + 1) / 64];
        };
        flags.for_all([&](int x, int y, int z) {
          if (flags.solid[flags.at(x, y, z)] != 0) {
            word(x, y, z) |= std::uint64_t{1} << ((x + 1) & 63);
          }
        });
        const std::uint64_t filled = fill_unreached(cells, std::uint32_t(gap), "v");
        Flags expected = gap == 0 ? flags.reached() : flags.dilated(gap).reached().dilated(gap);
        std::uint64_t expected_filled = 0, wrong = 0, bits = 0, inside = 0;
        flags.for_all([&](int x, int y, int z) {
          const bool free = expected.solid[flags.at(x, y, z)] != 0;
          expected_filled += !free && flags.solid[flags.at(x, y, z)] == 0 ? 1 : 0;
          inside += free ? 0 : 1;
          wrong += (word(x, y, z) >> ((x + 1) & 63) & 1) == (free ? 1U : 0U) ? 1 : 0;
        });
        for (std::uint32_t z = 0; z < size[2] + 2; ++z) {
          for (std::size_t w = 0; w < cells.plane_words(); ++w) {
            bits += std::uint64_t(std::popcount(cells.plane(z)[w]));
          }
        }
        EXPECT_EQ(wrong, 0U) << size[0] << " " << density << " " << gap;
        EXPECT_EQ(filled, expected_filled);
        EXPECT_EQ(bits, inside) << "padding is not to be filled";
      }
    }
  }
}

// Every second voxel is solid: as many runs as there can be.
TEST(Outer, AsksForMemory) {
  const Size size{254, 254, 30};
  CellGrid cells(size);
  for (std::uint32_t z = 0; z < size[2]; ++z) {
    for (std::uint32_t y = 0; y < size[1]; ++y) {
      std::uint64_t* row = cells.plane(z + 1) + std::size_t{y + 1} * cells.row_words();
      for (std::uint32_t x = (y + z) % 2; x < size[0]; x += 2) {
        row[(x + 1) / 64] |= std::uint64_t{1} << ((x + 1) & 63);
      }
    }
  }
  set_memory_limit(1);
  try {
    fill_unreached(cells, 0, "v");
    ADD_FAILURE() << "not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::internal);
    EXPECT_EQ(std::string(error.what()).find("The outside of volume 'v' would take"), 0U)
        << error.what();
  }
  set_memory_limit(0);
}

/// A ball of radius 18 that is hollow within 12, in which a ball of radius 6 floats; along +x a tunnel
/// of some radius leads in.
Volume hollow(double tunnel) {
  return make_float_volume({44, 45, 46}, [=](double x, double y, double z) {
    const double a = x - 21.3, b = y - 22.1, c = z - 22.6;
    const double r = std::sqrt(a * a + b * b + c * c);
    double field = std::max(std::min(18 - r, r - 12), 6 - r);
    if (a > 8) field = std::min(field, std::hypot(b, c) - tunnel);
    return field;
  });
}

TEST(Outer, CavitiesVanish) {
  KILN_REQUIRE_DEVICE();
  const Volume volume = hollow(0);
  EXPECT_EQ(test::topology(contour(*test::device(), volume)).parts, 3U);
  for (const VolumeBorder border : {VolumeBorder::closed, VolumeBorder::open}) {
    ContourReport report;
    const Mesh mesh =
        contour(*test::device(), volume, {.border = border, .outer_only = true}, &report);
    const test::Topology t = test::topology(mesh);
    EXPECT_TRUE(t.is_closed_manifold());
    EXPECT_EQ(t.parts, 1U);
    EXPECT_EQ(t.euler, 2);
    EXPECT_GT(report.filled_voxels, 4000U);
    EXPECT_NEAR(test::enclosed_volume(mesh), 4.0 / 3 * std::numbers::pi * 18 * 18 * 18, 150);
  }
}

TEST(Outer, ATunnelIsAWayInUnlessTheGapClosesIt) {
  KILN_REQUIRE_DEVICE();
  const Volume volume = hollow(1.6);
  // The tunnel joins the ball's outside and its hollow; the inner ball stays.
  EXPECT_EQ(test::topology(contour(*test::device(), volume, {.outer_only = true})).parts, 2U);
  const Mesh mesh = contour(*test::device(), volume, {.outer_only = true, .outer_gap = 2});
  const test::Topology t = test::topology(mesh);
  EXPECT_TRUE(t.is_closed_manifold());
  EXPECT_EQ(t.parts, 1U);
  EXPECT_EQ(t.euler, 2);
  // Nothing of a smooth surface moves, and the cap lies across the tunnel's mouth.
  std::size_t caps = 0;
  for (const Vec3& p : mesh.positions) {
    const double a = p.x - 21.3, b = p.y - 22.1, c = p.z - 22.6;
    const double r = std::sqrt(a * a + b * b + c * c);
    if (std::hypot(b, c) < 3.5 && a > 0) {
      ++caps;
      EXPECT_GT(a, 16);
    } else {
      EXPECT_NEAR(r, 18, 0.05);
    }
  }
  EXPECT_GT(caps, 5U);
}

TEST(Outer, HollowsThatACutOpensAreNotTheOutside) {
  // The hollow ball cut through its middle: the cut opens the hollow to the border.
  KILN_REQUIRE_DEVICE();
  Volume volume = hollow(0);
  const std::size_t plane = std::size_t{44} * 45 * sizeof(float);
  volume.size[2] -= 22;
  volume.voxels.erase(volume.voxels.begin(), volume.voxels.begin() + std::ptrdiff_t(22 * plane));
  const test::Topology all = test::topology(contour(*test::device(), volume));
  EXPECT_EQ(all.parts, 2U);
  const test::Topology outer =
      test::topology(contour(*test::device(), volume, {.outer_only = true}));
  EXPECT_TRUE(outer.is_closed_manifold());
  EXPECT_EQ(outer.parts, 2U) << "as large a hole as this is a way in";
  // Nearer to the top of the hollow, the hole is small beside the rest of the border.
  volume.size[2] -= 11;
  volume.voxels.erase(volume.voxels.begin(), volume.voxels.begin() + std::ptrdiff_t(11 * plane));
  EXPECT_LT(test::topology(contour(*test::device(), volume)).euler, 3);
  ContourReport report;
  const Mesh cap = contour(*test::device(), volume, {.outer_only = true}, &report);
  EXPECT_TRUE(test::topology(cap).is_closed_manifold());
  EXPECT_EQ(test::topology(cap).parts, 1U);
  EXPECT_GT(report.filled_voxels, 0U);
  for (const Vec3& p : cap.positions) {
    EXPECT_TRUE(p.z < 0.1 || std::hypot(p.x - 21.3, p.y - 22.1, p.z + 33 - 22.6) > 17) << p.z;
  }
}

TEST(Outer, HasTheSameBytesOnAnyNumberOfThreads) {
  KILN_REQUIRE_DEVICE();
  const Volume volume = make_float_volume({50, 51, 70}, [](double x, double y, double z) {
    return test::gyroid_field(x, y, z, 23.3) - 0.3 - 0.4 * std::sin(x) * std::sin(1.3 * y);
  });
  const ContourOptions options{.outer_only = true, .outer_gap = 1};
  const Mesh a = contour(*test::device(), volume, options);
  setenv("KILN_THREADS", "1", 1);
  const Mesh b = contour(*test::device(), volume, options);
  unsetenv("KILN_THREADS");
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.triangles, b.triangles);
}

TEST(Outer, SaysWhereThereIsNoWayIn) {
  KILN_REQUIRE_DEVICE();
  const Volume volume = make_float_volume({20, 20, 20}, [](double x, double y, double z) {
    return -test::sphere_field(x - 9.5, y - 9.5, z - 9.5, 6);
  });
  const auto code = [&](const ContourOptions& options) {
    try {
      contour(*test::device(), volume, options);
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::internal;
  };
  EXPECT_EQ(code({.outer_only = true}), ErrorCode::input);
  EXPECT_EQ(code({.outer_only = true, .outer_gap = 65}), ErrorCode::usage);
}

}  // namespace
}  // namespace kiln
