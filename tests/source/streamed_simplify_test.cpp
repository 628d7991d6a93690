// Low polys of a high poly that is larger than memory: made from its chunks,
// which are reduced one by one.
#include "simplify/streamed_simplify.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "asset/ply_stream.h"
#include "kiln/job.h"
#include "kiln/limits.h"
#include "kiln/simplify.h"
#include "mesh/surface_distance.h"
#include "mesh/vector.h"
#include "source/chunked_mesh.h"
#include "source/streamed_files.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

/// Number of triangles at each edge, by its two vertices in ascending order.
std::map<std::array<std::uint32_t, 2>, int> count_at_edges(const std::vector<Triangle>& triangles) {
  std::map<std::array<std::uint32_t, 2>, int> counts;
  for (const Triangle& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      ++counts[{std::min(a, b), std::max(a, b)}];
    }
  }
  return counts;
}

/// A square of n x n cells with a wave in it; two vertices at the same place
/// along one line.
Mesh wave(std::uint32_t n) {
  Mesh mesh;
  for (std::uint32_t y = 0; y <= n; ++y) {
    for (std::uint32_t x = 0; x <= n; ++x) {
      const float u = static_cast<float>(x) / static_cast<float>(n);
      const float v = static_cast<float>(y) / static_cast<float>(n);
      mesh.positions.push_back({u - 0.5F, v - 0.5F, 0.05F * std::sin(9 * u) * std::cos(7 * v)});
    }
  }
  const auto at = [&](std::uint32_t x, std::uint32_t y) { return y * (n + 1) + x; };
  for (std::uint32_t y = 0; y < n; ++y) {
    for (std::uint32_t x = 0; x < n; ++x) {
      mesh.triangles.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
      mesh.triangles.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
    }
  }
  return mesh;
}

double height_of_wave(const Vec3& p) {
  return 0.05 * std::sin(9 * (p.x + 0.5)) * std::cos(7 * (p.y + 0.5));
}

/// Area of a bumpy sphere's triangles that face its centre, as a share of all
/// area.
double inward_share(const Mesh& mesh) {
  double inward = 0, all = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3d a = to_double(mesh.positions[t[0]]);
    const Vec3d normal =
        cross(to_double(mesh.positions[t[1]]) - a, to_double(mesh.positions[t[2]]) - a);
    all += length(normal);
    if (dot(normal, a) < 0) inward += length(normal);
  }
  return inward / all;
}

/// Distance from the centre to the bumpy sphere in the direction of a point.
double distance_to_bumpy_sphere(const Vec3d& p) {
  const Vec3d unit = p * (1 / length(p));
  return test::BumpySphere::radius({unit.x, unit.y, unit.z});
}

TEST(StreamedSimplify, AChunkKeepsItsBorderAndItsSurface) {
  const Mesh mesh = wave(120);
  std::vector<Vec3> positions = mesh.positions;
  std::vector<Triangle> triangles = mesh.triangles;
  reduce_chunk(positions, triangles, 0.25);
  EXPECT_NEAR(static_cast<double>(triangles.size()),
              0.25 * static_cast<double>(mesh.triangles.size()),
              0.03 * static_cast<double>(mesh.triangles.size()));
  std::set<std::array<std::uint32_t, 2>> border, kept_border;
  for (const auto& [edge, count] : count_at_edges(mesh.triangles)) {
    if (count == 1) border.insert(edge);
  }
  for (const auto& [edge, count] : count_at_edges(triangles)) {
    EXPECT_LE(count, 2);
    if (count == 1) kept_border.insert(edge);
  }
  EXPECT_EQ(border.size(), 480U);
  EXPECT_EQ(kept_border, border);
  for (const auto& edge : border) {
    for (const std::uint32_t v : edge) {
      EXPECT_EQ(positions[v].x, mesh.positions[v].x);
      EXPECT_EQ(positions[v].y, mesh.positions[v].y);
      EXPECT_EQ(positions[v].z, mesh.positions[v].z);
    }
  }
  for (const Triangle& t : triangles) {
    const Vec3d a = to_double(positions[t[0]]);
    const Vec3d normal = cross(to_double(positions[t[1]]) - a, to_double(positions[t[2]]) - a);
    // Three vertices of the grid in a line make a triangle without area, up to
    // rounding; others have 7e-5 and more.
    EXPECT_GE(normal.z, -1e-8) << "a triangle folds at " << a.x << ", " << a.y;
    for (const std::uint32_t v : t) {
      EXPECT_NEAR(positions[v].z, height_of_wave(positions[v]), 2e-3);
    }
  }
}

TEST(StreamedSimplify, AChunkJoinsVerticesAtEqualPositions) {
  const Mesh mesh = wave(60);
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  for (const Triangle& t : mesh.triangles) {  // no two triangles share a vertex
    const auto first = static_cast<std::uint32_t>(positions.size());
    for (const std::uint32_t v : t) positions.push_back(mesh.positions[v]);
    triangles.push_back({first, first + 1, first + 2});
  }
  triangles.push_back({0, 0, 1});  // no area
  reduce_chunk(positions, triangles, 0.25);
  EXPECT_LT(triangles.size(), 0.3 * static_cast<double>(mesh.triangles.size()));
  std::size_t at_border = 0;
  for (const auto& [edge, count] : count_at_edges(triangles)) at_border += count == 1 ? 1 : 0;
  EXPECT_EQ(at_border, 240U);
}

TEST(StreamedSimplify, SharesDependOnTheMeshAndTheFacesAlone) {
  class Counted : public MeshStream {
   public:
    explicit Counted(std::uint32_t triangles) : triangles_(triangles) {}
    std::uint32_t vertex_count() const override { return triangles_ / 2; }
    std::uint32_t triangle_count() const override { return triangles_; }
    bool has_normals() const override { return false; }
    bool has_colors() const override { return false; }
    void read_positions(std::size_t, std::span<Vec3>) const override {}
    void read_triangles(std::size_t, std::span<Triangle>) const override {}
    void read_normals(std::size_t, std::span<Vec3>) const override {}
    void read_colors(std::size_t, std::span<Color>) const override {}
    const std::string& name() const override { return name_; }
    const std::string& path() const override { return name_; }
    std::string identity() const override { return name_; }

   private:
    std::uint32_t triangles_;
    std::string name_;
  };
  EXPECT_DOUBLE_EQ(reduced_share(Counted(10'000'000), 5000), 0.25);
  EXPECT_DOUBLE_EQ(reduced_share(Counted(100'000'000), 5000), 0.04);
  EXPECT_DOUBLE_EQ(reduced_share(Counted(100'000'000), 1'000'000), 0.08);
  EXPECT_DOUBLE_EQ(reduced_share(Counted(4000), 1000), 1);
}

TEST(StreamedSimplify, ReducedChunksFitTogether) {
  Mesh mesh = test::BumpySphere::dense(60000);
  std::map<std::array<float, 3>, std::array<std::uint8_t, 4>> color_at;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const Vec3& p = mesh.positions[v];
    mesh.colors.push_back({static_cast<std::uint8_t>(v), static_cast<std::uint8_t>(v >> 8U),
                           static_cast<std::uint8_t>(7 * v), 255});
    color_at[{p.x, p.y, p.z}] = mesh.colors.back();
  }
  const fs::path folder = test::scratch_folder();
  const ChunkedMesh chunks(stream_ply(test::save_ply(mesh, folder)),
                           {.triangles = 6000, .folder = folder / "chunks"});
  ASSERT_GE(chunks.size(), 10U);
  const Mesh reduced =
      chunks.reduced([](std::vector<Vec3>& positions, std::vector<Triangle>& triangles) {
        reduce_chunk(positions, triangles, 0.2);
      });
  EXPECT_EQ(reduced.name, "high");
  EXPECT_LT(reduced.triangles.size(), 0.35 * static_cast<double>(mesh.triangles.size()));
  // Both chunks at a border may connect two of its vertices, which makes an
  // edge of four triangles.
  std::size_t of_four = 0;
  for (const auto& [edge, count] : count_at_edges(reduced.triangles)) {
    EXPECT_TRUE(count == 2 || count == 4) << "edge " << edge[0] << ", " << edge[1] << ": " << count;
    of_four += count == 4 ? 1 : 0;
  }
  EXPECT_LT(of_four, 20U);
  ASSERT_EQ(reduced.colors.size(), reduced.positions.size());
  std::size_t in_place = 0;
  for (std::size_t v = 0; v < reduced.positions.size(); ++v) {
    const Vec3& p = reduced.positions[v];
    const Vec3d at = to_double(p);
    EXPECT_NEAR(length(at), distance_to_bumpy_sphere(at), 2e-3);
    const auto found = color_at.find({p.x, p.y, p.z});
    if (found == color_at.end()) continue;  // the vertex moved
    ++in_place;
    EXPECT_EQ(reduced.colors[v], found->second);
  }
  EXPECT_GT(in_place, reduced.positions.size() / 2);
  EXPECT_LT(in_place, reduced.positions.size()) << "no vertex slid along the surface";
  EXPECT_LT(inward_share(reduced), 2.5e-5);
}

TEST(StreamedSimplify, PiecesInMemoryFitTogether) {
  Mesh mesh = test::BumpySphere::dense(1'200'000);  // two pieces
  const std::size_t triangles = mesh.triangles.size();
  reduce_pieces(mesh, 0.2);
  EXPECT_NEAR(static_cast<double>(mesh.triangles.size()), 0.2 * static_cast<double>(triangles),
              0.01 * static_cast<double>(triangles));
  std::size_t odd = 0, of_four = 0;
  for (const auto& [edge, count] : count_at_edges(mesh.triangles)) {
    odd += count % 2 != 0 ? 1 : 0;
    of_four += count == 4 ? 1 : 0;
  }
  EXPECT_EQ(odd, 0U);
  EXPECT_LT(of_four, 200U);
  for (const Triangle& t : mesh.triangles) {
    const Vec3d at = to_double(mesh.positions[t[0]]);
    ASSERT_NEAR(length(at), distance_to_bumpy_sphere(at), 2e-3);
  }
  EXPECT_LT(inward_share(mesh), 1e-4);
}

TEST(StreamedSimplify, DeviationsAreThoseFromTheWholeMesh) {
  const Mesh mesh = test::BumpySphere::dense(60000);
  const fs::path folder = test::scratch_folder();
  const auto stream = stream_ply(test::save_ply(mesh, folder));
  SimplifyReport report;
  const Mesh low = simplify_reduced(*stream, mesh, {.faces = 300}, report);
  EXPECT_EQ(low.triangles, simplify(mesh, {.faces = 300}).triangles);
  EXPECT_EQ(report.input_faces, mesh.triangles.size());
  // Coordinates are of about unit size; the figures are shares of the diagonal
  // of the mesh's box.
  Vec3d least{9, 9, 9}, most{-9, -9, -9};
  for (const Vec3& p : mesh.positions) {
    least = glm::min(least, to_double(p));
    most = glm::max(most, to_double(p));
  }
  const double diagonal = length(most - least);
  const SurfaceDistance surface(low.positions, low.triangles);
  double largest = 0, sum = 0;
  for (const Vec3& p : mesh.positions) {
    const double distance = std::sqrt(surface.squared(p));
    largest = std::max(largest, distance);
    sum += distance;
  }
  EXPECT_NEAR(report.error, largest / diagonal, 0.02 * report.error);
  EXPECT_NEAR(report.mean_error, sum / static_cast<double>(mesh.positions.size()) / diagonal,
              0.02 * report.mean_error);
  // Deviations leave out parts that were dropped, so they stay as simplify()
  // measured them.
  Mesh with_speck = mesh;
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  with_speck.positions.insert(with_speck.positions.end(),
                              {{0, 0, 0}, {1e-4F, 0, 0}, {0, 1e-4F, 0}});
  with_speck.triangles.push_back({first, first + 1, first + 2});
  SimplifyReport of_whole, dropped;
  simplify(with_speck, {.faces = 300}, &of_whole);
  ASSERT_EQ(of_whole.dropped_parts, 1U);
  simplify_reduced(*stream, with_speck, {.faces = 300}, dropped);
  EXPECT_EQ(dropped.error, of_whole.error);
}

/// Largest distance from a mesh's vertices to a surface, as a share of the
/// diagonal of the mesh's box.
double deviation_of_vertices(const Mesh& mesh, const Mesh& low) {
  Vec3d least{9, 9, 9}, most{-9, -9, -9};
  const SurfaceDistance surface(low.positions, low.triangles);
  double largest = 0;
  for (const Vec3& p : mesh.positions) {
    least = glm::min(least, to_double(p));
    most = glm::max(most, to_double(p));
    largest = std::max(largest, std::sqrt(surface.squared(p)));
  }
  return largest / length(most - least);
}

TEST(StreamedSimplify, AnErrorBoundHoldsForTheWholeMesh) {
  const Mesh mesh = test::BumpySphere::dense(60000);
  const fs::path folder = test::scratch_folder();
  const auto stream = stream_ply(test::save_ply(mesh, folder));
  const ChunkedMesh chunks(stream, {.triangles = 6000, .folder = folder / "chunks"});
  const Mesh reduced =
      chunks.reduced([](std::vector<Vec3>& positions, std::vector<Triangle>& triangles) {
        reduce_chunk(positions, triangles, 0.5);
      });
  const double of_reduction = deviation_of_vertices(mesh, reduced);
  for (const double bound : {0.02, 0.01}) {
    SimplifyReport report, whole;
    const Mesh low = simplify_reduced(*stream, reduced, {.max_error = bound}, report);
    simplify(mesh, {.max_error = bound}, &whole);
    EXPECT_EQ(report.input_faces, mesh.triangles.size());
    EXPECT_LE(report.error, bound);
    EXPECT_GT(report.error, 0.5 * bound);
    EXPECT_LE(report.mean_error, report.error);
    EXPECT_LE(deviation_of_vertices(mesh, low), 1.02 * bound);
    EXPECT_LT(static_cast<double>(report.faces), 1.6 * static_cast<double>(whole.faces)) << bound;
    EXPECT_EQ(report.faces, low.triangles.size());
  }
  // The reduction alone takes more than nine tenths of the bound.
  const std::string refused = test::error_of([&] {
    SimplifyReport report;
    simplify_reduced(*stream, reduced, {.max_error = 1.05 * of_reduction}, report);
  });
  EXPECT_NE(refused.find("Allow a larger error"), std::string::npos) << refused;
}

TEST(StreamedSimplify, AJobMakesItsLowPolyFromChunks) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  const fs::path file = test::save_ply(test::BumpySphere::dense(1500000), folder);
  Job job;
  job.high = {file};
  job.low = MakeLow{.faces = 800};
  job.bake.maps = {MapKind::normal};
  job.bake.width = job.bake.height = 128;
  job.in_memory = true;
  test::leave_memory(std::uint64_t{440} << 20);
  const JobResult result = run(*test::device(), job);
  // Within a deviation
  job.low = MakeLow{.max_error = "0.5%"};
  test::leave_memory(std::uint64_t{440} << 20);
  const JobResult within = run(*test::device(), job);
  EXPECT_EQ(within.failure.text(), "");
  EXPECT_NE(within.report.find("\"streamed\": true"), std::string::npos);
  EXPECT_GT(within.low.triangles.size(), 100U);
  EXPECT_LE(deviation_of_vertices(test::BumpySphere::dense(60000), within.low), 0.0055);
  job.low = MakeLow{.max_error = "normal=10"};
  const std::string error = test::error_of([&] {
    test::leave_memory(std::uint64_t{100} << 20);
    run(*test::device(), job);
  });
  job.low = MakeLow{.faces = 800};
  job.fill_holes = 1;
  const std::string filling = test::error_of([&] {
    test::leave_memory(std::uint64_t{100} << 20);
    run(*test::device(), job);
  });
  set_memory_limit(0);
  EXPECT_NE(filling.find("fill_holes"), std::string::npos) << filling;
  EXPECT_EQ(result.failure.text(), "");
  std::string summary;
  for (const Message& line : result.summary) summary += line.text() + "\n";
  EXPECT_NE(summary.find("of 1,499,912 faces"), std::string::npos) << summary;
  for (const Warning& warning : result.warnings) EXPECT_NE(warning.code, "low-heavy");
  EXPECT_NE(result.report.find("\"streamed\": true"), std::string::npos);
  EXPECT_NEAR(static_cast<double>(result.low.triangles.size()), 800, 2);
  for (const Vec3& p : result.low.positions) {
    const Vec3d at = to_double(p);
    EXPECT_NEAR(length(at), distance_to_bumpy_sphere(at), 0.03);
  }
  EXPECT_NE(error.find("by rendered errors needs the whole high poly in memory: give LOW"),
            std::string::npos)
      << error;
}

}  // namespace
}  // namespace kiln
