// simplify() leaves out parts that are too small to be seen at the number of faces, and counts them.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

#include "kiln/limits.h"
#include "kiln/simplify.h"
#include "mesh/fans.h"
#include "support/shapes.h"

namespace kiln {
namespace {

/// Adds a ball.
void add_ball(Mesh& mesh, const Vec3& center, double radius, std::uint32_t slices) {
  const Mesh ball = test::uv_sphere(slices, slices, radius);
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const Vec3& p : ball.positions) {
    mesh.positions.push_back({p.x + center.x, p.y + center.y, p.z + center.z});
  }
  for (const Triangle& t : ball.triangles) {
    mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
}

/// A bumpy ball, and small balls on a larger one around it.
Mesh with_small_components(int count, double radius) {
  Mesh mesh = test::BumpySphere::dense(20000);
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  std::mt19937 random(7);
  const auto unit = [&] { return static_cast<float>(random() % 65536) / 32768 - 1; };
  for (int i = 0; i < count; ++i) {
    Vec3 p{unit(), unit(), unit()};
    const float away = 1.6F / std::max(0.01F, std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z));
    add_ball(mesh, {p.x * away, p.y * away, p.z * away}, radius, 5);
  }
  return mesh;
}

std::uint64_t parts_of(const Mesh& mesh) {
  return count_components(mesh.triangles, mesh.positions.size());
}

std::uint64_t warned(const SimplifyReport& report) {
  for (const Warning& w : report.warnings) {
    if (w.code == "dropped-parts") return w.count;
  }
  return 0;
}

TEST(SmallComponents, PartsSmallerThanTheErrorGo) {
  const Mesh high = with_small_components(30, 0.002);
  ASSERT_EQ(parts_of(high), 31u);
  SimplifyReport report;
  const Mesh low = simplify(high, {.faces = 300}, &report);
  EXPECT_EQ(parts_of(low), 1u);
  EXPECT_EQ(report.dropped_parts, 30u);
  EXPECT_EQ(warned(report), 30u);
  const bool reads_well =
      std::any_of(report.warnings.begin(), report.warnings.end(), [](const Warning& w) {
        return w.message.text().find(" and were left out: ") != std::string::npos;
      });
  EXPECT_TRUE(reads_well);
  EXPECT_LE(low.triangles.size(), 300u);
  EXPECT_GE(low.triangles.size(), 290u);
  EXPECT_EQ(report.input_faces, high.triangles.size());
}

TEST(SmallComponents, StayWhereAskedFor) {
  const Mesh high = with_small_components(30, 0.002);
  SimplifyReport report;
  EXPECT_EQ(parts_of(simplify(high, {.faces = 300, .keep_parts = true}, &report)), 31u);
  EXPECT_EQ(report.dropped_parts, 0u);
  EXPECT_EQ(warned(report), 0u);
  // A bound is of every part, and a hull encloses each.
  EXPECT_EQ(parts_of(simplify(high, {.max_error = 0.01}, &report)), 31u);
  EXPECT_EQ(parts_of(simplify(high, {.faces = 300, .hull = true}, &report)), 31u);
  EXPECT_EQ(report.dropped_parts, 0u);
}

TEST(SmallComponents, StayAboveTheLimitOfPresimplification) {
  Mesh high = with_small_components(30, 0.002);
  add_ball(high, {0, 0, 4}, 1, 210);
  ASSERT_GT(high.triangles.size(), 105'000u);
  SimplifyReport report;
  EXPECT_EQ(parts_of(simplify(high, {.faces = 600, .keep_parts = true}, &report)), 32u);
  EXPECT_EQ(report.dropped_parts, 0u);
  EXPECT_EQ(parts_of(simplify(high, {.max_error = 0.01}, &report)), 32u);
  // Each that goes is counted.
  EXPECT_EQ(parts_of(simplify(high, {.faces = 600}, &report)), 2u);
  EXPECT_EQ(report.dropped_parts, 30u);
}

TEST(SmallComponents, PartsThatCanBeSeenStay) {
  SimplifyReport report;
  EXPECT_EQ(parts_of(simplify(with_small_components(10, 0.2), {.faces = 800}, &report)), 11u);
  EXPECT_EQ(report.dropped_parts, 0u);
  // Small components are seen at more faces.
  EXPECT_EQ(parts_of(simplify(with_small_components(10, 0.01), {.faces = 8000}, &report)), 11u);
}

TEST(SmallComponents, PartsOfOneSizeAllStay) {
  Mesh high;
  for (int i = 0; i < 40; ++i)
    add_ball(high, {static_cast<float>(i % 8), static_cast<float>(i / 8), 0}, 0.2, 8);
  SimplifyReport report;
  EXPECT_EQ(parts_of(simplify(high, {.faces = 400}, &report)), 40u);
  EXPECT_EQ(report.dropped_parts, 0u);
  // Also where all components are small, something is left.
  EXPECT_GE(parts_of(simplify(high, {.faces = 4}, &report)), 1u);
}

TEST(SmallComponents, OfTooManyPartsTheSmallestGo) {
  // Loose triangles of growing size: nothing collapses, and each needs a face.
  Mesh high;
  for (std::uint32_t i = 0; i < 5000; ++i) {
    const auto x = static_cast<float>(i % 100), y = static_cast<float>(i / 100);
    const float size = 0.1F + 0.0001F * static_cast<float>(i);
    high.positions.insert(high.positions.end(), {{x, y, 0}, {x + size, y, 0}, {x, y + size, 0}});
    high.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  SimplifyReport report;
  const Mesh low = simplify(high, {.faces = 700}, &report);
  EXPECT_EQ(low.triangles.size(), 700u);
  EXPECT_EQ(report.dropped_parts, 4300u);
  EXPECT_EQ(warned(report), 4300u);
  for (const Vec3& p : low.positions) EXPECT_GE(p.y, 43);  // The last 700, which are the largest.
  EXPECT_EQ(simplify(high, {.faces = 700, .keep_parts = true}).triangles.size(), 5000u);
}

TEST(SmallComponents, OpenTubesThatNeedSixFacesGo) {
  // Tubes of growing length whose two rims stay: six faces each.
  Mesh high;
  for (std::uint32_t i = 0; i < 100; ++i) {
    const auto first = static_cast<std::uint32_t>(high.positions.size());
    for (std::uint32_t ring = 0; ring < 6; ++ring) {
      for (std::uint32_t k = 0; k < 5; ++k) {
        const double angle = 1.2566 * k;
        high.positions.push_back({static_cast<float>(i + 0.2 * std::cos(angle)),
                                  static_cast<float>(0.2 * std::sin(angle)),
                                  static_cast<float>(ring * (1 + 0.01 * i))});
      }
    }
    for (std::uint32_t a = first; a < first + 25; ++a) {
      const std::uint32_t b = (a - first) % 5 == 4 ? a - 4 : a + 1;
      high.triangles.insert(high.triangles.end(), {{a, b, b + 5}, {a, b + 5, a + 5}});
    }
  }
  SimplifyReport report;
  const Mesh low = simplify(high, {.faces = 300}, &report);
  EXPECT_LE(low.triangles.size(), 330u);
  EXPECT_GE(parts_of(low), 40u);
  EXPECT_EQ(parts_of(low) + report.dropped_parts, 100u);
}

TEST(SmallComponents, AStrayPartLeavesEyesAlone) {
  Mesh high = with_small_components(0, 1);
  add_ball(high, {0.35F, 0.35F, 0.95F}, 0.1, 10);
  add_ball(high, {-0.35F, 0.35F, 0.95F}, 0.1, 10);
  add_ball(high, {0, 60, 0}, 0.3, 10);
  SimplifyReport report;
  const Mesh low = simplify(high, {.faces = 600}, &report);
  EXPECT_EQ(report.dropped_parts, 0u);
  EXPECT_EQ(parts_of(low), 4u);
}

TEST(SmallComponents, RandomScenesKeepWhatIsLarger) {
  std::mt19937 random(11);
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(i);
    Mesh high;
    add_ball(high, {0, 0, 0}, 1, 24);
    const std::uint32_t count = 1 + static_cast<std::uint32_t>(random() % 12);
    for (std::uint32_t k = 0; k < count; ++k) {
      const double radius = 0.5 / (1 << random() % 10);
      add_ball(high, {3 + 1.5F * static_cast<float>(k), 0, 0}, radius, 6);
    }
    const std::uint32_t faces = 100 + static_cast<std::uint32_t>(random() % 400);
    SimplifyReport report, kept;
    const Mesh low = simplify(high, {.faces = faces}, &report);
    simplify(high, {.faces = faces, .keep_parts = true}, &kept);
    EXPECT_EQ(parts_of(low) + report.dropped_parts, count + 1u);
    EXPECT_EQ(warned(report), report.dropped_parts);
    EXPECT_LE(report.faces, std::max<std::uint64_t>(faces, 4 * (count + 1)));
    set_thread_limit(1);
    const Mesh again = simplify(high, {.faces = faces});
    set_thread_limit(0);
    ASSERT_EQ(again.triangles, low.triangles);
    ASSERT_EQ(again.positions.size(), low.positions.size());
  }
}

}  // namespace
}  // namespace kiln
